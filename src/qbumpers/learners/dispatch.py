"""The learner that settings belong to, called from the loops of the simulators.

As `qbumpers.assistants.dispatch` does for rules: compiled loops choose the learner by the type of
its settings when they are compiled.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types
from numba.extending import overload, register_jitable

from qbumpers.compilation import INLINE, uncompiled
from qbumpers.errors import RequestError
from qbumpers.learners.interface import Shape, Transition
from qbumpers.learners.registry import LearnerType, learner_for_settings


def start(settings: Any, shape: Shape, stream: np.ndarray) -> Any:
    """The memory of a learner before its first episode."""
    return uncompiled(learner_for_settings(type(settings)).start)(settings, shape, stream)


def fresh_memory(share: float | None, settings: Any, shape: Shape, stream: np.ndarray) -> Any:
    """A learner's first memory once more, if anything is to be forgotten; 0 if `share` is None."""
    return 0 if share is None else start(settings, shape, stream.copy())


def begin(settings: Any, memory: Any, episode: int, episodes: int) -> Any:
    """The rates of an episode; 0 of a learner without any."""
    function = learner_for_settings(type(settings)).begin
    return uncompiled(function)(settings, memory, episode, episodes) if function else 0


def choose(settings: Any, memory: Any, state: Any, rates: Any, stream: np.ndarray) -> int:
    """The action that a learner means to take in training."""
    kind = learner_for_settings(type(settings))
    return _action(kind, "choose", uncompiled(kind.choose)(settings, memory, state, rates, stream))


def prefer(settings: Any, memory: Any, state: Any, tie: float) -> int:
    """The action that a learner means to take in an unassisted probe."""
    kind = learner_for_settings(type(settings))
    return _action(kind, "prefer", uncompiled(kind.prefer)(settings, memory, state, tie))


def _action(kind: LearnerType, which: str, found: Any) -> Any:
    if not isinstance(found, int | float | np.number):
        raise RequestError(f"learner {kind.name}: {which} returns {found!r}, not an action")
    return found


def policy(settings: Any, memory: Any, state: Any, rates: Any, out: np.ndarray) -> None:
    """The probabilities [A] of `choose`, written into `out`."""
    uncompiled(learner_for_settings(type(settings)).policy)(settings, memory, state, rates, out)


def learn(
    settings: Any, memory: Any, transition: Transition, rates: Any, stream: np.ndarray
) -> None:
    """Change the memory of a learner by what it believes happened."""
    uncompiled(learner_for_settings(type(settings)).learn)(
        settings, memory, transition, rates, stream
    )


def forget(memory: Any, fresh: Any, share: float) -> None:
    """Move every table of a memory towards what it was at first.

    Args:
        memory: of a learner; of its fields, float64 [S, A] are tables.
        fresh: a memory of the same learner as it was at first.
        share: of the way, in [0, 1].
    """
    for field, origin in zip(memory, fresh, strict=True):
        if isinstance(field, np.ndarray) and field.ndim == 2 and field.dtype == np.float64:
            _fade(field, origin, share)


def _fade(table: np.ndarray, origin: np.ndarray, share: float) -> None:
    for state in range(table.shape[0]):
        for action in range(table.shape[1]):
            table[state, action] += share * (origin[state, action] - table[state, action])


# What the overloads below return is the Python source of the learner's function: compiled into the
# caller, without a layer of its own that would be linked and optimised once more.


@overload(start, strict=False, jit_options=INLINE)
def _compiled_start(settings: Any, shape: Any, stream: Any) -> Any:
    return uncompiled(learner_for_settings(settings.instance_class).start)


@overload(fresh_memory, strict=False, jit_options=INLINE)
def _compiled_fresh_memory(share: Any, settings: Any, shape: Any, stream: Any) -> Any:
    # Numba prunes `share is None` only if it is so: what is returned else has another type.
    if isinstance(share, types.NoneType):
        return lambda share, settings, shape, stream: 0
    return lambda share, settings, shape, stream: start(settings, shape, stream.copy())


@overload(begin, strict=False, jit_options=INLINE)
def _compiled_begin(settings: Any, memory: Any, episode: Any, episodes: Any) -> Any:
    function = learner_for_settings(settings.instance_class).begin
    return uncompiled(function) if function else lambda settings, memory, episode, episodes: 0


@overload(choose, strict=False, jit_options=INLINE)
def _compiled_choose(settings: Any, memory: Any, state: Any, rates: Any, stream: Any) -> Any:
    return uncompiled(learner_for_settings(settings.instance_class).choose)


@overload(prefer, strict=False, jit_options=INLINE)
def _compiled_prefer(settings: Any, memory: Any, state: Any, tie: Any) -> Any:
    return uncompiled(learner_for_settings(settings.instance_class).prefer)


@overload(policy, strict=False, jit_options=INLINE)
def _compiled_policy(settings: Any, memory: Any, state: Any, rates: Any, out: Any) -> Any:
    return uncompiled(learner_for_settings(settings.instance_class).policy)


@overload(learn, strict=False, jit_options=INLINE)
def _compiled_learn(settings: Any, memory: Any, transition: Any, rates: Any, stream: Any) -> Any:
    return uncompiled(learner_for_settings(settings.instance_class).learn)


@overload(forget, strict=False, jit_options=INLINE)
def _compiled_forget(memory: Any, fresh: Any, share: Any) -> Any:
    tables = [
        place
        for place, field in enumerate(memory.types)
        if isinstance(field, types.Array) and field.ndim == 2 and field.dtype == types.float64
    ]
    return _fading(tables)


def _fading(tables: list[int]) -> Callable[..., Any]:
    """A function that fades the fields at these places; compiled code cannot loop over fields."""
    if not tables:
        return lambda memory, fresh, share: None
    place, others = tables[0], register_jitable(_fading(tables[1:]))
    fade = register_jitable(_fade)

    def fade_one(memory: Any, fresh: Any, share: Any) -> None:
        fade(memory[place], fresh[place], share)
        others(memory, fresh, share)

    return fade_one
