"""Scores over cases are those of rliable, and their intervals hold what they should."""

import numpy as np
import pytest

from qbumpers.comparison.aggregates import aggregate, improvement, iqm, median, resampled_runs


@pytest.fixture
def scores():
    generator = np.random.default_rng(3)
    return generator.random((5, 7)), generator.random((5, 7)) + 0.1


def test_interquartile_mean_and_median_are_those_of_rliable(scores):
    metrics = pytest.importorskip("rliable.metrics")
    for each in scores:
        assert float(iqm(each)) == pytest.approx(metrics.aggregate_iqm(each))
        assert float(median(each)) == pytest.approx(metrics.aggregate_median(each))


def test_the_probability_of_improvement_is_that_of_rliable(scores):
    metrics = pytest.importorskip("rliable.metrics")
    first, second = (each.round(1) for each in scores)  # with ties
    assert float(improvement(first, second)) == pytest.approx(
        metrics.probability_of_improvement(first, second)
    )


def test_intervals_are_percentiles_of_runs_drawn_case_by_case(scores):
    """As rliable's StratifiedBootstrap does, written as a plain loop."""
    generator, replicates = np.random.default_rng(5), []
    for _ in range(4000):
        drawn = [generator.choice(case, len(case)) for case in scores[0].T]
        middle = np.sort(np.concatenate(drawn))[8:-8]  # a quarter of 35 at each end
        replicates.append(middle.mean())
    found = aggregate(iqm, (scores[0],), np.random.default_rng(0))
    assert (found.low, found.high) == pytest.approx(
        tuple(np.quantile(replicates, [0.025, 0.975])), abs=0.01
    )


def test_runs_are_drawn_within_their_case():
    scores = np.arange(6.0).reshape(2, 3)
    drawn = resampled_runs(scores, 100, np.random.default_rng(0))
    assert drawn.shape == (100, 2, 3)
    for case in range(3):
        assert set(drawn[:, :, case].ravel()) == set(scores[:, case])


def test_a_single_run_has_no_interval():
    found = aggregate(iqm, (np.array([[0.2, 0.4]]),), np.random.default_rng(0))
    assert found.mean == pytest.approx(0.3)
    assert np.isnan(found.low)
