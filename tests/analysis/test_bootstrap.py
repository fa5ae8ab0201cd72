"""Percentile and BCa intervals against every possible resample and against simulation."""

import itertools
import math

import numpy as np
import pytest
import scipy.stats

from qbumpers.analysis.statistics import (
    IntervalEstimate,
    bootstrap_interval,
    difference,
    percentile_interval,
)
from tests.analysis.coverage import bound, covering


def test_a_percentile_interval_cuts_equal_tails():
    replicates = np.random.default_rng(2).permutation(np.arange(1001.0))
    assert percentile_interval(480.0, replicates) == pytest.approx((480, 25, 975))
    assert percentile_interval(480.0, replicates, 0.5) == pytest.approx((480, 250, 750))


def test_a_few_replicates_without_a_value_are_left_out():
    replicates = np.concatenate([np.arange(991.0), np.full(9, np.nan)])
    assert percentile_interval(1.0, replicates) == pytest.approx((1.0, 24.75, 965.25))


def test_many_replicates_without_a_value_leave_no_interval():
    replicates = np.concatenate([np.arange(989.0), np.full(11, np.nan)])
    mean, low, high = percentile_interval(1.0, replicates)
    assert mean == 1.0
    assert math.isnan(low)
    assert math.isnan(high)


def exact_interval(samples, method):
    """Bootstrap interval of a mean from every possible resample, by the textbook's formulas."""
    means = np.array([np.mean(chosen) for chosen in itertools.product(samples, repeat=6)])
    shares = np.array([0.025, 0.975])
    if method == "BCa":
        mean = samples.mean()
        below = np.mean(means < mean) + np.mean(means == mean) / 2
        bias = scipy.stats.norm.ppf(below)
        left_out = np.array([np.delete(samples, place).mean() for place in range(6)])
        pull = left_out.mean() - left_out
        acceleration = np.sum(pull**3) / (6 * np.sum(pull**2) ** 1.5)
        moved = bias + scipy.stats.norm.ppf(shares)
        shares = scipy.stats.norm.cdf(bias + moved / (1 - acceleration * moved))
    return np.quantile(means, shares)


@pytest.mark.parametrize("method", ["percentile", "BCa"])
def test_a_bootstrap_interval_is_near_that_of_all_resamples(method):
    samples = np.array([0.0, 1.3, 2.17, 3.2, 4.1, 8.7])
    found = bootstrap_interval(
        [samples], np.mean, np.random.default_rng(0), method, resamples=40_000
    )
    assert found.mean == samples.mean()
    # 40,000 resamples miss a share of 0.975 by 0.003 at most (z = 4), in means by less than 0.1.
    assert found[1:] == pytest.approx(exact_interval(samples, method), abs=0.1)


def test_bca_leans_towards_the_long_tail():
    samples = np.random.default_rng(3).exponential(1, 40)
    percentile, corrected = (
        bootstrap_interval([samples], np.mean, np.random.default_rng(0), method)
        for method in ("percentile", "BCa")
    )
    assert corrected.high > percentile.high
    assert corrected.low > percentile.low


def mean_difference(first, second, axis):
    return np.mean(first, axis=axis) - np.mean(second, axis=axis)


def test_a_bootstrap_of_pairs_keeps_partners_together():
    generator = np.random.default_rng(8)
    first = generator.normal(0, 10, 50)
    second = first - 2 + generator.normal(0, 0.1, 50)
    pairs, apart = (
        bootstrap_interval([first, second], mean_difference, generator, paired=paired)
        for paired in (True, False)
    )
    assert pairs[1:] == pytest.approx(difference(first, second, True).estimate[1:], abs=0.01)
    assert apart[1:] == pytest.approx(difference(first, second).estimate[1:], abs=0.7)


def test_a_bootstrap_has_no_interval_of_one_trial_and_no_width_without_spread():
    generator = np.random.default_rng(0)
    single = bootstrap_interval([np.ones(1)], np.mean, generator)
    assert single.mean == 1
    assert math.isnan(single.low)
    assert bootstrap_interval([np.full(9, 87.0)], np.mean, generator) == IntervalEstimate(
        87, 87, 87
    )


@pytest.mark.parametrize("method", ["percentile", "BCa"])
@pytest.mark.parametrize(
    ("trials", "repetitions"), [(50, 300), pytest.param(100, 3000, marks=pytest.mark.slow)]
)
def test_bootstrap_intervals_cover_the_truth(method, trials, repetitions):
    generator = np.random.default_rng(21)
    found = [
        bootstrap_interval(
            [generator.gamma(4, 1, trials)], np.mean, generator, method, resamples=300
        )
        for _ in range(repetitions)
    ]
    # Bootstrap intervals of 50 trials fall short of their confidence by up to 0.015, 300 resamples
    # by another 0.005.
    assert covering(found, 4.0) == pytest.approx(0.95, abs=0.02 + bound(repetitions))
