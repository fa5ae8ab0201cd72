"""Resampled conditions against simulation, and intervals of the best of several means."""

import math

import numpy as np
import pytest

from qbumpers.analysis import resampling
from qbumpers.analysis.resampling import (
    MANY,
    function_interval,
    interquartile_interval,
    resampled_means,
    stratified_interval,
)
from qbumpers.analysis.statistics import interquartile_mean, mean_interval
from qbumpers.errors import RequestError


def test_resampled_means_spread_as_the_sample_says_and_keep_measures_together():
    generator = np.random.default_rng(5)
    first = generator.normal(size=60)
    samples = np.stack([first, 3 * first + 2, generator.exponential(size=60)], axis=1)
    resamples = 20_000
    means = resampled_means([samples], generator, resamples=resamples)[:, 0]
    assert means.shape == (resamples, 3)
    errors = samples.std(axis=0) / np.sqrt(60)  # of a resampled mean, exactly
    centre = np.abs(means.mean(axis=0) - samples.mean(axis=0))
    assert (centre < 4 * errors / np.sqrt(resamples)).all()  # z = 4
    # A standard deviation from B near-normal draws has a relative error of 1 / sqrt(2 B); z = 4.
    assert means.std(axis=0) == pytest.approx(errors, rel=4 / np.sqrt(2 * resamples))
    assert means[:, 1] == pytest.approx(3 * means[:, 0] + 2)
    assert abs(np.corrcoef(means[:, 0], means[:, 2])[0, 1]) < 0.5


def test_means_of_many_trials_spread_as_the_sample_says_and_keep_what_belongs_together():
    generator, trials, resamples = np.random.default_rng(5), 2 * MANY + 1, 4000
    first = generator.exponential(size=trials)
    samples = [np.stack([first, 3 * first + 2], axis=1), np.stack([first, first**2], axis=1)]
    means = resampled_means(samples, generator, True, resamples)
    assert np.array_equal(means[:, 0, 0], means[:, 1, 0])
    assert means[:, 0, 1] == pytest.approx(3 * means[:, 0, 0] + 2)
    columns = means.transpose(1, 2, 0).reshape(4, -1), np.hstack(samples).T
    for found, values in zip(*columns, strict=True):
        error = values.std() / np.sqrt(trials)
        assert abs(found.mean() - values.mean()) < 4 * error / np.sqrt(resamples)  # z = 4
        # 2,000 groups and 4,000 resamples: relative errors of 1 / sqrt(4,000) and 1 / sqrt(8,000).
        assert found.std() == pytest.approx(error, rel=4 * np.sqrt(1 / 4000 + 1 / 8000))


@pytest.mark.parametrize("paired", [False, True])
def test_the_interquartile_mean_of_many_trials_has_the_interval_of_single_trials(paired):
    generator, trials = np.random.default_rng(7), MANY + 500
    first = generator.exponential(size=trials)
    strata = [first, 2 - first + generator.normal(size=trials)]
    found = interquartile_interval(strata, np.random.default_rng(1), paired)
    expected = stratified_interval(strata, interquartile_mean, np.random.default_rng(2), paired)
    assert found.mean == expected.mean
    width = expected.high - expected.low
    # Each end of an interval from 2,000 resamples errs by 1.2% of the width, that of 2,000 groups
    # by 1.6%; both intervals: z = 4.
    assert found.low == pytest.approx(expected.low, abs=0.1 * width)
    assert found.high == pytest.approx(expected.high, abs=0.1 * width)


def test_a_resampled_mean_is_a_mean_of_that_many_samples():
    samples = np.array([[0.0], [1.0], [1.0]])
    means = resampled_means([samples], np.random.default_rng(1), resamples=500)
    assert set(np.round(3 * means.ravel(), 9)) == {0.0, 1.0, 2.0, 3.0}


def test_conditions_are_resampled_apart_unless_they_are_paired():
    samples = np.random.default_rng(0).normal(size=(40, 1))
    apart, paired = (
        resampled_means([samples, 5 - samples], np.random.default_rng(2), pairs, 2000)[..., 0]
        for pairs in (False, True)
    )
    assert paired[:, 1] == pytest.approx(5 - paired[:, 0])
    # A correlation of 2,000 unrelated pairs has a standard error of 0.022; z = 4.
    assert abs(np.corrcoef(apart.T)[0, 1]) < 0.09


