"""Measures of trials against plain loops over rows."""

import math
import statistics
from itertools import pairwise, product

import numpy as np
import polars as pl
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.analysis.measures import (
    CRITERION_RUN,
    MEASURES,
    learning_curve,
    override_curve,
    summary,
    trial_measures,
    trial_samples,
)

CONDITIONS = {"none": None, "tutor/alpha=0.7": 0.7, "tutor/alpha=0.2": 0.2}
OPTIONS = {
    "none": {},
    "tutor/alpha=0.7": {"zeal": 3, "alpha": 0.7, "second": True},
    "tutor/alpha=0.2": {"zeal": 3, "alpha": 0.2, "second": True},
}
TRIALS, EPISODES, RETAINED = 4, 25, 3
RATES = ("override_rate", "override_rate_first", "override_rate_last")
EVENTS = ("assisted_success", "unassisted_success", "assisted_crash", "unassisted_crash")
SHARES = (*RATES, *EVENTS, "criterion_reached")
CRITERION = -220.0


def episodes(trials=TRIALS, known=True, length=EPISODES, retained=0):
    """Rows of episodes, those of retention last."""
    generator = np.random.default_rng(42)

    def row(condition, trial, episode):
        alpha = CONDITIONS[condition]
        is_assisted = alpha is not None and episode < length
        return {
            "condition": condition,
            "assistant": condition.partition("/")[0],
            "alpha": alpha,
            "learner": "q-learning",
            "trial": trial,
            "episode": episode,
            "retention": episode >= length,
            "assisted_return": generator.normal(50, 20),
            "unassisted_return": generator.normal(-200, 90) + 10 * trial,
            "assisted_length": int(generator.integers(1, 100)),
            "unassisted_length": int(generator.integers(1, 100)),
            "overrides": int(generator.integers(0, 9)) * is_assisted,
            **{event: bool(generator.random() < 0.4) if known else None for event in EVENTS},
        }

    rows = [row(*key) for key in product(CONDITIONS, range(trials), range(length + retained))]
    booleans = dict.fromkeys(EVENTS, pl.Boolean)
    return pl.DataFrame(rows, schema_overrides={**booleans, "alpha": pl.Float64})


def shuffled(table):
    """The same rows, conditions in their order, trials and episodes not."""
    parts = table.partition_by("condition", maintain_order=True)
    return pl.concat([part.sample(fraction=1, shuffle=True, seed=1) for part in parts])


def area(values):
    """Under the curve, a trapezoid at a time."""
    return sum((a + b) / 2 for a, b in pairwise(values))


def criterion_by_hand(values, criterion):
    """Training episodes until the first of five successive ones, and whether there are five."""
    run = min(CRITERION_RUN, len(values))
    for start in range(len(values) - run + 1):
        if all(value >= criterion for value in values[start : start + run]):
            return start + 1, 1
    return len(values), 0


