"""Hypervolumes against counted squares, and their comparison against what is known of samples."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.analysis.hypervolume import compare_hypervolumes, hypervolume, worst

POINTS = st.lists(st.tuples(st.integers(-3, 6), st.integers(-3, 6)), min_size=1, max_size=8)


def squares(points, reference):
    """Unit squares above the reference that some point dominates."""
    return sum(
        any(x < a and y < b for a, b in points)
        for x in range(reference[0], 7)
        for y in range(reference[1], 7)
    )


@given(POINTS, st.tuples(st.integers(-4, 3), st.integers(-4, 3)))
def test_a_hypervolume_is_the_number_of_squares_that_points_dominate(points, reference):
    found = hypervolume(np.array(points, np.float64), np.array(reference, np.float64))
    assert found == squares(points, reference)


@given(POINTS, POINTS)
def test_further_points_never_cover_less(points, others):
    reference = np.zeros(2)
    table = np.array(points + others, np.float64)
    part, other = (
        hypervolume(table[: len(points)], reference),
        hypervolume(table[len(points) :], reference),
    )
    whole = hypervolume(table, reference)
    assert max(part, other) <= whole <= part + other


def test_hypervolumes_of_many_sets_are_those_of_each():
    sets = np.random.default_rng(3).normal(size=(5, 6, 7, 2))
    found = hypervolume(sets, np.array([-0.5, -1.0]))
    assert found.shape == (5, 6)
    for place in np.ndindex(5, 6):
        assert found[place] == pytest.approx(hypervolume(sets[place], np.array([-0.5, -1.0])))


MEANS = {
    "a/1": (10.0, 1.0),
    "a/2": (6.0, 6.0),
    "b/1": (5.0, 5.0),
    "b/2": (4.0, 9.0),
    "worst": (0.0, 0.0),
}
METHODS = {"a": ["a/1", "a/2"], "b": ["b/1", "b/2"], "worst": ["worst"]}
COVERED = {"a": 40.0, "b": 41.0, "worst": 0.0}


def drawn(generator, trials=100):
    return {name: generator.normal(mean, 1.5, (trials, 2)) for name, mean in MEANS.items()}


def exactly():
    return {name: np.tile(mean, (4, 1)) for name, mean in MEANS.items()}


def test_methods_without_spread_are_compared_exactly():
    found = compare_hypervolumes(exactly(), METHODS, np.random.default_rng(0), resamples=20)
    assert found.reference.tolist() == [0, 0] == worst(exactly()).tolist()
    for method, covered in COVERED.items():
        assert found.methods[method] == (covered,) * 3
    assert found.largest == {"a": 0, "b": 1, "worst": 0}
    assert set(found.advantages) == {("b", "a"), ("worst", "a"), ("worst", "b")}
    assert found.advantages["b", "a"].estimate == (1, 1, 1)
    assert found.advantages["b", "a"].probability == 1
    assert found.advantages["worst", "a"].estimate == (-40, -40, -40)
    assert found.advantages["worst", "a"].probability == 0


def test_the_reference_can_be_given_and_points_below_it_count_for_nothing():
    found = compare_hypervolumes(
        exactly(), METHODS, np.random.default_rng(0), np.array([4.0, -10.0]), resamples=20
    )
    assert found.reference.tolist() == [4, -10]
    assert found.methods["a"].mean == 2 * 16 + 4 * 11
    assert found.methods["b"].mean == 15
    assert found.methods["worst"].mean == 0


def test_equal_methods_share_and_differ_by_nothing():
    methods = {"one": ["a/1", "a/2"], "same": ["a/2", "a/1"], "worst": ["worst"]}
    samples = drawn(np.random.default_rng(1))
    found = compare_hypervolumes(samples, methods, np.random.default_rng(2), resamples=200)
    assert found.largest == {"one": 0.5, "same": 0.5, "worst": 0}
    assert found.advantages["same", "one"].estimate == (0, 0, 0)
    assert found.advantages["same", "one"].probability == 0.5
    assert found.methods["one"] == found.methods["same"]
    assert found.methods["worst"].low >= 0


def test_the_probability_of_covering_more_follows_the_samples():
    generator = np.random.default_rng(5)
    samples = {name: generator.normal(mean, 0.2, (50, 2)) for name, mean in MEANS.items()}
    wider = {**samples, "b/2": samples["b/2"] + 1}
    found = compare_hypervolumes(wider, METHODS, generator, np.zeros(2), resamples=500)
    assert found.advantages["b", "a"].probability == 1
    assert found.largest["b"] == 1
    assert found.advantages["b", "a"].estimate.low > 0


def test_paired_trials_are_drawn_together():
    values = np.random.default_rng(6).normal(5, 1.5, (60, 2))
    paired, apart = (
        compare_hypervolumes(
            {"one/1": values, "other/1": values},
            {"one": ["one/1"], "other": ["other/1"]},
            np.random.default_rng(7),
            np.zeros(2),
            pairs,
            300,
        ).advantages["other", "one"]
        for pairs in (True, False)
    )
    assert paired.estimate == (0, 0, 0)
    assert paired.probability == 0.5
    assert apart.estimate.high > 1


@pytest.mark.parametrize("repetitions", [200, pytest.param(3000, marks=pytest.mark.slow)])
def test_intervals_of_hypervolumes_and_advantages_cover_the_truth(repetitions):
    generator = np.random.default_rng(8)
    covered = np.zeros(3)
    for _ in range(repetitions):
        found = compare_hypervolumes(
            drawn(generator), METHODS, generator, np.zeros(2), resamples=200
        )
        intervals = [*map(found.methods.get, "ab"), found.advantages["b", "a"].estimate]
        truths = (COVERED["a"], COVERED["b"], 1.0)
        covered += [e.low <= t <= e.high for e, t in zip(intervals, truths, strict=True)]
    # Three standard errors of a share; 200 resamples cost up to 0.015.
    error = 3 * np.sqrt(0.95 * 0.05 / repetitions)
    assert (covered / repetitions > 0.95 - 0.015 - error).all()


def test_equal_generators_give_equal_intervals():
    samples = drawn(np.random.default_rng(9))
    first, again, other = (
        compare_hypervolumes(samples, METHODS, np.random.default_rng(seed), resamples=50)
        for seed in (1, 1, 2)
    )
    assert first.methods == again.methods
    assert first.advantages == again.advantages
    assert first.methods["a"] != other.methods["a"]