def test_conditions_of_unequal_size_are_each_resampled_at_their_own():
    first, second = np.array([[0.0], [1.0]]), np.array([[0.0], [1.0], [0.0], [1.0], [1.0]])
    means = resampled_means([first, second], np.random.default_rng(3), resamples=400)[..., 0]
    assert set(np.round(2 * means[:, 0], 9)) == {0, 1, 2}
    assert set(np.round(5 * means[:, 1], 9)) == {0, 1, 2, 3, 4, 5}


@pytest.mark.parametrize(
    "resample",
    [
        lambda samples, generator: resampled_means(samples, generator, True),
        lambda samples, generator: stratified_interval(
            [values[:, 0] for values in samples], interquartile_mean, generator, True
        ),
    ],
    ids=["means", "stratified"],
)
def test_pairs_need_as_many_trials_in_every_condition(resample):
    with pytest.raises(RequestError, match="paired = True: conditions have 3, 4 trials"):
        resample([np.zeros((4, 2)), np.zeros((3, 2))], np.random.default_rng(0))


def test_resamples_come_from_the_given_generator_alone():
    samples = [np.random.default_rng(0).normal(size=(20, 2))]
    first, again, other = (
        resampled_means(samples, np.random.default_rng(seed), resamples=50) for seed in (8, 8, 9)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_drawing_in_blocks_draws_the_same_resamples(monkeypatch):
    samples = [np.random.default_rng(0).normal(size=(20, 2)), np.zeros((20, 2))]
    whole = resampled_means(samples, np.random.default_rng(4), True, 37)
    monkeypatch.setattr(resampling, "_BLOCK", 20 * 8)
    blocks = resampled_means(samples, np.random.default_rng(4), True, 37)
    assert blocks == pytest.approx(whole)


def test_a_linear_function_of_means_has_its_bootstrap_interval():
    samples = np.random.default_rng(6).normal(3, 2, (400, 1))
    means = samples.mean(axis=0)[np.newaxis]
    resampled = resampled_means([samples], np.random.default_rng(7), resamples=8000)
    found = function_interval(lambda points: 2 * points[..., 0, 0] + 1, means, resampled)
    expected = 2 * np.array(mean_interval(samples[:, 0])) + 1
    assert found.mean == pytest.approx(expected[0])
    # Ends of an interval from 8,000 resamples err by 0.03 of a standard error (0.2); z = 4.
    assert found == pytest.approx(expected, abs=0.03)


def largest(points):
    return points[..., 0].max(axis=-1)


def best_of(truth, generator, trials=60, resamples=300):
    """Interval of the largest of several true means, from a sample of each."""
    samples = [generator.normal(mean, np.sqrt(trials), (trials, 1)) for mean in truth]
    means = np.array([values.mean(axis=0) for values in samples])
    resampled = resampled_means(samples, generator, resamples=resamples)
    return function_interval(largest, means, resampled)


@pytest.mark.parametrize(
    ("truth", "least"),
    [
        ([0.0], 0.94),
        ([0.0, 8.0], 0.94),
        ([0.0, 0.7, 1.5], 0.94),
        (np.append(np.zeros(12), 2.0), 0.94),
        (np.zeros(3), 0.93),
        (np.zeros(13), 0.88),  # percentile intervals hold it almost never
    ],
)
@pytest.mark.parametrize("repetitions", [200, pytest.param(3000, marks=pytest.mark.slow)])
def test_intervals_of_the_best_mean_cover_the_truth_where_chance_picks_it(
    truth, least, repetitions
):
    """Means lie apart as written in standard errors: clearly, hardly, or not at all."""
    generator = np.random.default_rng(15)
    found = [best_of(truth, generator) for _ in range(repetitions)]
    covered = np.mean([estimate.low <= max(truth) <= estimate.high for estimate in found])
    # Three standard errors of a share; 60 trials and 300 resamples cost up to 0.01.
    assert least - 0.01 - 3 * np.sqrt(least * (1 - least) / repetitions) < covered
    assert all(estimate.low <= estimate.mean <= estimate.high for estimate in found)


def test_a_function_that_often_has_no_value_has_no_interval():
    means = np.zeros((1, 1))
    resampled = np.linspace(-1, 1, 200).reshape(200, 1, 1)
    unknown = function_interval(
        lambda points: np.where(points[..., 0, 0] > 0.9, np.nan, points[..., 0, 0]),
        means,
        resampled,
    )
    assert unknown.mean == 0
    assert math.isnan(unknown.low)
    assert math.isnan(unknown.high)


def test_a_function_without_a_value_far_from_the_means_keeps_the_near_interval():
    resampled = np.linspace(-1, 1, 2001).reshape(2001, 1, 1)
    found = function_interval(
        lambda points: np.where(np.abs(points[..., 0, 0]) > 1, np.nan, points[..., 0, 0]),
        np.zeros((1, 1)),
        resampled,
    )
    assert found == pytest.approx((0, -0.95, 0.95))


def test_a_stratified_interval_of_a_pooled_mean_is_as_wide_as_strata_vary_within():
    generator = np.random.default_rng(16)
    strata = [generator.normal(mean, 1, 200) for mean in (0, 100, 1000)]
    found = stratified_interval(strata, lambda x: x.mean(axis=-1), generator, resamples=4000)
    assert found.mean == pytest.approx(np.mean(strata))
    # The standard error of the mean of 600 trials with variance 1 is 0.041; between strata the
    # variance is 200,000, and would make it 18. Ends from 4,000 resamples err by 4%; z = 4.
    error = np.sqrt(np.sum([np.var(values) for values in strata]) / 200) / 3
    assert (found.high - found.low) / (2 * 1.96 * error) == pytest.approx(1, abs=0.12)


def test_pairs_of_a_stratified_bootstrap_are_drawn_together():
    values = np.random.default_rng(17).normal(0, 1, 50)
    generator = np.random.default_rng(18)
    mirrored = [values, -values]
    paired, apart = (
        stratified_interval(mirrored, lambda x: x.mean(axis=-1), generator, pairs)
        for pairs in (True, False)
    )
    assert paired == pytest.approx((0, 0, 0), abs=1e-12)
    assert apart.high - apart.low > 0.2


def test_a_stratified_interval_of_single_trials_is_unknown():
    found = stratified_interval([np.ones(1), np.zeros(1)], np.mean, np.random.default_rng(0))
    assert found.mean == 0.5
    assert math.isnan(found.low)


@pytest.mark.parametrize("repetitions", [200, pytest.param(3000, marks=pytest.mark.slow)])
def test_stratified_intervals_of_the_interquartile_mean_cover_the_truth(repetitions):
    generator = np.random.default_rng(19)
    means = (0.0, 1.0, 5.0)
    large = np.concatenate([generator.exponential(1, 1_000_000) + mean for mean in means])
    truth = float(interquartile_mean(large))  # to 0.001
    found = [
        stratified_interval(
            [generator.exponential(1, 60) + mean for mean in means],
            interquartile_mean,
            generator,
            resamples=400,
        )
        for _ in range(repetitions)
    ]
    covered = np.mean([estimate.low <= truth <= estimate.high for estimate in found])
    # Percentile intervals of a few dozen trials miss their confidence by up to 0.02.
    assert covered == pytest.approx(0.95, abs=0.02 + 4 * np.sqrt(0.95 * 0.05 / repetitions))


@pytest.mark.parametrize("paired", [False, True])
def test_single_trials_have_no_resamples_and_what_they_enter_into_no_interval(paired):
    generator = np.random.default_rng(0)
    samples = [np.array([[1.0, 2.0]]), np.array([[3.0, 1.0]])]
    resampled = resampled_means(samples, generator, paired)
    assert np.isnan(resampled).all()
    means = np.array([values.mean(axis=0) for values in samples])
    found = function_interval(lambda points: points[..., 0].max(axis=-1), means, resampled)
    assert found.mean == 3.0
    assert np.isnan([found.low, found.high]).all()


def test_one_single_trial_leaves_the_resamples_of_others():
    generator = np.random.default_rng(0)
    resampled = resampled_means([np.ones((1, 1)), np.arange(4.0)[:, None]], generator)
    assert np.isnan(resampled[:, 0]).all()
    assert np.isfinite(resampled[:, 1]).all()
