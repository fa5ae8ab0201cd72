"""Tasks by name."""

import numpy as np
import pytest

from qbumpers import RequestError
from qbumpers.tasks import (
    TabularTask,
    VectorTask,
    cliff_walking,
    make_task,
    register_task,
    task_names,
)
from tests.narrowing import of_kind
from tests.tasks.examples import random_task


def test_cliff_walking_is_there_by_name():
    assert "cliff-walking" in task_names()
    assert make_task("cliff-walking").digest() == cliff_walking().digest()


@pytest.mark.usefixtures("own_tasks")
def test_a_registered_task_is_made_by_its_name():
    task = random_task(0, 3, 2)
    register_task("a-task-of-the-tests", lambda: task)
    assert make_task("a-task-of-the-tests") is task
    assert "a-task-of-the-tests" in task_names()


def test_gymnasium_environments_are_made_with_their_arguments():
    still = make_task("FrozenLake-v1", discount=0.9, is_slippery=False, map_name="8x8")
    assert (still.states, still.discount, still.episode_limit) == (64, 0.9, 100)
    assert set(np.unique(of_kind(TabularTask, still).probability)) <= {0.0, 1.0}
    slippery = make_task("FrozenLake-v1", discount=0.9, is_slippery=True, episode_limit=7)
    assert slippery.episode_limit == 7
    assert 0 < of_kind(TabularTask, slippery).probability[0, 0].max() < 1


def test_an_unknown_task_names_the_nearest_one():
    with pytest.raises(RequestError, match=r"'cliff-wlaking'.*did you mean 'cliff-walking'"):
        make_task("cliff-wlaking")
    with pytest.raises(RequestError, match=r"'FrozenLake'.*did you mean 'FrozenLake-v1'"):
        make_task("FrozenLake")


@pytest.mark.parametrize("arguments", [{"discount": 0.9}, {"episode_limit": 5}, {"slope": 1}])
def test_a_fixed_task_takes_no_arguments(arguments):
    with pytest.raises(RequestError, match="'cliff-walking' takes no arguments"):
        make_task("cliff-walking", **arguments)


def test_a_gymnasium_environment_needs_a_discount():
    with pytest.raises(RequestError, match="'FrozenLake-v1': discount is missing"):
        make_task("FrozenLake-v1")


def test_a_wrong_argument_of_an_environment_is_named():
    with pytest.raises(RequestError, match=r"'FrozenLake-v1': .*'wetness'"):
        make_task("FrozenLake-v1", discount=0.9, wetness=3)
    with pytest.raises(RequestError, match=r"'FrozenLake-v1': .*'5x5'"):
        make_task("FrozenLake-v1", discount=0.9, map_name="5x5")


def test_an_environment_with_vectors_makes_a_task_of_its_own_kind():
    task = make_task("CartPole-v1", discount=0.9, episode_limit=70, sutton_barto_reward=True)
    assert isinstance(task, VectorTask)
    assert (task.discount, task.episode_limit) == (0.9, 70)
    assert task.make_stepper().step


def test_an_environment_without_numbered_actions_is_refused():
    with pytest.raises(RequestError, match="'Pendulum-v1': its action space is Box"):
        make_task("Pendulum-v1", discount=0.9)


def test_an_environment_of_several_numbers_is_observed_as_a_vector():
    cards = make_task("Blackjack-v1", discount=1.0, episode_limit=20)
    assert (cards.observation_size, cards.actions) == (32 + 11 + 2, 2)


@pytest.mark.usefixtures("own_tasks")
def test_a_registered_task_may_take_arguments():
    register_task("a-task-with-arguments", lambda states: random_task(0, states, 2))
    assert make_task("a-task-with-arguments", states=4).states == 4
    with pytest.raises(RequestError, match=r"'states'; its arguments are: states"):
        make_task("a-task-with-arguments")


def test_an_environment_without_a_limit_needs_one():
    with pytest.raises(RequestError, match="CliffWalking-v1 has no step limit: give episode_limit"):
        make_task("CliffWalking-v1", discount=1.0)
