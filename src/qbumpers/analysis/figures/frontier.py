"""Learning against performance: Figure 2 of the paper, made to be read."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from qbumpers.analysis.figures.style import (
    NAMES,
    colour,
    figure,
    label_in_column,
    marker,
)

_AXES = ("mean return with the assistant", "mean return without it")


def frontier_figure(summary: pl.DataFrame, published: Sequence[Mapping[str, Any]] = ()) -> Figure:
    """Unassisted against assisted return of every condition, with 95% intervals.

    Above, the assistants that override; below, all conditions, and a tight cluster enlarged.

    Args:
        summary: the table of `summary.csv`.
        published: printed numbers (condition, measure, value), drawn hollow.

    Returns:
        The figure.
    """
    overriding = summary.filter(pl.col("overrides_mean") > 0)
    swept = overriding.filter(pl.col("condition").str.contains("/", literal=True))
    if swept.height:
        overriding = swept
    cluster = tightest_cluster(overriding)
    with figure(10, 10.5 if overriding.height else 5) as drawing:
        if not overriding.height:
            _everything(drawing.subplots(), summary)
            return drawing
        grid = drawing.add_gridspec(2, 2, height_ratios=(1.25, 1))
        main = drawing.add_subplot(grid[0, :])
        _main(main, overriding, published, cluster)
        _everything(drawing.add_subplot(grid[1, 0]), summary)
        if cluster.height:
            _cluster(drawing.add_subplot(grid[1, 1]), cluster, published)
    return drawing


def tightest_cluster(summary: pl.DataFrame) -> pl.DataFrame:
    """The conditions of one assistant that lie too close together to be labelled among the others.

    Args:
        summary: rows of overriding conditions.

    Returns:
        Its rows where at least five conditions of it share a tenth of the range of assisted
        returns; else no rows.
    """
    if summary.height < 2:
        return summary.head(0)
    reach = np.ptp(summary["assisted_mean"].to_numpy())
    for part in summary.partition_by("assistant", maintain_order=True):
        if part.height >= 5 and np.ptp(part["assisted_mean"].to_numpy()) < 0.1 * reach:
            return part
    return summary.head(0)


def _draw_points(axes: Axes, rows: pl.DataFrame, size: float = 6) -> None:
    for part in rows.partition_by("assistant", maintain_order=True):
        name = str(part["assistant"][0])
        x, y = part["assisted_mean"].to_numpy(), part["unassisted_mean"].to_numpy()
        margins = [
            np.nan_to_num(
                np.abs(part.select(f"{m}_low", f"{m}_high").cast(pl.Float64).to_numpy().T - centre)
            )
            for m, centre in (("assisted", x), ("unassisted", y))
        ]
        axes.errorbar(
            x, y, xerr=margins[0], yerr=margins[1], fmt=marker(name), color=colour(name),
            markersize=size, elinewidth=1, alpha=0.9, label=NAMES.get(name, name),
        )  # fmt: skip


def _draw_published(axes: Axes, rows: pl.DataFrame, published: Sequence[Mapping[str, Any]]) -> None:
    """Printed points, hollow; a condition needs both numbers to be one."""
    for condition, name in rows.select("condition", "assistant").iter_rows():
        numbers = {n["measure"]: n["value"] for n in published if n["condition"] == condition}
        if len(numbers) == 2:
            axes.plot(
                numbers["assisted"], numbers["unassisted"], marker="*", markersize=17,
                markerfacecolor="none", markeredgecolor=colour(name), markeredgewidth=1.6,
                linestyle="none", zorder=5,
            )  # fmt: skip


def _label(row: Mapping[str, Any]) -> str:
    """What tells a condition from others of its assistant."""
    if row.get("alpha") is not None:
        return f"α = {row['alpha']:g}"
    return str(row["condition"]).partition("/")[2]


def _main(
    axes: Axes,
    rows: pl.DataFrame,
    published: Sequence[Mapping[str, Any]],
    cluster: pl.DataFrame,
) -> None:
    _draw_points(axes, rows)
    _draw_published(axes, rows, published)
    clustered = set(cluster["condition"]) if cluster.height else set()
    for row in rows.iter_rows(named=True):
        if row["condition"] not in clustered:
            axes.annotate(
                _label(row), (row["assisted_mean"], row["unassisted_mean"]),
                xytext=(7, 7), textcoords="offset points", fontsize=9,
                color=colour(row["assistant"]),
            )  # fmt: skip
    axes.set(xlabel=_AXES[0], ylabel=_AXES[1], title="Assistants that override")
    axes.margins(x=0.08)
    handles, labels = axes.get_legend_handles_labels()
    if published:
        star = Line2D(
            [], [], marker="*", markersize=13, color="#555555", fillstyle="none", linestyle=""
        )
        handles, labels = [*handles, star], [*labels, "as printed in the paper"]
    axes.legend(handles, labels, loc="lower left")
    axes.annotate(
        "better", xy=(0.985, 0.965), xytext=(0.93, 0.87), xycoords="axes fraction",
        textcoords="axes fraction", ha="right", fontsize=9, color="#555555",
        arrowprops={"arrowstyle": "->", "color": "#555555"},
    )  # fmt: skip


def _everything(axes: Axes, summary: pl.DataFrame) -> None:
    _draw_points(axes, summary, size=5)
    axes.set(xlabel=_AXES[0], ylabel=_AXES[1], title="All conditions")
    axes.legend(loc="lower left", fontsize=9)


def _cluster(axes: Axes, rows: pl.DataFrame, published: Sequence[Mapping[str, Any]]) -> None:
    name = str(rows["assistant"][0])
    points = rows.select("assisted_mean", "unassisted_mean").to_numpy()
    _draw_points(axes, rows, size=5)
    _draw_published(axes, rows, published)
    low, high = points[:, 0].min(), points[:, 0].max()
    room = max(high - low, 1e-9)
    axes.set_xlim(low - 0.9 * room, high + 1.5 * room)
    labels = [_label(row) for row in rows.iter_rows(named=True)]
    label_in_column(axes, points, labels, at=0.82, ink=colour(name))
    title = f"{NAMES.get(name, name)}, enlarged"
    axes.set(xlabel=_AXES[0], ylabel=_AXES[1], title=title)
