"""Learning against performance: every condition a point, with its interval."""

import numpy as np
import polars as pl
import pytest

from qbumpers.analysis.figures.frontier import Marks, frontier_figure, overriding
from qbumpers.analysis.figures.labels import MOST_IN_A_COLUMN
from qbumpers.analysis.figures.style import looks, setting
from tests.analysis.drawn import point_of, xs, ys
from tests.analysis.examples import (
    BUMPERS,
    points_of,
    summary_row,
    summary_table,
)

CLOSE = {f"local-q-thresholding/alpha=0.01{digit}": 0.01 + digit / 1000 for digit in range(10)}
EVERYTHING = {"none": None, "maximal": None, **CLOSE, **BUMPERS}
AXES = ("mean assisted return per episode", "mean unassisted return per episode")
LABELS = {
    "none": "No assistance",
    "maximal": "Maximal assistance",
    "local-q-thresholding": "Local Q-Thresholding",
    "stochastic-q-bumpers": "Stochastic Q Bumpers",
}


def beaten(point, others):
    return any((other >= point).all() and (other > point).any() for other in others)


def table_of(conditions=EVERYTHING):
    """Made-up points, thresholds close together; which are beaten is found by comparing all."""
    squeezed = pl.when(assistant="local-q-thresholding").then(0.05).otherwise(1.0)
    table = summary_table(conditions).with_columns(
        (squeezed * (pl.col(name) + 130) - 130).alias(name)
        for name in ("unassisted_mean", "unassisted_low", "unassisted_high")
    )
    points = table.select("assisted_mean", "unassisted_mean").to_numpy()
    return table.with_columns(pareto=pl.Series([not beaten(point, points) for point in points]))


def drawn_from(table, marks=None):
    return frontier_figure(table, looks(table["assistant"]), marks)


def titles(drawing):
    return [axes.get_title(loc="left") for axes in drawing.axes]


def expected_points(table):
    return {
        LABELS.get(str(name), name): part.select("assisted_mean", "unassisted_mean").to_numpy()
        for (name,), part in table.partition_by("assistant", as_dict=True).items()
    }


def assert_points(axes, table):
    found, expected = points_of(axes), expected_points(table)
    assert found.keys() == expected.keys()
    for label in found:
        assert np.array_equal(found[label], expected[label])


def marked(axes, shape):
    """Places of the hollow marks of a shape."""
    return [
        tuple(place)
        for line in axes.lines
        if line.get_marker() == shape and line.get_markerfacecolor() == "none"
        for place in line.get_xydata()
    ]


def legend_of(drawing):
    [legend] = drawing.legends
    return [text.get_text() for text in legend.get_texts()]


def test_there_are_panels_of_overriding_assistants_of_all_and_of_a_cluster():
    table = table_of()
    drawing = drawn_from(table)
    assert titles(drawing) == ["Assistants that override", "All conditions", "Local Q-Thresholding"]
    assert {(axes.get_xlabel(), axes.get_ylabel()) for axes in drawing.axes} == {AXES}
    assert_points(drawing.axes[0], table.filter(pl.col("alpha").is_not_null()))
    assert_points(drawing.axes[1], table)
    assert_points(drawing.axes[2], table.filter(pl.col("assistant") == "local-q-thresholding"))


def test_bars_are_the_intervals_of_the_summary():
    table = table_of(BUMPERS)
    [container] = drawn_from(table).axes[0].containers
    horizontal, vertical = (bars.get_segments() for bars in container[2])
    for row, sideways, upright in zip(
        table.iter_rows(named=True), horizontal, vertical, strict=True
    ):
        assert sideways[:, 0] == pytest.approx([row["assisted_low"], row["assisted_high"]])
        assert upright[:, 1] == pytest.approx([row["unassisted_low"], row["unassisted_high"]])


def test_every_panel_rings_its_pareto_optimal_conditions():
    table = table_of()
    drawing = drawn_from(table)
    shown = [overriding(table), table, table.filter(assistant="local-q-thresholding")]
    for axes, rows in zip(drawing.axes, shown, strict=True):
        best = rows.filter("pareto").select("assisted_mean", "unassisted_mean").rows()
        assert sorted(marked(axes, "o")) == sorted(best)
    assert 0 < table["pareto"].sum() < table.height
    assert "Pareto-optimal" in legend_of(drawing)


def test_the_staircase_bounds_what_the_conditions_reach_and_stretches_no_panel():
    table = table_of()
    drawing = drawn_from(table)
    best = table.filter("pareto").sort("assisted_mean")
    for axes in drawing.axes:
        [stairs] = [line for line in axes.lines if line.get_linestyle() == ":"]
        assert stairs.get_drawstyle() == "steps-pre"  # to the left of a point, at its height
        assert xs(stairs).tolist() == best["assisted_mean"].to_list()
        assert ys(stairs).tolist() == best["unassisted_mean"].to_list()
    assert drawing.axes[0].get_xlim()[0] > 0  # "none" has -300


