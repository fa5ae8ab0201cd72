"""Unassisted returns, successes and crashes against assisted ones."""

import numpy as np
import polars as pl
import pytest

from qbumpers.analysis.figures.style import NAMES, looks
from qbumpers.analysis.figures.tradeoffs import (
    MOST_LABELS,
    PANELS,
    labelled,
    tradeoffs,
    tradeoffs_figure,
)
from tests.analysis.drawn import point_of, segments
from tests.analysis.examples import BUMPERS, points_of, summary_row

DENSE = [place / 10 for place in range(11)] + [0.9 + place / 100 for place in range(1, 10)]
EVERY = {
    "none": None,
    "maximal": None,
    **{f"local-q-thresholding/alpha={alpha:g}": alpha for alpha in DENSE},
    **BUMPERS,
}
EVENTS = ("success", "crash")


def summary(events=EVENTS, conditions=EVERY):
    generator = np.random.default_rng(2)
    rows = []
    for place, (condition, alpha) in enumerate(conditions.items()):
        row = summary_row(condition, alpha, place)
        for measure in (
            f"{side}_{event}" for side in ("assisted", "unassisted") for event in events
        ):
            mean = generator.random()
            row |= {f"{measure}_mean": mean, f"{measure}_low": mean - 0.1}
            row |= {f"{measure}_high": mean + 0.2}
        rows.append(row)
    return pl.DataFrame(rows, schema_overrides={"alpha": pl.Float64}, infer_schema_length=None)


def drawn_from(table):
    return tradeoffs_figure(tradeoffs(table), looks(table["assistant"]))


def test_a_panel_a_measure_has_every_condition_as_a_point():
    drawing = drawn_from(summary())
    assert len(drawing.axes) == 3
    for axes, (pair, title) in zip(drawing.axes, PANELS.items(), strict=True):
        assert axes.get_title(loc="left") == title
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("assisted", "unassisted")
        factor = 1 if "Return" in title else 100
        for label, points in points_of(axes).items():
            [name] = [name for name, text in NAMES.items() if text == label]
            rows = summary().filter(assistant=name).sort("alpha")
            expected = factor * rows.select(f"{measure}_mean" for measure in pair).to_numpy()
            assert points == pytest.approx(expected)


def test_lines_join_the_settings_of_a_method_by_alpha_and_bars_are_intervals():
    shuffled = summary().sample(fraction=1, shuffle=True, seed=1)
    axes = drawn_from(shuffled).axes[1]
    [container] = [c for c in axes.containers if c.get_label() == "Local Q-Thresholding"]
    assert container[0].get_linestyle() == "-"
    rows = summary().filter(assistant="local-q-thresholding").sort("alpha")
    for bars, side, along in zip(container[2], ("assisted", "unassisted"), (0, 1), strict=True):
        ends = rows.select(f"{side}_success_low", f"{side}_success_high").to_numpy()
        for segment, interval in zip(bars.get_segments(), ends, strict=True):
            assert segment[:, along] == pytest.approx(100 * interval)


def test_labels_are_few_and_name_the_ends_first():
    names = ["none", *["swept"] * len(DENSE), "maximal"]
    alphas = [None, *DENSE, None]
    chosen = labelled(names, alphas)
    assert len(chosen) == MOST_LABELS
    assert [alphas[place] for place in chosen[:2]] == [0, 1]
    assert sorted(alphas[place] for place in chosen) == [0, 0.2, 0.5, 0.7, 1]
    assert labelled(["a", "a"], [0.3, None]) == []


def test_labels_stand_at_their_points_and_none_overlap():
    drawing = drawn_from(summary())
    drawing.draw_without_rendering()
    for axes, pair in zip(drawing.axes, PANELS, strict=True):
        factor = 1 if pair == ("assisted", "unassisted") else 100
        places = {
            (row["alpha"], *(factor * row[f"{measure}_mean"] for measure in pair))
            for row in summary().iter_rows(named=True)
        }
        assert all((float(t.get_text()), *point_of(t)) in places for t in axes.texts)
        assert len(axes.texts) <= 2 * MOST_LABELS
        boxes = [text.get_window_extent() for text in axes.texts]
        for index, box in enumerate(boxes):
            assert not any(box.overlaps(other) for other in boxes[:index])
    assert len(drawing.axes[1].texts) >= 4


def test_what_is_not_known_has_no_panel():
    assert tradeoffs(summary(events=())).height == 0
    drawing = drawn_from(summary(events=("success",)))
    assert len(drawing.axes) == 2
    fixed = summary(conditions={"none": None, "maximal": None}).drop("alpha")
    assert not any(axes.texts for axes in drawn_from(fixed).axes)


def test_single_trials_have_points_without_bars():
    table = summary().with_columns(pl.selectors.ends_with("_low", "_high") * None)
    drawing = drawn_from(table)
    drawing.draw_without_rendering()
    bars = [
        segment
        for axes in drawing.axes
        for collection in axes.collections
        for segment in segments(collection)
    ]
    assert bars
    assert not any(np.ptp(segment, axis=0).any() for segment in bars)
    assert all(np.isfinite(line.get_xdata()).any() for axes in drawing.axes for line in axes.lines)


def test_rates_stay_within_what_rates_can_be_and_nothing_is_named_without_numbers():
    wide = summary(conditions={"none": None, "maximal": None}).with_columns(
        pl.selectors.contains("success_low") - 2, pl.selectors.contains("success_high") + 2
    )
    drawing = drawn_from(wide)
    for low, high in (drawing.axes[1].get_xlim(), drawing.axes[1].get_ylim()):
        assert (low, high) == (-4, 104)
    [legend] = drawing.legends
    assert not legend.get_title().get_text()
    [legend] = drawn_from(summary()).legends
    assert legend.get_title().get_text() == "Numbers at points are α"
