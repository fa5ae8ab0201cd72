"""Tasks whose observations are vectors."""

import functools
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec
from gymnasium.wrappers import TimeLimit

from qbumpers.errors import RequestError
from qbumpers.random_streams import content_digest
from qbumpers.tasks.announcing import found_keys
from qbumpers.tasks.checking import check_common
from qbumpers.tasks.displays.by_environment import display_maker
from qbumpers.tasks.dynamics import Dynamics
from qbumpers.tasks.identity import environment_digest
from qbumpers.tasks.observing import View, is_vector, make_viewed, viewed
from qbumpers.tasks.stepping import (
    REVISION,
    GymnasiumStepper,
    Stepper,
    environment_name,
    make_environment,
    maker_name,
    maker_of,
    remade_by,
    stepped_by_of,
)
from qbumpers.tasks.task import Remapping, distance_between
from qbumpers.tasks.undoing import can_undo
from qbumpers.tasks.wrapping import altering_wrappers, step_limit

_STEPS_REPEATED = 50  # of episodes that are played twice


@dataclass(frozen=True, eq=False)
class VectorTask:
    """An episodic task of which a vector of D numbers is observed; it is a `Task`.

    It can be pickled, so that every worker makes its own environment.

    Attributes:
        name: for messages and files.
        make_stepper: makes the environment for simulators.
        make_environment: makes it for participants, as Gymnasium's environment with its step limit;
            takes `render_mode`.
        observation_size: D.
        actions: A.
        discount: in (0, 1].
        episode_limit: steps after which an episode is truncated; not a terminal state, learners
            bootstrap through it.
        settings: JSON-like; all that decides how the environment behaves.
        has_success: whether the environment announces successes.
        has_crash: whether the environment announces crashes.
        undoable: whether its steppers have `snapshot` and `restore`, see `UndoableStepper`.
        no_op: the action that does nothing; -1 if there is none.
        action_distance: float [A, A], how far apart actions are; None if any two are alike.
        implied: `no_op` and `action_distance` that follow from the name and the settings; any
            others are part of the digest.
        first_action: number that the environment gives to action 0.
        origin: digest of the Gymnasium environment that it was made from; empty if there is none.
        make_display: makes `display` of the task; no part of its digest.
        environment_spec: how Gymnasium makes the environment that it is, if it does; no part of its
            digest.
        remapping: of which task it is one with other keys; no part of its digest.
        stepped_by: what else decides its steps beside `make_stepper`, no part of its digest:
            classes and functions; and modules, for the versions of their libraries.
        revision: raised when it gives other numbers for a reason that its code does not show.

    Raises:
        RequestError: if a size, the discount, the limit, an action or a distance is out of range,
            or the settings are not JSON-like.
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
    undoable: bool = False
    no_op: int = -1
    action_distance: np.ndarray | None = None
    implied: tuple[int, np.ndarray | None] = (-1, None)
    first_action: int = 0
    origin: str = ""
    make_display: Callable[["VectorTask"], Any] | None = None
    environment_spec: EnvSpec | None = None
    remapping: Remapping | None = None
    stepped_by: tuple[Any, ...] = ()
    revision: int = 1

    states = 0
    grid = None
    seen = None
    estimate = None
    releases_gil = False
    learners = ("double-dqn",)
    value_sources = ("expert",)

    def __post_init__(self) -> None:
        """Check every number."""
        for field in ("observation_size", "actions"):
            if getattr(self, field) < 1:
                raise RequestError(
                    f"task {self.name}: {field} = {getattr(self, field)!r}; at least 1 is needed"
                )
        check_common(self, self.make_display)
        try:
            self.digest()
        except (TypeError, ValueError) as error:
            raise RequestError(
                f"task {self.name}: settings = {self.settings!r}; only numbers, texts, true, false "
                "and lists and tables of them can be kept with results"
            ) from error

    def __getstate__(self) -> dict[str, Any]:
        """Without what workers need not have: modules cannot be pickled."""
        return {**self.__dict__, "stepped_by": (), "environment_spec": None}

    @property
    def start(self) -> np.ndarray:
        """Float64 [0]: no states are numbered."""
        return np.zeros(0)

    @property
    def observation_space(self) -> spaces.Box:
        """Every vector of D numbers."""
        return spaces.Box(-np.inf, np.inf, (self.observation_size,), np.float32)

    @property
    def action_space(self) -> spaces.Discrete:
        """The numbers of its actions, as its environment counts them."""
        return spaces.Discrete(self.actions, start=self.first_action)

    @property
    def events(self) -> frozenset[str]:
        """Which of "success" and "crash" it announces."""
        announced = {"success": self.has_success, "crash": self.has_crash}
        return frozenset(name for name, is_announced in announced.items() if is_announced)

    @property
    def has_distance(self) -> bool:
        """Whether it states distances between its actions."""
        return self.action_distance is not None

    @property
    def distance(self) -> np.ndarray:
        """Between actions, float64 [A, A]; 1 between any two if none is stated."""
        return distance_between(self.actions, self.action_distance)

    @property
    def display(self) -> Any:
        """How it is shown and played; None if it does not say."""
        return None if self.make_display is None else self.make_display(self)

    @property
    def code(self) -> tuple[Any, ...]:
        """What decides its steps beside its digest; chance comes from NumPy's generators."""
        return (self.make_stepper, *self.stepped_by, np)

    def dynamics(self) -> Dynamics:
        """Refused: it has no table of transitions.

        Raises:
            RequestError: always.
        """
        raise RequestError(f"task {self.name} has no table of transitions")

    def digest(self) -> str:
        """A SHA-256 of everything that decides how the task behaves, and what rules do in it."""
        content: dict[str, Any] = {
            "name": self.name,
            "settings": self.settings,
            "observation_size": self.observation_size,
            "actions": self.actions,
            "discount": float(self.discount),
            "episode_limit": self.episode_limit,
        }
        # Digests seed streams: those of tasks that state no more than is implied stay.
        stated = _plain_facts(self.no_op, self.action_distance)
        if stated != _plain_facts(*self.implied):
            content["stated"] = stated
        return content_digest(content).hex()

    def identity(self) -> str:
        """A SHA-256 of the environment that it was made from, else of its name and settings."""
        content = {"name": self.name, "settings": self.settings}
        return self.origin or content_digest(content).hex()

    @classmethod
    def from_gymnasium(
        cls,
        environment: Any,
        *,
        discount: float,
        episode_limit: int | None = None,
        observe: Sequence[str] = (),
        success_key: str | None = None,
        crash_key: str | None = None,
        **arguments: Any,
    ) -> "VectorTask":
        """A task from a Gymnasium environment with numbered actions.

        An observation that is no vector is made one by Gymnasium's FlattenObservation, unscaled:
        numbers of a Discrete space become one-hot vectors. Every episode is seeded by itself, and
        must follow from its seed and its actions alone: two are played twice. Wrappers are part of
        the environment. Steps can be undone if `undo_of` says so of the environment.

        Args:
            environment: its id, for example "CartPole-v1"; a function or class that makes
                it; or an environment of `gymnasium.make`, which is made again with its wrappers.
            discount: in (0, 1]; Gymnasium's environments state none.
            episode_limit: steps; the environment's own limit if None.
            observe: keys of a Dict observation, the others being left out; all if empty.
            success_key: key of `info` that tells a success, at whatever step. If None, the first of
                "success" and "is_success" that some random episode shows.
            crash_key: the same for a crash; "crash" or "crashed".
            **arguments: of the environment, JSON-like.

        Returns:
            The task.

        Raises:
            RequestError: if there is no such environment or it cannot be made, its actions are
                not Discrete or its observations cannot be made vectors, no limit is known, or an
                episode depends on those before it.

        Warns:
            UserWarning: if a key was given that no random episode showed.
        """
        maker: Any = environment
        if isinstance(environment, gymnasium.Env):
            episode_limit = step_limit(environment) if episode_limit is None else episode_limit
            maker, arguments = maker_of(environment)
        with closing(make_environment(maker, **arguments)) as environment:
            name = maker if isinstance(maker, str) else environment_name(environment)
            check_actions(name, environment)
            made_by = _made_by(maker, environment)
            shown = is_vector(environment.observation_space)  # displays show what is not flattened
            observed = viewed(environment, name, View(tuple(observe)))
            _check_repeatable(name, observed)
            found = found_keys(name, observed, success_key, crash_key)
            view = View(tuple(observe), found.keys)
            environment = viewed(environment, name, view)
            undoable, stepped_by = can_undo(environment), stepped_by_of(environment)
            limit = step_limit(environment) if episode_limit is None else episode_limit
            spec = remade_by(environment, limit)
        if limit is None:
            raise RequestError(f"environment {name} has no step limit: give episode_limit")
        return cls(
            name=name,
            make_stepper=functools.partial(
                GymnasiumStepper, _maker_for_simulators(maker, view, arguments)
            ),
            make_environment=_maker_for_participants(maker, view, limit, arguments),
            observation_size=environment.observation_space.shape[0],
            actions=int(environment.action_space.n),
            discount=discount,
            episode_limit=limit,
            settings={"environment": name, "arguments": arguments, **made_by, **view.settings()},
            has_success=found.success,
            has_crash=found.crash,
            undoable=undoable,
            first_action=int(environment.action_space.start),
            origin=environment_digest(environment),
            make_display=display_maker(environment) if shown else None,
            environment_spec=spec,
            stepped_by=stepped_by,
            revision=REVISION,
        )


