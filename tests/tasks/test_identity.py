"""What values of a task depend on, as a digest: alike for tasks of equal Q*, else another."""

import dataclasses

import gymnasium
import numpy as np
import pytest
from gymnasium import wrappers

from qbumpers import TabularTask, make_task
from qbumpers.tasks import VectorTask, cliff_walking
from qbumpers.tasks.identity import environment_digest, has_table, task_inside
from tests.tasks.examples import random_task
from tests.tasks.lakes import Tabled, frozen

TASK = random_task(4, 5, 3)


def shuffled(task):
    """The same task with its outcomes in another order, and one of them in two halves."""
    order = np.random.default_rng(0).permuted(np.argsort(task.probability, axis=2), axis=2)
    fields = {
        name: np.take_along_axis(getattr(task, name), order, axis=2)
        for name in ("next_state", "probability", "reward", "terminated")
    }
    doubled = {name: np.concatenate([each, each], axis=2) for name, each in fields.items()}
    doubled["probability"] = doubled["probability"] / 2
    return dataclasses.replace(task, **doubled)


def test_order_and_halves_of_outcomes_do_not_matter():
    assert shuffled(TASK).digest() != TASK.digest()
    assert shuffled(TASK).identity() == TASK.identity()


def test_what_does_not_change_values_at_a_discount_does_not_matter():
    start = np.eye(5)[3]
    other = dataclasses.replace(TASK, start=start, episode_limit=7, discount=0.5, name="other")
    assert other.identity() == TASK.identity()


def changed(name, change):
    array = np.array(getattr(TASK, name))
    possible = tuple(np.argwhere(TASK.probability > 0)[0])
    array[possible] = change(array[possible])
    return dataclasses.replace(TASK, **{name: array})


@pytest.mark.parametrize(
    "other",
    [
        changed("reward", lambda reward: reward + 1),
        changed("next_state", lambda state: (state + 1) % 5),
        changed("terminated", lambda ends: not ends),
        dataclasses.replace(TASK, seen=np.zeros(5, np.int64)),
        random_task(5, 5, 3),
        random_task(4, 5, 2),
    ],
)
def test_what_changes_values_matters(other):
    assert other.identity() != TASK.identity()


def test_a_task_of_an_environment_is_the_task_of_its_arrays():
    environment = Tabled(4)
    found = TabularTask.from_gymnasium(environment, discount=0.9, episode_limit=9)
    assert found.identity() == environment.task_of_table.identity()


def test_environments_are_alike_if_made_with_the_same_arguments():
    plain = environment_digest(gymnasium.make("FrozenLake-v1"))
    alike = [
        gymnasium.make("FrozenLake-v1", map_name="4x4", is_slippery=True),
        gymnasium.make("FrozenLake-v1", render_mode="rgb_array"),
        wrappers.RecordEpisodeStatistics(gymnasium.make("FrozenLake-v1", max_episode_steps=5)),
    ]
    assert {environment_digest(each) for each in alike} == {plain}
    others = [
        frozen(),
        wrappers.TransformReward(gymnasium.make("FrozenLake-v1"), lambda reward: reward),
        gymnasium.make("Taxi-v4"),
    ]
    assert len({plain, *(environment_digest(each) for each in others)}) == 4


def test_a_vector_task_is_that_of_its_environment():
    task = make_task("CartPole-v1", discount=0.9)
    assert task.identity() == environment_digest(gymnasium.make("CartPole-v1"))
    longer = VectorTask.from_gymnasium("CartPole-v1", discount=0.5, episode_limit=7)
    assert longer.identity() == task.identity()
    other = VectorTask.from_gymnasium("CartPole-v1", discount=0.9, sutton_barto_reward=True)
    assert other.identity() != task.identity()


class Errand(gymnasium.Env):
    """States a task of its own, in words, and something else as P."""

    task, P = "fetch the milk", 3
    observation_space = action_space = gymnasium.spaces.Discrete(2)


def test_what_an_environment_states_is_taken_only_if_it_is_meant():
    assert task_inside(Errand()) is None
    assert not has_table(Errand())
    assert task_inside(gymnasium.make("qbumpers/CliffWalking-v0")).name == cliff_walking().name
    assert has_table(frozen())
    assert not has_table(wrappers.FlattenObservation(frozen()))
