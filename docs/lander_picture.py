"""What was tried at Lunar Lander, in the plane of both returns."""

from typing import Any

import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from writing import DOCS

from qbumpers.analysis.figures.style import figure

_MARKERS = "ov^<>spDP"
_BUMPERS = "#0072b2"
_INKS = (_BUMPERS, "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#999999",
         "#8b4513")  # fmt: skip
_CLOSE = ((180, 240), (125, 240))


def lander_picture(rules: dict[str, Any]) -> Figure:
    """Draw rules among the settings of bumpers, all of them and those that learn well.

    Args:
        rules: by name, what `run_lander_rules.py` kept of each.
    """
    with figure(11, 4.2) as drawing:
        plane, close = drawing.subplots(1, 2)
        for axes in (plane, close):
            _draw(axes, rules)
        plane.set(title="All", xlim=(120, 240))
        close.set(title="Those that learn well", xlim=_CLOSE[0], ylim=_CLOSE[1])
        close.legend(loc="center left", bbox_to_anchor=(1, 0.5), fontsize=8)
    return drawing


def _draw(axes: Axes, rules: dict[str, Any]) -> None:
    kept = pl.read_csv(DOCS / "data" / "lunar-lander" / "trials.csv")
    kept = kept.filter(pl.col("assistant") == "stochastic-q-bumpers").group_by("alpha")
    settings = kept.agg(pl.col("assisted", "unassisted").mean()).sort("alpha")
    axes.plot(
        settings["assisted"], settings["unassisted"], ".-", color=_BUMPERS, alpha=0.4,
        label="bumpers, α from 0 to 1,\nof the page on Lunar Lander",
    )  # fmt: skip
    for (name, each), marker, ink in zip(rules.items(), _MARKERS, _INKS, strict=True):
        axes.errorbar(
            each["assisted"], each["unassisted"], each["unassisted_error"], each["assisted_error"],
            marker=marker, color=ink, label=name, linestyle="none", elinewidth=0.8,
        )  # fmt: skip
    axes.set(xlabel="assisted return", ylabel="unassisted return")
