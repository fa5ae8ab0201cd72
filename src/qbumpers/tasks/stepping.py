"""Environments as simulators step through them, one action at a time."""

import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any, Protocol

import gymnasium
import numpy as np

from qbumpers.errors import RequestError
from qbumpers.source import version_of
from qbumpers.tasks.dynamics import CRASH, SUCCESS, TERMINATED, TRUNCATED
from qbumpers.tasks.undoing import undo_of
from qbumpers.tasks.wrapping import layers

REVISION = 2
"""Of `GymnasiumStepper`: raised when tasks that it steps give other numbers."""

_SEEDS = 2**32  # as many as Gymnasium's environments are sure to take


class Stepper(Protocol):
    """An environment as a simulator steps through it; the simulator keeps the step limit."""

    def reset(self, chance: float) -> np.ndarray:
        """Start an episode.

        Args:
            chance: in [0, 1), decides everything about the episode that is left to chance.

        Returns:
            The first observation, a new array, float32 [D].
        """
        ...

    def step(self, action: int) -> tuple[np.ndarray, float, int]:
        """Take an action.

        Args:
            action: in [0, A).

        Returns:
            The observation, a new array, float32 [D]; the reward; the events, bits TERMINATED,
            SUCCESS, CRASH and TRUNCATED of `qbumpers.tasks.dynamics`.
        """
        ...


class UndoableStepper(Stepper, Protocol):
    """A stepper whose steps can be taken back."""

    def snapshot(self) -> Any:
        """The state of the episode, unchanged by later steps."""
        ...

    def restore(self, snapshot: Any) -> None:
        """Put the state of a snapshot back.

        Args:
            snapshot: from `snapshot`, in this episode.
        """
        ...


class GymnasiumStepper:
    """Any Gymnasium environment with numbered actions and a vector observation, for simulators.

    `snapshot` and `restore` are those of the environment, and refused if it has none.

    Args:
        make: makes the environment, without a step limit; its `info` has `success` and `crash` if
            it tells them.
    """

    def __init__(self, make: Callable[[], Any]) -> None:
        self._environment = make()
        self._first_action = int(self._environment.action_space.start)

    def reset(self, chance: float) -> np.ndarray:
        """As `Stepper.reset`; the chance becomes the seed of the episode."""
        observation, _ = self._environment.reset(seed=int(chance * _SEEDS))
        return np.array(observation, np.float32)

    def step(self, action: int) -> tuple[np.ndarray, float, int]:
        """As `Stepper.step`."""
        observation, reward, terminated, truncated, info = self._environment.step(
            self._first_action + action
        )
        events = TERMINATED * bool(terminated) | TRUNCATED * bool(truncated)
        events |= SUCCESS * bool(info.get("success")) | CRASH * bool(info.get("crash"))
        return np.array(observation, np.float32), float(reward), events

    def snapshot(self) -> Any:
        """As `UndoableStepper.snapshot`."""
        return undo_of(self._environment)[0]()

    def restore(self, snapshot: Any) -> None:
        """As `UndoableStepper.restore`."""
        undo_of(self._environment)[1](snapshot)


def stepped_by_of(environment: Any) -> tuple[Any, ...]:
    """What decides the steps of a Gymnasium environment.

    Args:
        environment: with its wrappers, as `make_environment` makes it.

    Returns:
        Its class and those of its wrappers, what they were made with and, if it is an installed
        one, the libraries that its modules import: one that steps it may be among them.
    """
    kinds = [type(layer) for layer in layers(environment)]
    spec = environment.spec
    given = [] if spec is None else [spec.kwargs, [w.kwargs for w in spec.additional_wrappers]]
    makes = [] if spec is None or isinstance(spec.entry_point, str) else [spec.entry_point]
    installed = [k.__module__ for k in kinds[-1].__mro__ if version_of(k.__module__)]
    there = [each for name in installed for each in vars(sys.modules[name]).values()]
    libraries = [e for e in there if isinstance(e, ModuleType) and version_of(e.__name__)]
    return (*kinds, *makes, *given, *dict.fromkeys(libraries))


def make_environment(name: str, **arguments: Any) -> Any:
    """A Gymnasium environment.

    Args:
        name: id of the environment, for example "CartPole-v1".
        **arguments: what `gymnasium.make` takes besides.

    Returns:
        The environment.

    Raises:
        RequestError: if there is none of this name or an argument does not suit it.
    """
    try:
        return gymnasium.make(name, disable_env_checker=True, **arguments)
    except (TypeError, ValueError, LookupError, gymnasium.error.Error, ImportError) as error:
        missing = "; pip install 'qbumpers[lunar]'" if "Box2D" in str(error) else ""
        raise RequestError(f"task {name!r}: {error}{missing}") from error
