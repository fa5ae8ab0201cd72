"""Parameters by name: which there are, which are free, and where they are looked for."""

import math

import pytest

from qbumpers import RequestError
from qbumpers.fitting import make_candidate
from qbumpers.fitting.parameters import Parameter, parameters_of, values_of, with_values
from qbumpers.learners import Perception, learners

FREE = {
    "q-learning": ["epsilon.start", "epsilon.end", "learning_rate.start", "learning_rate.end"],
    "sarsa": ["epsilon.start", "epsilon.end", "learning_rate.start", "learning_rate.end"],
    "expected-sarsa": ["epsilon.start", "epsilon.end", "learning_rate.start", "learning_rate.end"],
    "softmax-q-learning": [
        "inverse_temperature", "perseveration", "unchosen_decay", "learning_rate.start",
        "learning_rate.end",
    ],
    "actor-critic": ["actor_rate.start", "actor_rate.end", "critic_rate.start", "critic_rate.end"],
    "model-based": ["epsilon.start", "epsilon.end"],
    "imitator": ["epsilon.start", "epsilon.end"],
    "two-rate": [
        "epsilon.start", "epsilon.end", "fast_retention", "fast_learning", "slow_retention",
        "slow_learning",
    ],
}  # fmt: skip


def test_the_numbers_of_a_learner_are_free_but_for_discount_and_first_values():
    tabular = [n for n, kind in learners().items() if kind.built_in and kind.observes == "states"]
    assert set(FREE) == set(tabular)
    for name, free in FREE.items():
        assert list(make_candidate(name, "observant").free) == free


@pytest.mark.parametrize(
    ("parameter", "values"),
    [
        (Parameter("share", 0.0, 1.0), [0.0, 0.002, 0.5, 1.0]),
        (Parameter("temperature", 0.0, math.inf), [0.0001, 1.0, 99.0]),
        (Parameter("habit", -math.inf, math.inf), [-99.0, 0.0, 3.0]),
    ],
)
def test_values_come_back_from_their_coordinates(parameter, values):
    for value in values:
        assert parameter.value(parameter.coordinate(value)) == pytest.approx(value)
    low, high = parameter.ends()
    assert parameter.coordinate(-1e9) == low if parameter.low == 0 else parameter.coordinate(-1e9)
    assert parameter.coordinate(1e9) == high
    assert low < high


def test_a_whole_schedule_is_one_number_in_all_episodes():
    candidate = make_candidate("q-learning", "transition", free=["learning_rate"])
    assert candidate.free == ("epsilon.start", "epsilon.end", "learning_rate")
    stack = with_values(candidate.stack, {"learning_rate": 0.3, "epsilon.end": 0.1, "lapse": 0.2})
    assert stack.settings.learning_rate[:2] == (0.3, 0.3)
    assert (stack.settings.epsilon.start, stack.settings.epsilon.end) == (1.0, 0.1)
    assert values_of(stack, ["learning_rate", "epsilon.end", "lapse", "motor.slip"]) == {
        "learning_rate": 0.3, "epsilon.end": 0.1, "lapse": 0.2, "motor.slip": 0.0,
    }  # fmt: skip


def test_what_lies_around_a_learner_has_parameters_too():
    seen = Perception(0.3, "executed", 2.0)
    candidate = make_candidate("q-learning", seen, free=["perception.notices", "lapse"])
    assert {*candidate.free} >= {"perception.notices", "lapse"}
    assert values_of(candidate.stack, ["perception.notices", "perception.penalty"]) == {
        "perception.notices": 0.3, "perception.penalty": 2.0,
    }  # fmt: skip
    assert parameters_of(candidate.stack)["motor.lag"] == Parameter("motor.lag", 0.0, 1.0)
    assert candidate.name == "q-learning, notices=0.3 credits=executed penalty=2"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"free": ["epsilom"]}, "unknown parameter of learner q-learning: 'epsilom' .*'epsilon'"),
        ({"fixed": {"lapse": 2}}, r"lapse = 2; it must lie in \[0, 1\]"),
        ({"fixed": {"lapse": "much"}}, "lapse = 'much'; a number in"),
        ({"free": ["lapse"], "fixed": {"lapse": 0.1}}, "lapse: free and fixed = 0.1"),
    ],
)
def test_wrong_parameters_are_named(arguments, message):
    with pytest.raises(RequestError, match=message):
        make_candidate("q-learning", "transition", **arguments)


def test_learners_that_cannot_be_fitted_are_named():
    with pytest.raises(RequestError, match=r"'double-dqn'; it observes vectors, which cannot be"):
        make_candidate("double-dqn", "transition")
    with pytest.raises(RequestError, match=r"learner imitator copies what was executed"):
        make_candidate("imitator", "transition")
