"""Environments as simulators step through them, one action at a time."""

import dataclasses
import functools
import sys
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any, Protocol

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec, load_env_creator

from qbumpers.errors import RequestError, in_short
from qbumpers.source import version_of
from qbumpers.tasks.dynamics import CRASH, SUCCESS, TERMINATED, TRUNCATED
from qbumpers.tasks.undoing import undo_of
from qbumpers.tasks.wrapping import layers

REVISION = 1
"""Of `GymnasiumStepper`: raised when tasks that it steps give other numbers."""

_NOTHING = object()
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


def make_environment(maker: str | Callable[..., Any], **arguments: Any) -> Any:
    """A Gymnasium environment.

    Args:
        maker: id of the environment, for example "CartPole-v1", or what makes it.
        **arguments: what `gymnasium.make` or the maker takes besides.

    Returns:
        The environment.

    Raises:
        RequestError: if there is none of this name or an argument does not suit it.
    """
    if not isinstance(maker, str):
        return _made_by(maker, arguments)
    try:
        return gymnasium.make(maker, disable_env_checker=True, **arguments)
    except (TypeError, ValueError, LookupError, gymnasium.error.Error, ImportError) as error:
        missing = "; pip install 'qbumpers[lunar]'" if "Box2D" in str(error) else ""
        raise RequestError(f"task {maker!r}: {error}{missing}") from error


def _made_by(maker: Callable[..., Any], arguments: Mapping[str, Any]) -> Any:
    try:
        made = maker(**arguments)
    except Exception as error:  # whatever goes wrong in it
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise RequestError(f"task {maker_name(maker)}: no environment is made: {reason}") from error
    if not isinstance(made, gymnasium.Env):
        raise RequestError(
            f"task {maker_name(maker)}: it makes {in_short(made)}; a Gymnasium environment is "
            "needed"
        )
    return made


def maker_name(maker: Callable[..., Any]) -> str:
    """What makes an environment, for messages and files."""
    return str(getattr(maker, "__qualname__", type(maker).__name__))


def environment_name(environment: Any) -> str:
    """The id of a Gymnasium environment, or the name of its class."""
    spec = environment.spec
    return str(spec.id) if spec else type(environment.unwrapped).__name__


def remade_by(environment: Any, limit: int | None) -> EnvSpec | None:
    """How Gymnasium can make an environment again in any process, written as text.

    Args:
        environment: with its wrappers.
        limit: its steps.

    Returns:
        The specification; None if it names what cannot be written, or comes from no module.
    """
    if environment.spec is None:
        return None
    kwargs = {k: v for k, v in environment.spec.kwargs.items() if k != "render_mode"}
    made = environment.spec.entry_point
    named = made if isinstance(made, str) else f"{made.__module__}:{maker_name(made)}"
    spec = dataclasses.replace(
        environment.spec, kwargs=kwargs, max_episode_steps=limit, entry_point=named
    )
    wrappers = spec.additional_wrappers
    try:
        load_env_creator(named)
        spec.to_json()
    except (ImportError, AttributeError, TypeError, ValueError):
        return None
    from_modules = (named, *(wrapper.entry_point for wrapper in wrappers))
    if any(name.startswith("__main__:") for name in from_modules):
        return None
    return None if any(wrapper.kwargs is None for wrapper in wrappers) else spec


def maker_of(environment: Any) -> tuple[str | Callable[..., Any], dict[str, Any]]:
    """How a Gymnasium environment can be made again, with its wrappers.

    Args:
        environment: of `gymnasium.make`.

    Returns:
        Its id with the arguments that differ from those it is registered with, if wrappers are none
        but those of its registration; else a function that makes it.

    Raises:
        RequestError: if Gymnasium does not know how.
    """
    spec, name = environment.spec, environment_name(environment)
    if spec is None:
        raise RequestError(
            f"environment {name} is not of gymnasium.make, so that processes cannot make it again: "
            "give what makes it, its class or a function, in its place"
        )
    registered = gymnasium.registry.get(spec.id)
    for wrapper in spec.additional_wrappers:
        if wrapper.kwargs is None or wrapper.entry_point.startswith("__main__:"):
            raise RequestError(
                f"environment {name}: Gymnasium cannot make wrapper {wrapper.name} again; give a "
                "function that makes the environment with it in its place"
            )
    arguments = {k: v for k, v in spec.kwargs.items() if k != "render_mode"}
    if registered is None or registered.additional_wrappers != spec.additional_wrappers:
        unlimited = dataclasses.replace(spec, kwargs=arguments)
        return functools.partial(gymnasium.make, unlimited, max_episode_steps=-1), {}
    own = {k: v for k, v in arguments.items() if registered.kwargs.get(k, _NOTHING) is not v}
    return spec.id, own
