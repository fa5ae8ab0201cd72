"""Values learned by Q-learning."""

import numpy as np
import pytest

from qbumpers import QLearner, RequestError, Schedule, TabularTask, learn_values, solve
from qbumpers.tasks import cliff_walking, make_task
from tests.tasks.examples import chain


def reachable(task: TabularTask) -> list[int]:
    """States that an episode can act in, found by walking."""
    found, waiting = set(), np.flatnonzero(task.start).tolist()
    while waiting:
        state = waiting.pop()
        if state not in found:
            found.add(state)
            going_on = (task.probability[state] > 0) & ~task.terminated[state]
            waiting.extend(task.next_state[state][going_on].tolist())
    return sorted(found)


@pytest.mark.parametrize("seed", range(3))
def test_learned_values_of_cliff_walking_are_exact_wherever_an_episode_can_be(seed):
    task = cliff_walking()
    walkable = reachable(task)
    assert len(walkable) == 37
    learned, exact = learn_values(task, seed=seed).table, solve(task).table
    np.testing.assert_allclose(learned[walkable], exact[walkable], rtol=0, atol=1e-9)


def test_values_of_chances_are_learned_to_their_mean():
    # Reward 1 with probability 0.3. At a constant rate r the estimate has variance
    # r / (2 - r) 0.3 0.7, a standard deviation of 0.0102 at r = 0.001; z = 4.
    task = TabularTask.from_arrays(
        np.array([[[0.0, 0.3, 0.7]], [[0, 1, 0]], [[0, 0, 1]]]),
        np.array([[[0, 1, 0]]] * 3),
        [False, True, True], 0, discount=1.0, episode_limit=1,
    )  # fmt: skip
    learner = QLearner(learning_rate=Schedule(1.0, 0.001, 0.5))
    values = learn_values(task, episodes=20_000, seed=1, learner=learner)
    assert values(0)[0] == pytest.approx(0.3, abs=0.041)


def test_a_truncated_episode_is_not_an_end():
    # Every episode is cut off after one step; the values look through the cut.
    task = TabularTask.from_arrays(
        np.array([[[0.0, 1.0]], [[0.0, 1.0]]]), np.array([[1.0], [1.0]]), [False, False],
        [0.5, 0.5], discount=0.5, episode_limit=1,
    )  # fmt: skip
    np.testing.assert_allclose(learn_values(task, episodes=2000).table, 2.0, atol=1e-9)


def test_nothing_comes_after_the_end():
    # The goal's own values stay at the 7 they began with and must not be added to its reward.
    learner = QLearner(initial_value=7.0)
    values = learn_values(chain(3, -1.0, 10.0, 1.0), learner=learner)
    np.testing.assert_allclose(values.table[:, 0], [8.0, 9.0, 10.0, 7.0], rtol=0, atol=1e-9)


def test_pairs_never_visited_keep_the_initial_value():
    learner = QLearner(initial_value=7.0)
    values = learn_values(cliff_walking(), episodes=50, learner=learner)
    assert (values.table[37:48] == 7.0).all()


def test_the_discount_is_the_tasks_unless_the_learner_states_one():
    task = chain(4, 0.0, 1.0, 0.5)
    assert learn_values(task).table[:4, 0].tolist() == [0.125, 0.25, 0.5, 1.0]
    values = learn_values(task, learner=QLearner(discount=1.0))
    assert values.discount == 1.0
    assert values.table[:4, 0].tolist() == [1.0] * 4


def test_equal_seeds_give_equal_values_and_others_do_not():
    def learned(seed: int) -> bytes:
        return learn_values(cliff_walking(), episodes=5, seed=seed).table.tobytes()

    assert learned(1) == learned(1)
    assert learned(1) != learned(2)


def test_the_values_say_where_they_come_from():
    values = learn_values(cliff_walking(), episodes=20, seed=4)
    assert values.task == "cliff-walking"
    assert values.method == "Q-learning, 20 episodes, seed 4"


def test_numbers_out_of_range_are_refused():
    with pytest.raises(RequestError, match="episodes = 0; at least 1"):
        learn_values(cliff_walking(), episodes=0)
    with pytest.raises(RequestError, match="seed = -1; it must not be negative"):
        learn_values(cliff_walking(), seed=-1)


def test_a_task_without_a_table_is_refused():
    with pytest.raises(RequestError, match="task CartPole-v1 has no table of transitions"):
        learn_values(make_task("CartPole-v1", discount=0.9))
