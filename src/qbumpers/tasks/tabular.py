"""Tasks with numbered states and actions and known transitions."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec
from gymnasium.wrappers import TimeLimit
from numpy.typing import ArrayLike

from qbumpers.errors import RequestError
from qbumpers.tasks.agreement import check_agreement
from qbumpers.tasks.checking import check_arrays, check_cells, check_common, normalised_rows
from qbumpers.tasks.construction import (
    Judge,
    Table,
    description_of,
    outcomes_of_arrays,
    outcomes_of_table,
    start_distribution,
)
from qbumpers.tasks.display import Display
from qbumpers.tasks.displays.by_environment import display_maker
from qbumpers.tasks.displays.plain import plain_display
from qbumpers.tasks.dynamics import CRASH, SUCCESS, TERMINATED, Dynamics
from qbumpers.tasks.environment import TabularEnvironment
from qbumpers.tasks.estimation import Estimate, estimated_table
from qbumpers.tasks.identity import transitions_digest
from qbumpers.tasks.stepping import Stepper, remade_by
from qbumpers.tasks.task import Remapping, distance_between


@dataclass(frozen=True, eq=False)
class TabularTask:
    """A finite episodic Markov decision process (Section 2.1); it is a `Task`.

    S states, A actions, at most K outcomes of an action; unused outcomes have probability 0.
    Fields from `success` on are optional; `dataclasses.replace` adds them to any task.

    Attributes:
        name: for messages and files.
        next_state: int [S, A, K].
        probability: float [S, A, K], summing to 1 over K.
        reward: float [S, A, K].
        terminated: bool [S, A, K], whether the outcome ends the episode for good.
        start: float [S], distribution of the first state.
        discount: in (0, 1].
        episode_limit: steps after which an episode is truncated; not a terminal state, learners
            bootstrap through it.
        success: bool [S, A, K], outcomes that count as success; None if unknown.
        crash: bool [S, A, K], outcomes that count as a crash; None if unknown.
        grid: (rows, columns) if state = row * columns + column, for heatmaps; else None.
        no_op: the action that does nothing; -1 if there is none.
        action_distance: float [A, A], how far apart actions are; None if any two are alike.
        seen: int [S], number of what the assistant sees of each state, if it is less than all.
        first_state: number that its environment gives to state 0; it counts on from there.
        first_action: number that its environment gives to action 0.
        estimate: how the table was estimated; None if it is known. No part of the digest.
        make_display: makes `display` of the task; no part of its digest.
        environment_spec: how Gymnasium makes the environment that it is, if it does; no part of its
            digest.
        remapping: of which task it is one with other keys; no part of its digest.

    Raises:
        RequestError: if shapes disagree, a probability row does not sum to 1, a state or action
            number or the discount is out of range, or a number is not finite.
    """

    name: str
    next_state: np.ndarray
    probability: np.ndarray
    reward: np.ndarray
    terminated: np.ndarray
    start: np.ndarray
    discount: float
    episode_limit: int
    success: np.ndarray | None = None
    crash: np.ndarray | None = None
    grid: tuple[int, int] | None = None
    no_op: int = -1
    action_distance: np.ndarray | None = None
    seen: np.ndarray | None = None
    first_state: int = 0
    first_action: int = 0
    estimate: Estimate | None = None
    make_display: Callable[["TabularTask"], Any] | None = None
    environment_spec: EnvSpec | None = None
    remapping: Remapping | None = None

    observation_size = 0
    undoable = True
    releases_gil = True
    learners = (
        "q-learning", "sarsa", "expected-sarsa", "softmax-q-learning", "actor-critic",
        "model-based", "imitator", "two-rate",
    )  # fmt: skip
    value_sources = ("exact", "q-learning")
    code = ()
    revision = 1

    def __getstate__(self) -> dict[str, Any]:
        """Without `environment_spec`, which may name what workers need not have."""
        return {**self.__dict__, "environment_spec": None}

    def __post_init__(self) -> None:
        """Check every field."""
        check_arrays(self)
        for field in ("probability", "start"):
            rows = normalised_rows(f"task {self.name}: {field}", getattr(self, field))
            object.__setattr__(self, field, rows)
        check_common(self, self.make_display)
        check_cells(self)

    @property
    def states(self) -> int:
        """S."""
        return self.next_state.shape[0]

    @property
    def actions(self) -> int:
        """A."""
        return self.next_state.shape[1]

    @property
    def observation_space(self) -> spaces.Discrete:
        """The numbers of its states, as its environment counts them."""
        return spaces.Discrete(self.states, start=self.first_state)

    @property
    def action_space(self) -> spaces.Discrete:
        """The numbers of its actions, as its environment counts them."""
        return spaces.Discrete(self.actions, start=self.first_action)

    @property
    def events(self) -> frozenset[str]:
        """Which of "success" and "crash" it announces."""
        flags = {"success": self.success, "crash": self.crash}
        return frozenset(name for name, array in flags.items() if array is not None)

    @property
    def has_distance(self) -> bool:
        """Whether it states distances between its actions."""
        return self.action_distance is not None

    @property
    def distance(self) -> np.ndarray:
        """Between actions, float64 [A, A]; 1 between any two if none is stated."""
        return distance_between(self.actions, self.action_distance)

    @property
    def display(self) -> Display:
        """How it is shown and played; a plain one if it has none of its own."""
        return plain_display(self) if self.make_display is None else self.make_display(self)

    def dynamics(self) -> Dynamics:
        """The task laid out for compiled loops."""
        events = self.terminated * TERMINATED
        if self.success is not None:
            events = events + self.success * SUCCESS
        if self.crash is not None:
            events = events + self.crash * CRASH
        starts = np.flatnonzero(self.start)
        return Dynamics(
            next_state=np.ascontiguousarray(self.next_state, np.int64).ravel(),
            reward=np.ascontiguousarray(self.reward, np.float64).ravel(),
            cumulative=_cumulative(self.probability).ravel(),
            events=np.ascontiguousarray(events, np.uint8).ravel(),
            actions=self.actions,
            outcomes=self.next_state.shape[2],
            start_states=starts,
            start_cumulative=_cumulative(self.start[starts]),
            episode_limit=int(self.episode_limit),
        )

    def make_stepper(self) -> Stepper:
        """Refused: it has a table in the place of a stepper.

        Raises:
            RequestError: always.
        """
        raise RequestError(
            f"task {self.name} has numbered states and a table of transitions: its values are "
            "solved exactly, see solve, and compared so, see check_exactness"
        )

    def digest(self) -> str:
        """A SHA-256 of everything that decides how the task behaves."""
        parts = [np.asarray(part).tobytes() for part in (*self.dynamics(), float(self.discount))]
        return hashlib.sha256(b"|".join([*parts, *self._optional_parts()])).hexdigest()

    def identity(self) -> str:
        """A SHA-256 of what Q* depends on beside the discount, and of what is seen of states."""
        transitions = transitions_digest(self.dynamics())
        if self.seen is None:
            return transitions
        seen = np.asarray(self.seen, np.int64).tobytes()
        return hashlib.sha256(transitions.encode() + seen).hexdigest()

    def _optional_parts(self) -> list[bytes]:
        """What is part of the digest only if it is stated: digests of tasks without it stay."""
        parts = []
        if self.no_op >= 0:
            parts.append(b"no_op" + np.int64(self.no_op).tobytes())
        if self.has_distance:
            parts.append(b"distance" + self.distance.tobytes())
        if self.seen is not None:
            parts.append(b"seen" + np.asarray(self.seen, np.int64).tobytes())
        return parts

    def make_environment(self, *, render_mode: str | None = None) -> gymnasium.Env[Any, Any]:
        """The task as a Gymnasium environment with its step limit.

        Args:
            render_mode: one that `TabularEnvironment` has, or None for no pictures.

        Returns:
            A `TabularEnvironment` within Gymnasium's TimeLimit.

        Raises:
            RequestError: if there is no such mode.
        """
        environment = TabularEnvironment(self, render_mode)
        return TimeLimit(environment, max_episode_steps=self.episode_limit)

    @classmethod
    def from_arrays(
        cls,
        transition: ArrayLike,
        reward: ArrayLike,
        terminal: ArrayLike,
        start: ArrayLike,
        *,
        discount: float,
        episode_limit: int,
        name: str = "task",
        success: ArrayLike | None = None,
        crash: ArrayLike | None = None,
        grid: tuple[int, int] | None = None,
    ) -> "TabularTask":
        """A task from the arrays that textbooks use.

        Args:
            transition: p(s' | s, a), float [S, A, S].
            reward: float [S, A], or [S, A, S] if it depends on the next state.
            terminal: bool [S], states that end the episode when entered.
            start: the first state, or float [S], its distribution.
            discount: in (0, 1].
            episode_limit: steps after which an episode is truncated.
            name: for messages and files.
            success: bool [S], states whose entry is a success.
            crash: bool [S], states whose entry is a crash.
            grid: (rows, columns) if states are the cells of a grid, row by row.

        Returns:
            The task.

        Raises:
            RequestError: as the class does.
        """
        outcomes: Any = outcomes_of_arrays(transition, reward, terminal, success, crash)
        return cls(
            name=name, start=start_distribution(start, len(outcomes["next_state"])),
            discount=discount, episode_limit=episode_limit, grid=grid, **outcomes,
        )  # fmt: skip

    @classmethod
    def from_table(
        cls,
        table: Table,
        start: ArrayLike,
        *,
        discount: float,
        episode_limit: int,
        name: str = "task",
        success: Judge | None = None,
        crash: Judge | None = None,
        grid: tuple[int, int] | None = None,
    ) -> "TabularTask":
        """A task from a transition table as Gymnasium's toy-text environments keep it.

        Args:
            table: `table[state][action]`, a list of (probability, next state, reward, terminated).
            start: float [S], distribution of the first state.
            discount: in (0, 1].
            episode_limit: steps after which an episode is truncated.
            name: for messages and files.
            success: which outcomes are a success. Without it and `crash`, and if some ending pays
                a positive reward, those endings are the successes and the other endings crashes.
            crash: which outcomes are a crash.
            grid: (rows, columns) if states are the cells of a grid, row by row.

        Returns:
            The task.

        Raises:
            RequestError: as the class does.
        """
        outcomes: Any = outcomes_of_table(table, success, crash)
        return cls(
            name=name, start=np.asarray(start, np.float64), discount=discount,
            episode_limit=episode_limit, grid=grid, **outcomes,
        )  # fmt: skip

    @classmethod
    def from_gymnasium(
        cls,
        environment: Any,
        *,
        discount: float,
        episode_limit: int | None = None,
        success: Judge | None = None,
        crash: Judge | None = None,
    ) -> "TabularTask":
        """A task from a Gymnasium environment that has a transition table `P`.

        Wrappers that only watch, and TransformReward and ClipReward, are followed. Then the table
        is compared with steps of the environment, of a copy of it if it can be copied; see
        `check_agreement`. States and actions are counted from 0 in the task, whatever number the
        environment's spaces start with.

        Args:
            environment: for example `gymnasium.make("FrozenLake-v1")`.
            discount: in (0, 1]; Gymnasium's environments state none.
            episode_limit: steps; the environment's own limit if None.
            success: as for `from_table`.
            crash: as for `from_table`.

        Returns:
            The task.

        Raises:
            RequestError: if the environment has no table, no limit is known, it has a wrapper that
                cannot be followed, or its spaces or steps are not those of the table.
        """
        found = description_of(environment, episode_limit)
        made = cls.from_table(**found.table, discount=discount, success=success, crash=crash)
        numbered = replace(
            made, first_state=found.first_state, first_action=found.first_action,
            make_display=display_maker(environment),
            environment_spec=remade_by(environment, made.episode_limit),
        )  # fmt: skip
        check_agreement(numbered, environment.unwrapped, found.reward)
        return numbered

    @classmethod
    def estimated(
        cls,
        environment: Any,
        *,
        discount: float,
        steps: int,
        seed: int = 0,
        episode_limit: int | None = None,
        success_key: str | None = None,
        crash_key: str | None = None,
    ) -> "TabularTask":
        """A task from a Gymnasium environment with numbered states, its table being estimated.

        In each state the action that was tried least is tried, one of several at random.
        Probabilities are relative frequencies (maximum likelihood), rewards means. A pair of a
        state and an action that was never tried counts as the worst that could be: the end of the
        episode, at the cost of the worst reward in every step of a whole one. `estimate` says how
        often each was tried, and `qbumpers.values.start_interval` how uncertain V* is.

        Args:
            environment: with Discrete observations and actions; it is stepped.
            discount: in (0, 1].
            steps: of the environment, at least 1.
            seed: decides actions and episodes; not negative.
            episode_limit: steps; the environment's own limit if None.
            success_key: as for `VectorTask.from_gymnasium`; without either key in `info`, and if
                some ending pays, successes and crashes are as for `from_table`.
            crash_key: the same for crashes.

        Returns:
            The task.

        Raises:
            RequestError: if states or actions are not numbered, no limit is known, or a number is
                out of range.

        Warns:
            EstimateWarning: if a pair that an episode can meet was tried fewer than ten times.
        """
        found: Any = estimated_table(
            environment, discount=discount, steps=steps, seed=seed, episode_limit=episode_limit,
            success_key=success_key, crash_key=crash_key,
        )  # fmt: skip
        return cls(**found, discount=discount, make_display=display_maker(environment))


def _cumulative(probability: np.ndarray) -> np.ndarray:
    """Cumulative sums along the last axis, exactly 1 from the last possible outcome on."""
    cumulative = np.cumsum(np.asarray(probability, np.float64), axis=-1)
    remaining = np.flip(np.cumsum(np.flip(probability, -1), axis=-1), -1)
    last = np.concatenate([remaining[..., 1:], np.zeros_like(remaining[..., :1])], axis=-1) == 0
    return np.where(last, 1.0, cumulative)
