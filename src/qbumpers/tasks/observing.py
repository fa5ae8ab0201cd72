"""Gymnasium environments seen as vectors of numbers, by Gymnasium's own wrappers."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium import spaces, wrappers

from qbumpers.errors import RequestError
from qbumpers.tasks.announcing import Announced, Keys
from qbumpers.tasks.stepping import make_environment, maker_name


class View(NamedTuple):
    """What a task sees of an environment; it can be pickled.

    Attributes:
        observe: keys of a Dict observation that are kept, in any order; all if empty.
        keys: of `info`, that tell successes and crashes.
    """

    observe: tuple[str, ...] = ()
    keys: Keys = Keys()

    def settings(self) -> dict[str, Any]:
        """JSON-like; nothing of what is usual, so that tasks that need none of it stay."""
        observed = {"observe": sorted(self.observe)} if self.observe else {}
        return {**observed, **self.keys.settings()}


def is_vector(space: Any) -> bool:
    """Whether observations of a space are vectors as they are."""
    return isinstance(space, spaces.Box) and len(space.shape) == 1 and space.shape[0] > 0


def make_viewed(maker: str | Callable[..., Any], view: View, /, **arguments: Any) -> Any:
    """A Gymnasium environment of which a vector of numbers is observed.

    Args:
        maker: id of the environment, or what makes it.
        view: what is seen of it.
        **arguments: what `gymnasium.make` or the maker takes besides.

    Returns:
        The environment; within Gymnasium's FilterObservation if only some keys are kept, and within
        its FlattenObservation unless the observation is a vector already.

    Raises:
        RequestError: if there is no such environment, an argument does not suit it, or its
            observation cannot be made a vector; it names wrappers that can, if any were found.
    """
    name = maker if isinstance(maker, str) else maker_name(maker)
    return viewed(make_environment(maker, **arguments), name, view)


def viewed(environment: Any, name: str, view: View) -> Any:
    """An environment of which a vector of numbers is observed; see `make_viewed`.

    Args:
        environment: with any wrappers.
        name: of it, for messages.
        view: what is seen of it.

    Raises:
        RequestError: as `make_viewed`.
    """
    kept = _filtered(environment, name, view.observe) if view.observe else environment
    flat = kept if is_vector(kept.observation_space) else _flattened(kept, name, view.observe)
    return flat if view.keys == Keys() else Announced(flat, view.keys)


def way_to_vectors(space: gymnasium.Space[Any]) -> str:
    """Words for how an observation becomes the vector that a task has; none if it is one."""
    if is_vector(space):
        return ""
    keys = isinstance(space, spaces.Dict)
    inside = "FilterObservation(environment, keys)" if keys else "environment"
    also = ", without FilterObservation if the task keeps all keys" if keys else ""
    return (
        "; for a network that was made for vectors, put Gymnasium's wrappers inside shared "
        f"control: FlattenObservation({inside}){also}"
    )


def _filtered(environment: Any, name: str, observe: Sequence[str]) -> Any:
    space = environment.observation_space
    if not isinstance(space, spaces.Dict):
        raise RequestError(
            f"task {name!r}: observe = {list(observe)}; only an observation of several parts by "
            f"name (Dict) has keys, and its observation space is {space}"
        )
    unknown = [key for key in observe if key not in space.spaces]
    if unknown:
        raise RequestError(
            f"task {name!r}: observe = {list(observe)}; {unknown[0]!r} is no key of its "
            f"observation, which has: {', '.join(map(str, space.spaces))}"
        )
    return wrappers.FilterObservation(environment, sorted(observe))


def _flattened(environment: Any, name: str, observe: Sequence[str]) -> Any:
    flat = _attempt(environment)
    if flat is not None:
        return flat
    found = "" if observe else next(_remedies(environment), "")
    raise RequestError(
        f"task {name!r}: its observation space is {_in_a_line(environment.observation_space)}; "
        "FlattenObservation of Gymnasium makes no vector of it"
        + (found or ", nor does any part of it; give a wrapper of your own that does")
    )


def _attempt(environment: Any) -> Any:
    """The environment with a flat observation, if that works for a reset and a step."""
    try:
        flat = wrappers.FlattenObservation(environment)
        if not is_vector(flat.observation_space):
            return None
        first, _ = flat.reset(seed=0)
        later, *_ = flat.step(flat.action_space.sample())
        size = flat.observation_space.shape
        return flat if np.shape(first) == np.shape(later) == size else None
    except (NotImplementedError, TypeError, ValueError, AttributeError, KeyError):
        return None  # whatever flattening a space or an observation comes to


def _remedies(environment: Any) -> Iterator[str]:
    """Words for wrappers that were tried and make a vector; at most one."""
    space = environment.observation_space
    if not isinstance(space, spaces.Dict):
        return
    kept = [
        key
        for key in space.spaces
        if _attempt(wrappers.FilterObservation(environment, [key])) is not None
    ]
    if kept and _attempt(wrappers.FilterObservation(environment, kept)) is not None:
        yield (
            f", but of its parts {' and '.join(kept)}: give observe={kept!r}, which is "
            f"FlattenObservation(FilterObservation(environment, {kept!r}))"
        )


def _in_a_line(space: gymnasium.Space[Any]) -> str:
    return " ".join(str(space).split())
