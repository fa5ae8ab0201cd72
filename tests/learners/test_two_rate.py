"""The two-rate learner against the recursion and the closed forms of its source."""

import numpy as np
import pytest

from qbumpers.learners import TwoRate, dispatch
from qbumpers.learners.interface import Rates, Shape, Transition
from qbumpers.random_streams import trial_streams

STREAM = trial_streams(5, {"test": "two-rate"}, range(1))[0, 0]
FAST, SLOW = (0.59, 0.21), (0.992, 0.02)


class Reach:
    """One movement, whose perturbation is the reward: what is adapted to is its value."""

    def __init__(self):
        self.learner = TwoRate()
        self.memory = dispatch.start(self.learner, Shape(1, 0, (0, 0)), STREAM)

    def trial(self, reward):
        happened = Transition(0, 1, reward, 0, True, -1)
        dispatch.learn(self.learner, self.memory, happened, Rates(0.0, 0.0), STREAM)
        return self.memory.values[0, 1]

    def trials(self, reward, number):
        return [self.trial(reward) for _ in range(number)]


def test_a_series_of_perturbations_gives_the_series_of_the_equations():
    """As a linear system: z <- (diag(A) - B 1') z + B r."""
    retention, learning = np.diag([FAST[0], SLOW[0]]), np.array([[FAST[1]], [SLOW[1]]])
    system = retention - learning @ np.ones((1, 2))
    rewards = [*[1.0] * 50, *[-1.0] * 8, *[0.0] * 20]
    reach, state, expected = Reach(), np.zeros((2, 1)), []
    for reward in rewards:
        state = system @ state + learning * reward
        expected.append(float(state.sum()))
    np.testing.assert_allclose([reach.trial(reward) for reward in rewards], expected, atol=1e-12)
    assert reach.memory.values[0, 0] == 0  # the other movement is another one


def test_adaptation_stops_where_learning_makes_up_for_forgetting():
    gain = FAST[1] / (1 - FAST[0]) + SLOW[1] / (1 - SLOW[0])
    assert Reach().trials(40.0, 2000)[-1] == pytest.approx(40 * gain / (1 + gain), abs=1e-9)
    assert gain / (1 + gain) == pytest.approx(0.75, abs=0.01)


def test_what_was_unlearned_by_the_opposite_is_learned_again_faster():
    reach = Reach()
    first = reach.trials(1.0, 120)
    while reach.trial(-1.0) > 0:
        pass
    assert reach.memory.slow[0, 1] > 0 > reach.memory.fast[0, 1]
    again = reach.trials(1.0, 120)
    assert again[9] - first[9] > 0.05
    assert np.searchsorted(again, 0.6) < np.searchsorted(first, 0.6) / 2  # trials up to there


def test_an_unlearned_response_comes_back_while_errors_are_0():
    reach = Reach()
    reach.trials(1.0, 120)
    while reach.trial(-1.0) > 0:
        pass
    # What happens is what was expected.
    clamped = [reach.trial(reach.memory.values[0, 1]) for _ in range(15)]
    assert max(clamped) > 0.1


def test_there_are_no_savings_after_a_long_washout():
    reach = Reach()
    first = reach.trials(1.0, 120)
    reach.trials(0.0, 3000)
    np.testing.assert_allclose(reach.trials(1.0, 120), first, atol=1e-9)


@pytest.mark.parametrize(("ended", "future"), [(False, 0.5 * 30.0), (True, 0.0)])
def test_the_error_is_that_of_temporal_differences(ended, future):
    learner = TwoRate(discount=0.5)
    memory = dispatch.start(learner, Shape(2, 0, (0, 0)), STREAM)
    memory.values[1], memory.fast[1] = [30.0, 10.0], [30.0, 10.0]
    happened = Transition(0, 0, 4.0, 1, ended, -1)
    dispatch.learn(learner, memory, happened, Rates(0.0, 0.0), STREAM)
    assert memory.fast[0].tolist() == [FAST[1] * (4 + future), 0.0]
    assert memory.slow[0].tolist() == [SLOW[1] * (4 + future), 0.0]
    assert memory.values[0, 0] == memory.fast[0, 0] + memory.slow[0, 0]
