"""How good action values are: the returns that they predict against those achieved."""

from collections.abc import Sequence

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from qbumpers.analysis.figures.style import figure
from qbumpers.experts.quality import BEFORE_CRASH, bias_by

_COLOURS = ("#0072b2", "#d55e00")
_MARKERS = ("o", "^")
_BINS = 8


def quality_figure(checks: Sequence[tuple[str, pl.DataFrame]]) -> Figure:
    """Calibration, bias before crashes, and bias by distance from the expert's path.

    Args:
        checks: one or two, each with its name, from `qbumpers.experts.quality.check_values`.

    Returns:
        The figure; bars are 95% intervals over episodes.
    """
    visited = [(name, rows.filter(pl.col("policy") != "greedy")) for name, rows in checks]
    with figure(10, 3.6) as drawing:
        calibration, before, distance = drawing.subplots(1, 3)
        _draw_calibration(calibration, visited)
        _draw_before_crashes(before, visited)
        _draw_distances(distance, visited)
        if len(checks) > 1:
            handles, labels = calibration.get_legend_handles_labels()
            drawing.legend(handles, labels, loc="outside lower center", ncols=len(checks))
    return drawing


def _draw_calibration(axes: Axes, checks: Sequence[tuple[str, pl.DataFrame]]) -> None:
    for place, (name, rows) in enumerate(checks):
        picked = rows.filter("at_random")
        edges = _even_edges(picked["value"].to_numpy())
        _draw(axes, place, name, bias_by(picked, "value", edges), "value", "achieved")
    low, high = axes.get_xlim()
    axes.axline((low, low), slope=1, color="#7a7a7a", linewidth=1, linestyle="--")
    axes.set(
        xlabel="predicted: Q(s, a)", ylabel="achieved discounted return", title="Calibration",
        xlim=(low, high),
    )  # fmt: skip


def _draw_before_crashes(axes: Axes, checks: Sequence[tuple[str, pl.DataFrame]]) -> None:
    steps = np.array(BEFORE_CRASH)
    for place, (name, rows) in enumerate(checks):
        table = [bias_by(rows, "before_crash", (step, step + 1)) for step in steps]
        found = [part for part in table if not part.is_empty()]
        if found:
            _draw(axes, place, name, pl.concat(found), "low", "bias")
    _draw_bias_axes(axes, "steps before a crash", "Before crashes")
    axes.set_xscale("log")
    axes.set_xticks(steps, [str(step) for step in steps])
    axes.minorticks_off()
    axes.invert_xaxis()


def _draw_distances(axes: Axes, checks: Sequence[tuple[str, pl.DataFrame]]) -> None:
    for place, (name, rows) in enumerate(checks):
        picked = rows.filter("at_random")
        table = bias_by(picked, "distance", _even_edges(picked["distance"].to_numpy()))
        middle = table.with_columns(middle=(pl.col("low") + pl.col("high")) / 2)
        _draw(axes, place, name, middle, "middle", "bias")
    _draw_bias_axes(axes, "distance from greedy episodes", "Off the path")


def _draw_bias_axes(axes: Axes, xlabel: str, title: str) -> None:
    axes.axhline(0, color="#7a7a7a", linewidth=1, linestyle="--")
    axes.set(xlabel=xlabel, ylabel="predicted minus achieved", title=title)


def _draw(axes: Axes, place: int, name: str, table: pl.DataFrame, x: str, y: str) -> None:
    error = table["error"].to_numpy()
    axes.errorbar(
        table[x].to_numpy(), table[y].to_numpy(), yerr=1.96 * np.where(np.isinf(error), 0, error),
        fmt=_MARKERS[place] + "-", color=_COLOURS[place], markersize=4, elinewidth=1, label=name,
    )  # fmt: skip


def _even_edges(numbers: np.ndarray) -> list[float]:
    """Edges of bins that hold about equally many numbers."""
    first, *later = np.unique(np.quantile(numbers, np.linspace(0, 1, _BINS + 1))).tolist()
    return [first, *later[:-1], float(np.nextafter(later[-1] if later else first, np.inf))]
