"""Findings as tables give them, made up so that every number in them is known."""

import math

import polars as pl

from qbumpers.analysis.findings import LearnerFindings
from qbumpers.analysis.frontier import Regret
from qbumpers.analysis.leaders import Leader, Trade
from qbumpers.analysis.statistics import IntervalEstimate
from tests.analysis.examples import summary_table

NAN = IntervalEstimate(math.nan, math.nan, math.nan)
SOME = IntervalEstimate(-300.0, -320.0, -280.0)
SURE = IntervalEstimate(480.0, 400.0, 560.0)
PERFORMS = Leader(
    "maximal", 30, 9, [], IntervalEstimate(7.0, 6.0, 8.0), "stochastic-q-bumpers/alpha=0.2"
)
TEACHES = Leader(
    "none", 30, 9, ["maximal", "local-q-thresholding/alpha=0.010"],
    IntervalEstimate(10.0, -20.0, 40.0), "maximal",
)  # fmt: skip
TRADE = Trade("none", "maximal", IntervalEstimate(387, 385, 389), IntervalEstimate(10, -20, 40))
METHODS = pl.DataFrame(
    {
        "assistant": ["none", "stochastic-q-bumpers"],
        "conditions": [1, 3],
        "hypervolume_mean": [0.0, 900.0],
        "share": [0.0, 0.9],
        "largest": [0.02, 0.98],
    }
)
DIFFERENCES = pl.DataFrame(
    [
        ("assisted", 1.0, 2.0),
        ("assisted", -1.0, 2.0),
        ("unassisted", -3.0, -2.0),
        ("unassisted", -3.0, -1.0),
    ],
    schema=["measure", "simultaneous_low", "simultaneous_high"],
    orient="row",
)


def regret(method, reduction, gap=SURE):
    return Regret(0, "x", "y", 50.0, -500.0, method, -20.0, reduction, gap)


def about(learner="q-learning", regrets=(), trials=30):
    table = summary_table().with_columns(trials=pl.lit(trials))
    return LearnerFindings(
        learner=learner,
        summary=table,
        trials=pl.DataFrame(),
        frontier=table.with_columns(pareto=pl.int_range(10) < 4),
        methods=METHODS,
        advantages=pl.DataFrame(),
        control="none",
        differences=DIFFERENCES,
        compared=("stochastic-q-bumpers", "local-q-thresholding"),
        regrets=dict(regrets),
        leaders={"assisted": PERFORMS, "unassisted": TEACHES},
        trade=TRADE,
    )
