"""Q* of a tabular task by Q-learning, as the paper obtained its own (Section 4.2)."""

import numpy as np

from qbumpers.borrowing import borrow
from qbumpers.compilation import compiled
from qbumpers.errors import RequestError
from qbumpers.learners import q_learning
from qbumpers.learners.interface import Table, Transition
from qbumpers.learners.q_learning import QLearner
from qbumpers.random_streams import ENVIRONMENT, LEARNER, draw, trial_streams
from qbumpers.tasks.dynamics import TERMINATED, Dynamics, first_state, transition
from qbumpers.tasks.task import Task
from qbumpers.values.hidden import averaged
from qbumpers.values.tabular import TabularValues


def learn_values(
    task: Task,
    *,
    episodes: int = 10_000,
    seed: int = 0,
    learner: QLearner | None = None,
) -> TabularValues:
    """Q* by unassisted tabular Q-learning over many episodes.

    Args:
        task: what is to be learned.
        episodes: how many, at least 1.
        seed: decides all chance; not negative.
        learner: schedules and discount; if None, the paper's, with the task's discount.

    Returns:
        The values of the last episode. Pairs that were never visited keep the initial value.

    Raises:
        RequestError: if the task has no table of transitions, `episodes` is below 1 or `seed` is
            negative.
    """
    if episodes < 1:
        raise RequestError(f"episodes = {episodes!r}; at least 1 is needed")
    if seed < 0:
        raise RequestError(f"seed = {seed!r}; it must not be negative")
    learner = learner or QLearner(discount=task.discount)
    table = np.full((task.states, task.actions), learner.initial_value)
    streams = trial_streams(seed, ["learn_values", task.digest()], range(1))[0]
    _learn(task.dynamics(), learner, episodes, streams, (0,) * task.actions, table)
    return TabularValues(
        table=averaged(task, table),
        discount=learner.discount,
        task=task.name,
        method=f"Q-learning, {episodes} episodes, seed {seed}",
        made_for=task.identity(),
    )


@compiled
def _learn(
    dynamics: Dynamics,
    learner: QLearner,
    episodes: int,
    streams: np.ndarray,
    width: tuple[int, ...],
    table: np.ndarray,
) -> None:
    dynamics, memory = borrow(dynamics), Table(borrow(table), width)
    explore, nature = streams[LEARNER], streams[ENVIRONMENT]
    for episode in range(episodes):
        rates = q_learning.begin(learner, memory, episode, episodes)
        state = first_state(dynamics, draw(nature))
        for _ in range(dynamics.episode_limit):
            action = q_learning.choose(learner, memory, state, rates, explore)
            index = transition(dynamics, state, action, draw(nature))
            ended = dynamics.events[index] & TERMINATED != 0
            next_state, reward = dynamics.next_state[index], dynamics.reward[index]
            happened = Transition(state, action, reward, next_state, ended, -1)
            q_learning.learn(learner, memory, happened, rates, explore)
            state = next_state
            if ended:
                break
