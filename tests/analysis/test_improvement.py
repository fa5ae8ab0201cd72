"""Probability of improvement: as rliable's, with Wilson's interval, covering the truth."""

import math

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from qbumpers.analysis.statistics import probability_of_improvement
from tests.analysis.coverage import bound

SCORES = arrays(np.float64, st.integers(2, 20), elements=st.integers(-5, 5))  # many ties


@given(SCORES, SCORES)
def test_improvement_is_the_share_of_all_comparisons_won_and_half_of_those_tied(first, second):
    metrics = pytest.importorskip("rliable.metrics")
    found = probability_of_improvement(first, second)
    won = [(a > b) + (a == b) / 2 for a in first for b in second]
    assert found.mean == pytest.approx(np.mean(won))
    assert found.mean == pytest.approx(
        metrics.probability_of_improvement(first[:, np.newaxis], second[:, np.newaxis])
    )
    assert 0 <= found.low <= found.mean <= found.high <= 1
    mirrored = probability_of_improvement(second, first)
    assert (1 - mirrored.mean, 1 - mirrored.high, 1 - mirrored.low) == pytest.approx(found)


@pytest.mark.parametrize("wins", [0, 3, 14, 20])
def test_improvement_over_a_constant_is_a_share_with_wilsons_interval(wins):
    first = np.where(np.arange(20) < wins, 1.0, -1.0)
    expected = scipy.stats.binomtest(wins, 20).proportion_ci(method="wilson")
    for found in (
        probability_of_improvement(first, np.zeros(50)),
        probability_of_improvement(first, np.zeros(20), paired=True),
    ):
        assert found == pytest.approx((wins / 20, expected.low, expected.high))


def test_pairs_are_compared_with_their_partners_alone():
    first, second = np.array([1.0, 2.0, 3.0, 9.0]), np.array([0.0, 1.0, 2.0, 9.0])
    assert probability_of_improvement(first, second, paired=True).mean == 7 / 8
    assert probability_of_improvement(first, second).mean == 10.5 / 16


def test_improvement_of_a_single_trial_has_no_interval():
    found = probability_of_improvement(np.ones(1), np.zeros(1))
    assert found.mean == 1
    assert math.isnan(found.low)
    assert math.isnan(found.high)


def improvement_case(name, trials, generator):
    """Two samples and the probability that the first exceeds the second."""
    normal = scipy.stats.norm.cdf
    if name == "exponential":
        return generator.exponential(1, trials), generator.exponential(4, trials), 0.2
    if name == "discrete":
        return generator.integers(0, 3, trials), generator.integers(0, 3, trials), 0.5
    shift, spread = {"equal": (1, 1), "wide": (1, 10), "constant": (1, 0)}[name]
    first, second = generator.normal(shift, 1, trials), generator.normal(0, spread, trials)
    return first, second, normal(shift / np.hypot(1, spread))


@pytest.mark.parametrize("name", ["exponential", "discrete", "equal", "wide", "constant"])
@pytest.mark.parametrize(
    ("trials", "repetitions"), [(40, 1000), pytest.param(15, 10_000, marks=pytest.mark.slow)]
)
def test_intervals_of_improvement_cover_the_truth(name, trials, repetitions):
    generator = np.random.default_rng(5)
    covered = 0
    for _ in range(repetitions):
        first, second, truth = improvement_case(name, trials, generator)
        found = probability_of_improvement(first, second)
        covered += found.low <= truth <= found.high
    # A formula for many trials, and steps of a count: up to 0.025 from 0.95 with few.
    assert covered / repetitions == pytest.approx(0.95, abs=0.025 + bound(repetitions))
