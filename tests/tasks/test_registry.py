"""Tasks by name."""

from typing import Any, cast

import gymnasium
import numpy as np
import pytest
from gymnasium import wrappers
from gymnasium.envs.classic_control.cartpole import CartPoleEnv

from qbumpers import RequestError
from qbumpers.tasks import (
    TabularTask,
    VectorTask,
    cliff_walking,
    make_task,
    register_task,
    task_names,
)
from qbumpers.tasks.registry import explanations
from tests.narrowing import of_kind
from tests.tasks.examples import random_task


def test_cliff_walking_is_there_by_name():
    assert "cliff-walking" in task_names()
    assert make_task("cliff-walking").digest() == cliff_walking().digest()


REMAPPED = {"of": "cliff-walking", "keys": (1, 2, 3, 0)}
NAMED = {name: REMAPPED if name == "remapped" else {} for name in task_names()}


@pytest.mark.parametrize("name", NAMED)
def test_every_task_has_a_display_and_a_line_of_explanation(name):
    task = make_task(name, **cast(Any, NAMED[name]))
    display = task.display
    assert len(set(display.actions)) == task.actions
    assert set(display.keys.values()) == set(range(task.actions))
    line = explanations()[name]
    assert line.endswith(".")
    assert len(line) < 100


@pytest.mark.parametrize("name", NAMED)
def test_every_task_is_an_environment_that_gymnasium_accepts(name):
    environment = make_task(name, **cast(Any, NAMED[name])).make_environment()
    observation, _ = environment.reset(seed=0)
    space = environment.observation_space
    for step in range(20):
        assert space.contains(observation)
        observation, reward, terminated, truncated, _ = environment.step(step % 2)
        assert isinstance(float(reward), float)
        if terminated or truncated:
            observation, _ = environment.reset()


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


def test_an_environment_stands_for_its_name():
    made = gymnasium.make("CartPole-v1", sutton_barto_reward=True, render_mode="rgb_array")
    task = make_task(made, discount=0.9)
    named = make_task("CartPole-v1", discount=0.9, sutton_barto_reward=True)
    assert task.digest() == named.digest()
    assert task.identity() == named.identity()
    lake = make_task(gymnasium.make("FrozenLake-v1", is_slippery=False), discount=0.9)
    assert lake.digest() == make_task("FrozenLake-v1", discount=0.9, is_slippery=False).digest()


def rewards_of(task, steps=5):
    stepper = task.make_stepper()
    stepper.reset(0.5)
    return [stepper.step(0)[1] for _ in range(steps)]


def halved():
    return wrappers.TransformReward(gymnasium.make("CartPole-v1"), lambda reward: float(reward) / 2)


def test_wrappers_of_an_environment_are_made_again():
    clipped = wrappers.ClipReward(gymnasium.make("CartPole-v1", max_episode_steps=30), 0, 0.25)
    task = make_task(clipped, discount=0.9)
    assert rewards_of(task) == [0.25] * 5
    assert task.episode_limit == 30
    participants = task.make_environment(render_mode="rgb_array")
    assert participants.render_mode == "rgb_array"
    participants.reset(seed=0)
    assert participants.step(0)[1] == 0.25
    assert task.digest() != make_task("CartPole-v1", discount=0.9, episode_limit=30).digest()


def test_a_function_or_class_makes_the_environment():
    task = make_task(halved, discount=0.9)
    assert rewards_of(task) == [0.5] * 5
    assert (task.name, task.episode_limit) == ("CartPole-v1", 500)
    assert make_task(halved, discount=0.9, max_episode_steps=8).episode_limit == 8
    pole = make_task(CartPoleEnv, discount=0.9, episode_limit=9, sutton_barto_reward=True)
    assert rewards_of(pole) == [0.0] * 5
    environment = pole.make_environment()
    environment.reset(seed=0)
    ends = [environment.step(step % 2)[3] for step in range(9)]
    assert ends == [False] * 8 + [True]
    lake = make_task(lambda: gymnasium.make("FrozenLake-v1", is_slippery=False), discount=0.9)
    assert lake.digest() == make_task("FrozenLake-v1", discount=0.9, is_slippery=False).digest()


class Own(gymnasium.RewardWrapper):
    def reward(self, reward):
        return reward


UNUSABLE = {
    "no environment": (
        lambda: make_task(cast(Any, lambda: 3), discount=0.9),
        "it makes 3; a Gymnasium environment is needed",
    ),
    "fails": (
        lambda: make_task(cast(Any, lambda: 1 / 0), discount=0.9),
        "no environment is made: ZeroDivisionError: division by zero",
    ),
    "takes none": (lambda: make_task(halved, discount=0.9, size=3), "halved: .*'size'"),
    "no discount": (lambda: make_task(halved), "task halved: discount is missing"),
    "gamma": (
        lambda: make_task("FrozenLake-v1", gamma=0.9),
        r"unknown argument of task 'FrozenLake-v1' 'gamma' \(did you mean 'discount'\?\)",
    ),
    "made already": (
        lambda: make_task(gymnasium.make("CartPole-v1"), discount=0.9, sutton_barto_reward=True),
        "sutton_barto_reward cannot be given; the environment is made already",
    ),
    "no spec": (lambda: make_task(CartPoleEnv(), discount=0.9), "CartPoleEnv is not of gymnasium"),
    "a wrapper": (
        lambda: make_task(Own(gymnasium.make("CartPole-v1")), discount=0.9),
        "cannot make wrapper Own again; give a function",
    ),
    "two limits": (
        lambda: make_task("CartPole-v1", discount=0.9, episode_limit=3, max_episode_steps=4),
        "max_episode_steps = 4; episode_limit = 3 means the same",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("ask", "message"), UNUSABLE.values(), ids=list(UNUSABLE))
def test_what_gives_no_environment_is_named(ask, message):
    with pytest.raises(RequestError, match=message) as caught:
        ask()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["FrozenLake-v1", "CartPole-v1"])
def test_the_limit_has_two_words(name):
    tasks = [
        make_task(name, discount=0.9, **cast(Any, {word: 7}))
        for word in ("episode_limit", "max_episode_steps")
    ]
    assert tasks[0].digest() == tasks[1].digest()
    assert tasks[0].episode_limit == 7


def test_an_environment_without_a_limit_needs_one():
    with pytest.raises(RequestError, match="CliffWalking-v1 has no step limit: give episode_limit"):
        make_task("CliffWalking-v1", discount=1.0)
