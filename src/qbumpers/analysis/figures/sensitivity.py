"""How sensitive results are to each swept option."""

from collections.abc import Mapping, Sequence

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from qbumpers.analysis.figures.style import DASHES, NAMES, Look, figure, write_in_full

_PANELS = {
    "assisted": "assisted return per episode",
    "unassisted": "unassisted return per episode",
    "override_rate": "steps overridden, per cent",
}
_PARTS = ("mean", "low", "high")
_MOST_LINES = 8


def sensitivities(summary: pl.DataFrame, options: Sequence[str]) -> pl.DataFrame:
    """Results against each numeric option that an assistant is swept over.

    Args:
        summary: rows of `summary.csv`, of one learner.
        options: its columns that are options of assistants.

    Returns:
        A row per option and condition: assistant, option, value, others (the other swept options,
        as text), condition, and mean, low and high of `assisted`, `unassisted`, `override_rate`;
        no rows if nothing is swept.
    """
    parts = []
    numeric = [name for name in options if summary.schema[name].is_numeric()]
    for rows in summary.partition_by("assistant", maintain_order=True):
        swept = [name for name in options if rows[name].drop_nulls().n_unique() > 1]
        for option in (name for name in swept if name in numeric):
            others = [
                pl.format("{}={}", pl.lit(name), pl.col(name)) for name in swept if name != option
            ]
            parts.append(
                rows.drop_nulls(option).select(
                    "assistant",
                    pl.lit(option).alias("option"),
                    pl.col(option).cast(pl.Float64).alias("value"),
                    pl.concat_str(others, separator=", ").alias("others")
                    if others
                    else pl.lit("").alias("others"),
                    "condition",
                    *(pl.col(f"{m}_{p}").cast(pl.Float64) for m in _PANELS for p in _PARTS),
                )
            )
    return pl.concat(parts) if parts else pl.DataFrame()


def sensitivity_figure(numbers: pl.DataFrame, drawn: Mapping[str, Look]) -> Figure:
    """Returns and overrides against each swept option, a row of panels for each of an assistant.

    Args:
        numbers: from `sensitivities`.
        drawn: looks of the assistants.

    Returns:
        The figure; bars are 95% intervals, each line is one choice of the other options.
    """
    groups = numbers.partition_by("assistant", "option", maintain_order=True)
    with figure(10, 0.4 + 2.6 * len(groups)) as drawing:
        panels = drawing.subplots(len(groups), len(_PANELS), squeeze=False)
        for row, group in zip(panels, groups, strict=True):
            name, option = str(group["assistant"][0]), str(group["option"][0])
            lines = group.partition_by("others", maintain_order=True)[:_MOST_LINES]
            for axes, (measure, title) in zip(row, _PANELS.items(), strict=True):
                places = _place(axes, np.unique(group["value"].to_numpy()))
                axes.set(xlabel="α" if option == "alpha" else option, ylabel=title)
                _draw(axes, lines, measure, places, drawn[name])
                write_in_full(axes.yaxis)
            row[0].set_title(NAMES.get(name, name))
            if len(lines) > 1:
                row[-1].legend(fontsize=7)
    return drawing


def _place(axes: Axes, values: np.ndarray) -> dict[float, float]:
    """Places of values on the axis: evenly spaced if some are too close to be distinguished."""
    if np.diff(values).min() >= np.ptp(values) / 40:
        return {value: value for value in values.tolist()}
    step = max(1, len(values) // 14)
    shown = range(0, len(values), step)
    axes.set_xticks(shown, [f"{values[place]:g}" for place in shown], rotation=90, fontsize=8)
    return {value: float(place) for place, value in enumerate(values.tolist())}


def _draw(
    axes: Axes,
    lines: Sequence[pl.DataFrame],
    measure: str,
    places: Mapping[float, float],
    look: Look,
) -> None:
    factor = 100 if measure == "override_rate" else 1
    for index, line in enumerate(lines):
        rows = line.sort("value")
        mean, low, high = (factor * rows[f"{measure}_{part}"].to_numpy() for part in _PARTS)
        axes.errorbar(
            [places[value] for value in rows["value"]], mean,
            yerr=np.nan_to_num([mean - low, high - mean]),
            fmt=look.marker + DASHES[index % len(DASHES)], color=look.colour, markersize=4,
            alpha=1 - 0.7 * index / _MOST_LINES, elinewidth=1, label=str(rows["others"][0]),
        )  # fmt: skip
