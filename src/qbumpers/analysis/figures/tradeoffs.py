"""Unassisted returns, successes and crashes against assisted ones."""

from collections.abc import Mapping, Sequence

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from qbumpers.analysis.figures.frontier import draw_points
from qbumpers.analysis.figures.labels import room_for_labels
from qbumpers.analysis.figures.style import Look, figure, show_returns

PANELS = {
    ("assisted", "unassisted"): "Return per episode (better ↗)",
    ("assisted_success", "unassisted_success"): "Success rate, per cent (better ↗)",
    ("assisted_crash", "unassisted_crash"): "Crash rate, per cent (better ↙)",
}
"""Measures to the right and upwards, and what they are."""

MOST_LABELS = 5
"""Of a method, in a panel: the ends of its sweep and a few settings between them."""

_PARTS = ("mean", "low", "high")
_PANEL_SIZE = np.array([2.9, 3.0])  # in inches, about


def tradeoffs(summary: pl.DataFrame) -> pl.DataFrame:
    """What is known of returns, successes and crashes of every condition.

    Args:
        summary: rows of `summary.csv`, of one learner.

    Returns:
        A row per condition, those of each assistant by growing alpha: condition, assistant, alpha,
        and mean, low and high of the measures of `PANELS` that are known; no rows if those are
        the returns alone.
    """
    known = [m for pair in PANELS for m in pair if f"{m}_mean" in summary.columns]
    if len(known) <= 2:
        return pl.DataFrame()
    alpha = pl.col("alpha") if "alpha" in summary.columns else pl.lit(None, pl.Float64)
    columns = [pl.col(f"{measure}_{part}").cast(pl.Float64) for measure in known for part in _PARTS]
    table = summary.select("condition", "assistant", alpha.alias("alpha"), *columns)
    parts = table.partition_by("assistant", maintain_order=True)
    return pl.concat(part.sort("alpha", maintain_order=True) for part in parts)


def tradeoffs_figure(numbers: pl.DataFrame, drawn: Mapping[str, Look]) -> Figure:
    """A panel per measure: unassisted upwards, assisted to the right.

    Args:
        numbers: from `tradeoffs`.
        drawn: looks of the assistants.

    Returns:
        The figure; lines join the settings of a method by alpha, bars are 95% intervals.
    """
    shown = {pair: title for pair, title in PANELS.items() if f"{pair[0]}_mean" in numbers.columns}
    with figure(1.2 + 3.3 * len(shown), 4.4) as drawing:
        panels = drawing.subplots(1, len(shown), squeeze=False)[0]
        for axes, (pair, title) in zip(panels, shown.items(), strict=True):
            rows = numbers
            if pair != ("assisted", "unassisted"):
                rows = numbers.with_columns(pl.selectors.starts_with(*pair) * 100)
            draw_points(axes, rows, drawn, 5, pair, line="-")
            if pair == ("assisted", "unassisted"):
                show_returns(axes, "x")
                show_returns(axes, "y")
            else:
                _within(axes)
            axes.set(title=title, xlabel="assisted", ylabel="unassisted")
            _label(axes, rows, pair, drawn)
        handles, labels = panels[0].get_legend_handles_labels()
        numbered = any(axes.texts for axes in panels)
        drawing.legend(
            handles, labels, loc="outside lower center", ncols=4, fontsize=9,
            title="Numbers at points are α" if numbered else None, title_fontsize=9,
        )  # fmt: skip
    return drawing


def _within(axes: Axes) -> None:
    """Limits that go hardly beyond 0 and 100 per cent, whatever margins there are."""
    for limits, narrow in ((axes.get_xlim(), axes.set_xlim), (axes.get_ylim(), axes.set_ylim)):
        narrow(max(limits[0], -4), min(limits[1], 104))


def _label(
    axes: Axes, rows: pl.DataFrame, pair: tuple[str, str], drawn: Mapping[str, Look]
) -> None:
    """The alpha of a few points of each method, if there is room."""
    axes.autoscale_view()  # now, since places in inches depend on the limits
    places = rows.select(f"{measure}_mean" for measure in pair).to_numpy()
    inches = axes.transAxes.inverted().transform(axes.transData.transform(places)) * _PANEL_SIZE
    chosen = labelled(rows["assistant"].to_list(), rows["alpha"].to_list())
    rest = [place for place in range(rows.height) if place not in chosen]
    texts = [f"{rows['alpha'][place]:g}" for place in chosen]
    offsets = room_for_labels(inches[[*chosen, *rest]], texts, _PANEL_SIZE)
    for place, text, offset in zip(chosen, texts, 72 * offsets, strict=True):
        if np.isfinite(offset[0]):
            axes.annotate(
                text, tuple(places[place]), xytext=tuple(offset), textcoords="offset points",
                fontsize=8, ha="center", va="center",
                color=drawn[str(rows["assistant"][place])].colour,
                path_effects=[withStroke(linewidth=2, foreground="white")],
            )  # fmt: skip


def labelled(assistants: Sequence[str], alphas: Sequence[float | None]) -> list[int]:
    """Which conditions to label with their alpha, those that matter most first.

    Args:
        assistants: name of the assistant of each condition.
        alphas: alpha of each condition; None if its assistant has none.

    Returns:
        Places of at most `MOST_LABELS` conditions of each assistant that has several: the ends of
        its sweep, then those nearest to evenly spaced alphas between them.
    """
    ends, between = [], []
    for name in dict.fromkeys(assistants):
        own = {
            place: alpha
            for place, (other, alpha) in enumerate(zip(assistants, alphas, strict=True))
            if other == name and alpha is not None
        }
        if len(own) < 2:
            continue
        places, values = list(own), np.array(list(own.values()))
        wanted = np.linspace(values.min(), values.max(), MOST_LABELS)
        nearest = [places[int(np.argmin(np.abs(values - alpha)))] for alpha in wanted]
        ends += [nearest[0], nearest[-1]]
        between += nearest[1:-1]
    return list(dict.fromkeys([*ends, *between]))
