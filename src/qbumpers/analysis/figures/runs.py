"""The same conditions in several runs, which differ in one thing each."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from qbumpers.analysis.figures.style import Look, assistant_of, figure, readable, show_returns
from qbumpers.analysis.measures import trial_samples
from qbumpers.analysis.statistics import mean_interval

_PANELS = {
    "assisted": "mean assisted return per episode",
    "unassisted": "mean unassisted return per episode",
}
_MEASURES = (*_PANELS, "assisted_success", "unassisted_success")
_FILLS = ("full", "none", "left", "bottom")
_SPREAD = 0.7  # of the height of a run, over which its conditions are drawn


def run_means(trials: pl.DataFrame) -> pl.DataFrame:
    """Mean returns and success rates of every condition of several runs.

    Args:
        trials: a row per run and trial: run, and the columns of `trial_measures`.

    Returns:
        A row per run and condition, those in the same order in every run: run, condition, trials,
        and `_mean`, `_low` and `_high` of `assisted`, `unassisted`, `assisted_success`,
        `unassisted_success`: 95% intervals over trials, null if unknown.
    """
    rows = []
    for run in trials["run"].unique(maintain_order=True):
        samples = trial_samples(trials.filter(run=run), *_MEASURES)
        known = [c for c in trials["condition"].unique(maintain_order=True) if c in samples]
        rows += [_row(run, condition, samples[condition]) for condition in known]
    return pl.DataFrame(rows).fill_nan(None)


def _row(run: str, condition: str, values: np.ndarray) -> dict[str, Any]:
    row: dict[str, Any] = {"run": run, "condition": condition, "trials": len(values)}
    for measure, numbers in zip(_MEASURES, values.T, strict=True):
        row |= {f"{measure}_{p}": number for p, number in mean_interval(numbers)._asdict().items()}
    return row


def runs_figure(numbers: pl.DataFrame, drawn: Mapping[str, Look]) -> Figure:
    """Assisted and unassisted returns, a row per run.

    Args:
        numbers: from `run_means`.
        drawn: looks of the assistants.

    Returns:
        The figure; bars are 95% intervals over trials.
    """
    runs = numbers["run"].unique(maintain_order=True).to_list()
    with figure(10, 1.3 + 0.62 * len(runs)) as drawing:
        panels = drawing.subplots(1, len(_PANELS), sharey=True)
        for axes, (measure, title) in zip(panels, _PANELS.items(), strict=True):
            _draw(axes, numbers, measure, drawn)
            for boundary in range(1, len(runs)):
                axes.axhline(boundary - 0.5, color="#cccccc", linewidth=0.8)
            axes.set_yticks(range(len(runs)), runs)
            axes.set(ylim=(len(runs) - 0.5, -0.5), xlabel=title)
            axes.grid(visible=False, axis="y")
            show_returns(axes, "x")
        handles, labels = panels[0].get_legend_handles_labels()
        drawing.legend(handles, labels, loc="outside upper left", ncols=4)
    return drawing


def _draw(axes: Axes, numbers: pl.DataFrame, measure: str, drawn: Mapping[str, Look]) -> None:
    """A marker with its interval for each condition, a little below the one before."""
    places = {run: place for place, run in enumerate(numbers["run"].unique(maintain_order=True))}
    conditions = numbers["condition"].unique(maintain_order=True).to_list()
    seen = dict.fromkeys(map(assistant_of, conditions), 0)
    for index, condition in enumerate(conditions):
        name = assistant_of(condition)
        rows = numbers.filter(condition=condition)
        ends = [f"{measure}_{part}" for part in ("mean", "low", "high")]
        mean, low, high = rows.select(pl.col(ends).cast(pl.Float64)).to_numpy().T
        heights = rows["run"].replace_strict(places, return_dtype=pl.Float64).to_numpy()
        heights = heights + _SPREAD * ((index + 0.5) / len(conditions) - 0.5)
        axes.hlines(heights, low, high, color=drawn[name].colour, linewidth=1.5)
        axes.plot(
            mean, heights, drawn[name].marker, color=drawn[name].colour, markersize=7,
            fillstyle=_FILLS[seen[name] % len(_FILLS)], markerfacecoloralt="white",
            label=readable(condition),
        )  # fmt: skip
        seen[name] += 1
