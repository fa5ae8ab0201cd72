"""Conditions one below the other: how trials spread, and how conditions differ from a control."""

from collections.abc import Mapping, Sequence

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from qbumpers.analysis.figures.style import Look, assistant_of, figure, readable, show_returns

MOST_ROWS = 60
"""More conditions than these are too many for a figure."""

_PANELS = ("assisted", "unassisted")
_QUANTILES = {"low": 0.05, "quarter": 0.25, "median": 0.5, "three_quarters": 0.75, "high": 0.95}
_MOST_DOTS = 100  # of a condition; more trials only make a smear


def spreads(trials: pl.DataFrame, conditions: Sequence[str]) -> pl.DataFrame:
    """How the mean returns of trials are distributed.

    Args:
        trials: from `trial_measures`.
        conditions: which ones.

    Returns:
        A row per condition and measure: measure, condition, and quantiles: low (5%), quarter,
        median, three_quarters, high (95%); of a single trial, the median alone.
    """
    chosen = trials.filter(pl.col("condition").is_in(list(conditions)))
    parts = [
        chosen.group_by("condition", maintain_order=True)
        .agg(
            pl.when((pl.len() > 1) | pl.lit(name == "median"))
            .then(pl.col(measure).quantile(share, "linear"))
            .alias(name)
            for name, share in _QUANTILES.items()
        )
        .select(pl.lit(measure).alias("measure"), pl.all())
        for measure in _PANELS
    ]
    return pl.concat(parts)


def spreads_figure(spread: pl.DataFrame, trials: pl.DataFrame, drawn: Mapping[str, Look]) -> Figure:
    """Distribution over trials of their mean returns, a row per condition.

    Args:
        spread: from `spreads`.
        trials: from `trial_measures`; up to 100 of each condition are drawn as dots.
        drawn: looks of the assistants.

    Returns:
        The figure: markers at medians, thick lines over the middle half of the trials, thin ones
        from the 5% to the 95% quantile.
    """
    conditions = spread["condition"].unique(maintain_order=True).to_list()
    with figure(10, 1 + 0.21 * len(conditions)) as drawing:
        panels = drawing.subplots(1, len(_PANELS), sharey=True)
        for axes, measure in zip(panels, _PANELS, strict=True):
            _draw_dots(axes, trials, conditions, measure, drawn)
            rows = spread.filter(measure=measure)
            places = rows.select("low", "quarter", "median", "three_quarters", "high")
            _draw_rows(axes, conditions, places.cast(pl.Float64).to_numpy(), drawn)
            axes.set(xlabel=f"mean {measure} return per episode")
    return drawing


def differences_figure(differences: pl.DataFrame, drawn: Mapping[str, Look]) -> Figure:
    """How mean returns differ from a control's, a row per condition.

    Args:
        differences: a row per measure and condition: measure, condition, `difference_mean`, `_low`,
            `_high`, simultaneous_low, simultaneous_high.
        drawn: looks of the assistants.

    Returns:
        The figure: thick lines are 95% intervals of each alone, thin ones hold simultaneously.
    """
    conditions = differences["condition"].unique(maintain_order=True).to_list()
    with figure(10, 1 + 0.21 * len(conditions)) as drawing:
        panels = drawing.subplots(1, len(_PANELS), sharey=True)
        for axes, measure in zip(panels, _PANELS, strict=True):
            rows = differences.filter(measure=measure)
            ends = ("simultaneous_low", "difference_low", "difference_mean", "difference_high",
                    "simultaneous_high")  # fmt: skip
            axes.axvline(0, color="#555555", linewidth=1)
            _draw_rows(axes, conditions, rows.select(ends).cast(pl.Float64).to_numpy(), drawn)
            axes.set(xlabel=f"difference in mean {measure} return per episode")
    return drawing


def _draw_rows(
    axes: Axes, conditions: Sequence[str], places: np.ndarray, drawn: Mapping[str, Look]
) -> None:
    """A marker, a thick and a thin line for each condition.

    Args:
        axes: to draw on.
        conditions: C of them, the first on top.
        places: float64 [C, 5]: ends of the thin line, ends of the thick one, the marker between.
        drawn: looks of the assistants.
    """
    names = np.array([assistant_of(condition) for condition in conditions])
    for name in dict.fromkeys(names.tolist()):
        (heights,) = np.nonzero(names == name)
        thin_low, low, middle, high, thin_high = places[heights].T
        look = drawn[name]
        axes.hlines(heights, thin_low, thin_high, color=look.colour, linewidth=1)
        axes.hlines(heights, low, high, color=look.colour, linewidth=3)
        axes.plot(
            middle, heights, look.marker, color=look.colour, markersize=6, markeredgecolor="white",
            markeredgewidth=0.8,
        )  # fmt: skip
    axes.set_yticks(range(len(conditions)), [readable(c) for c in conditions], fontsize=8)
    axes.set_ylim(len(conditions) - 0.4, -0.6)
    show_returns(axes, "x")


def _draw_dots(
    axes: Axes,
    trials: pl.DataFrame,
    conditions: Sequence[str],
    measure: str,
    drawn: Mapping[str, Look],
) -> None:
    height = {condition: place for place, condition in enumerate(conditions)}
    chosen = trials.filter(pl.col("condition").is_in(list(conditions)))
    chosen = chosen.group_by("condition", maintain_order=True).head(_MOST_DOTS)
    # Heights follow the golden ratio, which spreads any number of dots evenly, without chance.
    aside = 0.6 * (np.arange(chosen.height) * 0.618034 % 1 - 0.5)
    axes.scatter(
        chosen[measure].to_numpy(),
        chosen["condition"].replace_strict(height, return_dtype=pl.Float64).to_numpy() + aside,
        c=[drawn[name].colour for name in chosen["assistant"]], s=5, alpha=0.25, linewidths=0,
        rasterized=True,
    )  # fmt: skip