def test_points_outside_the_cluster_are_labelled_with_their_alpha():
    drawing = drawn_from(table_of())
    notes = {note.get_text(): point_of(note) for note in drawing.axes[0].texts}
    rows = table_of().filter(assistant="stochastic-q-bumpers").iter_rows(named=True)
    assert notes == {
        setting(row["condition"]): (row["assisted_mean"], row["unassisted_mean"]) for row in rows
    }
    enlarged = {text.get_text().strip() for text in drawing.axes[2].texts}
    assert enlarged == {setting(condition) for condition in CLOSE}


def crowd(name, centre):
    """Eight conditions of an assistant within a thousandth of the range of the others."""
    rows = [summary_row(f"{name}/alpha=0.{place}", place / 10, place) for place in range(1, 9)]
    return pl.DataFrame(rows).with_columns(
        assisted_mean=centre + pl.int_range(8) / 50,
        unassisted_mean=-500.0 - pl.int_range(8) / 10,
    )


def test_two_clusters_are_both_enlarged_with_every_label():
    two = [crowd("local-q-thresholding", 50.0), crowd("stochastic-q-bumpers", 55.0)]
    table = pl.concat([*two, summary_table({"none": None})], how="vertical_relaxed")
    drawing = drawn_from(table.with_columns(pareto=pl.lit(False)))
    assert titles(drawing)[1:] == ["All conditions", "Local Q-Thresholding", "Stochastic Q Bumpers"]
    assert not drawing.axes[0].texts
    for axes in drawing.axes[2:]:
        found = sorted(text.get_text().strip() for text in axes.texts)
        assert found == [f"α = 0.{place}" for place in range(1, 9)]
    drawing.draw_without_rendering()


def test_marks_of_drawn_conditions_are_hollow_stars():
    points = {next(iter(BUMPERS)): (66.6, -465.6), "absent/alpha=1": (1.0, 2.0)}
    drawing = drawn_from(table_of(), Marks("as printed elsewhere", points))
    assert marked(drawing.axes[0], "*") == [(66.6, -465.6)]
    assert marked(drawing.axes[1], "*") == []  # all conditions: measured ones alone
    low, high = drawing.axes[0].get_ylim()
    assert low < -465.6 < high
    assert legend_of(drawing) == [*LABELS.values(), "Pareto-optimal", "as printed elsewhere"]


def test_without_marks_the_legend_has_none():
    assert legend_of(drawn_from(table_of())) == [*LABELS.values(), "Pareto-optimal"]


def test_where_all_conditions_override_one_panel_shows_them():
    table = table_of(BUMPERS)
    drawing = drawn_from(table)
    assert titles(drawing) == ["All conditions"]
    assert_points(drawing.axes[0], table)


def test_without_overrides_there_is_one_panel():
    table = table_of({"none": None})
    drawing = drawn_from(table)
    assert titles(drawing) == ["All conditions"]
    assert_points(drawing.axes[0], table)
    assert legend_of(drawing) == ["No assistance", "Pareto-optimal"]


def test_assistants_without_alpha_need_no_column_of_it():
    table = table_of({"none": None, "maximal": None}).drop("alpha")
    drawing = drawn_from(table)
    assert_points(drawing.axes[0], table.filter(pl.col("assistant") == "maximal"))
    drawing.draw_without_rendering()


def test_a_cluster_of_an_own_rule_is_labelled_with_its_options():
    own = crowd("own", 50.0).with_columns(
        condition=pl.format("own/zeal={}@perception=observant", pl.int_range(8))
    )
    table = pl.concat([own, summary_table({"maximal": None})], how="vertical_relaxed")
    drawing = drawn_from(table.with_columns(pareto=pl.lit(False)))
    labels = {text.get_text().strip() for axes in drawing.axes for text in axes.texts}
    assert {f"zeal={place}" for place in range(8)} <= labels


def test_single_trials_have_points_without_bars():
    table = table_of().with_columns(
        pl.lit(None, pl.Float64).alias(f"{measure}_{end}")
        for measure in ("assisted", "unassisted")
        for end in ("low", "high")
    )
    drawing = drawn_from(table)
    drawing.draw_without_rendering()
    assert_points(drawing.axes[1], table)


def test_of_a_large_cluster_so_many_are_labelled_as_there_is_room_for_spread_over_all():
    rows = [
        summary_row(f"local-q-thresholding/alpha=0.{place:03d}", place / 1000, 0)
        for place in range(100, 140)
    ]
    cluster = pl.DataFrame(rows).with_columns(
        assisted_mean=50 + pl.int_range(40) / 500,
        unassisted_mean=-500.0 - pl.int_range(40) / 100,
        pareto=pl.int_range(40) == 7,
    )
    rest = summary_table({"none": None, **BUMPERS}).with_columns(pareto=pl.lit(value=False))
    drawing = drawn_from(pl.concat([cluster, rest], how="vertical_relaxed"))
    [panel] = [axes for axes in drawing.axes if axes.get_title(loc="left").startswith("Local")]
    labels = sorted(text.get_text().strip() for text in panel.texts)
    assert len(labels) == MOST_IN_A_COLUMN
    assert {"α = 0.100", "α = 0.107", "α = 0.139"} <= set(labels)
