"""Maxima and intervals against closed forms, and against the truth that made a record."""

import math

import numpy as np
import pytest
import scipy.optimize
import scipy.stats

from qbumpers.fitting import Likelihood, choices_of, estimate, interval, make_candidate
from qbumpers.learners import Perception
from qbumpers.learners.interface import Shape
from tests.fitting.records import EPSILON, RATE, bandit, part, walked

OTHERS, CHOICES = 30, 200  # of action 1, after the first choice has shown that 0 is better


def knowing():
    """One who knows after the first choice: epsilon is all that decides."""
    proposed = np.zeros(CHOICES + 1, np.int64)
    proposed[1 : OTHERS + 1] = 1
    candidate = make_candidate(
        "q-learning", "transition", free=["epsilon"], fixed={"learning_rate": 1.0, "lapse": 0.0}
    )
    choices = choices_of(bandit(proposed), "participant")
    return Likelihood(candidate, choices, Shape(1, 0, (0, 0)), CHOICES + 1)


def binomial(epsilon):
    others = epsilon / 2  # a random action is the other one half of the time
    return OTHERS * np.log(others) + (CHOICES - OTHERS) * np.log(1 - others)


def test_epsilon_is_twice_the_share_of_choices_that_are_not_greedy():
    found = estimate(knowing())
    assert found.parameters["epsilon"] == pytest.approx(2 * OTHERS / CHOICES, abs=1e-3)
    assert found.log_likelihood == pytest.approx(
        math.log(0.5) + binomial(2 * OTHERS / CHOICES), abs=1e-4
    )
    assert found.bic == pytest.approx(math.log(CHOICES + 1) - 2 * found.log_likelihood)
    assert (found.error, found.impossible, found.steps) == (0.0, 0, CHOICES + 1)


def test_an_interval_ends_where_the_likelihood_ratio_says():
    likelihood = knowing()
    best = 2 * OTHERS / CHOICES
    half = scipy.stats.chi2.ppf(0.95, 1) / 2

    def excess(epsilon):
        return binomial(best) - binomial(epsilon) - half

    expected = [scipy.optimize.brentq(excess, *ends) for ends in ((1e-6, best), (best, 1.0))]
    found = interval(likelihood, estimate(likelihood), "epsilon")
    assert [*found] == pytest.approx(expected, abs=2e-3)


def test_choices_that_are_held_out_do_not_decide():
    likelihood = knowing()
    counted = np.arange(CHOICES + 1) > OTHERS // 2
    found = estimate(likelihood, counted)
    expected = 2 * (OTHERS - OTHERS // 2) / (CHOICES - OTHERS // 2)
    assert found.parameters["epsilon"] == pytest.approx(expected, abs=1e-3)
    assert found.steps == counted.sum()


def test_a_learner_that_never_would_have_done_it_is_impossible():
    candidate = make_candidate(
        "q-learning", "transition", fixed={"epsilon": 0.0, "learning_rate": 1.0, "lapse": 0.0}
    )
    choices = choices_of(bandit([0, 1, 1]), "participant")
    found = estimate(Likelihood(candidate, choices, Shape(1, 0, (0, 0)), 3))
    assert (found.log_likelihood, found.impossible, found.parameters) == (-np.inf, 2, {})


def walking(learner, trial=0):
    steps = walked(learner, trial=trial, episodes=30)
    candidate = make_candidate(learner, "transition", free=["epsilon", "learning_rate"])
    choices = choices_of(steps, "participant")
    return Likelihood(candidate, choices, Shape(48, 0, (0,) * 4), 30)


def test_numbers_of_simulated_learners_are_recovered():
    """Bound: epsilon has a standard error of about 0.02 in 600 choices, the mean of 6 of 0.01."""
    found = [estimate(walking("q-learning", trial=trial)).parameters for trial in range(6)]
    assert np.mean([each["epsilon"] for each in found]) == pytest.approx(EPSILON, abs=0.03)
    assert np.mean([each["learning_rate"] for each in found]) == pytest.approx(RATE, abs=0.05)


def test_the_maximum_is_above_the_truth_and_the_interval_around_it():
    likelihood = walking("q-learning", trial=1)
    found = estimate(likelihood)
    truth = make_candidate(
        "q-learning", "transition", fixed={"epsilon": EPSILON, "learning_rate": RATE}
    )
    assert found.log_likelihood > likelihood.log_probabilities(truth.stack).sum()
    low, high = interval(likelihood, found, "epsilon")
    assert low < found.parameters["epsilon"] < high


def test_what_is_hidden_gives_the_likelihood_an_error():
    seen = Perception(0.5, "executed")
    steps = part(walked("softmax-q-learning", seen, 0, 30), 150)
    assert steps.overridden.any()
    candidate = make_candidate(
        "softmax-q-learning", seen, fixed={"perseveration": 0.0, "unchosen_decay": 0.0,
                                           "learning_rate": RATE},
    )  # fmt: skip
    choices = choices_of(steps, "participant")
    found = estimate(Likelihood(candidate, choices, Shape(48, 0, (0,) * 4), 30, 50))
    assert 0 < found.error < 1
    assert -len(steps.episode) * math.log(4) < found.log_likelihood < 0


def test_the_same_search_gives_the_same_numbers():
    assert estimate(walking("q-learning")) == estimate(walking("q-learning"))


def test_schedules_that_do_not_change_are_found():
    """Bound: the truth lies on a ridge, and the maximum is above it."""
    steps = walked("q-learning", trial=2, episodes=30)
    candidate = make_candidate("q-learning", "transition")
    likelihood = Likelihood(candidate, choices_of(steps, "participant"), Shape(48, 0, (0,) * 4), 30)
    truth = make_candidate(
        "q-learning", "transition", fixed={"epsilon": EPSILON, "learning_rate": RATE}
    )
    found = estimate(likelihood)
    assert found.log_likelihood > likelihood.log_probabilities(truth.stack).sum()
    assert found.parameters["learning_rate.start"] == pytest.approx(RATE, abs=0.05)
    assert found.parameters["learning_rate.end"] == pytest.approx(RATE, abs=0.05)
