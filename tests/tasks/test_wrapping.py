"""Wrappers between a caller's environment and its table: followed, or refused by name."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import wrappers
from gymnasium.envs.toy_text import FrozenLakeEnv
from gymnasium.wrappers import TimeLimit, TransformReward
from stable_baselines3.common.monitor import Monitor

from qbumpers import RequestError, SharedControl, TabularTask, make_task, solve
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.sources import make_experiment
from tests.tasks.lakes import frozen

COST = TransformReward.wrapper_spec(func=lambda reward: 100 * float(reward) - 1)
# Six steps at a cost of 1 each, and 100 for the last.
TRUE_VALUE = sum(-(0.99**t) for t in range(6)) + 100 * 0.99**5


@pytest.fixture
def register():
    """Registers environments, and forgets them."""
    before = dict(gymnasium.registry)

    def registered(name, entry_point: Any = FrozenLakeEnv, **fields):
        gymnasium.register(name, entry_point=entry_point, max_episode_steps=100, **fields)
        return name

    yield registered
    gymnasium.registry.clear()
    gymnasium.registry.update(before)


def costly():
    return TransformReward(frozen(), lambda reward: 100 * float(reward) - 1)


def task_of(environment, **arguments):
    return TabularTask.from_gymnasium(environment, discount=0.99, **arguments)


def played(environment, values):
    """Discounted return of the greedy policy, in the environment as it is."""
    observation, _ = environment.reset(seed=0)
    total, factor, over = 0.0, 1.0, False
    while not over:
        observation, reward, terminated, truncated, _ = environment.step(
            int(values(observation).argmax())
        )
        total, factor, over = total + factor * reward, factor * 0.99, terminated or truncated
    return total


def test_values_are_those_of_the_wrapped_rewards():
    values = solve(task_of(costly()))
    assert values(0).max() == pytest.approx(TRUE_VALUE, abs=1e-8)
    assert abs(TRUE_VALUE - 89.25) < 0.01
    assert played(costly(), values) == pytest.approx(TRUE_VALUE)


def test_functions_of_rewards_are_applied_from_the_inside_out():
    doubled_then_clipped = wrappers.ClipReward(
        TransformReward(frozen(), lambda reward: 2 * float(reward) - 0.1), max_reward=1.0
    )
    values = solve(task_of(doubled_then_clipped))
    expected = sum(-0.1 * 0.99**t for t in range(5)) + 0.99**5
    assert values(0).max() == pytest.approx(expected)
    assert played(doubled_then_clipped, values) == pytest.approx(expected)


def test_wrappers_that_an_id_is_registered_with_are_followed(register):
    name = register("CostlyLake-v0", kwargs={"is_slippery": False}, additional_wrappers=(COST,))
    assert solve(make_task(name, discount=0.99))(0).max() == pytest.approx(TRUE_VALUE)
    experiment = {
        "name": "costly", "task": {"name": name, "discount": 0.99}, "trials": 1, "episodes": 1,
        "assistants": [{"name": "none"}],
    }  # fmt: skip
    plan = make_plan(make_experiment(experiment))
    assert plan.values(0).max() == pytest.approx(TRUE_VALUE)


class Watching(gymnasium.Wrapper):
    """Changes nothing that a step gives."""

    def render(self):
        return "a picture"


@pytest.mark.parametrize(
    "wrap",
    [wrappers.RecordEpisodeStatistics, wrappers.PassiveEnvChecker, wrappers.OrderEnforcing,
     Watching, Monitor],
)  # fmt: skip
def test_wrappers_that_only_watch_change_nothing(wrap):
    assert task_of(wrap(frozen())).digest() == task_of(frozen()).digest()


class Sticky(gymnasium.Wrapper):
    """Repeats the action before, one time in four."""

    def reset(self, **arguments):
        self.last = None
        return self.env.reset(**arguments)

    def step(self, action):
        repeats = self.last is not None and self.np_random.random() < 0.25
        self.last = self.last if repeats else action
        return self.env.step(self.last)


class Patience(TimeLimit):
    """Gymnasium's limit, and something of its own."""

    def step(self, action) -> Any:
        observation, reward, *rest = super().step(action)
        return observation, float(reward) - 1, *rest


