"""Q* of a tabular task by Q-learning, as the paper obtained its own (Section 4.2)."""

import numpy as np

from qbumpers.borrowing import borrow, row
from qbumpers.choice import best_value
from qbumpers.compilation import compiled
from qbumpers.errors import RequestError
from qbumpers.learners.q_learning import QLearner, choose, learned, scheduled
from qbumpers.random_streams import ENVIRONMENT, LEARNER, draw, trial_streams
from qbumpers.tasks.dynamics import TERMINATED, Dynamics, first_state, transition
from qbumpers.tasks.tabular import TabularTask
from qbumpers.values.tabular import TabularValues


def learn_values(
    task: TabularTask,
    *,
    episodes: int = 10_000,
    seed: int = 0,
    learner: QLearner | None = None,
) -> TabularValues:
    """Q* by tabular Q-learning without help, over many episodes.

    Args:
        task: the task.
        episodes: how many, at least 1.
        seed: of the random streams, not negative.
        learner: schedules and discount; where None, the paper's, with the task's discount.

    Returns:
        The values of the last episode. Pairs that were never visited keep the initial value.

    Raises:
        RequestError: where `episodes` is below 1 or `seed` is negative.
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
        table=table,
        discount=learner.discount,
        task=task.name,
        method=f"Q-learning, {episodes} episodes, seed {seed}",
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
    dynamics, table = borrow(dynamics), borrow(table)
    explore, nature = streams[LEARNER], streams[ENVIRONMENT]
    for episode in range(episodes):
        epsilon = scheduled(learner.epsilon, episode, episodes)
        learning_rate = scheduled(learner.learning_rate, episode, episodes)
        state = first_state(dynamics, draw(nature))
        for _ in range(dynamics.episode_limit):
            values = row(table, state, width)
            action = choose(values, epsilon, draw(explore), draw(explore))
            index = transition(dynamics, state, action, draw(nature))
            ended = dynamics.events[index] & TERMINATED
            state = dynamics.next_state[index]
            future = 0.0 if ended else learner.discount * best_value(row(table, state, width))
            values[action] = learned(values[action], dynamics.reward[index], future, learning_rate)
            if ended:
                break
