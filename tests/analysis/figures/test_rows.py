"""Conditions one below the other."""

import numpy as np
import polars as pl
import pytest
from matplotlib.collections import PathCollection

from qbumpers.analysis.figures.rows import differences_figure, spreads, spreads_figure
from qbumpers.analysis.figures.style import looks, readable
from tests.analysis.drawn import xs
from tests.analysis.examples import BUMPERS

CONDITIONS = ["none", *BUMPERS]
DRAWN = looks(["none", "stochastic-q-bumpers"])
MEASURES = ("assisted", "unassisted")


def trials(count=9):
    generator = np.random.default_rng(5)
    keys = [(c, c.partition("/")[0], t) for c in CONDITIONS for t in range(count)]
    table = pl.DataFrame(keys, schema=["condition", "assistant", "trial"], orient="row")
    return table.with_columns(
        assisted=generator.normal(50, 5, len(keys)), unassisted=generator.normal(-50, 20, len(keys))
    )


def lines_of(axes, width):
    """Ends of the horizontal lines of a width, from top to bottom."""
    segments = [
        segment
        for collection in axes.collections
        if collection.get_linewidth()[0] == width and hasattr(collection, "get_segments")
        for segment in collection.get_segments()
    ]
    return [segment[:, 0] for segment in sorted(segments, key=lambda s: s[0, 1])]


def markers_of(axes):
    places = [p for line in axes.lines if line.get_marker() in "so" for p in line.get_xydata()]
    return [x for x, _ in sorted(places, key=lambda place: place[1])]


def test_quantiles_of_each_condition_and_measure():
    table = trials()
    found = spreads(table, CONDITIONS[::2])
    assert found.height == 2 * 2
    for row in found.iter_rows(named=True):
        values = table.filter(condition=row["condition"])[row["measure"]].to_numpy()
        names = ("low", "quarter", "median", "three_quarters", "high")
        expected = np.quantile(values, [0.05, 0.25, 0.5, 0.75, 0.95])
        assert [row[name] for name in names] == pytest.approx(expected.tolist())


def test_a_row_shows_median_middle_half_and_nine_in_ten():
    table = trials()
    spread = spreads(table, CONDITIONS)
    for axes, measure in zip(spreads_figure(spread, table, DRAWN).axes, MEASURES, strict=True):
        rows = spread.filter(measure=measure)
        assert markers_of(axes) == pytest.approx(rows["median"].to_list())
        for width, ends in ((1, ("low", "high")), (3, ("quarter", "three_quarters"))):
            shown = np.array(lines_of(axes, width))
            assert shown == pytest.approx(rows.select(ends).to_numpy())
        top, bottom = axes.get_ylim()[::-1]
        assert top < 0 < len(CONDITIONS) - 1 < bottom  # the first condition on top


def test_rows_bear_the_names_of_the_conditions():
    table = trials()
    axes = spreads_figure(spreads(table, CONDITIONS), table, DRAWN).axes[0]
    labels = [label.get_text() for label in axes.get_yticklabels()]
    assert labels == [readable(condition) for condition in CONDITIONS]


@pytest.mark.parametrize(("count", "shown"), [(9, 9), (130, 100)])
def test_dots_are_single_trials_up_to_a_hundred_of_a_condition(count, shown):
    table = trials(count)
    axes = spreads_figure(spreads(table, CONDITIONS), table, DRAWN).axes[1]
    [dots] = [c for c in axes.collections if isinstance(c, PathCollection)]
    places = np.asarray(dots.get_offsets())
    assert len(places) == shown * len(CONDITIONS)
    for index, condition in enumerate(CONDITIONS):
        own = table.filter(condition=condition)["unassisted"].to_list()[:shown]
        near = places[np.abs(places[:, 1] - index) < 0.5]
        assert sorted(near[:, 0]) == pytest.approx(sorted(own))
    assert dots.get_rasterized()


def differences(known=True):
    rows = [
        {
            "measure": measure,
            "condition": condition,
            "difference_mean": 10.0 * place,
            "difference_low": 10.0 * place - 2 if known else None,
            "difference_high": 10.0 * place + 3 if known else None,
            "simultaneous_low": 10.0 * place - 4 if known else None,
            "simultaneous_high": 10.0 * place + 5 if known else None,
        }
        for measure in MEASURES
        for place, condition in enumerate(BUMPERS)
    ]
    return pl.DataFrame(rows, infer_schema_length=None)


def test_differences_have_two_intervals_and_a_line_at_nothing():
    for axes in differences_figure(differences(), DRAWN).axes:
        assert markers_of(axes) == [0.0, 10.0, 20.0]
        assert np.array(lines_of(axes, 3)).tolist() == [[-2, 3], [8, 13], [18, 23]]
        assert np.array(lines_of(axes, 1)).tolist() == [[-4, 5], [6, 15], [16, 25]]
        [nothing] = [line for line in axes.lines if xs(line).tolist() == [0, 0]]
        assert nothing.get_marker() == "None"


def test_differences_of_single_trials_are_drawn_without_intervals():
    drawing = differences_figure(differences(known=False), DRAWN)
    drawing.draw_without_rendering()
    assert markers_of(drawing.axes[0]) == [0.0, 10.0, 20.0]
