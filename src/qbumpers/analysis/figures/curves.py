"""What happens by episode: learning curves, and the course of overrides."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from qbumpers.analysis.figures.style import (
    DASHES,
    Look,
    assistant_of,
    figure,
    readable,
    show_returns,
)
from qbumpers.analysis.measures import learning_curve, override_curve

MOST_POINTS = 100
"""Curves of longer trainings are of means over blocks of episodes, so many or fewer."""

_UNITS = {
    "return": "return per episode",
    "success": "episodes that succeed, per cent",
    "crash": "episodes that crash, per cent",
}
_PANELS = {"assisted": "Assisted", "unassisted": "Unassisted"}


def representative(summary: pl.DataFrame, each: int = 2) -> list[str]:
    """A few conditions that represent the rest.

    Args:
        summary: rows of `summary.csv`, of one learner.
        each: at most so many of each assistant, spread evenly over its conditions.

    Returns:
        Ids of conditions, in the order of the experiment.
    """
    chosen = []
    overriding = summary.filter((pl.col("overrides_mean") > 0) | (pl.col("assistant") == "none"))
    if overriding.is_empty():
        overriding = summary
    for part in overriding.partition_by("assistant", maintain_order=True):
        places = np.linspace(0, part.height - 1, min(each, part.height)).round().astype(int)
        chosen += [str(part["condition"][int(place)]) for place in places]
    return chosen


def block_size(training: int) -> int:
    """How many successive episodes of a training make a point of a curve."""
    return max(1, -(-training // MOST_POINTS))


class _Blocks(NamedTuple):
    """Blocks of episodes.

    Attributes:
        starts: int [B], the first episodes, from 0; retention begins a block.
        middles: float64 [B], the middles, of episodes counted from 1.
        retained: bool [B], whether they are of retention.
    """

    starts: np.ndarray
    middles: np.ndarray
    retained: np.ndarray


def _blocks(episodes: pl.DataFrame) -> _Blocks:
    length = episodes["episode"].n_unique()
    training = episodes.filter(~pl.col("retention"))["episode"].n_unique()
    size = block_size(training)
    starts = np.concatenate([np.arange(0, training, size), np.arange(training, length, size)])
    widths = np.diff(np.append(starts, length))
    return _Blocks(starts, starts + (widths + 1) / 2, starts >= training)


def learning_curves(
    episodes: pl.DataFrame, conditions: Sequence[str], measure: str = "return"
) -> pl.DataFrame:
    """A measure by episode, with 95% intervals over trials.

    Args:
        episodes: as in `episodes.parquet`.
        conditions: which ones.
        measure: "return", "success" or "crash".

    Returns:
        A row per condition and episode, or block of episodes if there are more than
        `MOST_POINTS`: condition, episode (from 1; the middle of a block), retention, and `_mean`,
        `_low` and `_high` of the measure's `assisted_` and `unassisted_` column.
    """
    blocks = _blocks(episodes)
    parts = []
    for condition in conditions:
        names = [f"{side}_{measure}" for side in _PANELS]
        curves = {name: learning_curve(episodes, condition, name, blocks.starts) for name in names}
        part = _course(condition, curves, blocks.middles)
        parts.append(part.with_columns(retention=pl.Series(blocks.retained)))
    return pl.concat(parts)


def override_courses(episodes: pl.DataFrame, conditions: Sequence[str]) -> pl.DataFrame:
    """Share of steps overridden by episode of training, with 95% intervals over trials.

    Args:
        episodes: as in `episodes.parquet`.
        conditions: which ones.

    Returns:
        A row per condition and episode, or block of episodes as for `learning_curves`: condition,
        episode (from 1; the middle of a block), `override_rate_mean`, `_low` and `_high`.
    """
    blocks = _blocks(episodes.filter(~pl.col("retention")))
    return pl.concat(
        _course(c, {"override_rate": override_curve(episodes, c, blocks.starts)}, blocks.middles)
        for c in conditions
    )


def _course(condition: str, curves: Mapping[str, np.ndarray], middles: np.ndarray) -> pl.DataFrame:
    columns: dict[str, Any] = {
        f"{name}_{part}": values
        for name, curve in curves.items()
        for part, values in zip(("mean", "low", "high"), curve, strict=True)
    }
    numbers = pl.DataFrame({"episode": middles, **columns}, nan_to_null=True)
    return numbers.select(pl.lit(condition).alias("condition"), pl.all())


def curves_figure(
    curves: pl.DataFrame, drawn: Mapping[str, Look], measure: str = "return"
) -> Figure:
    """A measure by episode, assisted and, after each, unassisted.

    Args:
        curves: from `learning_curves`.
        drawn: looks of the assistants.
        measure: the same as there; rates are drawn as percentages.

    Returns:
        The figure; bands are 95% intervals over trials, episodes of retention stand on grey.
    """
    with figure(10, 5.4) as drawing:
        for axes, (side, title) in zip(drawing.subplots(1, 2), _PANELS.items(), strict=True):
            if measure == "return":
                _draw(axes, curves, f"{side}_return", drawn)
                show_returns(axes, "y")
            else:
                _draw(axes, _percentages(curves, f"{side}_{measure}"), f"{side}_{measure}", drawn)
                axes.set(ylim=(-4, 104))
            axes.set(xlabel="episode", ylabel=_UNITS[measure], title=title)
            retained = curves.filter("retention")["episode"]
            if len(retained):
                last = curves.filter(~pl.col("retention"))["episode"].to_numpy().max()
                first, end = retained.to_numpy().min(), retained.to_numpy().max()
                axes.axvspan((last + first) / 2, end + 0.5, color="#eeeeee", zorder=0)
        _legend(drawing)
    return drawing


def courses_figure(courses: pl.DataFrame, drawn: Mapping[str, Look]) -> Figure:
    """Share of steps overridden, by episode.

    Args:
        courses: from `override_courses`.
        drawn: looks of the assistants.

    Returns:
        The figure; bands are 95% intervals over trials.
    """
    with figure(10, 4.4) as drawing:
        axes = drawing.subplots()
        _draw(axes, _percentages(courses, "override_rate"), "override_rate", drawn)
        axes.set(xlabel="episode", ylabel="steps overridden, per cent")
        axes.set_ylim(bottom=-0.02 * axes.get_ylim()[1])
        _legend(drawing)
    return drawing


def _percentages(curves: pl.DataFrame, column: str) -> pl.DataFrame:
    """Shares as percentages; what a band claims below 0 or above 100 is left out."""
    return curves.with_columns((pl.selectors.starts_with(column) * 100).clip(0, 100))


def _draw(axes: Axes, curves: pl.DataFrame, column: str, drawn: Mapping[str, Look]) -> None:
    """A line with a band for each condition, distinguished by colour, marker and dashes."""
    conditions = curves["condition"].unique(maintain_order=True).to_list()
    seen = dict.fromkeys(drawn, 0)
    for place, condition in enumerate(conditions):
        name = assistant_of(condition)
        rows = curves.filter(condition=condition)
        number = rows["episode"].to_numpy()
        mean, low, high = (
            rows[f"{column}_{part}"].cast(pl.Float64).to_numpy() for part in ("mean", "low", "high")
        )
        gap = max(1, len(number) // 8)
        axes.plot(
            number, mean, DASHES[seen[name] % len(DASHES)], color=drawn[name].colour,
            marker=drawn[name].marker, markevery=(place * gap // len(conditions), gap),
            markersize=5, label=readable(condition),
        )  # fmt: skip
        axes.fill_between(number, low, high, color=drawn[name].colour, alpha=0.13, linewidth=0)
        seen[name] += 1


def _legend(drawing: Figure) -> None:
    handles, labels = drawing.axes[0].get_legend_handles_labels()
    drawing.legend(
        handles, labels, loc="outside lower center", ncols=3, fontsize=9, handlelength=3.2
    )
