"""The figure of performance and learning as points that can be read one by one."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from matplotlib.ticker import MaxNLocator

from qbumpers.analysis.figures.frontier import overriding
from qbumpers.analysis.figures.style import looks, readable
from qbumpers.analysis.findings import LearnerFindings
from qbumpers.analysis.formatting import decimals_for, decimals_of, format_number, format_share

WIDTH, HEIGHT, LEFT, BELOW = 560, 380, 86, 52
"""Of a panel and of its margins, in its own units."""

_TOP, _RIGHT = 12, 14


class Point(NamedTuple):
    """A condition in a panel; places in its units, from the upper left.

    Attributes:
        x: where the mean assisted return lies.
        y: where the mean unassisted return lies.
        left: end of the bar of the assisted return.
        right: the other end.
        top: end of the bar of the unassisted return.
        bottom: the other end.
        colour: as "#rrggbb".
        pareto: whether it is Pareto-optimal.
        name: the condition in words.
        numbers: what it returned, in lines.
    """

    x: float
    y: float
    left: float
    right: float
    top: float
    bottom: float
    colour: str
    pareto: bool
    name: str
    numbers: Sequence[str]


class Panel(NamedTuple):
    """A panel of points.

    Attributes:
        title: which conditions it shows.
        across: places and texts of the numbers on the horizontal axis.
        up: the same of the vertical axis.
        points: in the order of the experiment, which is that of the keyboard.
    """

    title: str
    across: Sequence[tuple[float, str]]
    up: Sequence[tuple[float, str]]
    points: Sequence[Point]


def panels(about: LearnerFindings) -> list[Panel]:
    """Panels of points: those that override, if others would crowd them, and all."""
    shown = overriding(about.frontier)
    colours = {name: look.colour for name, look in looks(about.summary["assistant"]).items()}
    parts = [("Assistants that override", shown)] if 1 < shown.height < about.summary.height else []
    return [
        _panel(title, rows, colours, about.decimals)
        for title, rows in (*parts, ("All conditions", about.frontier))
    ]


def _panel(title: str, rows: pl.DataFrame, colours: dict[str, str], decimals: int) -> Panel:
    wide, high = WIDTH - LEFT - _RIGHT, HEIGHT - _TOP - BELOW
    (left, right), (low, top) = (_limits(rows, measure) for measure in ("assisted", "unassisted"))

    def across(value: float) -> float:
        return round(LEFT + wide * (value - left) / (right - left), 1)

    def up(value: float) -> float:
        return round(_TOP + high * (top - value) / (top - low), 1)

    points = []
    for row in rows.iter_rows(named=True):
        sides, heights = (_ends(row, measure) for measure in ("assisted", "unassisted"))
        points.append(
            Point(
                x=across(row["assisted_mean"]),
                y=up(row["unassisted_mean"]),
                left=across(sides[0]),
                right=across(sides[1]),
                top=up(heights[1]),
                bottom=up(heights[0]),
                colour=colours[row["assistant"]],
                pareto=bool(row["pareto"]),
                name=readable(row["condition"]),
                numbers=_numbers(row, decimals),
            )
        )
    return Panel(title, _ticks(left, right, across, 5), _ticks(low, top, up, 6), points)


def _ends(row: dict[str, Any], measure: str) -> tuple[float, float]:
    """Ends of an interval; both the mean itself without one."""
    ends = (row[f"{measure}_low"], row[f"{measure}_high"])
    return (row[f"{measure}_mean"],) * 2 if None in ends else ends


def _limits(rows: pl.DataFrame, measure: str) -> tuple[float, float]:
    """Limits of an axis that hold all intervals, with a margin."""
    ends = np.array([_ends(row, measure) for row in rows.iter_rows(named=True)])
    low, high = float(ends.min()), float(ends.max())
    margin = 0.06 * (high - low) or max(1.0, abs(high)) * 0.06
    return low - margin, high + margin


def _ticks(low: float, high: float, place: Any, most: int) -> list[tuple[float, str]]:
    found = np.asarray(MaxNLocator(most).tick_values(low, high))
    values = [value for value in found.tolist() if low <= value <= high]
    # As many decimals as the places have: a rounded number would stand at another's place.
    exact = (d for d in range(12) if np.allclose(np.round(values, d), values, atol=0, rtol=1e-9))
    digits = next(exact, 12)
    return [(place(value), format_number(value, digits)) for value in values]


def _numbers(row: dict[str, Any], decimals: int) -> list[str]:
    lines = []
    for measure in ("assisted", "unassisted"):
        mean, low, high = (row[f"{measure}_{part}"] for part in ("mean", "low", "high"))
        digits = decimals_for(low, high, decimals)
        written = [format_number(value, digits) for value in (mean, low, high)]
        interval = f" [{written[1]}, {written[2]}]" if low is not None else ", no interval"
        lines.append(f"{measure} return {written[0]}{interval} per episode")
    overrides = row["overrides_mean"]
    lines.append(f"{format_number(overrides, decimals_of([0.0, overrides]))} overrides per episode")
    optimal = "Pareto-optimal" if row["pareto"] else "not Pareto-optimal"
    if row["probability"] is not None:
        optimal += f"; in {format_share(row['probability'])} of the resamples it is"
    return [*lines, optimal]
