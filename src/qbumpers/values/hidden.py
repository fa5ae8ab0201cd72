"""Values for an assistant that does not see all of the state: a goal that only the learner knows.

States that look alike to it, `seen` of a `TabularTask`, differ in their goal.
"""

import numpy as np

from qbumpers.borrowing import borrow, row
from qbumpers.choice import best_value, pick
from qbumpers.compilation import compiled
from qbumpers.errors import RequestError
from qbumpers.learners.q_learning import q_update
from qbumpers.random_streams import ASSISTANT, ENVIRONMENT, LEARNER, draw, trial_streams
from qbumpers.tasks import TabularTask, Task
from qbumpers.tasks.dynamics import TERMINATED, Dynamics, first_state, transition

_EPISODES = 20_000
_ERRORS = 0.3  # probability that the pilot proposes at random
_ACCEPTED, _EXPLORED = 0.4, 0.3  # probabilities that the proposal, or any action, is executed
_DECAY = 0.7  # the step size is the number of visits to the power of minus this


def averaged(task: Task, table: np.ndarray) -> np.ndarray:
    """Means over states that look alike.

    Args:
        task: with what is seen of its states.
        table: float64 [S, A].

    Returns:
        float64 [Z, A], of what is seen; the table itself if that is all.
    """
    if task.seen is None:
        return table
    counts = np.bincount(task.seen)
    sums = np.zeros((len(counts), table.shape[1]))
    np.add.at(sums, task.seen, table)
    return sums / np.maximum(counts, 1)[:, None]


def for_each_goal(task: TabularTask, table: np.ndarray) -> np.ndarray:
    """Q*(s, .) of each state that looks alike.

    Args:
        task: in which equally many states look alike, in the order of their goals.
        table: Q*, float64 [S, A].

    Returns:
        float64 [K, Z, A], for each of K goals; K = 1 if the assistant sees all.

    Raises:
        RequestError: if not equally many states look alike.
    """
    if task.seen is None:
        return table[None]
    counts = np.bincount(task.seen)
    if counts.min() != counts.max():
        raise RequestError(
            f"task {task.name}: between {counts.min()} and {counts.max()} states look alike; "
            "values for each goal need equally many"
        )
    alike = np.argsort(task.seen, kind="stable").reshape(len(counts), -1)
    return table[alike.T]


def learned_with_proposals(task: TabularTask, table: np.ndarray, discount: float) -> np.ndarray:
    """Q of what is seen together with the proposal, by Q-learning with a pilot in the loop.

    The proposal tells something of what is not seen (Reddy, Dragan and Levine 2018). The simulated
    pilot sees all of the state and proposes a best action, or 3 times in 10 any.

    Args:
        task: what is to be done.
        table: Q* of the pilot, float64 [S, A].
        discount: in (0, 1].

    Returns:
        float64 [A, Z, A], for each proposal; pairs that were never met keep the mean of Q* over
        states that look alike.
    """
    seen = np.arange(task.states) if task.seen is None else np.asarray(task.seen, np.int64)
    values = np.repeat(averaged(task, table)[None], task.actions, axis=0)
    values = np.ascontiguousarray(values.swapaxes(0, 1)).reshape(-1, task.actions)
    streams = trial_streams(0, ["learned_with_proposals", task.digest(), discount], range(1))[0]
    width = (0,) * task.actions
    _learn(task.dynamics(), seen, table, discount, streams, width, values, np.zeros(values.shape))
    return values.reshape(-1, task.actions, task.actions).swapaxes(0, 1).copy()


@compiled
def _propose(best: np.ndarray, chances: np.ndarray) -> int:
    if draw(chances) < _ERRORS:
        return int(draw(chances) * len(best))
    return pick(best, best_value(best), draw(chances))


@compiled
def _decide(values: np.ndarray, proposed: int, chances: np.ndarray) -> int:
    chance = draw(chances)
    if chance < _ACCEPTED:
        return proposed
    if chance < _ACCEPTED + _EXPLORED:
        return int(draw(chances) * len(values))
    return pick(values, best_value(values), draw(chances))


@compiled
def _learn(
    dynamics: Dynamics, seen: np.ndarray, table: np.ndarray, discount: float, streams: np.ndarray,
    width: tuple[int, ...], values: np.ndarray, visits: np.ndarray,
) -> None:  # fmt: skip
    """Q-learning of `values`, float64 [Z A, A]: rows are what is seen, and then the proposal."""
    actions = dynamics.actions
    known, learned, counted = borrow(table), borrow(values), borrow(visits)
    pilot, helper, nature = streams[LEARNER], streams[ASSISTANT], streams[ENVIRONMENT]
    for _episode in range(_EPISODES):
        state = first_state(dynamics, draw(nature))
        proposed = _propose(row(known, state, width), pilot)
        for _step in range(dynamics.episode_limit):
            place = seen[state] * actions + proposed
            executed = _decide(row(learned, place, width), proposed, helper)
            index = transition(dynamics, state, executed, draw(nature))
            ended = dynamics.events[index] & TERMINATED != 0
            state = dynamics.next_state[index]
            proposed = _propose(row(known, state, width), pilot)
            future = 0.0
            if not ended:
                following = row(learned, int(seen[state]) * actions + proposed, width)
                future = discount * best_value(following)
            row(counted, place, width)[executed] += 1
            rate = row(counted, place, width)[executed] ** -_DECAY
            row(learned, place, width)[executed] = q_update(
                row(learned, place, width)[executed], dynamics.reward[index], future, rate
            )
            if ended:
                break
