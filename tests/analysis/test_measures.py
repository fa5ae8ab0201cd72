"""Means over trials against plain loops over rows."""

import math
import statistics
from itertools import product

import numpy as np
import polars as pl
import pytest
import scipy.stats

from qbumpers.analysis.measures import (
    ESTIMATED,
    learning_curve,
    summary,
    trial_means,
    trial_samples,
)

CONDITIONS = {"none": None, "tutor/alpha=0.7": 0.7, "tutor/alpha=0.2": 0.2}
OPTIONS = {
    "none": {},
    "tutor/alpha=0.7": {"zeal": 3, "alpha": 0.7, "second": True},
    "tutor/alpha=0.2": {"zeal": 3, "alpha": 0.2, "second": True},
}
TRIALS, EPISODES = 4, 5
EVENTS = ("assisted_success", "unassisted_success", "assisted_crash", "unassisted_crash")


def episodes(trials=TRIALS, known=True):
    generator = np.random.default_rng(42)

    def row(condition, trial, episode):
        alpha = CONDITIONS[condition]
        return {
            "condition": condition,
            "assistant": condition.partition("/")[0],
            "alpha": alpha,
            "trial": trial,
            "episode": episode,
            "assisted_return": generator.normal(50, 20),
            "unassisted_return": generator.normal(-200, 90),
            "assisted_length": int(generator.integers(1, 100)),
            "unassisted_length": int(generator.integers(1, 100)),
            "overrides": int(generator.integers(0, 9)) * (alpha is not None),
            **{event: bool(generator.random() < 0.4) if known else None for event in EVENTS},
        }

    rows = [row(*key) for key in product(CONDITIONS, range(trials), range(EPISODES))]
    booleans = dict.fromkeys(EVENTS, pl.Boolean)
    return pl.DataFrame(rows, schema_overrides={**booleans, "alpha": pl.Float64})


def measured_by_hand(table, condition, trial):
    rows = [r for r in table.to_dicts() if (r["condition"], r["trial"]) == (condition, trial)]
    measures = {
        "assisted": [r["assisted_return"] for r in rows],
        "unassisted": [r["unassisted_return"] for r in rows],
        "overrides": [r["overrides"] for r in rows],
        **{event: [r[event] for r in rows] for event in EVENTS},
    }
    means = {name: sum(values) / EPISODES for name, values in measures.items()}
    steps = sum(r["assisted_length"] for r in rows)
    return {**means, "override_rate": sum(measures["overrides"]) / steps}


def test_a_trials_measures_are_means_over_its_episodes():
    table = episodes()
    found = trial_means(table.sample(fraction=1, shuffle=True, seed=1))
    assert found.height == 3 * TRIALS
    for row in found.iter_rows(named=True):
        expected = measured_by_hand(table, row["condition"], row["trial"])
        assert {name: row[name] for name in ESTIMATED} == pytest.approx(expected)


def test_samples_keep_the_order_of_conditions_and_measures():
    table = episodes()
    samples = trial_samples(trial_means(table), "unassisted", "overrides")
    assert list(samples) == list(CONDITIONS)
    for condition, array in samples.items():
        by_hand = [measured_by_hand(table, condition, trial) for trial in range(TRIALS)]
        assert array == pytest.approx(
            np.array([(m["unassisted"], m["overrides"]) for m in by_hand])
        )


def test_a_summary_is_a_macro_average_over_trials_with_an_interval_over_trials():
    table = episodes()
    found = summary(table, trial_means(table), OPTIONS)
    assert found["condition"].to_list() == list(CONDITIONS)
    for row in found.iter_rows(named=True):
        by_hand = [measured_by_hand(table, row["condition"], trial) for trial in range(TRIALS)]
        for measure in ESTIMATED:
            values = [m[measure] for m in by_hand]
            mean = statistics.fmean(values)
            margin = scipy.stats.t.ppf(0.975, TRIALS - 1) * statistics.stdev(values) / math.sqrt(4)
            interval = [row[f"{measure}_{part}"] for part in ("mean", "low", "high")]
            assert interval == pytest.approx([mean, mean - margin, mean + margin])


def test_a_summary_leads_with_names_options_and_counts():
    table = episodes()
    found = summary(table, trial_means(table), OPTIONS)
    assert found.columns[:7] == [
        "condition", "assistant", "alpha", "second", "zeal", "trials", "episodes",
    ]  # fmt: skip
    assert found.columns[7:10] == ["assisted_mean", "assisted_low", "assisted_high"]
    assert found.select(found.columns[1:7]).rows() == [
        ("none", None, None, None, TRIALS, EPISODES),
        ("tutor", 0.7, True, 3, TRIALS, EPISODES),
        ("tutor", 0.2, True, 3, TRIALS, EPISODES),
    ]


def test_conditions_without_options_have_no_columns_of_options():
    table = episodes().filter(pl.col("condition") == "none")
    found = summary(table, trial_means(table), {"none": {}})
    assert found.columns[:4] == ["condition", "assistant", "trials", "episodes"]


def test_unknown_events_have_no_numbers_and_the_rest_has():
    table = episodes(known=False)
    found = summary(table, trial_means(table), OPTIONS)
    empty = {column for column in found.columns if found[column].null_count() == found.height}
    assert empty == {f"{event}_{part}" for event in EVENTS for part in ("mean", "low", "high")}


def test_a_single_trial_has_means_and_no_intervals():
    table = episodes(trials=1)
    found = summary(table, trial_means(table), OPTIONS)
    for row in found.iter_rows(named=True):
        by_hand = measured_by_hand(table, row["condition"], 0)
        for measure in ESTIMATED:
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
        assert found[:, episode] == pytest.approx([mean, mean - margin, mean + margin])


def test_a_curve_of_a_single_trial_has_no_band():
    mean, low, high = learning_curve(episodes(trials=1), "none", "assisted_return")
    expected = episodes(trials=1).filter(condition="none")["assisted_return"]
    assert mean.tolist() == expected.to_list()
    assert np.isnan(low).all()
    assert np.isnan(high).all()
