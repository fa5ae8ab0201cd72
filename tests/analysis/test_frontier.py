"""Frontiers against brute force, and regret against synthetic data whose truth is known."""

import math

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.analysis.frontier import (
    at_matched,
    is_optimal,
    matched_regret,
    optimal_probability,
    pareto,
)

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


@given(POINTS)
def test_optimal_points_are_those_that_no_point_beats(points):
    expected = [not beaten(point, points) for point in points]
    assert is_optimal(np.array(points, np.float64)).tolist() == expected


def test_optimal_points_of_many_sets_are_those_of_each():
    sets = np.random.default_rng(3).integers(0, 4, (5, 6, 7, 2)).astype(np.float64)
    found = is_optimal(sets)
    for place in np.ndindex(5, 6):
        assert (found[place] == is_optimal(sets[place])).all()


def test_the_probability_of_being_optimal_is_that_of_normal_means():
    """Two conditions equal in learning up to noise: each is best with a known probability."""
    generator = np.random.default_rng(4)
    trials, shift = 400, 0.06
    better, worse = (generator.normal(0, 1, (trials, 2)) for _ in range(2))
    worse[:, 0] += better[:, 0].mean() - worse[:, 0].mean() - 1  # clearly less performance
    worse[:, 1] += better[:, 1].mean() - worse[:, 1].mean() + shift  # a little more learning
    samples = {"better": better, "worse": worse, "hopeless": better - 10}
    found = optimal_probability(samples, generator, resamples=20_000)
    spread = math.hypot(better[:, 1].std(), worse[:, 1].std()) / math.sqrt(trials)
    expected = scipy.stats.norm.cdf(shift / spread)  # about 0.8
    assert found["better"] == 1
    assert found["hopeless"] == 0
    # Four standard errors of a share among 20,000, and as much for means not quite normal.
    assert found["worse"] == pytest.approx(expected, abs=0.023)
    together = optimal_probability(
        {"one": better, "other": better - [1, -shift]}, generator, paired=True, resamples=100
    )
    assert together == {"one": 1, "other": 1}


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


def reached_by_hand(points, level, axis):
    """The same from a sorted frontier and NumPy's interpolation."""
    frontier = sorted(points[index].tolist()[:: 1 - 2 * axis] for index in pareto(points))
    if level > frontier[-1][0]:
        return math.nan
    levels, reached = zip(*frontier, strict=True)
    return float(np.interp(level, levels, reached))


@given(st.lists(POINTS, min_size=1, max_size=3), st.sampled_from([0, 1]), st.floats(-5, 5))
def test_many_sets_are_matched_as_each_is(sets, axis, level):
    size = min(map(len, sets))
    tables = np.array([points[:size] for points in sets], np.float64)
    found = at_matched(tables, np.full(len(sets), level), axis)
    expected = [reached_by_hand(table, level, axis) for table in tables]
    assert found == pytest.approx(expected, nan_ok=True)


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
    """Trials whose two measures are correlated, as those of one learner are."""
    covariance = [[4.0, 12.0], [12.0, 1600.0]]
    return generator.multivariate_normal(mean, covariance, trials)


def drawn_all(means, generator):
    return {name: drawn(mean, generator) for name, mean in means.items()}


def exactly(means):
    """Samples without any spread."""
    return {name: np.tile(mean, (3, 1)) for name, mean in means.items()}


def regret(method=METHOD, baseline=BASELINE, best=BEST, axis=0, make=exactly, **others):
    """Regret of one set of conditions against another, in an experiment with a best one."""
    means = {
        "best": best,
        **{f"m/{name}": mean for name, mean in method.items()},
        **{f"b/{name}": mean for name, mean in baseline.items()},
    }
    ours, theirs = ([name for name in means if name.startswith(start)] for start in ("m/", "b/"))
    generator = others.pop("generator", None) or np.random.default_rng(0)
    return matched_regret(make(means), ours, theirs, axis, generator, **others)


def test_regret_of_samples_without_spread_is_the_truth():
    found = regret(resamples=10)
    assert (found.axis, found.baseline_condition) == (0, "b/better")
    assert found.best_condition == "best"
    assert (found.level, found.baseline, found.best) == (55.0, -500.0, -20.0)
    assert found.method == pytest.approx((-300.0,) * 3)
    assert found.reduction == pytest.approx((LEARNING,) * 3)


def test_regret_at_matched_learning_compares_performance():
    found = regret(best=(87.0, -3000.0), axis=1, resamples=10)
    assert (found.axis, found.baseline_condition) == (1, "b/worse")
    assert (found.level, found.baseline, found.best) == (-700.0, 58.0, 87.0)
    assert found.method == pytest.approx((60.0,) * 3)
    assert found.reduction == pytest.approx((PERFORMANCE,) * 3)


