"""What every task says about itself: hosts ask the task, never what kind of task it is."""

from typing import Any, NamedTuple, Protocol

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec

from qbumpers.errors import RequestError, in_short
from qbumpers.tasks.dynamics import Dynamics
from qbumpers.tasks.stepping import Stepper


def check_task(task: Any) -> None:
    """Check that a task is none in name only.

    Raises:
        RequestError: if it is.
    """
    if not callable(getattr(task, "digest", None)):
        raise RequestError(
            f"task = {in_short(task)}; a task is needed, for instance of make_task(name)"
        )


class Task(Protocol):
    """An episodic task with A numbered actions.

    Its states are numbered (a table, S states) or observed as vectors (of D numbers).
    """

    @property
    def name(self) -> str:
        """For messages and files."""
        ...

    @property
    def actions(self) -> int:
        """A."""
        ...

    @property
    def discount(self) -> float:
        """In (0, 1]."""
        ...

    @property
    def episode_limit(self) -> int:
        """Steps after which an episode is truncated."""
        ...

    @property
    def states(self) -> int:
        """S; 0 if observations are vectors."""
        ...

    @property
    def observation_size(self) -> int:
        """D; 0 if states are numbered."""
        ...

    @property
    def observation_space(self) -> gymnasium.Space[Any]:
        """Discrete(S), with the environment's start, or Box of float32 [D]."""
        ...

    @property
    def action_space(self) -> gymnasium.spaces.Discrete:
        """Discrete(A), with the environment's start: elsewhere actions count from 0."""
        ...

    @property
    def grid(self) -> tuple[int, int] | None:
        """(rows, columns) if states are the cells of a grid, row by row; else None."""
        ...

    @property
    def start(self) -> np.ndarray:
        """Distribution of the first state, float [S]."""
        ...

    @property
    def seen(self) -> np.ndarray | None:
        """Number of what the assistant sees of each state, int [S]; None if it sees all of it."""
        ...

    @property
    def estimate(self) -> Any:
        """What its table was estimated from; None if it is known, or there is none."""
        ...

    @property
    def events(self) -> frozenset[str]:
        """Which of "success" and "crash" the task announces."""
        ...

    @property
    def no_op(self) -> int:
        """The action that does nothing; -1 if there is none."""
        ...

    @property
    def has_distance(self) -> bool:
        """Whether the task states distances between its actions."""
        ...

    @property
    def distance(self) -> np.ndarray:
        """Between actions, float64 [A, A]; 0 on the diagonal and 1 elsewhere if none is stated."""
        ...

    @property
    def undoable(self) -> bool:
        """Whether a step can be taken back."""
        ...

    @property
    def display(self) -> Any:
        """How the task is shown and played; None if it does not say."""
        ...

    @property
    def remapping(self) -> "Remapping | None":
        """Of which task it is another one with its actions in another order; None if of none."""
        ...

    @property
    def learners(self) -> tuple[str, ...]:
        """Names of the learners that suit it; the first is the default."""
        ...

    @property
    def value_sources(self) -> tuple[str, ...]:
        """Names of the sources that Q* of it can come from."""
        ...

    @property
    def releases_gil(self) -> bool:
        """Whether simulations of it run in threads at once: none of it is Python."""
        ...

    @property
    def environment_spec(self) -> EnvSpec | None:
        """How Gymnasium makes the environment that it is; None if Gymnasium does not know it."""
        ...

    @property
    def code(self) -> tuple[Any, ...]:
        """What decides its steps beside its digest: functions, classes, modules of libraries."""
        ...

    @property
    def revision(self) -> int:
        """Raised when it gives other numbers for a reason that its code does not show."""
        ...

    def digest(self) -> str:
        """A SHA-256 of everything that decides how the task behaves."""
        ...

    def identity(self) -> str:
        """A SHA-256 of what Q* depends on beside the discount; values state it."""
        ...

    def dynamics(self) -> Dynamics:
        """Its transitions, laid out for compiled loops.

        Raises:
            RequestError: if observations are vectors.
        """
        ...

    def make_stepper(self) -> Stepper:
        """The task as simulators of vector observations step through it.

        Raises:
            RequestError: if states are numbered.
        """
        ...

    def make_environment(self, *, render_mode: str | None = None) -> gymnasium.Env[Any, Any]:
        """The task as a Gymnasium environment that truncates episodes at the step limit."""
        ...


class Remapping(NamedTuple):
    """What a task is whose actions are those of another one in another order.

    Attributes:
        of: the other task, which is not remapped itself.
        keys: [A]; action a does what action keys[a] does in the other task.
    """

    of: Task
    keys: tuple[int, ...]


def distance_between(actions: int, stated: np.ndarray | None) -> np.ndarray:
    """Distances between actions, float64 [A, A]: as stated, or 1 between any two."""
    return 1 - np.eye(actions) if stated is None else np.asarray(stated, np.float64)
