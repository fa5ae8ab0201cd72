"""Roles of assistants in a report: they follow from what they are, not from their order."""

import itertools

import numpy as np
import polars as pl
import pytest

from qbumpers.analysis.findings import find_tables
from qbumpers.analysis.measures import MEASURES
from qbumpers.experiments.record import RecordedCondition
from qbumpers.experiments.sources import make_experiment
from tests.experiments.examples import settings

LEVELS = {
    "none": (-300.0, -40.0),
    "local-q-thresholding": (50.0, -500.0),
    "stochastic-q-bumpers": (60.0, -220.0),
    "own": (55.0, -300.0),
}


def found_of(order, spread=5.0, levels=LEVELS):
    generator = np.random.default_rng(7)
    rows = []
    for name in order:
        for alpha in (None,) if name == "none" else (0.2, 0.8):
            condition = name if alpha is None else f"{name}/alpha={alpha}"
            for trial in range(12):
                assisted, unassisted = levels[name] + generator.normal(0, spread, 2)
                rows.append(
                    dict.fromkeys(MEASURES)
                    | {
                        "condition": condition,
                        "assistant": name,
                        "alpha": alpha,
                        "learner": "q-learning",
                        "trial": trial,
                        "assisted": assisted,
                        "unassisted": unassisted,
                        "overrides": 0.0 if name == "none" else 3.0,
                    }
                )
    number = dict.fromkeys([*MEASURES, "alpha"], pl.Float64)
    trials = pl.DataFrame(rows, schema_overrides=number)
    conditions = [
        RecordedCondition(c, a, None, "q-learning", {} if alpha is None else {"alpha": alpha})
        for c, a, alpha in trials.select("condition", "assistant", "alpha")
        .unique(maintain_order=True)
        .iter_rows()
    ]
    [learner] = find_tables(trials, make_experiment(settings()), conditions).learners
    return learner


@pytest.mark.parametrize(
    "order", list(itertools.permutations(["none", "local-q-thresholding", "stochastic-q-bumpers"]))
)
def test_baseline_and_control_do_not_depend_on_the_order_of_the_file(order):
    found = found_of(order)
    assert found.compared == ("stochastic-q-bumpers", "local-q-thresholding")
    assert found.control == "none"
    assert found.regrets["performance"].baseline_condition.startswith("local-q-thresholding")


def test_one_s_own_is_held_against_what_was_published():
    for order in itertools.permutations(["own", "stochastic-q-bumpers", "none"]):
        assert found_of(order).compared == ("own", "stochastic-q-bumpers")


def test_a_regret_surely_above_zero_is_known_and_one_that_may_be_nothing_is_not():
    order = ["none", "local-q-thresholding", "stochastic-q-bumpers"]
    sure = found_of(order).regrets["performance"]
    assert sure.gap.mean == pytest.approx(sure.best - sure.baseline)
    assert sure.is_known
    close = {**LEVELS, "none": (-300.0, -219.0), "local-q-thresholding": (50.0, -220.0)}
    regret = found_of(order, levels=close, spread=20.0).regrets["performance"]
    assert regret.gap.low <= 0 < regret.gap.mean
    assert not regret.is_known


def test_no_reduction_is_above_all_of_the_regret():
    order = ["none", "local-q-thresholding", "stochastic-q-bumpers"]
    for regret in found_of(order, spread=60.0).regrets.values():
        assert not regret.reduction.high > 1
