"""The model-based learner's plan against exact solutions, and its model by hand."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from qbumpers.learners import ModelBased, dispatch
from qbumpers.learners.interface import Shape, Transition
from qbumpers.random_streams import trial_streams
from qbumpers.tasks import cliff_walking
from qbumpers.values import solve
from tests.simulation.conditions import in_a_random_world

STREAM = trial_streams(5, {"test": "model"}, range(1))[0, 0]


def learner_of(states, actions, **settings):
    learner = ModelBased(**settings)
    memory = dispatch.start(learner, Shape(states, 0, (0,) * actions), STREAM)
    rates = dispatch.begin(learner, memory, 0, 1)

    def learn(state, action, reward, next_state, ended=False):
        happened = Transition(state, action, reward, next_state, ended, -1)
        dispatch.learn(learner, memory, happened, rates, STREAM)

    return memory, learn


def test_who_tried_everything_once_plans_the_exact_values():
    task = cliff_walking()
    memory, learn = learner_of(task.states, task.actions, discount=task.discount, backups=200)
    pairs = [(s, a) for s in range(task.states) for a in range(task.actions)]
    for _ in range(2):  # once to know them all, then to plan with all of them
        for s, a in pairs:
            ended = bool(task.terminated[s, a, 0])
            learn(s, a, float(task.reward[s, a, 0]), int(task.next_state[s, a, 0]), ended)
    np.testing.assert_array_equal(memory.values, solve(task).table)


def test_planning_with_frequencies_gives_the_exact_values_of_these():
    """Each outcome as often as its probability says, in hundredths."""
    task: Any = in_a_random_world().task
    counts = np.round(task.probability * 100).astype(int)
    exact = replace(task, probability=counts / counts.sum(axis=2, keepdims=True))
    memory, learn = learner_of(10, 3, discount=exact.discount, outcomes=3, backups=28)
    for (s, a, k), times in np.ndenumerate(counts):
        for _ in range(times):
            ended = bool(task.terminated[s, a, k])
            learn(s, a, float(task.reward[s, a, k]), int(task.next_state[s, a, k]), ended)
    for _ in range(300):  # only to plan: a tenth state that leads nowhere
        learn(9, 0, 0.0, 9)
    mean = (exact.probability * exact.reward).sum(axis=2)
    again = mean + exact.discount * (
        exact.probability * ~exact.terminated * memory.values[exact.next_state].max(axis=3)
    ).sum(axis=2)
    np.testing.assert_allclose(memory.rewards[:9] / memory.trials[:9], mean, atol=1e-12)
    np.testing.assert_allclose(memory.values[:9], again, atol=1e-12)
    np.testing.assert_allclose(memory.values[:9], solve(exact).table, atol=1e-6)


def test_a_reward_reaches_the_beginning_of_a_chain_in_one_step():
    """Ten states in a row: with a backup for each of them, the whole way is known at the end."""
    memory, learn = learner_of(10, 1, discount=0.5, backups=10)
    for state in range(9):
        learn(state, 0, 0.0, state + 1)
    assert not memory.values.any()
    learn(9, 0, 8.0, 0, True)
    assert memory.values[:, 0].tolist() == [8 * 0.5**n for n in range(9, -1, -1)]


def test_without_backups_only_the_credited_action_is_worked_out():
    memory, learn = learner_of(3, 1, backups=0)
    learn(0, 0, 1.0, 1)
    learn(1, 0, 2.0, 2, True)
    assert memory.values[:, 0].tolist() == [1.0, 2.0, 0.0]
    learn(0, 0, 1.0, 1)
    assert memory.values[:, 0].tolist() == [3.0, 2.0, 0.0]


def test_the_value_of_a_chance_is_the_mean_over_what_came():
    memory, learn = learner_of(4, 1, discount=0.5, backups=0, initial_value=8.0)
    for next_state, ended, reward in ((1, False, 1.0), (2, True, 4.0), (1, False, 1.0)):
        learn(0, 0, reward, next_state, ended)
    assert memory.values[0, 0] == 2.0 + 0.5 * (2 * 8.0 + 0.0) / 3
    assert memory.outcomes[0].tolist() == [1, -1, -2, -2]
    assert memory.counts[0].tolist() == [2.0, 1.0, 0.0, 0.0]


def test_a_further_outcome_takes_the_place_of_the_rarest():
    memory, learn = learner_of(5, 2, outcomes=2)
    for next_state in (1, 2, 1, 3, 3, 3, 4):
        learn(0, 1, 0.0, next_state)
    # 3 takes the place of 2, seen once; then 4 that of 1, seen twice, as 3 was seen three times.
    assert memory.outcomes[0].tolist() == [-2, -2, 4, 3]
    assert memory.counts[0].tolist() == [0.0, 0.0, 1.0, 3.0]
    assert memory.trials[0].tolist() == [0.0, 7.0]


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_what_is_left_of_the_counts_gives_the_same_plan_again(share):
    memory, learn = learner_of(2, 1, backups=1, discount=0.5)
    fresh, _ = learner_of(2, 1)
    learn(1, 0, 6.0, 0, True)
    learn(0, 0, 2.0, 1)
    assert memory.values[:, 0].tolist() == [5.0, 6.0]
    dispatch.forget(memory, fresh, share)
    assert memory.values[:, 0].tolist() == [5.0 * (1 - share), 6.0 * (1 - share)]
    learn(0, 0, 2.0, 1)
    learn(0, 0, 2.0, 1)
    assert memory.values[:, 0].tolist() == ([2.0, 0.0] if share == 1 else [5.0, 6.0])
    assert memory.counters[0] == 2  # still the same two actions
