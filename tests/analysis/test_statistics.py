"""Intervals against SciPy, against simulation, and against closed forms."""

import math

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from qbumpers.analysis.statistics import (
    Estimate,
    bootstrap_means,
    mean_interval,
    percentile_interval,
    standard_error,
)


@given(
    arrays(np.float64, st.integers(2, 40), elements=st.floats(-1e6, 1e6, width=32)),
    st.floats(0.5, 0.999),
)
def test_an_interval_is_scipys_students_t_interval(samples, confidence):
    error = scipy.stats.sem(samples)
    found = mean_interval(samples, confidence)
    assert found.mean == pytest.approx(samples.mean())
    assert standard_error(samples) == pytest.approx(error)
    if error > 0:
        low, high = scipy.stats.t.interval(
            confidence, len(samples) - 1, loc=samples.mean(), scale=error
        )
        assert (found.low, found.high) == pytest.approx((low, high), rel=1e-9, abs=1e-9 * error)


def test_an_interval_is_for_95_per_cent_unless_told_otherwise():
    # Two samples, one degree of freedom: t = 12.7062, standard error 1.
    assert mean_interval(np.array([1.0, 3.0])) == pytest.approx((2.0, 2 - 12.7062, 2 + 12.7062))


def test_equal_samples_have_an_interval_without_width():
    assert mean_interval(np.full(7, 87.0)) == Estimate(87.0, 87.0, 87.0)


def test_a_single_sample_has_a_mean_and_no_interval():
    mean, low, high = mean_interval(np.array([3.5]))
    assert mean == 3.5
    assert math.isnan(low)
    assert math.isnan(high)
    assert math.isnan(standard_error(np.array([3.5])))


def test_intervals_cover_the_truth_as_often_as_they_say():
    generator = np.random.default_rng(20190801)
    repetitions, truth = 4000, -3.0
    draws = generator.normal(truth, 5.0, (repetitions, 10))
    covered = sum(low <= truth <= high for _, low, high in map(mean_interval, draws))
    # Four standard errors of a share of 0.95 among 4,000: 4 * 0.0034.
    assert covered / repetitions == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / 4000))


def test_resampled_means_spread_as_the_sample_says_and_keep_measures_together():
    generator = np.random.default_rng(5)
    first = generator.normal(size=60)
    samples = np.stack([first, 3 * first + 2, generator.exponential(size=60)], axis=1)
    resamples = 20_000
    means = bootstrap_means(samples, resamples, generator)
    assert means.shape == (resamples, 3)
    errors = samples.std(axis=0) / np.sqrt(60)  # of a resampled mean, exactly
    centre = np.abs(means.mean(axis=0) - samples.mean(axis=0))
    assert (centre < 4 * errors / np.sqrt(resamples)).all()  # z = 4
    # A standard deviation from B near-normal draws has a relative error of 1 / sqrt(2 B); z = 4.
    assert means.std(axis=0) == pytest.approx(errors, rel=4 / np.sqrt(2 * resamples))
    assert means[:, 1] == pytest.approx(3 * means[:, 0] + 2)
    assert abs(np.corrcoef(means[:, 0], means[:, 2])[0, 1]) < 0.5


def test_a_resampled_mean_is_a_mean_of_that_many_samples():
    means = bootstrap_means(np.array([[0.0], [1.0], [1.0]]), 500, np.random.default_rng(1))
    assert set(np.round(3 * means[:, 0], 9)) == {0.0, 1.0, 2.0, 3.0}


def test_resamples_come_from_the_given_generator_alone():
    samples = np.random.default_rng(0).normal(size=(20, 2))
    first, again, other = (
        bootstrap_means(samples, 50, np.random.default_rng(seed)) for seed in (8, 8, 9)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


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