def measured_by_hand(table, condition, trial, criterion=CRITERION):
    chosen = [r for r in table.to_dicts() if (r["condition"], r["trial"]) == (condition, trial)]
    rows = sorted((r for r in chosen if not r["retention"]), key=lambda r: r["episode"])
    retained = [r["unassisted_return"] for r in chosen if r["retention"]]
    tenth = max(1, len(rows) // 10)

    def mean(column, span=rows):
        values = [r[column] for r in span]
        return None if None in values else sum(values) / len(values)

    def rate(span):
        return sum(r["overrides"] for r in span) / sum(r["assisted_length"] for r in span)

    first, last = rows[:tenth], rows[-tenth:]
    found = {}
    for side in ("assisted", "unassisted"):
        found[side] = mean(f"{side}_return")
        found[f"{side}_last"] = mean(f"{side}_return", last)
        found[f"{side}_area"] = area([r[f"{side}_return"] for r in rows])
    count, reached = criterion_by_hand([r["unassisted_return"] for r in rows], criterion)
    return found | {
        "overrides": mean("overrides"),
        "override_rate": rate(rows),
        "override_rate_first": rate(first),
        "override_rate_last": rate(last),
        "dependence": found["assisted"] - found["unassisted"],
        "dependence_last": found["assisted_last"] - found["unassisted_last"],
        "retention": sum(retained) / len(retained) if retained else None,
        **{event: mean(event) for event in EVENTS},
        "criterion_episodes": count,
        "criterion_reached": reached,
    }


@pytest.mark.parametrize(
    ("length", "retained"), [(EPISODES, RETAINED), (EPISODES, 0), (7, 2), (3, 1), (1, 0)]
)
def test_measures_of_a_trial_are_those_of_its_episodes(length, retained):
    table = episodes(length=length, retained=retained)
    found = trial_measures(shuffled(table), CRITERION)
    assert found.columns == ["condition", "assistant", "alpha", "learner", "trial", *MEASURES]
    keys = [(condition, trial) for condition in CONDITIONS for trial in range(TRIALS)]
    assert found.select("condition", "trial").rows() == keys
    for row in found.iter_rows(named=True):
        expected = measured_by_hand(table, row["condition"], row["trial"])
        assert {name: row[name] for name in MEASURES} == pytest.approx(expected)
        assert row["assistant"] == row["condition"].partition("/")[0]
        assert (row["alpha"], row["learner"]) == (CONDITIONS[row["condition"]], "q-learning")


def test_some_trials_of_the_example_reach_the_criterion_and_others_never_do():
    reached = trial_measures(episodes(), CRITERION)["criterion_reached"]
    assert set(reached) == {0, 1}


def test_what_is_not_known_is_null():
    found = trial_measures(episodes(known=False))
    unknown = {name for name in MEASURES if found[name].null_count() == found.height}
    assert unknown == {*EVENTS, "retention", "criterion_episodes", "criterion_reached"}
    assert all(found[name].null_count() == 0 for name in set(MEASURES) - unknown)


@given(st.lists(st.integers(0, 3), min_size=1, max_size=14), st.integers(0, 4))
def test_a_criterion_is_reached_with_the_first_of_five_successive_episodes(values, criterion):
    table = episodes(trials=1, length=len(values)).filter(condition="none")
    table = table.with_columns(unassisted_return=pl.Series(values, dtype=pl.Float64))
    found = trial_measures(table, float(criterion)).row(0, named=True)
    expected = criterion_by_hand(values, criterion)
    assert (found["criterion_episodes"], found["criterion_reached"]) == expected


def test_retention_does_not_count_as_training():
    table = episodes(retained=RETAINED)
    with_it, without = (trial_measures(t) for t in (table, table.filter(~pl.col("retention"))))
    assert with_it.drop("retention").equals(without.drop("retention"))
    assert without["retention"].null_count() == without.height


def test_samples_keep_the_order_of_conditions_trials_and_measures():
    table = episodes()
    trials = trial_measures(table)
    samples = trial_samples(shuffled(trials), "unassisted", "overrides")
    assert list(samples) == list(CONDITIONS)
    for condition, array in samples.items():
        by_hand = [measured_by_hand(table, condition, trial) for trial in range(TRIALS)]
        assert array == pytest.approx(
            np.array([(m["unassisted"], m["overrides"]) for m in by_hand])
        )


def test_a_summary_is_a_macro_average_over_trials_with_an_interval_over_trials():
    table = episodes(retained=RETAINED)
    found = summary(trial_measures(table, CRITERION), OPTIONS, EPISODES, RETAINED)
    assert found["condition"].to_list() == list(CONDITIONS)
    for row in found.iter_rows(named=True):
        by_hand = [measured_by_hand(table, row["condition"], trial) for trial in range(TRIALS)]
        for measure in MEASURES:
            values = [m[measure] for m in by_hand]
            mean = statistics.fmean(values)
            error = statistics.stdev(values) / math.sqrt(TRIALS)
            margin = scipy.stats.t.ppf(0.975, TRIALS - 1) * error
            assert row[f"{measure}_mean"] == pytest.approx(mean)
            least, most = (0, 1) if measure in SHARES else (-math.inf, math.inf)
            assert row[f"{measure}_low"] == pytest.approx(max(least, mean - margin))
            assert row[f"{measure}_high"] == pytest.approx(min(most, mean + margin))


def test_a_summary_says_what_a_condition_is():
    table = episodes(retained=RETAINED)
    found = summary(trial_measures(table), OPTIONS, EPISODES, RETAINED)
    assert found.columns[:9] == [
        "condition", "assistant", "learner", "alpha", "second", "zeal", "trials", "episodes",
        "retention_episodes",
    ]  # fmt: skip
    assert found.columns[9:12] == ["assisted_mean", "assisted_low", "assisted_high"]
    assert found.select(found.columns[1:9]).rows() == [
        ("none", "q-learning", None, None, None, TRIALS, EPISODES, RETAINED),
        ("tutor", "q-learning", 0.7, True, 3, TRIALS, EPISODES, RETAINED),
        ("tutor", "q-learning", 0.2, True, 3, TRIALS, EPISODES, RETAINED),
    ]


def test_conditions_without_options_have_no_columns_of_options():
    table = episodes().filter(pl.col("condition") == "none")
    found = summary(trial_measures(table), {"none": {}}, EPISODES)
    assert found.columns[:5] == ["condition", "assistant", "learner", "trials", "episodes"]


def test_a_summary_has_columns_of_what_is_known_alone():
    table = episodes(known=False)
    found = summary(trial_measures(table), OPTIONS, EPISODES)
    known = [name for name in MEASURES if f"{name}_mean" in found.columns]
    left_out = {*EVENTS, "retention", "criterion_episodes", "criterion_reached"}
    assert set(MEASURES) - set(known) == left_out
    assert not any(column.startswith(tuple(left_out)) for column in found.columns)


def test_a_measure_known_of_some_conditions_is_null_elsewhere():
    table = episodes()
    is_assisted = pl.col("condition") != "none"
    trials = trial_measures(table).with_columns(
        assisted_crash=pl.when(is_assisted).then("assisted_crash")
    )
    found = summary(trials, OPTIONS, EPISODES)
    for part in ("mean", "low", "high"):
        assert found[f"assisted_crash_{part}"].is_null().to_list() == [True, False, False]


def test_a_single_trial_has_means_and_no_intervals():
    table = episodes(trials=1)
    found = summary(trial_measures(table, CRITERION), OPTIONS, EPISODES)
    for row in found.iter_rows(named=True):
        by_hand = measured_by_hand(table, row["condition"], 0)
        for measure in set(MEASURES) - {"retention"}:
            assert row[f"{measure}_mean"] == pytest.approx(by_hand[measure])
            assert row[f"{measure}_low"] is row[f"{measure}_high"] is None


@pytest.mark.parametrize("column", ["assisted_return", "overrides", "unassisted_success"])
def test_a_curve_is_a_mean_and_interval_over_trials_at_each_episode(column):
    table = episodes()
    found = learning_curve(
        table.sample(fraction=1, shuffle=True, seed=2), "tutor/alpha=0.2", column
    )
    assert found.shape == (3, EPISODES)
    for episode in range(EPISODES):
        chosen = table.filter(condition="tutor/alpha=0.2", episode=episode)
        values = [float(value) for value in chosen[column]]
        mean = statistics.fmean(values)
        margin = scipy.stats.t.ppf(0.975, TRIALS - 1) * statistics.stdev(values) / math.sqrt(4)
        ends = [mean - margin, mean + margin]
        if column == "unassisted_success":  # a share
            ends = [max(0, ends[0]), min(1, ends[1])]
        assert found[:, episode] == pytest.approx([mean, *ends])


def test_a_curve_of_a_single_trial_has_no_band():
    mean, low, high = learning_curve(episodes(trials=1), "none", "assisted_return")
    expected = episodes(trials=1).filter(condition="none")["assisted_return"]
    assert mean.tolist() == expected.to_list()
    assert np.isnan(low).all()
    assert np.isnan(high).all()


def test_the_course_of_overrides_is_a_rate_a_step_and_ends_with_the_training():
    table = episodes(retained=RETAINED)
    found = override_curve(shuffled(table), "tutor/alpha=0.2")
    assert found.shape == (3, EPISODES)
    for episode in range(EPISODES):
        chosen = table.filter(condition="tutor/alpha=0.2", episode=episode)
        rates = [r["overrides"] / r["assisted_length"] for r in chosen.iter_rows(named=True)]
        assert found[0, episode] == pytest.approx(statistics.fmean(rates))
        assert found[1, episode] <= found[0, episode] <= found[2, episode]
    assert (override_curve(table, "none") == 0).all()


def test_blocks_of_episodes_are_averaged_within_trials_first():
    table = episodes(retained=RETAINED)
    starts = np.array([0, 10, 20, EPISODES])
    ends = [*starts[1:], EPISODES + RETAINED]
    found = learning_curve(shuffled(table), "tutor/alpha=0.7", "unassisted_return", starts)
    rates = override_curve(shuffled(table), "tutor/alpha=0.7", starts[:-1])
    assert (found.shape, rates.shape) == ((3, 4), (3, 3))
    for block, (first, end) in enumerate(zip(starts, ends, strict=True)):
        rows = table.filter(pl.col("episode").is_between(first, end, closed="left"))
        rows = rows.filter(condition="tutor/alpha=0.7")
        means, shares = [], []
        for trial in range(TRIALS):
            own = rows.filter(trial=trial)
            means.append(statistics.fmean(own["unassisted_return"]))
            shares.append(sum(own["overrides"]) / sum(own["assisted_length"]))
        margin = scipy.stats.t.ppf(0.975, TRIALS - 1) * statistics.stdev(means) / math.sqrt(TRIALS)
        mean = statistics.fmean(means)
        assert found[:, block] == pytest.approx([mean, mean - margin, mean + margin])
        if end <= EPISODES:
            assert rates[0, block] == pytest.approx(statistics.fmean(shares))
