"""Tables of comparisons against the statistics they are made of, computed apart."""

import numpy as np
import polars as pl
import pytest
import scipy.stats

from qbumpers.analysis.comparisons import against, compare_methods, optimal, pooled
from qbumpers.analysis.measures import MEASURES
from qbumpers.errors import RequestError

TRIALS = 30
# Assisted and unassisted mean of each condition.
MEANS = {
    "none": (-300.0, -40.0),
    "local-q-thresholding/alpha=0.5": (50.0, -500.0),
    "local-q-thresholding/alpha=0.1": (51.0, -520.0),
    "stochastic-q-bumpers/alpha=0.7": (54.0, -220.0),
    "stochastic-q-bumpers/alpha=0.2": (66.0, -460.0),
}
NONE, *OTHERS = MEANS


def measured(learner="q-learning", trials=TRIALS, seed=3, common=0.0):
    """Trials of a made-up experiment; a part of their chance is common to all conditions."""
    generator = np.random.default_rng(seed)
    shared = common * generator.normal(0, 40, (trials, 2))
    parts = []
    for condition, mean in MEANS.items():
        values = mean + shared + generator.normal(0, (3, 40), (trials, 2))
        part = pl.DataFrame(
            {
                "condition": condition,
                "assistant": condition.partition("/")[0],
                "alpha": float(condition.partition("=")[2] or "nan"),
                "learner": learner,
                "trial": np.arange(trials),
            }
        )
        unknown = [pl.lit(None, pl.Float64).alias(name) for name in MEASURES]
        parts.append(
            part.with_columns(*unknown).with_columns(assisted=values[:, 0], unassisted=values[:, 1])
        )
    return pl.concat(parts).with_columns(pl.col("alpha").fill_nan(None))


def sample(trials, condition, measure="unassisted"):
    return trials.filter(condition=condition).sort("trial")[measure].to_numpy()


def generator():
    return np.random.default_rng(0)


@pytest.mark.parametrize("paired", [False, True])
def test_conditions_are_compared_with_the_control(paired):
    trials = measured(common=1.0)
    found = against(trials.sample(fraction=1, shuffle=True, seed=1).sort("alpha"), NONE,
                    "unassisted", paired)  # fmt: skip
    assert set(found["condition"]) == set(OTHERS)
    control = sample(trials, NONE)
    for row in found.iter_rows(named=True):
        values = sample(trials, row["condition"])
        if paired:
            test = scipy.stats.ttest_rel(values, control)
            wins = np.mean(values > control)
        else:
            test = scipy.stats.ttest_ind(values, control, equal_var=False)
            wins = np.mean(values[:, np.newaxis] > control)
        _, p_value = test
        for start, confidence in (("difference", 0.95), ("simultaneous", 1 - 0.05 / 4)):
            interval = test.confidence_interval(confidence)
            assert row[f"{start}_low"] == pytest.approx(interval.low)
            assert row[f"{start}_high"] == pytest.approx(interval.high)
        assert row["difference_mean"] == pytest.approx(values.mean() - control.mean())
        assert row["p_value"] == pytest.approx(p_value)
        assert row["improvement_mean"] == pytest.approx(wins)
        assert row["improvement_low"] <= wins <= row["improvement_high"]
        assert row["alpha"] == float(row["condition"].partition("=")[2])
    adjusted = found.sort("p_value")
    steps = np.minimum(1, np.maximum.accumulate(adjusted["p_value"].to_numpy() * [4, 3, 2, 1]))
    assert adjusted["p_adjusted"].to_list() == pytest.approx(list(steps))


def test_pairs_are_of_equal_trial_number_and_leave_less_doubt():
    trials = measured(common=1.0)
    upside_down = trials.reverse()
    paired, apart, again = (
        against(table, NONE, "assisted", pairs).sort("condition")
        for table, pairs in ((trials, True), (trials, False), (upside_down, True))
    )
    narrow, wide = (
        (table["difference_high"] - table["difference_low"]).to_numpy().mean()
        for table in (paired, apart)
    )
    assert narrow < wide / 5
    assert paired["difference_low"].to_list() == pytest.approx(again["difference_low"].to_list())