class Shaped(gymnasium.RewardWrapper):
    def reward(self, reward):
        return float(reward) - 1


def mirrored(action: Any) -> Any:
    return 3 - action


ALTERING = {
    "Sticky": Sticky,
    "StickyAction": lambda env: wrappers.StickyAction(env, 0.25),
    "TransformAction": lambda env: wrappers.TransformAction(env, mirrored, None),
    "TransformObservation": lambda env: wrappers.TransformObservation(env, lambda s: 15 - s, None),
    "NormalizeReward": wrappers.NormalizeReward,
    "Patience": lambda env: Patience(env, 50),
    "Shaped": Shaped,
    "SharedControl": lambda env: SharedControl(env, "maximal", solve(task_of(frozen()))),
}


@pytest.mark.parametrize("name", ALTERING)
def test_a_wrapper_whose_effect_on_the_table_is_not_known_is_refused_by_name(name):
    wrapped = wrappers.RecordEpisodeStatistics(ALTERING[name](frozen()))
    with pytest.raises(RequestError, match=rf"FrozenLake-v1: what wrapper {name} does") as caught:
        task_of(wrapped)
    assert "\n" not in str(caught.value)


def test_so_is_one_that_an_id_is_registered_with(register):
    sticky = wrappers.StickyAction.wrapper_spec(repeat_action_probability=0.25)
    name = register("StickyLake-v0", additional_wrappers=(sticky,))
    with pytest.raises(RequestError, match="what wrapper StickyAction does"):
        make_task(name, discount=0.99)
    experiment = {"name": "sticky", "task": {"name": name, "discount": 0.99},
                  "assistants": [{"name": "none"}]}  # fmt: skip
    with pytest.raises(RequestError, match="what wrapper StickyAction does"):
        make_plan(make_experiment(experiment))


def test_a_function_of_rewards_that_remembers_is_found_out():
    paid = []

    def less_each_time(reward):
        paid.append(reward)
        return reward / len(paid)

    with pytest.raises(RequestError, match="its steps do not do what its transition table says"):
        task_of(TransformReward(gymnasium.make("FrozenLake-v1"), less_each_time))


def test_a_function_of_rewards_that_fails_is_named():
    with pytest.raises(RequestError, match=r"TransformReward fails at the reward 0\.0: .*division"):
        task_of(TransformReward(frozen(), lambda reward: 1 / float(reward)))


def test_the_limit_is_the_first_to_be_reached(register):
    assert task_of(TimeLimit(TimeLimit(frozen().unwrapped, 5), 100)).episode_limit == 5
    assert task_of(TimeLimit(frozen(), 7)).episode_limit == 7
    assert task_of(TimeLimit(frozen(), 7), episode_limit=9).episode_limit == 9
    for entry_point in (FrozenLakeEnv, "gymnasium.envs.classic_control:CartPoleEnv"):
        limit = TimeLimit.wrapper_spec(max_episode_steps=6)
        name = register("Brief-v0", entry_point, additional_wrappers=(limit,))
        assert make_task(name, discount=0.99).episode_limit == 6
        del gymnasium.registry[name]


def test_a_numbered_state_that_is_shown_as_a_vector_makes_a_task_of_vectors(register):
    flat = wrappers.FlattenObservation.wrapper_spec()
    task = make_task(register("FlatLake-v0", additional_wrappers=(flat,)), discount=0.99)
    assert (task.states, task.observation_size) == (0, 16)
    assert np.array_equal(task.make_stepper().reset(0.5), np.eye(16, dtype=np.float32)[0])