def _maker_for_simulators(
    maker: Any, view: View, arguments: Mapping[str, Any]
) -> Callable[[], gymnasium.Env[Any, Any]]:
    """Makes the environment without a step limit, unless a function makes it with one."""
    unlimited = {"max_episode_steps": -1} if isinstance(maker, str) else {}
    return functools.partial(make_viewed, maker, view, **unlimited, **arguments)


def _maker_for_participants(
    maker: Any, view: View, limit: int, arguments: Mapping[str, Any]
) -> Callable[..., gymnasium.Env[Any, Any]]:
    if isinstance(maker, str):
        return functools.partial(make_viewed, maker, view, max_episode_steps=limit, **arguments)
    return functools.partial(_limited, maker, view, limit, arguments)


def _limited(
    maker: Any,
    view: View,
    limit: int,
    arguments: Mapping[str, Any],
    *,
    render_mode: str | None = None,
) -> gymnasium.Env[Any, Any]:
    """What a function makes, with a step limit if it has another or none."""
    drawn = {} if render_mode is None else {"render_mode": render_mode}
    environment = make_viewed(maker, view, **arguments, **drawn)
    return environment if step_limit(environment) == limit else TimeLimit(environment, limit)


def _made_by(maker: Any, environment: Any) -> dict[str, Any]:
    """What tells an environment that a function makes from the one of its id."""
    if isinstance(maker, str):
        return {}
    around = [type(layer).__name__ for layer in altering_wrappers(environment)]
    return {"made by": maker_name(maker), "wrappers": around}