def test_single_trials_have_differences_and_nothing_else():
    found = against(measured(trials=1), NONE, "unassisted")
    assert found["difference_mean"].null_count() == 0
    assert found["improvement_mean"].null_count() == 0
    for name in ("difference_low", "simultaneous_high", "p_value", "p_adjusted", "improvement_low"):
        assert found[name].null_count() == found.height


def test_optimal_conditions_and_how_sure_they_are():
    found = optimal(measured(trials=400), generator())
    assert found.columns == [
        "condition", "assistant", "alpha", "assisted", "unassisted", "pareto", "probability",
    ]  # fmt: skip
    assert found["condition"].to_list() == list(MEANS)
    assert found["pareto"].to_list() == [True, False, False, True, True]
    assert found["probability"].to_list() == pytest.approx([1, 0, 0, 1, 1], abs=1e-12)
    for row in found.iter_rows(named=True):
        assert (row["assisted"], row["unassisted"]) == pytest.approx(
            MEANS[row["condition"]], abs=5 * 40 / np.sqrt(400)
        )


def test_methods_are_pooled_over_their_conditions_each_counting_the_same():
    trials = measured()
    few = pl.col("condition") == "local-q-thresholding/alpha=0.1"
    unequal = trials.filter(~few | (pl.col("trial") < 5))
    found = pooled(unequal, "unassisted", generator())
    assert found["assistant"].to_list() == ["none", "local-q-thresholding", "stochastic-q-bumpers"]
    assert found["conditions"].to_list() == [1, 2, 2]
    assert found["trials"].to_list() == [30, 35, 60]
    for row in found.iter_rows(named=True):
        conditions = [name for name in MEANS if name.partition("/")[0] == row["assistant"]]
        samples = [sample(unequal, name) for name in conditions]
        errors = [scipy.stats.sem(values, ddof=0) for values in samples]
        error = np.sqrt(np.sum(np.square(errors))) / len(samples)
        assert row["macro_mean"] == pytest.approx(np.mean([v.mean() for v in samples]))
        # A bootstrap of 2,000 resamples finds ends to 6% of the half-width (z = 4 or so).
        width = (row["macro_high"] - row["macro_low"]) / 2
        assert width == pytest.approx(1.96 * error, rel=0.12)
        everything = np.sort(np.concatenate(samples))
        cut = len(everything) // 4
        assert row["interquartile_mean"] == pytest.approx(everything[cut:-cut].mean())
        assert row["interquartile_low"] < row["interquartile_mean"] < row["interquartile_high"]


def test_pairs_are_pooled_together():
    trials = measured(common=1.0)
    widths = []
    for paired in (False, True):
        row = pooled(trials, "assisted", generator(), paired).row(2, named=True)
        widths.append(row["macro_high"] - row["macro_low"])
    # Two conditions that move together vary more in their mean, by the square root of two.
    assert widths[1] / widths[0] == pytest.approx(np.sqrt(2), rel=0.15)


def test_methods_are_measured_by_what_they_cover():
    trials = measured(trials=400)
    reference = np.array([-400.0, -600.0])
    found = compare_methods(trials, generator(), reference=reference).methods
    assert found["assistant"].to_list() == ["none", "local-q-thresholding", "stochastic-q-bumpers"]
    assert found["conditions"].to_list() == [1, 2, 2]
    truth = [100 * 560, 450 * 100 + 1 * 80, 454 * 380 + 12 * 140]
    assert found["hypervolume_mean"].to_list() == pytest.approx(truth, rel=0.05)
    assert (found["hypervolume_low"] < found["hypervolume_mean"]).all()
    assert found["largest"].to_list() == [0, 0, 1]
    whole = truth[2] + 100 * (560 - 380)
    expected = [value / whole for value in truth]
    assert found["share"].to_list() == pytest.approx(expected, rel=0.05)
    assert found["reference_assisted"].to_list() == [-400] * 3
    assert found["reference_unassisted"].to_list() == [-600] * 3


