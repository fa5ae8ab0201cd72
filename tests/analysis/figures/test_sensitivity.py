"""Results against each swept option."""

import polars as pl
import pytest

from qbumpers.analysis.figures.sensitivity import sensitivities, sensitivity_figure
from qbumpers.analysis.figures.style import looks
from tests.narrowing import present

OPTIONS = ["alpha", "p_max", "second"]
PARTS = ("mean", "low", "high")


def row(assistant, place, **options):
    means = {"assisted": 10.0 + place, "unassisted": -50.0 * place, "override_rate": 0.01 * place}
    named = ",".join(f"{option}={value}" for option, value in options.items())
    return {
        "condition": f"{assistant}/{named}" if named else assistant,
        "assistant": assistant,
        **dict.fromkeys(OPTIONS),
        **options,
        **{
            f"{measure}_{part}": mean + step
            for measure, mean in means.items()
            for part, step in zip(PARTS, (0.0, -2.0, 3.0), strict=True)
        },
    }


def summary():
    rows = [row("none", 0)]
    rows += [row("thresholds", p, alpha=a) for p, a in enumerate((0.018, 0.0185, 0.5, 1.0))]
    rows += [
        row("bumpers", 2 * place + other, alpha=alpha, p_max=p_max, second=True)
        for place, alpha in enumerate((0.8, 0.2, 0.5))
        for other, p_max in enumerate((0.8, 0.9))
    ]
    schema = {"alpha": pl.Float64, "p_max": pl.Float64, "second": pl.Boolean}
    return pl.DataFrame(rows, schema_overrides=schema, infer_schema_length=None)


def drawn_from(table):
    return sensitivity_figure(sensitivities(table, OPTIONS), looks(table["assistant"]))


def test_every_swept_number_is_told_with_the_other_options():
    table = summary()
    found = sensitivities(table, OPTIONS)
    groups = found.group_by("assistant", "option", maintain_order=True).len().rows()
    assert groups == [("thresholds", "alpha", 4), ("bumpers", "alpha", 6), ("bumpers", "p_max", 6)]
    for one in found.iter_rows(named=True):
        [source] = table.filter(condition=one["condition"]).to_dicts()
        assert one["value"] == source[one["option"]]
        other = {"alpha": "p_max", "p_max": "alpha"}[one["option"]]
        expected = "" if source[other] is None else f"{other}={source[other]}"
        assert one["others"] == expected  # `second` is the same everywhere
        assert all(one[f"{m}_{p}"] == source[f"{m}_{p}"] for m in ("assisted",) for p in PARTS)


def test_nothing_swept_gives_no_rows():
    assert sensitivities(summary().filter(assistant="none"), OPTIONS).height == 0
    only = summary().filter(pl.col("condition") == "thresholds/alpha=0.5")
    assert sensitivities(only, OPTIONS).height == 0


def test_options_that_are_no_numbers_tell_lines_apart_but_have_no_panels():
    table = summary().filter(assistant="bumpers").with_columns(second=pl.col("p_max") > 0.85)
    found = sensitivities(table, OPTIONS)
    assert "second" not in found["option"].unique()
    assert found.filter(option="alpha")["others"].unique(maintain_order=True).to_list() == [
        "p_max=0.8, second=false",
        "p_max=0.9, second=true",
    ]


def test_each_option_of_an_assistant_is_a_row_of_three_panels_with_a_line_a_choice():
    drawing = drawn_from(summary())
    assert len(drawing.axes) == 3 * 3
    labels = [axes.get_xlabel() for axes in drawing.axes[::3]]
    assert labels == ["α", "α", "p_max"]
    panels = drawing.axes[3:6]
    measures = {"assisted": 1, "unassisted": 1, "override_rate": 100}
    for axes, (measure, factor) in zip(panels, measures.items(), strict=True):
        for container, p_max in zip(axes.containers, (0.8, 0.9), strict=True):
            rows = summary().filter(assistant="bumpers", p_max=p_max).sort("alpha")
            line, _, [bars] = container
            assert line.get_xdata().tolist() == [0.2, 0.5, 0.8]
            assert line.get_ydata() == pytest.approx(factor * rows[f"{measure}_mean"].to_numpy())
            ends = rows.select(f"{measure}_low", f"{measure}_high").to_numpy()
            for segment, interval in zip(bars.get_segments(), ends, strict=True):
                assert segment[:, 1] == pytest.approx(factor * interval)
        assert len({container[0].get_linestyle() for container in axes.containers}) == 2
    legend = [text.get_text() for text in present(panels[-1].get_legend()).get_texts()]
    assert legend == ["p_max=0.8", "p_max=0.9"]


def test_values_too_close_together_are_spaced_evenly_under_their_names():
    axes = drawn_from(summary()).axes[0]
    assert axes.containers[0][0].get_xdata().tolist() == [0, 1, 2, 3]
    labels = [label.get_text() for label in axes.get_xticklabels()]
    assert labels == ["0.018", "0.0185", "0.5", "1"]


def test_unknown_intervals_leave_points_without_bars():
    ends = [f"{m}_{p}" for m in ("assisted", "unassisted", "override_rate") for p in PARTS[1:]]
    drawing = drawn_from(summary().with_columns(pl.lit(None, pl.Float64).alias(e) for e in ends))
    drawing.draw_without_rendering()
    assert drawing.axes[0].containers[0][0].get_ydata().tolist() == [10.0, 11.0, 12.0, 13.0]
