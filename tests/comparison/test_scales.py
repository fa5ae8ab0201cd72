"""Quantities of tasks against what can be worked out by hand."""

import numpy as np
import pytest

from qbumpers.comparison.scales import Scales, best_return, reachable, thresholds
from qbumpers.tasks import TabularTask
from qbumpers.tasks.cliff_walking import cliff_walking
from qbumpers.tasks.toy_text import frozen_lake
from qbumpers.values import solve


def corridor(discount=1.0, limit=10):
    """Three cells and a goal; left, right; every step costs 1, a fourth cell is out of reach."""
    next_state = np.array([[[0], [1]], [[0], [2]], [[1], [2]], [[2], [3]]])
    terminated = np.zeros((4, 2, 1), bool)
    terminated[2, 1] = True
    return TabularTask(
        name="corridor", next_state=next_state, probability=np.ones((4, 2, 1)),
        reward=np.full((4, 2, 1), -1.0), terminated=terminated, start=np.array([1.0, 0, 0, 0]),
        discount=discount, episode_limit=limit, success=terminated,
    )  # fmt: skip


def test_only_states_that_an_episode_can_meet_are_reachable():
    assert reachable(corridor()).tolist() == [True, True, True, False]


def test_the_scales_of_a_corridor():
    scales = Scales(corridor(), 100)
    # Q*: (-4, -3), (-4, -2), (-3, -1)
    assert scales.spread == 3
    assert scales.lowest_start == -3
    assert scales.gaps.tolist() == [1, 2]
    assert scales.relative_gaps.tolist() == [1]
    assert scales.path == [0, 1, 2]
    assert scales.failures.tolist() == []


@pytest.mark.parametrize(
    ("discount", "limit", "expected"), [(1.0, 10, -3), (0.9, 10, -3), (1.0, 2, -2)]
)
def test_the_best_return_is_undiscounted_and_within_the_limit(discount, limit, expected):
    assert best_return(corridor(discount, limit)) == pytest.approx(expected)


def test_the_best_return_of_cliff_walking_is_the_value_of_its_start():
    assert best_return(cliff_walking()) == pytest.approx(87)


def test_the_best_return_of_a_slippery_lake_is_what_its_best_policy_gets():
    task = frozen_lake()
    values = solve(task).table
    generator, wins = np.random.default_rng(0), 0
    for _ in range(2000):
        state = 0
        for _ in range(task.episode_limit):
            action = values[state].argmax()
            outcome = generator.choice(task.probability.shape[2], p=task.probability[state, action])
            wins += task.reward[state, action, outcome]
            if task.terminated[state, action, outcome]:
                break
            state = task.next_state[state, action, outcome]
    assert best_return(task) == pytest.approx(wins / 2000, abs=0.04)


def test_thresholds_lie_between_values_and_each_overrides_another_set():
    values = np.array([1.0, 2.0, 5.0, 6.0])
    assert thresholds(values, 8) == [0, 1.5, 3.5, 5.5]
    assert thresholds(values, 2) == [0, 5.5]
    assert thresholds(np.array([]), 8) == [0]
    overridden = {tuple(values > limit) for limit in thresholds(values, 8)}
    assert len(overridden) == 4
