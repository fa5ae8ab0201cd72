"""Exact probabilities of a crash and of success, as further rows beside Q*."""

from collections.abc import Callable
from typing import cast

import numpy as np

from qbumpers.errors import RequestError
from qbumpers.tasks import TabularTask
from qbumpers.values.hidden import averaged
from qbumpers.values.tabular import DECIMALS, TabularValues

_CLOSE = 1e-13


def safety(task: TabularTask) -> np.ndarray:
    """Probability of never crashing after an action, under the policy that is safest.

    The largest solution of S(s, a) = sum_k p_k (1 - crash_k) (1 if terminated_k else max S(s'_k)),
    by value iteration from 1 down: an episode that goes on for ever has not crashed.

    Args:
        task: which announces crashes.

    Returns:
        float64 [S, A], in [0, 1].

    Raises:
        RequestError: if the task announces no crashes.
    """
    crash = _announced(task, "crash", task.crash)
    return _iterated(task, np.where(crash, 0.0, 1.0), crash | task.terminated, 1.0)


def success(task: TabularTask) -> np.ndarray:
    """Probability of a success after an action, under the policy that makes it likeliest.

    The smallest solution of P(s, a) = sum_k p_k (1 if success_k else 0 if terminated_k else
    max P(s'_k)), by value iteration from 0 up.

    Args:
        task: which announces successes.

    Returns:
        float64 [S, A], in [0, 1].

    Raises:
        RequestError: if the task announces no successes.
    """
    won = _announced(task, "success", task.success)
    return _iterated(task, np.where(won, 1.0, 0.0), won | task.terminated, 0.0)


EVENT_ROWS: dict[str, Callable[[TabularTask], np.ndarray]] = {
    "safety": safety,
    "success": success,
}
"""What `solve` can give beside Q*, by the name that a rule asks for."""


def event_values(task: TabularTask, name: str) -> TabularValues:
    """One of the `EVENT_ROWS`, as values; they are not discounted.

    Args:
        task: which is solved.
        name: which row.

    Raises:
        RequestError: if the task announces no such events.
    """
    table = np.round(averaged(task, EVENT_ROWS[name](task)), DECIMALS)
    return TabularValues(table, 1.0, task.name, f"probability of {name} by value iteration")


def _announced(task: TabularTask, event: str, flags: np.ndarray | None) -> np.ndarray:
    if flags is None:
        raise RequestError(
            f"task {task.name} announces no {event}, so that its probability cannot be solved: "
            f"give the task {event}="
        )
    return np.asarray(flags, np.bool_)


def _iterated(task: TabularTask, value: np.ndarray, known: np.ndarray, first: float) -> np.ndarray:
    """Value iteration [S, A] from `first`; outcomes [S, A, K] that are known have a value."""
    state_values = np.full(task.states, first)
    while True:
        outcomes = np.where(known, value, state_values[task.next_state])
        table = (task.probability * outcomes).sum(axis=2)
        before, state_values = state_values, cast(np.ndarray, table.max(axis=1))
        if np.abs(state_values - before).max() <= _CLOSE:
            return np.clip(table, 0.0, 1.0)
