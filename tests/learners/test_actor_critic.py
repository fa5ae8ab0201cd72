"""The actor-critic's step, worked out by hand, and what it must come to."""

import math

import numpy as np
import pytest

from qbumpers.learners import ActorCritic, Schedule, dispatch
from qbumpers.learners.interface import Shape, Transition
from qbumpers.random_streams import draw, trial_streams

SHAPE = Shape(2, 0, (0, 0))
LEARNER = ActorCritic(0.5, Schedule(0.1, 0.1), Schedule(0.5, 0.5), 2.0)


def stream():
    return trial_streams(5, {"test": "actor-critic"}, range(1))[0, 0]


def learned(memory, *transitions):
    rates = dispatch.begin(LEARNER, memory, 0, 1)
    for state, action, reward, next_state, ended in transitions:
        happened = Transition(state, action, reward, next_state, ended, -1)
        dispatch.learn(LEARNER, memory, happened, rates, stream())
    return memory


def test_one_step_by_hand():
    memory = dispatch.start(LEARNER, SHAPE, stream())
    memory.preferences[0] = [math.log(3), 0.0]  # probabilities 3/4 and 1/4
    learned(memory, (0, 1, 3.0, 1, False))
    # delta = 3 + 0.5 * 2 - 2 = 2; the actor's step is 0.1 * 2 = 0.2
    expected = [math.log(3) - 0.2 * 0.75, 0.2 * 0.75]
    np.testing.assert_allclose(memory.preferences, [expected, [0, 0]], atol=1e-12)
    assert memory.critic.ravel().tolist() == [3.0, 2.0]


def test_later_steps_count_less_by_the_discount_and_a_new_episode_begins_anew():
    memory = dispatch.start(LEARNER, SHAPE, stream())
    learned(memory, (1, 0, 2.0, 0, True), (0, 0, 6.0, 0, True))
    # In state 1 nothing was surprising; in state 0 delta = 4, at half its weight.
    np.testing.assert_allclose(memory.preferences, [[0.1, -0.1], [0, 0]], atol=1e-12)
    assert memory.weight[0] == 0.25
    dispatch.begin(LEARNER, memory, 1, 2)
    assert memory.weight[0] == 1.0


@pytest.mark.parametrize("value", [0.0, 1e6, -1e6])
def test_preferences_of_any_size_give_a_policy(value):
    memory, out = dispatch.start(LEARNER, SHAPE, stream()), np.empty(2)
    memory.preferences[0] = [value, 1e6]
    dispatch.policy(LEARNER, memory, 0, dispatch.begin(LEARNER, memory, 0, 1), out)
    assert out.sum() == 1
    assert out[0] == pytest.approx({0.0: 0.0, 1e6: 0.5, -1e6: 0.0}[value])


def test_the_mean_change_of_preferences_is_the_gradient_of_the_expected_reward():
    """One state, one step: of rewards r the gradient of sum pi r is pi (r - sum pi r)."""
    rewards, chances, draws = np.array([1.0, -2.0]), stream(), 20_000
    probabilities = np.array([0.75, 0.25])
    total = np.zeros(2)
    for _ in range(draws):
        memory = dispatch.start(LEARNER, SHAPE, stream())
        memory.preferences[0] = [math.log(3), 0.0]
        before = memory.preferences[0].copy()
        action = int(draw(chances) >= 0.75)
        learned(memory, (0, action, rewards[action], 0, True))
        total += (memory.preferences[0] - before) / 0.1
    gradient = probabilities * (rewards - probabilities @ rewards)
    # A change is at most 4 in size: 5 standard errors of the mean of 20,000 are below 0.15.
    np.testing.assert_allclose(total / draws, gradient, atol=0.15)
    assert np.abs(gradient).min() > 0.5
