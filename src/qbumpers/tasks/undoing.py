"""Taking a step of a Gymnasium environment back, through its wrappers."""

from collections.abc import Callable
from typing import Any

import gymnasium
from gymnasium import wrappers

from qbumpers.errors import RequestError
from qbumpers.tasks.wrapping import WATCHING, layers

# Nothing that they keep decides what later steps give, or it counts the step, which has happened.
# Classes derived from these may keep something of their own, so each is named.
_HARMLESS = {
    *WATCHING,
    wrappers.TransformObservation,
    wrappers.AddRenderObservation,
    wrappers.DiscretizeObservation,
    wrappers.DtypeObservation,
    wrappers.FilterObservation,
    wrappers.FlattenObservation,
    wrappers.GrayscaleObservation,
    wrappers.RescaleObservation,
    wrappers.ReshapeObservation,
    wrappers.ResizeObservation,
    wrappers.TransformReward,
    wrappers.ClipReward,
    wrappers.TransformAction,
    wrappers.ClipAction,
    wrappers.DiscretizeAction,
    wrappers.RescaleAction,
}

Snapshot = Callable[[], Any]
Restore = Callable[[Any], None]


def undo_of(environment: gymnasium.Env[Any, Any]) -> tuple[Snapshot, Restore]:
    """How to take a step of an environment back.

    An undone step has happened: a TimeLimit and statistics go on counting it.

    Args:
        environment: with methods `snapshot()`, which gives its state, and `restore(snapshot)`,
            which makes it the state again; or a wrapper of one that has them.

    Returns:
        The two methods.

    Raises:
        RequestError: if the environment lacks them, or a wrapper may keep something that would not
            be put back, and does not define both itself.
    """
    for layer in layers(environment):
        kind = type(layer)
        if hasattr(kind, "snapshot") and hasattr(kind, "restore"):
            undoing: Any = layer
            return undoing.snapshot, undoing.restore
        if not isinstance(layer, gymnasium.Wrapper):
            break
        if kind not in _HARMLESS:
            raise RequestError(
                f"wrapper {kind.__name__} may keep something that an undone step would not put "
                "back: give it methods snapshot and restore, or leave it out"
            )
    raise RequestError(
        f"environment {type(environment.unwrapped).__name__} has no methods snapshot and restore: "
        "its steps cannot be undone"
    )


def can_undo(environment: gymnasium.Env[Any, Any]) -> bool:
    """Whether `undo_of` finds how to take a step of an environment back."""
    try:
        undo_of(environment)
    except RequestError:
        return False
    return True


def reached_limit(environment: gymnasium.Env[Any, Any]) -> bool:
    """Whether an episode has reached the limit of one of Gymnasium's TimeLimit wrappers.

    Args:
        environment: with any wrappers.

    Returns:
        Whether it has; false before the first episode.
    """
    # Gymnasium has no public name for either number.
    return any(
        (layer._elapsed_steps or 0) >= layer._max_episode_steps
        for layer in layers(environment)
        if isinstance(layer, wrappers.TimeLimit)
    )
