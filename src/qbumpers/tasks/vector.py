"""Tasks whose observations are vectors, stepped through one action at a time."""

import functools
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from typing import Any, Protocol

import gymnasium
import numpy as np
from gymnasium import spaces

from qbumpers.errors import RequestError
from qbumpers.random_streams import content_digest
from qbumpers.tasks.dynamics import CRASH, SUCCESS, TERMINATED, TRUNCATED

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


@dataclass(frozen=True, eq=False)
class VectorTask:
    """An episodic task with A numbered actions, of which a vector of D numbers is observed.

    It can be pickled, so that every worker makes its own environment.

    Attributes:
        name: for messages and files.
        make_stepper: makes the environment for simulators.
        make_environment: makes it for people, as Gymnasium's environment with its step limit; takes
            `render_mode`.
        observation_size: D.
        actions: A.
        discount: in (0, 1].
        episode_limit: steps after which an episode is truncated; not a terminal state, learners
            bootstrap through it.
        settings: JSON-like; all that decides how the environment behaves.
        has_success: whether the environment tells successes.
        has_crash: whether the environment tells crashes.

    Raises:
        RequestError: where a size, the discount or the limit is out of range, or the settings are
            not JSON-like.
    """

    name: str
    make_stepper: Callable[[], Stepper]
    make_environment: Callable[..., gymnasium.Env[Any, Any]]
    observation_size: int
    actions: int
    discount: float
    episode_limit: int
    settings: Mapping[str, Any]
    has_success: bool
    has_crash: bool

    def __post_init__(self) -> None:
        """Check every number."""
        if not 0 < self.discount <= 1:
            raise RequestError(
                f"task {self.name}: discount = {self.discount!r}; it must lie in (0, 1]"
            )
        for field in ("observation_size", "actions", "episode_limit"):
            if getattr(self, field) < 1:
                raise RequestError(
                    f"task {self.name}: {field} = {getattr(self, field)!r}; at least 1 is needed"
                )
        try:
            self.digest()
        except (TypeError, ValueError) as error:
            raise RequestError(
                f"task {self.name}: settings = {self.settings!r}; only numbers, texts, true, false "
                "and lists and tables of them can be kept with results"
            ) from error

    states = 0
    no_op = -1
    has_distance = False
    undoable = False
    seen = None
    learners = ("double-dqn",)

    @property
    def distance(self):
        return 1 - np.eye(self.actions)

    def digest(self) -> str:
        """A SHA-256 of everything that decides how the task behaves."""
        content = {
            "name": self.name,
            "settings": self.settings,
            "observation_size": self.observation_size,
            "actions": self.actions,
            "discount": float(self.discount),
            "episode_limit": self.episode_limit,
        }
        return content_digest(content).hex()

    @classmethod
    def from_gymnasium(
        cls, name: str, *, discount: float, episode_limit: int | None = None, **arguments: Any
    ) -> "VectorTask":
        """A task from a Gymnasium environment with numbered actions and a vector observation.

        Every episode is seeded by itself. Successes and crashes are known where `info` has the keys
        `success` and `crash` at reset or after the first step.

        Args:
            name: id of the environment, for instance "CartPole-v1".
            discount: in (0, 1]; Gymnasium's environments state none.
            episode_limit: steps; the environment's own limit where None.
            **arguments: of the environment, JSON-like.

        Returns:
            The task.

        Raises:
            RequestError: where there is no such environment or it cannot be made, its actions are
                not Discrete or its observations not a vector, or no limit is known.
        """
        with closing(make_environment(name, **arguments)) as environment:
            _check_spaces(name, environment)
            told = _told(environment)
            limit = episode_limit
            if limit is None and environment.spec:
                limit = environment.spec.max_episode_steps
        if limit is None:
            raise RequestError(f"environment {name} has no step limit: give episode_limit")
        return cls(
            name=name,
            make_stepper=functools.partial(GymnasiumStepper, name, arguments),
            make_environment=functools.partial(
                gymnasium.make, name, max_episode_steps=limit, **arguments
            ),
            observation_size=environment.observation_space.shape[0],
            actions=int(environment.action_space.n),
            discount=discount,
            episode_limit=limit,
            settings={"environment": name, "arguments": arguments},
            has_success="success" in told,
            has_crash="crash" in told,
        )


def make_environment(name: str, **arguments: Any) -> Any:
    """A Gymnasium environment.

    Args:
        name: its id.
        **arguments: of `gymnasium.make`.

    Returns:
        The environment.

    Raises:
        RequestError: where there is none of this name or an argument does not suit it.
    """
    try:
        return gymnasium.make(name, disable_env_checker=True, **arguments)
    except (TypeError, ValueError, LookupError, gymnasium.error.Error, ImportError) as error:
        missing = "; pip install 'qbumpers[lunar]'" if "Box2D" in str(error) else ""
        raise RequestError(f"task {name!r}: {error}{missing}") from error


def _check_spaces(name: str, environment: Any) -> None:
    if not isinstance(environment.action_space, spaces.Discrete):
        raise RequestError(
            f"task {name!r}: its action space is {environment.action_space}; numbered actions "
            "(Discrete) are needed"
        )
    space = environment.observation_space
    if not (isinstance(space, spaces.Box) and len(space.shape) == 1 and space.shape[0] > 0):
        raise RequestError(
            f"task {name!r}: its observation space is {space}; a vector of "
            "numbers (Box with one dimension) is needed"
        )


def _told(environment: Any) -> set[str]:
    """Keys of `info` at reset and after a step."""
    _, first = environment.reset(seed=0)
    *_, info = environment.step(environment.action_space.start)
    return {*first, *info}


class GymnasiumStepper:
    """Any Gymnasium environment with numbered actions and a vector observation, for simulators.

    Args:
        name: id of the environment.
        arguments: of the environment.
    """

    def __init__(self, name: str, arguments: Mapping[str, Any]) -> None:
        self._environment = make_environment(name, max_episode_steps=-1, **arguments)
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
