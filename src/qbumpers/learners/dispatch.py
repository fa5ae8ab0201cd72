"""The learner that settings belong to, called from the loops of the simulators.

As `qbumpers.assistants.dispatch` does for rules: compiled loops choose the learner by the type of
its settings when they are compiled.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types
from numba.extending import overload, register_jitable

from qbumpers.compilation import INLINE, called, inlined, uncompiled
from qbumpers.errors import RequestError
from qbumpers.learners.forgetting import Practice, fade, fade_by_age, grow_older
from qbumpers.learners.interface import Shape, Transition
from qbumpers.learners.registry import LearnerType, learner_for_settings


def start(settings: Any, shape: Shape, stream: np.ndarray) -> Any:
    """The memory of a learner before its first episode."""
    return uncompiled(learner_for_settings(type(settings)).start)(settings, shape, stream)


def fresh_memory(forgets: Any, settings: Any, shape: Shape, stream: np.ndarray) -> Any:
    """A learner's first memory once more, if anything is to be forgotten.

    Args:
        forgets: the ways in which it forgets, a tuple.
        settings: hyperparameters; their type says which learner it is.
        shape: of what it learns.
        stream: uint64 [4], random stream of the memory; it does not change.

    Returns:
        The memory; 0 if all ways are None.
    """
    nothing = all(way is None for way in forgets)
    return 0 if nothing else start(settings, shape, stream.copy())


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


def copy_memory(memory: Any, other: Any) -> None:
    """Overwrite every array of a memory by that of another one of the same learner."""
    for field, origin in zip(memory, other, strict=True):
        if isinstance(field, np.ndarray):
            field[:] = origin


def forget(memory: Any, fresh: Any, share: float) -> None:
    """Move every table of a memory towards what it was at first.

    Args:
        memory: of a learner; of its fields, float64 [S, K] are tables.
        fresh: a memory of the same learner as it was at first.
        share: of the way, in [0, 1].
    """
    for field, origin in _tables(memory, fresh):
        fade(field, origin, share)


def forget_by_age(memory: Any, fresh: Any, practice: Practice) -> None:
    """Move every table of a memory towards what it was at first, the older the less of the rest.

    Args:
        memory: of a learner; of its fields, float64 [S, K] are tables.
        fresh: a memory of the same learner as it was at first.
        practice: says how old each action in each state is.
    """
    for field, origin in _tables(memory, fresh):
        fade_by_age(field, origin, practice)


@inlined
def forget_between(share: float | None, practice: Practice | None, memory: Any, fresh: Any) -> None:
    """Move every table of a memory towards what it was at first, between two episodes.

    Args:
        share: as for `forget`; None if no share is forgotten.
        practice: as for `forget_by_age`, then an episode older; None if age means nothing.
        memory: what a learner has learned so far.
        fresh: a memory of the same learner as it was at first; anything if nothing is forgotten.
    """
    if share is not None:
        forget(memory, fresh, share)
    if practice is not None:
        forget_by_age(memory, fresh, practice)
        grow_older(practice)


def _tables(memory: Any, fresh: Any) -> list[tuple[np.ndarray, np.ndarray]]:
    return [
        (field, origin)
        for field, origin in zip(memory, fresh, strict=True)
        if isinstance(field, np.ndarray) and field.ndim == 2 and field.dtype == np.float64
    ]


# What the overloads below return is the Python source of the learner's function: compiled into the
# caller, without a layer of its own that would be linked and optimised once more.


@overload(start, strict=False, jit_options=INLINE)
def _compiled_start(settings: Any, shape: Any, stream: Any) -> Any:
    return uncompiled(learner_for_settings(settings.instance_class).start)


@overload(fresh_memory, strict=False, jit_options=INLINE)
def _compiled_fresh_memory(forgets: Any, settings: Any, shape: Any, stream: Any) -> Any:
    if all(isinstance(way, types.NoneType) for way in forgets.types):
        return lambda forgets, settings, shape, stream: 0
    return lambda forgets, settings, shape, stream: start(settings, shape, stream.copy())


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


@overload(copy_memory, strict=False, jit_options=INLINE)
def _compiled_copy_memory(memory: Any, other: Any) -> Any:
    places = [p for p, field in enumerate(memory.types) if isinstance(field, types.Array)]
    copy_each = register_jitable(_for_each(places, _overwrite))
    return lambda memory, other: copy_each(memory, other, 0)


@called
def _overwrite(field: np.ndarray, origin: np.ndarray, by: int) -> None:
    for place in range(field.size):
        field.flat[place] = origin.flat[place]


@overload(forget, strict=False, jit_options=INLINE)
def _compiled_forget(memory: Any, fresh: Any, share: Any) -> Any:
    return _for_each(_places_of_tables(memory), fade)


@overload(forget_by_age, strict=False, jit_options=INLINE)
def _compiled_forget_by_age(memory: Any, fresh: Any, practice: Any) -> Any:
    return _for_each(_places_of_tables(memory), fade_by_age)


def _places_of_tables(memory: Any) -> list[int]:
    return [
        place
        for place, field in enumerate(memory.types)
        if isinstance(field, types.Array) and field.ndim == 2 and field.dtype == types.float64
    ]


def _for_each(places: list[int], change: Callable[..., None]) -> Callable[..., Any]:
    """A function that changes the fields at these places; compiled code cannot loop over fields."""
    if not places:
        return lambda memory, fresh, by: None
    place, others = places[0], register_jitable(_for_each(places[1:], change))
    change_field = register_jitable(change)

    def change_one(memory: Any, fresh: Any, by: Any) -> None:
        change_field(memory[place], fresh[place], by)
        others(memory, fresh, by)

    return change_one
