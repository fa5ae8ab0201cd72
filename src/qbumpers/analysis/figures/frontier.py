"""Learning against performance: unassisted return against assisted return, by condition."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from qbumpers.analysis.figures.labels import MOST_IN_A_COLUMN, label_in_column, room_for_labels
from qbumpers.analysis.figures.style import NAMES, Look, figure, setting, write_in_full

_AXES = {
    "xlabel": "mean assisted return per episode",
    "ylabel": "mean unassisted return per episode",
}
_MAIN_SIZE = np.array([9.0, 4.6])  # of the main panel, in inches, about
_CLUSTER = 3  # so many labels without room make a cluster, which is enlarged
_RING: Any = {"marker": "o", "markerfacecolor": "none", "color": "#222222"}
_STAR: Any = {"marker": "*", "markerfacecolor": "none", "linestyle": "none"}


class Marks(NamedTuple):
    """Points to compare those of conditions with, drawn as hollow stars.

    Attributes:
        label: what they are, in the legend.
        points: assisted and unassisted return, by the condition that each belongs to.
    """

    label: str
    points: Mapping[str, tuple[float, float]]


NO_MARKS = Marks("", {})


class _Content(NamedTuple):
    points: pl.DataFrame
    marks: Marks
    looks: Mapping[str, Look]


def frontier_figure(
    points: pl.DataFrame,
    drawn: Mapping[str, Look],
    marks: Marks | None = None,
) -> Figure:
    """Unassisted against assisted return of every condition of one learner, with 95% intervals.

    Above, the assistants that override; below, all conditions, and tight clusters enlarged.

    Args:
        points: a row per condition: condition, assistant, `assisted_` and `unassisted_` mean, low
            and high, overrides_mean, pareto.
        drawn: looks of the assistants.
        marks: points to compare with, drawn as hollow stars; None for none.

    Returns:
        The figure.
    """
    content = _Content(points, marks or NO_MARKS, drawn)
    main = overriding(points)
    if main.height in (0, points.height):
        main = points
    limits = _limits(main, content)
    offsets = _label_offsets(main, limits, content)
    clusters = _clusters(main, offsets)
    below = [points] * (main.height < points.height) + clusters
    with figure(10, 10.5 if below else 6) as drawing:
        parts = drawing.subfigures(2 if below else 1, 1, squeeze=False)[:, 0]
        axes = parts[0].subplots()
        _draw(axes, main, content, 6)
        _label(axes, main, offsets, clusters, content)
        axes.set(title="All conditions" if main is points else "Assistants that override")
        axes.set(xlim=limits[0], ylim=limits[1])
        panels = parts[1].subplots(1, len(below), squeeze=False)[0] if below else []
        for panel, rows in zip(panels, below, strict=True):
            if rows is points:
                _draw(panel, rows, content._replace(marks=NO_MARKS), 5)
                panel.set(title="All conditions")
            else:
                _draw(panel, rows, content, 5)
                _enlarge(panel, rows, content)
        drawing.legend(handles=_legend(content), loc="outside upper left", ncols=4)
    return drawing


def overriding(points: pl.DataFrame) -> pl.DataFrame:
    """Conditions whose assistant overrides; the swept ones of them, if there are any."""
    found = points.filter(pl.col("overrides_mean") > 0)
    swept = found.filter(pl.col("condition").str.contains("/", literal=True))
    return swept if swept.height else found


def _places(rows: pl.DataFrame) -> np.ndarray:
    return rows.select("assisted_mean", "unassisted_mean").to_numpy()


def draw_points(
    axes: Axes,
    rows: pl.DataFrame,
    drawn: Mapping[str, Look],
    size: float,
    measures: tuple[str, str] = ("assisted", "unassisted"),
    line: str = "",
) -> None:
    """A point with its intervals for each condition, assistant by assistant.

    Args:
        axes: to draw on.
        rows: a row per condition: assistant, and mean, low and high of both measures.
        drawn: looks of the assistants.
        size: of markers, in points.
        measures: to the right and upwards.
        line: style of what joins the conditions of an assistant, in their order; none if empty.
    """
    for part in rows.partition_by("assistant", maintain_order=True):
        name = str(part["assistant"][0])
        ends = [
            part.select(f"{measure}_{end}" for end in ("mean", "low", "high"))
            .cast(pl.Float64)
            .to_numpy()
            .T
            for measure in measures
        ]
        margins = [np.nan_to_num(np.abs(e[1:] - e[0])) for e in ends]
        axes.errorbar(
            ends[0][0], ends[1][0], xerr=margins[0], yerr=margins[1],
            fmt=drawn[name].marker + line, color=drawn[name].colour, markersize=size,
            elinewidth=1, linewidth=1.2, alpha=0.9, label=NAMES.get(name, name),
        )  # fmt: skip


def _draw(axes: Axes, rows: pl.DataFrame, content: _Content, size: float) -> None:
    """Points with their intervals, rings around Pareto-optimal ones, and what they bound."""
    draw_points(axes, rows, content.looks, size)
    axes.plot(*_places(rows.filter("pareto")).T, linestyle="none", markersize=2.1 * size, **_RING)
    for place, ink in _marked(rows, content):
        axes.plot(*place, markersize=17, markeredgewidth=1.6, color=ink, zorder=5, **_STAR)
    best = _places(content.points.filter("pareto").sort("assisted_mean")).T
    axes.plot(
        *best, ":", color="#777777", linewidth=1, drawstyle="steps-pre", zorder=1, scalex=False,
        scaley=False,
    )  # fmt: skip
    axes.set(**_AXES)
    write_in_full(axes.xaxis, axes.yaxis)


def _marked(rows: pl.DataFrame, content: _Content) -> list[tuple[tuple[float, float], str]]:
    """The marks of conditions and their colours."""
    marks = content.marks.points
    return [
        (marks[condition], content.looks[name].colour)
        for condition, name in rows.select("condition", "assistant").iter_rows()
        if condition in marks
    ]


def _legend(content: _Content) -> list[Line2D]:
    handles = [
        Line2D([], [], marker=look.marker, color=look.colour, label=NAMES.get(name, name))
        for name, look in content.looks.items()
        if name in content.points["assistant"]
    ]
    ring = Line2D([], [], linestyle=":", markersize=11, label="Pareto-optimal", **_RING)
    star = Line2D([], [], markersize=13, color="#555555", label=content.marks.label, **_STAR)
    return [*handles, ring] + [star] * bool(_marked(content.points, content))


def _limits(rows: pl.DataFrame, content: _Content) -> np.ndarray:
    """Limits of axes that hold all intervals and marks; float64 [2, 2]."""
    marks = np.array([place for place, _ in _marked(rows, content)]).reshape(-1, 2)
    limits = []
    for axis, measure in enumerate(("assisted", "unassisted")):
        ends = rows.select(f"{measure}_{part}" for part in ("mean", "low", "high"))
        values = np.append(ends.cast(pl.Float64).to_numpy().ravel(), marks[:, axis])
        low, high = np.nanmin(values), np.nanmax(values)
        room = 0.06 * (high - low) or 1.0
        limits.append((low - room, high + room))
    return np.array(limits)


def _label_offsets(rows: pl.DataFrame, limits: np.ndarray, content: _Content) -> np.ndarray:
    """Where labels of the main panel may stand, from their points in inches; float64 [N, 2]."""
    order = np.argsort(~rows["pareto"].to_numpy(), kind="stable")
    labels = [_name(str(rows["condition"][int(index)])) for index in order]
    marks = np.array([place for place, _ in _marked(rows, content)]).reshape(-1, 2)
    points = np.concatenate([_places(rows)[order], marks])
    places = (points - limits[:, 0]) / np.ptp(limits, axis=1) * _MAIN_SIZE
    offsets = np.full((rows.height, 2), np.nan)
    offsets[order] = room_for_labels(places, labels, _MAIN_SIZE)
    return offsets


def _clusters(rows: pl.DataFrame, offsets: np.ndarray) -> list[pl.DataFrame]:
    """The conditions of each assistant that lie too close together for their labels; two at most.

    Args:
        rows: the conditions that the main panel draws, in the order of `offsets`.
        offsets: where their labels stand, float64 [N, 2], from `room_for_labels`; NaN if they have
            no place.
    """
    marked = rows.with_columns(crowded=pl.Series(np.isnan(offsets[:, 0])))
    parts = marked.partition_by("assistant", maintain_order=True)
    return [part for part in parts if part["crowded"].sum() >= _CLUSTER][:2]


def _name(condition: str) -> str:
    """What distinguishes a condition from others of its assistant."""
    return setting(condition) or NAMES.get(condition, condition)


def _label(
    axes: Axes,
    rows: pl.DataFrame,
    offsets: np.ndarray,
    clusters: Sequence[pl.DataFrame],
    content: _Content,
) -> None:
    enlarged = {name for part in clusters for name in part["assistant"]}
    for row, offset in zip(rows.iter_rows(named=True), 72 * offsets, strict=True):
        if row["assistant"] not in enlarged and np.isfinite(offset[0]):
            axes.annotate(
                _name(row["condition"]), (row["assisted_mean"], row["unassisted_mean"]),
                xytext=tuple(offset), textcoords="offset points", fontsize=9, ha="center",
                va="center", color=content.looks[row["assistant"]].colour,
            )  # fmt: skip


def _thinned(rows: pl.DataFrame) -> pl.DataFrame:
    """So many conditions as there is room to label: Pareto-optimal ones, and evenly spread ones."""
    best, others = rows.filter("pareto").head(MOST_IN_A_COLUMN), rows.filter(~pl.col("pareto"))
    room = min(MOST_IN_A_COLUMN - best.height, others.height)
    spread = np.linspace(0, others.height - 1, room).round().astype(int)
    return pl.concat([best, others[spread.tolist()]])


def _enlarge(axes: Axes, rows: pl.DataFrame, content: _Content) -> None:
    """Look closely at a cluster; labels stand beside it, of Pareto-optimal conditions first."""
    name = str(rows["assistant"][0])
    (low, high), heights = _limits(rows, content._replace(marks=NO_MARKS))
    axes.set(xlim=(low, high + 0.6 * (high - low)), ylim=heights)
    chosen = _thinned(rows)
    labels = [_name(str(condition)) for condition in chosen["condition"]]
    label_in_column(axes, _places(chosen), labels, at=0.78, ink=content.looks[name].colour)
    axes.set(title=NAMES.get(name, name))
