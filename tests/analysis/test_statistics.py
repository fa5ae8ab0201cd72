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
    bootstrap_interval,
    difference,
    holm,
    interquartile_mean,
    mean_interval,
    percentile_interval,
    probability_of_improvement,
    standard_error,
)
from qbumpers.errors import RequestError

SAMPLES = arrays(np.float64, st.integers(2, 30), elements=st.floats(-1e4, 1e4, width=32))
SCORES = arrays(np.float64, st.integers(2, 20), elements=st.integers(-5, 5))  # many ties


def covering(estimates, truth):
    """Share of the intervals that hold the truth."""
    return np.mean([estimate.low <= truth <= estimate.high for estimate in estimates])


def bound(repetitions, share=0.95):
    """Four standard errors of a share among that many."""
    return 4 * np.sqrt(share * (1 - share) / repetitions)


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
    assert found.p_value == pytest.approx(expected.pvalue, rel=1e-6)


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
