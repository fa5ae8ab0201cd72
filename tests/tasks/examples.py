"""Small tasks and plain views of tasks that several test modules use."""

import numpy as np
from hypothesis import strategies as st

from qbumpers.tasks import TabularTask


def random_task(
    seed: int,
    states: int,
    actions: int,
    *,
    discount: float = 0.9,
    ending: float = 0.0,
    several_starts: bool = True,
) -> TabularTask:
    """A task with sparse random transitions whose last state is terminal.

    `ending` is the least probability of reaching the terminal state from any state and action.
    """
    generator = np.random.default_rng(seed)
    weight = generator.integers(1, 5, (states, actions, states))
    weight *= generator.random(weight.shape) < 0.5
    weight[:, :, 0] += weight.sum(axis=2) == 0
    transition = (1 - ending) * weight / weight.sum(axis=2, keepdims=True)
    transition[:, :, -1] += ending
    start = generator.integers(0, 4, states).astype(float)
    if not several_starts or not start.sum():
        start[:] = np.eye(states)[0]
    return TabularTask.from_arrays(
        transition,
        generator.integers(-5, 6, (states, actions, states)),
        np.arange(states) == states - 1,
        start / start.sum(),
        discount=discount,
        episode_limit=50,
    )


random_tasks = st.builds(
    random_task, seed=st.integers(0, 2**32 - 1), states=st.integers(1, 6), actions=st.integers(1, 4)
)


def chain(length: int, step_reward: float, last_reward: float, discount: float) -> TabularTask:
    """`length` states in a row, one action that moves on; leaving the last ends the episode."""
    states = length + 1
    transition = np.zeros((states, 1, states))
    transition[np.arange(states), 0, np.minimum(np.arange(states) + 1, length)] = 1
    reward = np.full((states, 1), step_reward)
    reward[length - 1] = last_reward
    return TabularTask.from_arrays(
        transition, reward, np.arange(states) == length, 0, discount=discount, episode_limit=1000
    )


def outcomes(task: TabularTask, state: int, action: int) -> dict[tuple[int, float, bool], float]:
    """What may follow an action: (next state, reward, terminated) -> probability."""
    found: dict[tuple[int, float, bool], float] = {}
    for k in range(task.next_state.shape[2]):
        if task.probability[state, action, k] > 0:
            outcome = (
                int(task.next_state[state, action, k]),
                float(task.reward[state, action, k]),
                bool(task.terminated[state, action, k]),
            )
            found[outcome] = found.get(outcome, 0.0) + task.probability[state, action, k]
    return found
