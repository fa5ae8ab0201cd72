"""Intervals against SciPy, against simulation, and against closed forms."""

import itertools
import math

import numpy as np
import pytest
import scipy.stats
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from qbumpers.analysis.statistics import (
    Difference,
    IntervalEstimate,
    bonferroni,
    difference,
    holm,
    interquartile_mean,
    mean_interval,
    probability_of_improvement,
    standard_error,
)
from qbumpers.errors import RequestError
from tests.analysis.coverage import bound, covering

SAMPLES = arrays(np.float64, st.integers(2, 30), elements=st.floats(-1e4, 1e4, width=32))


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
    assert mean_interval(np.full(7, 87.0)) == IntervalEstimate(87.0, 87.0, 87.0)


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
    assert covering(map(mean_interval, draws), truth) == pytest.approx(0.95, abs=bound(repetitions))


@given(SAMPLES, SAMPLES, st.floats(0.5, 0.999))
def test_a_difference_is_that_of_welchs_test(first, second, confidence):
    assume_spread(first, second)
    found = difference(first, second, confidence=confidence)
    with np.errstate(all="ignore"):
        expected = scipy.stats.ttest_ind(first, second, equal_var=False)
    interval = expected.confidence_interval(confidence)
    scale = (found.estimate.high - found.estimate.low) / 2
    assert found.estimate.mean == pytest.approx(first.mean() - second.mean(), abs=1e-9)
    assert found.estimate[1:] == pytest.approx((interval.low, interval.high), abs=1e-6 * scale)
    _, p_value = expected
    assert found.p_value == pytest.approx(p_value, rel=1e-6)


@given(st.data(), st.floats(0.5, 0.999))
def test_a_difference_of_pairs_is_that_of_the_paired_t_test(data, confidence):
    first = data.draw(SAMPLES)
    second = data.draw(arrays(np.float64, len(first), elements=st.floats(-1e4, 1e4, width=32)))
    assume_spread(first - second)
    found = difference(first, second, paired=True, confidence=confidence)
    expected = scipy.stats.ttest_rel(first, second)
    interval = expected.confidence_interval(confidence)
    scale = (found.estimate.high - found.estimate.low) / 2
    assert found.estimate[1:] == pytest.approx((interval.low, interval.high), abs=1e-6 * scale)
    assert found.p_value == pytest.approx(expected.pvalue, rel=1e-6)


def assume_spread(*samples):
    """SciPy warns of samples that hardly vary, and has no test of those that do not."""
    for values in samples:
        assume(np.std(values) > 1e-6 * (1 + np.abs(values).max()))


def test_a_condition_that_never_varies_is_compared_by_the_spread_of_the_other():
    varied = np.array([1.0, 3.0, 4.0, 8.0])
    found = difference(varied, np.full(6, 87.0))
    assert found.estimate == pytest.approx(np.array(mean_interval(varied)) - 87)


def test_conditions_that_never_vary_differ_surely_or_not_at_all():
    same, other = np.full(3, 87.0), np.full(5, 85.0)
    assert difference(same, other) == Difference(IntervalEstimate(2.0, 2.0, 2.0), 0.0)
    assert difference(same, np.full(3, 85.0), paired=True).p_value == 0
    assert difference(same, same) == Difference(IntervalEstimate(0.0, 0.0, 0.0), 1.0)


@pytest.mark.parametrize("paired", [False, True])
def test_a_difference_of_single_trials_has_no_interval(paired):
    found = difference(np.array([3.0]), np.array([1.0]), paired)
    assert found.estimate.mean == 2
    assert all(map(math.isnan, (*found.estimate[1:], found.p_value)))


@pytest.mark.parametrize("compare", [difference, probability_of_improvement])
def test_pairs_need_as_many_trials_of_both(compare):
    with pytest.raises(RequestError, match="paired = True: 3 and 4 trials"):
        compare(np.zeros(3), np.zeros(4), paired=True)


def test_intervals_of_differences_cover_the_truth_with_unequal_variances_or_pairs():
    generator = np.random.default_rng(11)
    repetitions = 3000
    first = generator.normal(3, 1, (repetitions, 10))
    second = generator.normal(1, 6, (repetitions, 25))
    partner = first + generator.normal(1, 0.3, first.shape)
    apart = [difference(*pair).estimate for pair in zip(first, second, strict=True)]
    pairs = [difference(*pair, paired=True).estimate for pair in zip(partner, first, strict=True)]
    assert covering(apart, 2.0) == pytest.approx(0.95, abs=bound(repetitions))
    assert covering(pairs, 1.0) == pytest.approx(0.95, abs=bound(repetitions))


@given(arrays(np.float64, st.integers(1, 7), elements=st.floats(0, 1)))
def test_adjusted_p_values_are_holms(p_values):
    # Holm's procedure is the closed test with Bonferroni's: a hypothesis falls at a level if
    # every set of hypotheses that it belongs to does.
    numbers = range(len(p_values))
    sets = [s for size in numbers for s in itertools.combinations(numbers, size + 1)]
    expected = [
        max(min(1.0, len(s) * p_values[list(s)].min()) for s in sets if number in s)
        for number in numbers
    ]
    assert holm(p_values) == pytest.approx(expected, abs=1e-12)


def test_simultaneous_intervals_all_hold_with_unequal_variances():
    generator = np.random.default_rng(12)
    repetitions, comparisons = 1500, 8
    spreads = np.geomspace(0.1, 30, comparisons)
    held = 0
    for _ in range(repetitions):
        control = generator.normal(0, 1, 20)
        found = [
            difference(generator.normal(0, s, 20), control, False, bonferroni(comparisons))
            for s in spreads
        ]
        held += all(one.estimate.low <= 0 <= one.estimate.high for one in found)
    # At least 0.95, and not wastefully more: tests against one control are hardly dependent here.
    assert 0.95 - bound(repetitions) < held / repetitions < 0.99


def test_simultaneous_intervals_are_hardly_wider_than_dunnetts():
    generator = np.random.default_rng(13)
    control, *others = generator.normal(0, 1, (5, 60))
    dunnett = scipy.stats.dunnett(*others, control=control, rng=generator)
    theirs = dunnett.confidence_interval(0.95)
    for place, values in enumerate(others):
        found = difference(values, control, False, bonferroni(len(others))).estimate
        width = theirs.high[place] - theirs.low[place]
        # Bonferroni is wider by 2%; Welch's standard error differs from the pooled one by chance.
        assert found.high - found.low == pytest.approx(width, rel=0.2)
    assert bonferroni(1) == 0.95
    assert bonferroni(25) == pytest.approx(0.998)


@given(arrays(np.float64, st.integers(1, 60), elements=st.floats(-1e3, 1e3)))
def test_an_interquartile_mean_is_that_of_the_middle_half(samples):
    metrics = pytest.importorskip("rliable.metrics")
    cut = len(samples) // 4
    expected = np.sort(samples)[cut : len(samples) - cut].mean()
    assert interquartile_mean(samples) == pytest.approx(expected, abs=1e-9)
    assert interquartile_mean(samples) == pytest.approx(
        metrics.aggregate_iqm(samples[:, np.newaxis]), abs=1e-9
    )