def test_the_reference_is_the_worst_of_all_conditions_by_default():
    trials = measured()
    means = [[sample(trials, name, m).mean() for m in ("assisted", "unassisted")] for name in MEANS]
    found = compare_methods(trials, generator()).methods.row(0, named=True)
    reference = (found["reference_assisted"], found["reference_unassisted"])
    assert reference == pytest.approx(tuple(np.min(means, axis=0)))


def test_advantages_are_differences_of_what_methods_cover():
    trials = measured(trials=400)
    reference = np.array([-400.0, -600.0])
    methods, found = compare_methods(trials, generator(), reference=reference)
    covered = dict(methods.select("assistant", "hypervolume_mean").iter_rows())
    assert found.height == 3
    for row in found.iter_rows(named=True):
        expected = covered[row["assistant"]] - covered[row["other"]]
        assert row["advantage_mean"] == pytest.approx(expected)
        assert row["advantage_low"] <= expected <= row["advantage_high"]
        assert row["probability"] == float(expected > 0)


def test_how_sure_comparisons_are_is_unknown_from_single_trials():
    single = measured(trials=1)
    best = optimal(single, np.random.default_rng(0))
    assert best["probability"].null_count() == best.height
    assert best["pareto"].any()
    tables = compare_methods(single, np.random.default_rng(0))
    for table, columns in (
        (tables.methods, ["hypervolume_low", "hypervolume_high", "largest"]),
        (tables.advantages, ["advantage_low", "advantage_high", "probability"]),
    ):
        assert table.height > 0
        assert table.select(pl.col(columns).null_count()).row(0) == (table.height,) * 3
    assert tables.methods["hypervolume_mean"].null_count() == 0


def test_a_single_method_has_no_advantages():
    trials = measured().filter(assistant="stochastic-q-bumpers")
    found = compare_methods(trials, generator()).advantages
    assert found.height == 0
    assert found.columns == [
        "assistant", "other", "advantage_mean", "advantage_low", "advantage_high", "probability",
    ]  # fmt: skip


def test_trials_of_several_learners_are_refused():
    trials = pl.concat([measured("q-learning/perception=transition"), measured("other")])
    for compare in (
        lambda: against(trials, NONE, "assisted"),
        lambda: optimal(trials, generator()),
        lambda: pooled(trials, "assisted", generator()),
        lambda: compare_methods(trials, generator()),
    ):
        with pytest.raises(RequestError, match=r"trials of 2 learners .*filter"):
            compare()


def test_what_these_trials_do_not_have_is_refused():
    trials = measured()
    with pytest.raises(RequestError, match=r"unknown measure 'retention'.*assisted, unassisted"):
        against(trials, NONE, "retention")
    with pytest.raises(RequestError, match=r"unknown measure 'asisted'.*'assisted'"):
        pooled(trials, "asisted", generator())
    with pytest.raises(RequestError, match="unknown condition 'non'"):
        against(trials, "non", "assisted")
    with pytest.raises(RequestError, match="there is no other condition"):
        against(trials.filter(condition=NONE), NONE, "assisted")


def test_pairs_need_the_same_trials_in_every_condition():
    trials = measured().filter((pl.col("condition") != NONE) | (pl.col("trial") != 7))
    with pytest.raises(RequestError, match=r"paired = True: none and .* \(29 and 30\)"):
        against(trials, NONE, "assisted", paired=True)
    assert against(trials, NONE, "assisted").height == 4


def test_equal_generators_give_equal_tables():
    trials = measured()
    assert optimal(trials, generator()).equals(optimal(trials, generator()))
    both = zip(*(compare_methods(trials, generator()) for _ in range(2)), strict=True)
    assert all(table.equals(again) for table, again in both)
    first, other = (compare_methods(trials, np.random.default_rng(s)).methods for s in (1, 2))
    assert first["hypervolume_high"].to_list() != other["hypervolume_high"].to_list()
