"""The same conditions in several runs."""

import numpy as np
import polars as pl
import pytest
import scipy.stats

from qbumpers.analysis.figures.runs import run_means, runs_figure
from qbumpers.analysis.figures.style import NAMES, looks
from tests.analysis.drawn import xs, ys

CONDITIONS = ["none", "stochastic-q-bumpers/alpha=1", "stochastic-q-bumpers/alpha=0.8"]
RETURNS = ("assisted", "unassisted")
RATES = ("assisted_success", "unassisted_success")


def trials():
    """Two runs; the second has its conditions in another order, and one of them fewer."""
    generator = np.random.default_rng(3)
    keys = [("default", c, t) for c in CONDITIONS for t in range(5)]
    keys += [("relu", c, t) for c in CONDITIONS[:0:-1] for t in range(3)]
    table = pl.DataFrame(keys, schema=["run", "condition", "trial"], orient="row")
    return table.with_columns(
        *(pl.Series(name, generator.normal(100, 20, len(keys))) for name in RETURNS),
        *(pl.Series(name, generator.random(len(keys))) for name in RATES),
    )


def test_means_and_intervals_are_over_the_trials_of_a_run():
    found = run_means(trials())
    assert found.select("run", "condition", "trials").rows() == [
        *(("default", condition, 5) for condition in CONDITIONS),
        *(("relu", condition, 3) for condition in CONDITIONS[1:]),
    ]
    for row in found.iter_rows(named=True):
        own = trials().filter(run=row["run"], condition=row["condition"])
        for measure in (*RETURNS, *RATES):
            values = own[measure].to_numpy()
            interval = scipy.stats.t.interval(
                0.95, len(values) - 1, values.mean(), scipy.stats.sem(values)
            )
            found_parts = [row[f"{measure}_{part}"] for part in ("mean", "low", "high")]
            assert found_parts == pytest.approx([values.mean(), *interval])


def test_every_run_is_a_row_in_which_no_marks_share_a_height():
    numbers = run_means(trials())
    drawing = runs_figure(numbers, looks(NAMES))
    drawing.draw_without_rendering()
    names = [label.get_text() for label in drawing.axes[0].get_yticklabels()]
    assert names == ["default", "relu"]
    for axes, measure in zip(drawing.axes, RETURNS, strict=True):
        marks = [line for line in axes.lines if line.get_marker() not in ("", "None")]
        for line, condition in zip(marks, CONDITIONS, strict=True):
            rows = numbers.filter(condition=condition)
            assert xs(line).tolist() == rows[f"{measure}_mean"].to_list()
            expected = rows["run"].replace_strict({"default": 0, "relu": 1}).to_list()
            assert np.round(ys(line)).tolist() == expected
        heights = [height for line in marks for height in ys(line)]
        assert len(set(heights)) == len(heights) == numbers.height
        assert marks[1].get_fillstyle() != marks[2].get_fillstyle()


def test_single_trials_have_no_intervals():
    numbers = run_means(trials().filter(trial=0))
    assert numbers["assisted_low"].null_count() == numbers.height
    runs_figure(numbers, looks(NAMES)).draw_without_rendering()
