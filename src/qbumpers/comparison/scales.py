"""Quantities of a task by which the settings of methods are scaled."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from qbumpers.tasks import TabularTask
from qbumpers.values import solve
from qbumpers.values.events import safety, success
from qbumpers.values.exact import solved_rows
from qbumpers.values.others import PER_PROPOSAL


def reachable(task: TabularTask) -> np.ndarray:
    """The states in which an episode can take a step, bool [S]."""
    found = task.start > 0
    goes_on = (task.probability > 0) & ~task.terminated
    while True:
        further = found.copy()
        further[task.next_state[found][goes_on[found]]] = True
        if np.array_equal(further, found):
            return found
        found = further


def best_return(task: TabularTask) -> float:
    """The largest mean return that any policy has, as returns are measured.

    It is V*(s_0), averaged over the starts, but undiscounted and within the step limit, as the
    returns of episodes are; the same number if the discount is 1 and the limit does not bind.

    Args:
        task: with a table of transitions.

    Returns:
        The return, in reward units.
    """
    reward = (task.probability * task.reward).sum(axis=2)
    going_on = np.where(task.terminated, 0.0, task.probability)
    value = np.zeros(task.states)
    for _ in range(task.episode_limit):
        value = (reward + (going_on * value[task.next_state]).sum(axis=2)).max(axis=1)
    return float(task.start @ value)


@dataclass(frozen=True, eq=False)
class Scales:
    """What settings are scaled by; each quantity is found when it is asked for.

    Attributes:
        task: with a table of transitions.
        episodes: assisted episodes of a trial.
    """

    task: TabularTask
    episodes: int

    @cached_property
    def values(self) -> np.ndarray:
        """Q* of what the assistant sees of each state, float64 [S, A]."""
        found, seen = solve(self.task).table, self.task.seen
        return found if seen is None else found[seen]

    @cached_property
    def states(self) -> np.ndarray:
        """Numbers of the states in which an episode can take a step, int64 [R]."""
        return np.flatnonzero(reachable(self.task))

    @cached_property
    def spread(self) -> float:
        """The largest minus the smallest Q* of reachable states, in reward units."""
        found = self.values[self.states]
        return float(found.max() - found.min())

    @cached_property
    def lowest_start(self) -> float:
        """The lowest V*(s_0) of all starts, in reward units."""
        return float(self.values.max(axis=1)[self.task.start > 0].min())

    @cached_property
    def gaps(self) -> np.ndarray:
        """The distinct losses V*(s) - Q*(s, a) above 0, growing, float64 [D]."""
        own = self.values[self.states]
        return distinct(own.max(axis=1, keepdims=True) - own)

    @cached_property
    def relative_gaps(self) -> np.ndarray:
        """The distinct (V* - Q*) / (V* - min Q*) above 0, growing, float64 [D]."""
        own = self.values[self.states]
        best, worst = own.max(axis=1, keepdims=True), own.min(axis=1, keepdims=True)
        return distinct((best - own) / np.where(best > worst, best - worst, 1.0))

    @cached_property
    def gaps_by_proposal(self) -> np.ndarray:
        """`relative_gaps` of each proposal in its own row of the values, float64 [D]."""
        rows = solved_rows(self.task, PER_PROPOSAL, self.task.discount).values()
        found = []
        for proposed, row in enumerate(rows):
            table = row.table
            best, worst = table.max(axis=1), table.min(axis=1)
            found.append((best - table[:, proposed]) / np.where(best > worst, best - worst, 1.0))
        return distinct(np.array(found))

    @cached_property
    def losses_to_no_op(self) -> np.ndarray:
        """The distinct Q*(s, no_op) - Q*(s, a) above 0, growing, float64 [D]."""
        own = self.values[self.states]
        return distinct(own[:, [self.task.no_op]] - own)

    @cached_property
    def risks(self) -> np.ndarray:
        """The distinct probabilities above 0 of a crash under the safest policy, float64 [D]."""
        return distinct(1 - safety(self.task)[self.states])

    @cached_property
    def failures(self) -> np.ndarray:
        """The distinct probabilities above 0 of no success under the best policy, float64 [D]."""
        return distinct(1 - success(self.task)[self.states])

    @cached_property
    def path(self) -> list[int]:
        """States from the start to an end, by best actions and their best outcomes."""
        task, best = self.task, self.values.max(axis=1)
        state, path = int(task.start.argmax()), []
        while state not in path:
            path.append(state)
            action = int(self.values[state].argmax())
            ends = task.terminated[state, action]
            future = np.where(ends, 0.0, best[task.next_state[state, action]])
            worth = task.reward[state, action] + task.discount * future
            outcome = np.where(task.probability[state, action] > 0, worth, -np.inf).argmax()
            if ends[outcome]:
                break
            state = int(task.next_state[state, action, outcome])
        return path


def distinct(values: np.ndarray) -> np.ndarray:
    """Distinct values above 0, growing; those that differ by round-off are one.

    Args:
        values: float64 of any shape.

    Returns:
        float64 [D].
    """
    return np.unique(values[values > 1e-9].round(9))


def thresholds(values: np.ndarray, number: int) -> list[float]:
    """Limits of a rule that overrides what is above its limit, each with another outcome.

    The first is 0, which overrides every one of the values; each other one lies halfway between
    two neighbours among them.

    Args:
        values: what the rule compares with its limit: distinct, above 0 and growing, float64 [D].
        number: of limits; evenly spaced among the D that there are, or all of those if fewer.

    Returns:
        Growing limits, at least one.
    """
    limits = np.concatenate([[0.0], (values[1:] + values[:-1]) / 2])
    chosen = np.linspace(0, len(limits) - 1, min(number, len(limits))).round().astype(int)
    return [float(limit) for limit in limits[chosen]]
