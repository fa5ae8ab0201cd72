"""Tasks with numbered states and actions and known transitions."""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from qbumpers.errors import RequestError
from qbumpers.tasks.dynamics import CRASH, SUCCESS, TERMINATED, Dynamics

_ROW_TOLERANCE = 1e-8

Judge = Callable[[int, int, int, float, bool], bool]
"""`(state, action, next_state, reward, terminated) -> bool`."""


@dataclass(frozen=True, eq=False)
class TabularTask:
    """A finite episodic Markov decision process (Section 2.1).

    S states, A actions, at most K outcomes of an action; unused outcomes have probability 0.

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
        success: bool [S, A, K], outcomes that count as success; None where unknown.
        crash: bool [S, A, K], outcomes that count as a crash; None where unknown.
        grid: (rows, columns) where state = row * columns + column, for heatmaps; else None.

    Raises:
        RequestError: where shapes disagree, a probability row does not sum to 1, a state number or
            the discount is out of range, or a number is not finite.
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

    def __post_init__(self) -> None:
        """Check every field."""
        _check(self)

    observation_size = 0
    no_op = -1
    has_distance = False
    undoable = True
    seen = None
    learners = ("q-learning", "sarsa", "expected-sarsa")

    @property
    def distance(self):
        return 1 - np.eye(self.actions)

    @property
    def states(self) -> int:
        """S."""
        return self.next_state.shape[0]

    @property
    def actions(self) -> int:
        """A."""
        return self.next_state.shape[1]

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

    def digest(self) -> str:
        """A SHA-256 of everything that decides how the task behaves."""
        parts = [np.asarray(part).tobytes() for part in (*self.dynamics(), float(self.discount))]
        return hashlib.sha256(b"|".join(parts)).hexdigest()

    @classmethod
    def from_arrays(
        cls,
        transition: np.ndarray,
        reward: np.ndarray,
        terminal: np.ndarray,
        start: np.ndarray | int,
        *,
        discount: float,
        episode_limit: int,
        name: str = "task",
        success: np.ndarray | None = None,
        crash: np.ndarray | None = None,
        grid: tuple[int, int] | None = None,
    ) -> "TabularTask":
        """A task from the arrays that textbooks use.

        Args:
            transition: p(s' | s, a), float [S, A, S].
            reward: float [S, A], or [S, A, S] where it depends on the next state.
            terminal: bool [S], states that end the episode when entered.
            start: the first state, or float [S], its distribution.
            discount: in (0, 1].
            episode_limit: steps after which an episode is truncated.
            name: for messages and files.
            success: bool [S], states whose entry is a success.
            crash: bool [S], states whose entry is a crash.
            grid: (rows, columns) where states are the cells of a grid, row by row.

        Returns:
            The task.

        Raises:
            RequestError: as the class does.
        """
        transition = np.asarray(transition, np.float64)
        if transition.ndim != 3 or transition.shape[0] != transition.shape[2]:
            raise RequestError(f"transition has shape {transition.shape}; [S, A, S] is needed")
        _check_rows("transition", transition)
        states, actions, _ = transition.shape
        outcomes = max(1, int((transition > 0).sum(axis=2).max()))
        # Likely outcomes first: the others' probability is 0 and they are never drawn.
        order = np.argsort(transition == 0, axis=2, kind="stable")[:, :, :outcomes]
        full_reward = np.asarray(reward, np.float64)
        if full_reward.shape == (states, actions):
            full_reward = np.repeat(full_reward[:, :, None], states, axis=2)
        if full_reward.shape != transition.shape:
            raise RequestError(
                f"reward has shape {full_reward.shape}; [S, A] or [S, A, S] of the transition's "
                f"{transition.shape} is needed"
            )
        distribution = np.asarray(start, np.float64)
        if np.ndim(start) == 0:
            if start not in range(states):
                raise RequestError(f"start = {start!r}; it must lie in [0, {states})")
            distribution = np.eye(states)[int(np.asarray(start))]
        return cls(
            name=name,
            next_state=order,
            probability=np.take_along_axis(transition, order, 2),
            reward=np.take_along_axis(full_reward, order, 2),
            terminated=_state_flags("terminal", terminal, states)[order],
            start=distribution,
            discount=discount,
            episode_limit=episode_limit,
            success=None if success is None else _state_flags("success", success, states)[order],
            crash=None if crash is None else _state_flags("crash", crash, states)[order],
            grid=grid,
        )

    @classmethod
    def from_table(
        cls,
        table: Mapping[int, Mapping[int, list[tuple[float, int, float, bool]]]],
        start: np.ndarray,
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
            success: which outcomes are a success. Without it, and where some ending pays a
                positive reward, those endings are the successes and the other endings crashes.
            crash: which outcomes are a crash.
            grid: (rows, columns) where states are the cells of a grid, row by row.

        Returns:
            The task.

        Raises:
            RequestError: as the class does.
        """
        states, actions = len(table), len(table.get(0, ()))
        if any(set(table.get(s, ())) != set(range(actions)) for s in range(states)) or not actions:
            raise RequestError(
                "table must have states 0, 1, ... and in each the same actions 0, 1, ..."
            )
        outcomes = max(len(table[s][a]) for s in range(states) for a in range(actions))
        shape = (states, actions, outcomes)
        probability, next_state = np.zeros(shape), np.zeros(shape, np.int64)
        reward, terminated = np.zeros(shape), np.zeros(shape, np.bool_)
        judges = {"success": success, "crash": crash}
        judged = {name: np.zeros(shape, np.bool_) for name in judges}
        for s, a in np.ndindex(states, actions):
            for k, (p, to, r, done) in enumerate(table[s][a]):
                place = s, a, k
                probability[place], next_state[place] = p, to
                reward[place], terminated[place] = r, done
                for event, judge in judges.items():
                    judged[event][place] = judge is not None and p > 0 and judge(s, a, to, r, done)
        events = {event: judged[event] if judge else None for event, judge in judges.items()}
        if success is None and crash is None:
            events = _endings(terminated, reward, probability)
        return cls(
            name=name,
            next_state=next_state,
            probability=probability,
            reward=reward,
            terminated=terminated,
            start=np.asarray(start, np.float64),
            discount=discount,
            episode_limit=episode_limit,
            success=events["success"],
            crash=events["crash"],
            grid=grid,
        )

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

        Args:
            environment: an environment, for instance `gymnasium.make("FrozenLake-v1")`.
            discount: in (0, 1]; Gymnasium's environments state none.
            episode_limit: steps; the environment's own limit where None.
            success: as for `from_table`.
            crash: as for `from_table`.

        Returns:
            The task.

        Raises:
            RequestError: where the environment has no table, or no limit is known.
        """
        inner = environment.unwrapped
        name = environment.spec.id if environment.spec else type(inner).__name__
        table = getattr(inner, "P", None)
        start = getattr(inner, "initial_state_distrib", None)
        if table is None or start is None:
            missing = "P" if table is None else "initial_state_distrib"
            raise RequestError(
                f"environment {name} has no attribute {missing}: a tabular task needs its "
                "transition table; give one with TabularTask.from_table or TabularTask.from_arrays"
            )
        limit = episode_limit
        if limit is None and environment.spec:
            limit = environment.spec.max_episode_steps
        if limit is None:
            raise RequestError(f"environment {name} has no step limit: give episode_limit")
        grid = np.shape(inner.desc) if np.ndim(getattr(inner, "desc", 0)) == 2 else None
        if grid is not None and int(np.prod(grid)) != len(table):
            grid = None
        return cls.from_table(
            table, start, discount=discount, episode_limit=limit, name=name,
            success=success, crash=crash, grid=grid,
        )  # fmt: skip


def _endings(
    terminated: np.ndarray, reward: np.ndarray, probability: np.ndarray
) -> dict[str, np.ndarray | None]:
    endings = terminated & (probability > 0)
    paid = endings & (reward > 0)
    # Absorbing states loop on themselves with reward 0; no episode gets there, they do not matter.
    return (
        {"success": paid, "crash": endings & ~paid}
        if paid.any()
        else {"success": None, "crash": None}
    )


def _cumulative(probability: np.ndarray) -> np.ndarray:
    """Cumulative sums along the last axis, exactly 1 from the last possible outcome on."""
    cumulative = np.cumsum(np.asarray(probability, np.float64), axis=-1)
    remaining = np.flip(np.cumsum(np.flip(probability, -1), axis=-1), -1)
    last = np.concatenate([remaining[..., 1:], np.zeros_like(remaining[..., :1])], axis=-1) == 0
    return np.where(last, 1.0, cumulative)


def _state_flags(name: str, flags: np.ndarray, states: int) -> np.ndarray:
    array = np.asarray(flags, np.bool_)
    if array.shape != (states,):
        raise RequestError(
            f"{name} has shape {array.shape}; one flag a state, [{states}], is needed"
        )
    return array


def _check_rows(name: str, probability: np.ndarray) -> None:
    if not np.isfinite(probability).all() or (probability < 0).any():
        raise RequestError(f"{name} holds a number that is no probability (negative or not finite)")
    sums = probability.sum(axis=-1)
    wrong = np.argwhere(np.abs(sums - 1) > _ROW_TOLERANCE)
    if len(wrong):
        where = ", ".join(str(i) for i in wrong[0])
        labels = "state, action" if sums.ndim == 2 else "distribution"
        place = f" for ({labels}) = ({where})" if sums.ndim else ""
        raise RequestError(f"{name}{place} sums to {sums[tuple(wrong[0])]:g}; it must sum to 1")


def _check(task: TabularTask) -> None:
    shape = np.shape(task.next_state)
    if len(shape) != 3 or 0 in shape:
        raise RequestError(f"task {task.name}: next_state has shape {shape}; [S, A, K] is needed")
    for field in ("probability", "reward", "terminated", "success", "crash"):
        array = getattr(task, field)
        if array is not None and np.shape(array) != shape:
            raise RequestError(
                f"task {task.name}: {field} has shape {np.shape(array)}; {shape} is needed"
            )
    if np.shape(task.start) != shape[:1]:
        raise RequestError(
            f"task {task.name}: start has shape {np.shape(task.start)}; {shape[:1]} is needed"
        )
    _check_rows(f"task {task.name}: probability", task.probability)
    _check_rows(f"task {task.name}: start", task.start)
    if not np.isfinite(task.reward).all():
        raise RequestError(f"task {task.name}: reward holds a number that is not finite")
    if task.next_state.min() < 0 or task.next_state.max() >= shape[0]:
        raise RequestError(f"task {task.name}: next_state must lie in [0, {shape[0]})")
    if not 0 < task.discount <= 1:
        raise RequestError(f"task {task.name}: discount = {task.discount!r}; it must lie in (0, 1]")
    if task.episode_limit < 1:
        raise RequestError(
            f"task {task.name}: episode_limit = {task.episode_limit!r}; at least 1 is needed"
        )
    if task.grid is not None and task.grid[0] * task.grid[1] != shape[0]:
        raise RequestError(f"task {task.name}: grid {task.grid} does not hold {shape[0]} states")
