"""Learning against performance: every condition a point, with its interval."""

import numpy as np
import polars as pl
import pytest

from qbumpers.analysis.figures.frontier import frontier_figure, tightest_cluster
from tests.analysis.examples import (
    ALPHAS,
    BUMPERS,
    THRESHOLDS,
    points_of,
    summary_row,
    summary_table,
)

AXES = ("mean return with the assistant", "mean return without it")
LABELS = {
    "none": "No assistance",
    "maximal": "Maximal assistance",
    "local-q-thresholding": "Local Q-Thresholding",
    "stochastic-q-bumpers": "Stochastic Q Bumpers",
}


def titles(drawing):
    return [axes.get_title(loc="left") for axes in drawing.axes]


def expected_points(table):
    return {
        LABELS[str(name)]: part.select("assisted_mean", "unassisted_mean").to_numpy()
        for (name,), part in table.partition_by("assistant", as_dict=True).items()
    }


def assert_points(axes, table):
    found, expected = points_of(axes), expected_points(table)
    assert found.keys() == expected.keys()
    for label in found:
        assert np.array_equal(found[label], expected[label])


def test_there_are_panels_of_overriding_assistants_of_all_and_of_a_cluster():
    table = summary_table()
    drawing = frontier_figure(table)
    assert titles(drawing) == [
        "Assistants that override",
        "All conditions",
        "Local Q-Thresholding, enlarged",
    ]
    assert {(axes.get_xlabel(), axes.get_ylabel()) for axes in drawing.axes} == {AXES}
    swept = table.filter(pl.col("alpha").is_not_null())
    assert_points(drawing.axes[0], swept)
    assert_points(drawing.axes[1], table)
    assert_points(drawing.axes[2], table.filter(pl.col("assistant") == "local-q-thresholding"))


def test_bars_are_the_intervals_of_the_summary():
    table = summary_table(BUMPERS)
    [container] = frontier_figure(table).axes[0].containers
    horizontal, vertical = (bars.get_segments() for bars in container[2])
    for row, sideways, upright in zip(table.to_dicts(), horizontal, vertical, strict=True):
        assert sideways[:, 0] == pytest.approx([row["assisted_low"], row["assisted_high"]])
        assert upright[:, 1] == pytest.approx([row["unassisted_low"], row["unassisted_high"]])


def test_points_outside_the_cluster_are_labelled_with_their_alpha():
    drawing = frontier_figure(summary_table())
    notes = [note.get_text() for note in drawing.axes[0].texts]
    assert sorted(notes) == sorted([*(f"α = {alpha:g}" for alpha in BUMPERS.values()), "better"])
    enlarged = {note.get_text(): tuple(note.xy) for note in drawing.axes[2].texts}
    thresholds = summary_table().filter(pl.col("assistant") == "local-q-thresholding")
    assert enlarged == {
        f"α = {row['alpha']:g}": (row["assisted_mean"], row["unassisted_mean"])
        for row in thresholds.iter_rows(named=True)
    }


def test_printed_points_are_hollow_stars_where_both_numbers_are_printed():
    [both, one, *_] = BUMPERS
    printed = [
        {"condition": both, "measure": "assisted", "value": 66.6},
        {"condition": both, "measure": "unassisted", "value": -465.6},
        {"condition": one, "measure": "assisted", "value": 53.9},
        {"condition": "absent/alpha=1", "measure": "assisted", "value": 1.0},
        {"condition": "absent/alpha=1", "measure": "unassisted", "value": 2.0},
    ]
    axes = frontier_figure(summary_table(), printed).axes[0]
    stars = [line for line in axes.lines if line.get_marker() == "*"]
    assert [(star.get_xdata()[0], star.get_ydata()[0]) for star in stars] == [(66.6, -465.6)]
    assert stars[0].get_markerfacecolor() == "none"
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    assert legend == ["Local Q-Thresholding", "Stochastic Q Bumpers", "as printed in the paper"]


def test_without_printed_numbers_the_legend_mentions_none():
    legend = frontier_figure(summary_table()).axes[0].get_legend()
    assert "as printed in the paper" not in [text.get_text() for text in legend.get_texts()]


def test_without_a_cluster_there_is_no_enlargement():
    drawing = frontier_figure(summary_table(BUMPERS))
    assert titles(drawing) == ["Assistants that override", "All conditions"]


def test_without_overrides_there_is_one_panel():
    table = summary_table({"none": None})
    drawing = frontier_figure(table)
    assert titles(drawing) == ["All conditions"]
    assert_points(drawing.axes[0], table)


def test_assistants_without_alpha_need_no_column_of_it():
    table = summary_table({"none": None, "maximal": None}).drop("alpha")
    drawing = frontier_figure(table)
    assert_points(drawing.axes[0], table.filter(pl.col("assistant") == "maximal"))
    drawing.draw_without_rendering()


def test_a_cluster_of_an_own_rule_needs_no_alpha():
    rows = [summary_row(f"own/zeal={place}", None, place) for place in range(5)]
    own = pl.DataFrame(rows).with_columns(assisted_mean=50 + pl.int_range(5) / 10)
    far = summary_table({"maximal": None})
    drawing = frontier_figure(pl.concat([own, far], how="vertical_relaxed").drop("alpha"))
    labels = {text.get_text() for axes in drawing.axes for text in axes.texts}
    assert {f"zeal={place}" for place in range(5)} <= labels


def test_single_trials_have_points_without_bars():
    table = summary_table().with_columns(
        pl.lit(None, pl.Float64).alias(f"{measure}_{end}")
        for measure in ("assisted", "unassisted")
        for end in ("low", "high")
    )
    drawing = frontier_figure(table)
    drawing.draw_without_rendering()
    assert_points(drawing.axes[1], table)


@pytest.mark.parametrize(
    ("conditions", "names"),
    [
        (ALPHAS, list(THRESHOLDS)),
        (BUMPERS, []),  # no five of them
        ({**dict(list(THRESHOLDS.items())[:4]), **BUMPERS}, []),  # four
        (THRESHOLDS, []),  # nothing else to be close to
        ({"none": None}, []),
    ],
    ids=["five", "spread", "four", "alone", "one"],
)
def test_a_cluster_is_five_settings_within_a_tenth_of_the_range(conditions, names):
    table = summary_table(conditions).filter(pl.col("assistant") != "none")
    assert tightest_cluster(table)["condition"].to_list() == names
