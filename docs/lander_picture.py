"""What was tried at Lunar Lander, and what comes before a crash, as a picture."""

from typing import Any

import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from writing import DOCS

from qbumpers.analysis.figures.style import figure

_BUMPERS, _TRIED, _SAVED = "#0072b2", "#d55e00", "#009e73"


def lander_picture(found: dict[str, Any]) -> Figure:
    """Draw rules in the plane of both returns, and the steps before a crash.

    Args:
        found: what `run_lander_rules.py` kept.
    """
    with figure(11, 4.4) as drawing:
        plane, crash = drawing.subplots(1, 2, width_ratios=(1.5, 1))
        _draw_rules(plane, found["rules"])
        _draw_crashes(crash, found["before"])
    return drawing


def _draw_rules(axes: Axes, rules: dict[str, Any]) -> None:
    kept = pl.read_csv(DOCS / "data" / "lunar-lander" / "trials.csv")
    kept = kept.filter(pl.col("assistant") == "stochastic-q-bumpers").group_by("alpha")
    settings = kept.agg(pl.col("assisted", "unassisted").mean()).sort("alpha")
    axes.plot(
        settings["assisted"], settings["unassisted"], "o-", color=_BUMPERS, alpha=0.4,
        label="bumpers, α from 0 to 1",
    )  # fmt: skip
    for name, each in rules.items():
        ink = _BUMPERS if name.startswith("bumpers") else _TRIED
        label = "rules that were tried" if name == list(rules)[1] else None
        axes.plot(each["assisted"], each["unassisted"], "D", color=ink, label=label)
        axes.annotate(
            name, (each["assisted"], each["unassisted"]), xytext=(-6, -3), ha="right",
            textcoords="offset points", fontsize=7,
        )  # fmt: skip
    axes.set(xlabel="assisted return", ylabel="unassisted return", title="Lunar Lander")
    axes.set(xlim=(95, 240))
    axes.legend(loc="lower left", fontsize=8)


def _draw_crashes(axes: Axes, before: dict[str, Any]) -> None:
    steps = [int(each) for each in before]
    values, corrected, saved, _ = zip(*before.values(), strict=True)
    axes.plot(steps, values, "o-", color=_BUMPERS, label="the expert's value")
    axes.plot(steps, corrected, "s-", color=_TRIED, label="corrected")
    axes.plot([], [], "^--", color=_SAVED, label="share saved by the expert")
    axes.set(xlabel="steps before a crash", ylabel="value of the state")
    axes.invert_xaxis()
    share = axes.twinx()
    share.plot(steps, saved, "^--", color=_SAVED)
    share.set(ylim=(-0.05, 1.05), ylabel="share saved")
    axes.legend(fontsize=8, loc="lower left")