def _plain_facts(no_op: int, distance: np.ndarray | None) -> list[Any]:
    """What is stated of actions, JSON-like."""
    return [int(no_op), None if distance is None else np.asarray(distance, np.float64).tolist()]


def check_actions(name: str, environment: Any) -> None:
    """Check that an environment's actions are numbered.

    Raises:
        RequestError: if they are not.
    """
    if not isinstance(environment.action_space, spaces.Discrete):
        raise RequestError(
            f"task {name!r}: its action space is {environment.action_space}; numbered actions "
            "(Discrete) are needed"
        )


def _check_repeatable(name: str, environment: Any) -> None:
    """Play an episode, another one, and both once more; RequestError if one differs."""
    first = [_beginning(environment, seed) for seed in (0, 1)]
    again = [_beginning(environment, seed) for seed in (0, 1)]
    if not all(np.array_equal(*both, equal_nan=True) for both in zip(first, again, strict=True)):
        around = [type(layer).__name__ for layer in altering_wrappers(environment)]
        blamed = f"; is it wrapper {' or '.join(around)}?" if around else ""
        raise RequestError(
            f"task {name!r}: an episode went another way when it was played again with the same "
            f"seed and actions, so its numbers would depend on what was played before{blamed}"
        )


def _beginning(environment: Any, seed: int) -> np.ndarray:
    """The first steps of an episode, a row of observation, reward and end each."""
    observation, _ = environment.reset(seed=seed)
    rows = [[*observation, 0.0, 0.0]]
    space = environment.action_space
    for action in np.random.default_rng(seed).integers(int(space.n), size=_STEPS_REPEATED):
        observation, reward, terminated, truncated, _ = environment.step(int(space.start + action))
        rows.append([*observation, float(reward), float(terminated)])
        if terminated or truncated:
            break
    return np.array(rows)
