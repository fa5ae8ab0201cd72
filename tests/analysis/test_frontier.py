"""Frontiers against brute force, and regret against synthetic data whose truth is known."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.analysis.frontier import at_matched, matched_regret, pareto

POINTS = st.lists(st.tuples(st.integers(-4, 4), st.integers(-4, 4)), min_size=1, max_size=12)
# On the frontier (0, 10), (5, 8), (10, 0); below it (3, 1) and (5, 7).
SETTINGS = np.array([[5.0, 8.0], [3.0, 1.0], [10.0, 0.0], [0.0, 10.0], [5.0, 7.0]])


def beaten(point, others):
    return any(o != point and o[0] >= point[0] and o[1] >= point[1] for o in others)


@given(POINTS)
def test_the_frontier_is_what_no_point_beats(points):
    indices = pareto(np.array(points, np.float64))
    found = [points[index] for index in indices]
    assert set(found) == {point for point in points if not beaten(point, points)}
    assert len(set(found)) == len(found)
    assert found == sorted(found)


@pytest.mark.parametrize(
    ("axis", "level", "reached"),
    [
        (0, 5.0, 8.0),
        (0, 2.5, 9.0),
        (0, 7.5, 4.0),
        (0, 10.0, 0.0),
        (0, 0.0, 10.0),
        (0, -3.0, 10.0),
        (1, 8.0, 5.0),
        (1, 9.0, 2.5),
        (1, 4.0, 7.5),
        (1, 10.0, 0.0),
        (1, -3.0, 10.0),
    ],
)
def test_a_level_is_matched_on_the_line_between_neighbours(axis, level, reached):
    assert at_matched(SETTINGS, level, axis) == pytest.approx(reached)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_level_above_every_setting_is_out_of_reach(axis):
    assert math.isnan(at_matched(SETTINGS, 10.001, axis))


def test_a_single_setting_serves_up_to_its_own_level():
    only = np.array([[3.0, -7.0]])
    assert at_matched(only, 2.0, 0) == at_matched(only, 3.0, 0) == -7.0
    assert math.isnan(at_matched(only, 3.1, 0))


@given(POINTS, st.sampled_from([0, 1]))
def test_matching_a_setting_of_the_frontier_reaches_that_setting(points, axis):
    table = np.array(points, np.float64)
    for index in pareto(table):
        assert at_matched(table, table[index, axis], axis) == table[index, 1 - axis]


@given(POINTS, st.sampled_from([0, 1]), st.floats(-5, 4), st.floats(0, 3))
def test_asking_for_more_of_one_never_gives_more_of_the_other(points, axis, level, more):
    table = np.array(points, np.float64)
    less = at_matched(table, level + more, axis)
    assert math.isnan(less) or less <= at_matched(table, level, axis) + 1e-12


# Means by construction. At the baseline's better setting, (55, -500), the method stands half-way
# between its own two, at -300: a regret of 280 against 480 from the best, -20.
METHOD = {"a": (50.0, -200.0), "b": (60.0, -400.0), "worse": (45.0, -450.0)}
BASELINE = {"worse": (58.0, -700.0), "better": (55.0, -500.0)}
BEST = (-300.0, -20.0)
LEARNING = 1 - 280 / 480
# Matched in learning at the baseline's best performance, (58, -700), the method is at its own
# highest, 60: a regret of 27 against 29 from the best performance, 87.
PERFORMANCE = 1 - 27 / 29


def drawn(mean, generator, trials=100):
    """Trials whose two measures are correlated, as those of one person are."""
    covariance = [[4.0, 12.0], [12.0, 1600.0]]
    return generator.multivariate_normal(mean, covariance, trials)


def drawn_all(means, generator):
    return {name: drawn(mean, generator) for name, mean in means.items()}


def exactly(means):
    """Samples without any spread."""
    return {name: np.tile(mean, (3, 1)) for name, mean in means.items()}


def test_regret_of_samples_without_spread_is_the_truth():
    generator = np.random.default_rng(0)
    found = matched_regret(
        exactly(METHOD), exactly(BASELINE), np.tile(BEST, (3, 1)), 0, generator, 10
    )
    assert (found.axis, found.baseline_condition) == (0, "better")
    assert (found.level, found.baseline, found.best) == (55.0, -500.0, -20.0)
    assert found.method == pytest.approx((-300.0,) * 3)
    assert found.reduction == pytest.approx((LEARNING,) * 3)


def test_regret_at_matched_learning_compares_performance():
    generator = np.random.default_rng(0)
    best = np.tile((87.0, -3000.0), (3, 1))
    found = matched_regret(exactly(METHOD), exactly(BASELINE), best, 1, generator, 10)
    assert (found.axis, found.baseline_condition) == (1, "worse")
    assert (found.level, found.baseline, found.best) == (-700.0, 58.0, 87.0)
    assert found.method == pytest.approx((60.0,) * 3)
    assert found.reduction == pytest.approx((PERFORMANCE,) * 3)


def test_regret_intervals_cover_the_truth():
    generator = np.random.default_rng(31)
    repetitions, covered = 200, 0
    for _ in range(repetitions):
        found = matched_regret(
            drawn_all(METHOD, generator),
            drawn_all(BASELINE, generator),
            drawn(BEST, generator),
            0,
            generator,
            resamples=200,
        )
        assert found.baseline_condition == "better"
        covered += found.reduction.low <= LEARNING <= found.reduction.high
    # Three standard errors of a share of 0.95 among 200: 3 * 0.0154; percentile intervals of 100
    # trials and 200 resamples fall short of their confidence by less than another 0.015.
    assert 0.95 - 3 * 0.0154 - 0.015 < covered / repetitions < 0.95 + 3 * 0.0154


def test_intervals_shrink_with_the_number_of_trials():
    widths = []
    for trials in (50, 800):
        generator = np.random.default_rng(4)
        found = matched_regret(
            {name: drawn(mean, generator, trials) for name, mean in METHOD.items()},
            {name: drawn(mean, generator, trials) for name, mean in BASELINE.items()},
            drawn(BEST, generator, trials),
            0,
            generator,
            500,
        )
        widths.append(found.reduction.high - found.reduction.low)
    # Sixteen times the trials, a quarter of the width; spread and width are estimates too.
    assert widths[0] / widths[1] == pytest.approx(4, rel=0.3)


def test_a_level_that_resamples_often_miss_has_no_interval():
    generator = np.random.default_rng(6)
    edge = {"edge": drawn((60.0, -500.0), generator)}
    found = matched_regret(
        drawn_all(METHOD, generator), edge, drawn(BEST, generator), 0, generator, 300
    )
    assert math.isnan(found.method.low)
    assert math.isnan(found.reduction.high)


def test_a_baseline_that_is_best_leaves_no_regret_to_reduce():
    generator = np.random.default_rng(0)
    found = matched_regret(
        exactly(METHOD), exactly(BASELINE), np.tile((55.0, -500.0), (3, 1)), 0, generator, 10
    )
    assert found.method.mean == pytest.approx(-300.0)
    assert math.isnan(found.reduction.mean)


def test_equal_generators_give_equal_intervals():
    data = np.random.default_rng(9)
    arguments = drawn_all(METHOD, data), drawn_all(BASELINE, data), drawn(BEST, data), 0
    first, again, other = (
        matched_regret(*arguments, np.random.default_rng(seed), 100) for seed in (1, 1, 2)
    )
    assert first == again
    assert first.reduction.mean == other.reduction.mean
    assert first.reduction.low != other.reduction.low
