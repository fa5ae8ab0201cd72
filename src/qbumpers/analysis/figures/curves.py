"""What happens by episode: learning curves, and the course of overrides."""

from collections.abc import Mapping, Sequence
from typing import Any

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
    stretch,
)
from qbumpers.analysis.measures import learning_curve, override_curve

_PANELS = {"assisted_return": "With the assistant", "unassisted_return": "Without it"}


def representative(summary: pl.DataFrame, each: int = 2) -> list[str]:
    """A few conditions that stand for the rest.

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


def learning_curves(episodes: pl.DataFrame, conditions: Sequence[str]) -> pl.DataFrame:
    """Returns by episode, with 95% intervals over trials.

    Args:
        episodes: as in `episodes.parquet`.
        conditions: which ones.

    Returns:
        A row a condition and episode: condition, episode (from 1), retention, and `_mean`, `_low`
        and `_high` of `assisted_return` and `unassisted_return`.
    """
    retained = episodes.filter("retention")["episode"].min()
    parts = []
    for condition in conditions:
        curves = {column: learning_curve(episodes, condition, column) for column in _PANELS}
        part = _course(condition, curves)
        first = part.height + 1 if retained is None else int(str(retained)) + 1
        parts.append(part.with_columns(retention=pl.col("episode") >= first))
    return pl.concat(parts)


def override_courses(episodes: pl.DataFrame, conditions: Sequence[str]) -> pl.DataFrame:
    """Share of steps overridden by episode of training, with 95% intervals over trials.

    Args:
        episodes: as in `episodes.parquet`.
        conditions: which ones.

    Returns:
        A row a condition and episode: condition, episode (from 1), `override_rate_mean`, `_low`
        and `_high`.
    """
    parts = [_course(c, {"override_rate": override_curve(episodes, c)}) for c in conditions]
    return pl.concat(parts)


def _course(condition: str, curves: Mapping[str, np.ndarray]) -> pl.DataFrame:
    columns: dict[str, Any] = {
        f"{name}_{part}": values
        for name, curve in curves.items()
        for part, values in zip(("mean", "low", "high"), curve, strict=True)
    }
    length = len(next(iter(columns.values())))
    numbers = pl.DataFrame({"episode": np.arange(1, length + 1), **columns}, nan_to_null=True)
    return numbers.select(pl.lit(condition).alias("condition"), pl.all())


def curves_figure(curves: pl.DataFrame, drawn: Mapping[str, Look]) -> Figure:
    """Return by episode with the assistant and, after each, without it.

    Args:
        curves: from `learning_curves`.
        drawn: looks of the assistants.

    Returns:
        The figure; bands are 95% intervals over trials, episodes of retention stand on grey.
    """
    with figure(10, 5.4) as drawing:
        for axes, (column, title) in zip(drawing.subplots(1, 2), _PANELS.items(), strict=True):
            _draw(axes, curves, column, drawn)
            stretch(axes, "y")
            axes.set(xlabel="episode", ylabel="return", title=title)
            retained = curves.filter("retention")["episode"]
            if len(retained):
                span = retained.to_numpy()
                axes.axvspan(span.min() - 0.5, span.max() + 0.5, color="#eeeeee", zorder=0)
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
        percentages = courses.with_columns(pl.selectors.starts_with("override_rate") * 100)
        _draw(axes, percentages, "override_rate", drawn)
        axes.set(xlabel="episode", ylabel="steps overridden, per cent")
        axes.set_ylim(bottom=min(0.0, *axes.get_ylim()))
        _legend(drawing)
    return drawing


def _draw(axes: Axes, curves: pl.DataFrame, column: str, drawn: Mapping[str, Look]) -> None:
    """A line with a band for each condition, told apart by colour, marker and dashes."""
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
