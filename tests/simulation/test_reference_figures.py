"""Cliff Walking's numbers against the paper's and against an independent simulation's.

Bound: the difference of two means is at most 4 combined standard errors, the measured one's (over
trials) and the reference's, plus half a unit of the last printed digit. Two right simulations
differ by more in one of 16,000 comparisons; with the seeds fixed the outcome is always the same.
"""

from typing import NamedTuple

import numpy as np
import pytest

from qbumpers.assistants import make_assistant
from qbumpers.learners import QLearner, Schedule
from qbumpers.simulation import simulate
from qbumpers.tasks import cliff_walking

STANDARD_ERRORS = 4
LAST_DIGIT = 0.05
PAPER_TRIALS = 100

BUMPERS, THRESHOLDS = "stochastic-q-bumpers", "local-q-thresholding"
TENTH = QLearner(epsilon=Schedule(fraction=0.1), learning_rate=Schedule(fraction=0.1))


class Row(NamedTuple):
    """One reference: mean assisted and unassisted returns with their standard errors."""

    assistant: str
    options: dict
    assisted: tuple[float, float]
    unassisted: tuple[float, float]
    learner: QLearner = QLearner()


SIMULATED = {
    "none": Row("none", {}, (-348.8, 1.7), (-31.9, 1.5)),
    "bumpers 0.7": Row(BUMPERS, {"alpha": 0.7, "second": True}, (54.1, 0.1), (-232.2, 5.7)),
    "bumpers 0.2": Row(BUMPERS, {"alpha": 0.2, "second": True}, (66.4, 0.1), (-455.8, 6.7)),
    "thresholds 0.0195": Row(
        THRESHOLDS, {"alpha": 0.0195, "second": True}, (51.3, 0.1), (-509.7, 9.6)
    ),
    "maximal": Row("maximal", {}, (87.0, 0.0), (-2790.0, 104.0)),
    "bumpers 0.7, escalation off": Row(
        BUMPERS,
        {"alpha": 0.7, "second": True, "escalate": False},
        (46.2, 0.1),
        (-282.2, 7.0),
    ),
    "thresholds 0.0195, decay over a tenth": Row(
        THRESHOLDS, {"alpha": 0.0195, "second": True}, (55.7, 0.2), (-2812.6, 48.5), TENTH
    ),
}
"""1,000 trials of an independent simulation: mean and standard error over trials."""

PUBLISHED = [
    ("none", {}, "unassisted", -26.6),
    (THRESHOLDS, {"alpha": 1.0, "second": True}, "unassisted", -26.6),
    (BUMPERS, {"alpha": 0.7, "second": True}, "assisted", 53.9),
    (BUMPERS, {"alpha": 0.7, "second": True}, "unassisted", -222.6),
    (BUMPERS, {"alpha": 0.2, "second": True}, "assisted", 66.6),
    (BUMPERS, {"alpha": 0.2, "second": True}, "unassisted", -465.6),
    (THRESHOLDS, {"alpha": 0.0195, "second": True}, "assisted", 51.5),
    (THRESHOLDS, {"alpha": 0.0195, "second": True}, "unassisted", -486.5),
    (THRESHOLDS, {"alpha": 0.0191, "second": True}, "assisted", 51.3),
    (THRESHOLDS, {"alpha": 0.0191, "second": True}, "unassisted", -486.9),
    ("maximal", {}, "assisted", 87.0),
]
"""Figure 2 of the paper: means over 100 trials, without standard errors."""


def mean_and_error(returns, trials):
    """Mean of [T, E] returns and its standard error had there been so many trials."""
    by_trial = returns.mean(axis=1)
    return by_trial.mean(), by_trial.std(ddof=1) / np.sqrt(trials)


def run_row(assistant, options, learner, trials):
    made = make_assistant(assistant, **options)
    return simulate(
        cliff_walking(), made, learner=learner, trials=trials, seed=2019, workers=2
    ).outcomes


def assert_close(found, found_error, expected, expected_error):
    bound = STANDARD_ERRORS * np.hypot(found_error, expected_error) + LAST_DIGIT
    assert abs(found - expected) <= bound, f"{found:.2f} is not {expected} +- {bound:.2f}"


@pytest.mark.parametrize("trials", [300, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", SIMULATED)
def test_means_agree_with_an_independent_simulation(name, trials):
    row = SIMULATED[name]
    outcomes = run_row(row.assistant, row.options, row.learner, trials)
    assert_close(*mean_and_error(outcomes.assisted_return, trials), *row.assisted)
    assert_close(*mean_and_error(outcomes.unassisted_return, trials), *row.unassisted)


@pytest.mark.parametrize("trials", [300, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("assistant", "options", "kind", "published"), PUBLISHED)
def test_means_agree_with_the_published_figure(assistant, options, kind, published, trials):
    outcomes = run_row(assistant, options, QLearner(), trials)
    returns = getattr(outcomes, f"{kind}_return")
    _, published_error = mean_and_error(returns, PAPER_TRIALS)
    assert_close(*mean_and_error(returns, trials), published, published_error)


@pytest.mark.parametrize("trials", [300, pytest.param(1000, marks=pytest.mark.slow)])
def test_readings_that_differ_give_means_that_differ(trials):
    """The bounds above are narrow enough to tell the readings of the paper apart."""
    means = {}
    for name in ("bumpers 0.7", "bumpers 0.7, escalation off"):
        row = SIMULATED[name]
        outcomes = run_row(row.assistant, row.options, row.learner, trials)
        means[name], error = mean_and_error(outcomes.assisted_return, trials)
        assert STANDARD_ERRORS * error < 1.0
    assert means["bumpers 0.7"] - means["bumpers 0.7, escalation off"] > 6.0
