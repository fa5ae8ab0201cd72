"""The softmax learner's probabilities and values, worked out by hand."""

import math

import numpy as np
import pytest

from qbumpers import RequestError
from qbumpers.learners import Schedule, SoftmaxQLearner, dispatch, make_learner
from qbumpers.learners.interface import Rates, Shape, Transition
from qbumpers.learners.softmax import by_weight
from qbumpers.random_streams import trial_streams

SHAPE = Shape(2, 0, (0, 0, 0))


def stream():
    return trial_streams(5, {"test": "softmax"}, range(1))[0, 0]


def policy_of(values, last=-1, **settings):
    learner = SoftmaxQLearner(**settings)
    memory = dispatch.start(learner, SHAPE, stream())
    memory.values[0], memory.last[0] = values, last
    out = np.empty(3)
    dispatch.policy(learner, memory, 0, Rates(0.0, 1.0), out)
    return out.tolist()


def close(*expected):
    return [pytest.approx(each, abs=1e-12) for each in expected]


def test_a_difference_of_log_two_over_beta_is_chosen_twice_as_often():
    beta = 0.01
    values = [700.0, 700.0 + math.log(2) / beta, 700.0 + math.log(5) / beta]
    assert policy_of(values, inverse_temperature=beta) == close(1 / 8, 2 / 8, 5 / 8)


def test_perseveration_favours_the_last_action_or_avoids_it():
    for kappa, share in ((math.log(2), 2 / 4), (-math.log(2), 0.5 / 2.5)):
        rest = (1 - share) / 2
        assert policy_of([1.0] * 3, 1, perseveration=kappa) == close(rest, share, rest)


@pytest.mark.parametrize("beta", [0.0, 1.0, 1e300])
@pytest.mark.parametrize("kappa", [0.0, 1e300, -1e300])
def test_no_values_are_too_large_or_too_far_apart(beta, kappa):
    for last in (-1, 0, 2):
        found = policy_of(
            [-1e200, 1e200, 1e200], last, inverse_temperature=beta, perseveration=kappa
        )
        assert sum(found) == pytest.approx(1, abs=1e-12)
        assert min(found) >= 0


@pytest.mark.parametrize(("chance", "action"), [(0.0, 1), (0.49, 1), (0.5, 2), (1 - 1e-16, 2)])
def test_what_has_no_weight_is_never_chosen(chance, action):
    assert by_weight(np.array([0.0, 2.0, 2.0, 0.0]), 4.0, 4, chance) == action
    assert by_weight(np.array([0.0, 2.0, 2.0, 0.0]), 4.5, 4, 1 - 1e-16) == 2  # badly rounded


def test_the_credited_action_learns_and_the_others_decay():
    learner = SoftmaxQLearner(discount=0.5, unchosen_decay=0.25, initial_value=4.0)
    memory = dispatch.start(learner, SHAPE, stream())
    memory.values[:] = [[8.0, 0.0, 4.0], [1.0, 6.0, 2.0]]
    dispatch.learn(learner, memory, Transition(0, 1, -1.0, 1, False, -1), Rates(0.0, 0.5), stream())
    # -1 + 0.5 * 6 = 2, half of the way from 0; a quarter of the way from 8, and from 4, to 4.
    assert memory.values.tolist() == [[7.0, 1.0, 4.0], [1.0, 6.0, 2.0]]
    assert memory.last.tolist() == [1, -1]


def test_what_is_learned_is_what_is_perseverated_and_stays_in_the_next_episode():
    learner = SoftmaxQLearner(perseveration=1e9, learning_rate=Schedule(0.0, 0.0))
    memory, chances = dispatch.start(learner, SHAPE, stream()), stream()
    rates = Rates(0.0, 0.0)
    dispatch.learn(learner, memory, Transition(0, 2, 0.0, 1, False, -1), rates, chances)
    assert {dispatch.choose(learner, memory, 0, rates, chances) for _ in range(20)} == {2}
    assert {dispatch.choose(learner, memory, 1, rates, chances) for _ in range(60)} == {0, 1, 2}
    assert {dispatch.prefer(learner, memory, 0, tie) for tie in (0.0, 0.4, 0.9)} == {0, 1, 2}


@pytest.mark.parametrize(
    ("field", "value"),
    [("inverse_temperature", -0.1), ("unchosen_decay", 1.1), ("perseveration", math.nan)],
)
def test_numbers_out_of_range_are_named(field, value):
    with pytest.raises(RequestError, match=f"softmax-q-learning: {field} = {value}"):
        make_learner("softmax-q-learning", **{field: value})
