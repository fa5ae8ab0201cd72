"""Random tasks with few outcomes per action, so-called Garnets, with an end.

After the generator of Archibald, McKinnon and Thomas (1995), "On the generation of Markov decision
processes", Journal of the Operational Research Society 46(3).
"""

import numpy as np

from qbumpers.random_streams import ENVIRONMENT, draw, trial_streams
from qbumpers.tasks.checking import whole_in
from qbumpers.tasks.tabular import TabularTask

BONUS = 10.0
"""Of reaching the end."""

DISCOUNT = 0.95
EPISODE_LIMIT = 100


def random_mdp(seed: int = 0, states: int = 20, actions: int = 4, branches: int = 3) -> TabularTask:
    """A random task: from each state each action leads to a few others; the last is the end.

    From a state an action may lead to `branches` different states, drawn at random, with the
    probabilities into which random cuts divide 1. It costs a number that is uniform in [0, 1), and
    reaching the end brings 10. In each state an action, drawn at random, may lead to the state with
    the next number, so that the end can be reached from everywhere. Everything is drawn from
    `qbumpers.random_streams`: equal arguments give equal numbers on every machine.

    Args:
        seed: which of the random tasks; not negative.
        states: S, the end included, in [2, 1,000].
        actions: A, in [1, 100].
        branches: in [1, S].

    Returns:
        The task; it starts in state 0, and reaching the end is its success.

    Raises:
        RequestError: if a number is out of range.
    """
    where = "task 'random-mdp'"
    seed = whole_in(seed, f"{where}: seed", 0, 2**63 - 1)
    states = whole_in(states, f"{where}: states", 2, 1_000)
    actions = whole_in(actions, f"{where}: actions", 1, 100)
    branches = whole_in(branches, f"{where}: branches", 1, states)
    content = ["random-mdp", states, actions, branches]
    stream = trial_streams(seed, content, range(1))[0, ENVIRONMENT]
    shape = (states, actions, branches)
    next_state, probability = np.empty(shape, np.int64), np.empty(shape)
    cost = np.empty(shape[:2])
    for pair in np.ndindex(states, actions):
        next_state[pair] = _chosen(stream, states, branches)
        cuts = np.sort([draw(stream) for _ in range(branches - 1)])
        probability[pair] = np.diff([0.0, *cuts, 1.0])
        cost[pair] = draw(stream)
    for state in range(states - 1):
        action = int(actions * draw(stream))
        if state + 1 not in next_state[state, action]:
            next_state[state, action, 0] = state + 1
    ends = next_state == states - 1
    return TabularTask(
        name="random-mdp",
        next_state=next_state,
        probability=probability,
        reward=np.where(ends, BONUS, 0.0) - cost[:, :, None],
        terminated=ends,
        success=ends,
        start=np.eye(states)[0],
        discount=DISCOUNT,
        episode_limit=EPISODE_LIMIT,
    )


def _chosen(stream: np.ndarray, states: int, count: int) -> list[int]:
    """Different states, drawn one after the other."""
    left = list(range(states))
    return [left.pop(int(len(left) * draw(stream))) for _ in range(count)]
