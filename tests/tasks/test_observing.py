"""Observations of any kind as vectors: what a task sees is what Gymnasium's wrappers give."""

import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import FilterObservation, FlattenObservation

from qbumpers import Network, RequestError, SharedControl, make_task
from qbumpers.tasks import VectorTask
from qbumpers.values import NetworkValues
from tests.narrowing import of_kind
from tests.tasks.worlds import World

FLAT = {"number": 4, "numbers": 5, "bits": 3, "pair": 5, "picture": 18, "parts": 22}


@pytest.fixture(autouse=True)
def world():
    """A registered environment of the tests."""
    entry_point: Any = World
    gymnasium.register("World-v0", entry_point=entry_point, max_episode_steps=9)
    yield
    del gymnasium.registry["World-v0"]


def task_of(shown, **arguments):
    task = make_task("World-v0", discount=0.9, shown=shown, **arguments)
    return of_kind(VectorTask, task)


@pytest.mark.parametrize("shown", FLAT)
def test_a_stepper_gives_what_flattening_gives(shown):
    task = task_of(shown)
    assert task.observation_size == FLAT[shown]
    stepper = task.make_stepper()
    flat = FlattenObservation(gymnasium.make("World-v0", shown=shown))
    for chance in (0.25, 0.75):
        mine, (observation, _) = stepper.reset(chance), flat.reset(seed=int(chance * 2**32))
        for action in (0, 1, 0):
            assert mine.dtype == np.float32
            assert mine.tolist() == np.asarray(observation, np.float32).tolist()
            mine, reward, _ = stepper.step(action)
            observation, expected, over, *_ = flat.step(action + 1)
            assert reward == expected
            if over:
                break


def test_numbers_are_one_hot_and_bytes_keep_their_size():
    hot = task_of("number").make_stepper().reset(0.5)
    assert sorted(hot.tolist()) == [0, 0, 0, 1]
    assert task_of("picture").make_stepper().reset(0.5).max() > 1


def test_only_some_keys_are_kept():
    task = task_of("mission", observe=["where"])
    assert task.observation_size == 4
    both = task_of("mission", observe=["where", "view"])
    assert both.observation_size == 22
    assert both.digest() == task_of("mission", observe=["view", "where"]).digest()
    assert task.identity() != both.identity()
    assert task_of("parts").identity() != task_of("parts", observe=["view"]).identity()


def test_a_participant_sees_the_same_vector():
    task = task_of("mission", observe=["view", "where"])
    seen, _ = task.make_environment().reset(seed=2**31)
    assert seen.tolist() == task.make_stepper().reset(0.5).tolist()


def test_a_flat_task_travels_to_other_processes():
    task = task_of("mission", observe=["view"])
    travelled = pickle.loads(pickle.dumps(task))
    assert travelled.digest() == task.digest()
    assert np.array_equal(travelled.make_stepper().reset(0.3), task.make_stepper().reset(0.3))


def test_what_cannot_be_flattened_names_the_parts_that_can_and_they_work():
    with pytest.raises(RequestError, match="makes no vector of it, but") as caught:
        task_of("mission")
    code = str(caught.value).split("observe=")[1].split(", which is ")
    keys = eval(code[0])  # what the message offers for pasting
    assert set(keys) == {"where", "view"}
    assert task_of("mission", observe=keys).observation_size == 22
    environment = gymnasium.make("World-v0", shown="mission")
    names = {
        "environment": environment,
        "FlattenObservation": FlattenObservation,
        "FilterObservation": FilterObservation,
    }
    assert eval(code[1], names).observation_space.shape == (22,)


@pytest.mark.parametrize(
    ("shown", "observe", "message"),
    [
        ("texts", None, "nor does any part of it"),
        ("mission", ["mission"], "makes no vector of it, nor"),
        ("mission", ["vue"], "'vue' is no key .* which has: mission, view, where"),
        ("number", ["view"], r"observe = \['view'\]; only an observation of several parts"),
    ],
)
def test_what_cannot_be_observed_is_refused(shown, observe, message):
    with pytest.raises(RequestError, match=message):
        task_of(shown, observe=observe)


def test_a_table_needs_no_keys():
    with pytest.raises(RequestError, match=r"observe = \['x'\]; leave it out: its table tells"):
        make_task("FrozenLake-v1", discount=0.9, observe=["x"])


def values_of(task):
    """A network made for a task, each action's value the sum of the observation, times its number.

    Its hidden layer has one linear unit for positive numbers.
    """
    network = Network((1,), "relu")
    size = task.observation_size
    parameters = [*np.ones(size), 0.0, 1.0, 2.0, 0.0, 0.0]
    return NetworkValues(
        network, size, 2, np.array(parameters, np.float32), 0.99, task.name, "by hand",
        made_for=task.identity(),
    )  # fmt: skip


@pytest.mark.parametrize("shown", ["number", "picture", "mission"])
def test_values_of_a_flat_task_are_offered_the_flat_observation(shown):
    observe = ["view"] if shown == "mission" else None
    task = task_of(shown, observe=observe)
    made = values_of(task)
    bare = gymnasium.make("World-v0", shown=shown)
    wrapped = FlattenObservation(FilterObservation(bare, observe) if observe else bare)
    for environment in (wrapped, task.make_environment()):
        observation, info = SharedControl(environment, "maximal", made).reset(seed=3)
        total = float(np.sum(observation))
        assert info["assistance"]["values"].tolist() == [total, 2 * total]
    with pytest.raises(RequestError, match=r"FlattenObservation\(.*environment"):
        SharedControl(bare, "maximal", made)


def test_values_of_other_keys_of_equal_size_are_refused():
    made = values_of(task_of("parts", observe=["view"]))
    with pytest.raises(RequestError, match="they were made for a task that differs"):
        SharedControl(FlattenObservation(gymnasium.make("World-v0", shown="picture")), "maximal",
                      made)  # fmt: skip
