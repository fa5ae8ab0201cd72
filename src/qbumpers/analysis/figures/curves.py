"""Learning curves: returns by episode."""

from collections.abc import Sequence

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from qbumpers.analysis.figures.style import colour, figure, readable
from qbumpers.analysis.measures import learning_curve

_DASHES = ("-", "--", ":", "-.")


def representative(summary: pl.DataFrame, each: int = 2) -> list[str]:
    """A few conditions that stand for the rest.

    Args:
        summary: the table of `summary.csv`.
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


def curves_figure(episodes: pl.DataFrame, conditions: Sequence[str]) -> Figure:
    """Return by episode with the assistant and, after each, without it.

    Args:
        episodes: as in `episodes.parquet`.
        conditions: which ones.

    Returns:
        The figure; bands are 95% intervals over trials.
    """
    panels = {"assisted_return": "With the assistant", "unassisted_return": "Without it"}
    with figure(10, 5.4) as drawing:
        for axes, (column, title) in zip(drawing.subplots(1, 2), panels.items(), strict=True):
            seen: dict[str, int] = {}
            for condition in conditions:
                name = condition.partition("/")[0]
                dash = _DASHES[seen.setdefault(name, 0) % len(_DASHES)]
                seen[name] += 1
                mean, low, high = learning_curve(episodes, condition, column)
                number = np.arange(1, len(mean) + 1)
                axes.plot(number, mean, dash, color=colour(name), label=readable(condition))
                axes.fill_between(number, low, high, color=colour(name), alpha=0.13, linewidth=0)
            _stretch(axes)
            axes.set(xlabel="episode", ylabel="return", title=title)
        handles, labels = drawing.axes[0].get_legend_handles_labels()
        drawing.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=9)
    return drawing


def _stretch(axes: Axes) -> None:
    """Show returns of very different size: linear within -100..100, logarithmic beyond."""
    low, high = axes.get_ylim()
    if low < -300 or high > 300:
        axes.set_yscale("symlog", linthresh=100, linscale=1.2)
        ticks = [
            t for t in (-10_000, -3000, -1000, -300, -100, 0, 100, 300, 1000) if low <= t <= high
        ]
        axes.set_yticks(ticks, [f"{tick:,}".replace("-", "\N{MINUS SIGN}") for tick in ticks])
        axes.minorticks_off()