# A baseline of eight settings that are all equally good: the sample's best is picked by chance.
TIED = {str(place): (55.0, -500.0) for place in range(8)}


@pytest.mark.parametrize(("baseline", "least"), [(BASELINE, 0.95), (TIED, 0.90)])
@pytest.mark.parametrize("repetitions", [200, pytest.param(2000, marks=pytest.mark.slow)])
def test_regret_intervals_cover_the_truth(baseline, least, repetitions):
    generator = np.random.default_rng(31)
    covered = 0
    for _ in range(repetitions):
        found = regret(
            baseline=baseline,
            make=lambda means: drawn_all(means, generator),
            generator=generator,
            resamples=200,
        )
        covered += found.reduction.low <= LEARNING <= found.reduction.high
    # Three standard errors of a share; intervals of 100 trials and 200 resamples fall short of
    # their confidence by less than another 0.015.
    error = 3 * np.sqrt(least * (1 - least) / repetitions)
    assert least - error - 0.015 < covered / repetitions


def test_intervals_shrink_with_the_number_of_trials():
    widths = []
    for trials in (50, 800):
        generator = np.random.default_rng(4)
        found = regret(
            make=lambda means: {n: drawn(m, generator, trials) for n, m in means.items()},  # noqa: B023
            generator=generator,
            resamples=500,
        )
        widths.append(found.reduction.high - found.reduction.low)
    # Sixteen times the trials, a quarter of the width; spread and width are estimates too.
    assert widths[0] / widths[1] == pytest.approx(4, rel=0.35)


def test_the_best_setting_is_picked_anew_in_every_resample():
    """Two settings that swap places with the trials drawn: either may be the one to match."""
    values = np.random.default_rng(8).normal(0, 40, (100, 1))
    values -= values.mean()
    samples = {
        "method": np.tile((60.0, -300.0), (100, 1)),
        "rising": np.hstack([np.full((100, 1), 55.0), -500 + values]),
        "falling": np.hstack([np.full((100, 1), 55.0), -500.001 - values]),
        "best": np.tile(BEST, (100, 1)),
    }
    found = matched_regret(
        samples, ["method"], ["rising", "falling"], 0, np.random.default_rng(1), paired=True
    )
    fixed = matched_regret(
        samples, ["method"], ["rising"], 0, np.random.default_rng(1), paired=True
    )
    assert found.baseline_condition == fixed.baseline_condition == "rising"
    assert found.reduction.mean == fixed.reduction.mean
    # Picked anew, the baseline gains whichever way the trials fall: the 2.5% quantile is not that
    # of a normal deviate, -1.96, but that of minus its size, -2.24. From 2,000 resamples, to 5%.
    reach, usual = (e.reduction.high - e.reduction.mean for e in (found, fixed))
    assert reach / usual == pytest.approx(2.24 / 1.96, rel=0.05)


def test_paired_trials_leave_less_doubt():
    generator = np.random.default_rng(12)
    common = generator.multivariate_normal((0, 0), [[4.0, 12.0], [12.0, 1600.0]], 100)
    paired, apart = (
        regret(
            make=lambda means: {n: m + common for n, m in means.items()},
            paired=pairs,
            resamples=500,
        )
        for pairs in (True, False)
    )
    # Everything moves together: the reduction does not move at all.
    assert paired.reduction == pytest.approx((LEARNING,) * 3)
    assert apart.reduction.high - apart.reduction.low > 0.02


def test_a_level_that_resamples_often_miss_has_no_interval():
    found = regret(
        baseline={"edge": (60.0, -500.0)},
        make=lambda means: drawn_all(means, np.random.default_rng(6)),
        resamples=300,
    )
    assert math.isnan(found.method.low)
    assert math.isnan(found.reduction.high)


def test_a_baseline_that_is_best_leaves_no_regret_to_reduce():
    found = regret(best=(55.0, -500.0), baseline={"only": (55.0, -100.0)}, resamples=10)
    assert found.best_condition == "b/only"
    assert found.method.mean == pytest.approx(-300.0)
    assert math.isnan(found.reduction.mean)


def test_equal_generators_give_equal_intervals():
    first, again, other = (
        regret(
            make=lambda means: drawn_all(means, np.random.default_rng(9)),
            generator=np.random.default_rng(seed),
            resamples=100,
        )
        for seed in (1, 1, 2)
    )
    assert first == again
    assert first.reduction.mean == other.reduction.mean
    assert first.reduction.low != other.reduction.low
