"""Figures of a comparison, drawn from its tables."""

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from qbumpers.analysis.figures.style import Look, figure, looks, readable, show_returns
from qbumpers.analysis.page.elements import Drawing
from qbumpers.comparison.methods import ANCHORS, BASELINE
from qbumpers.comparison.scores import Tables

_ACROSS = 3
_PANEL = 3.3  # width of a panel, in inches
_WIDEST = 11  # inches
_LEGEND_COLUMNS = 5
_FAR = 1000  # from which on the axis is logarithmic, and needs more space beyond the last point
_SHOWN, _LIMITS = (-0.5, 1.05), (-0.6, 1.15)  # of normalised returns


def drawings(tables: Tables) -> list[Drawing]:
    """Every figure of a comparison.

    Args:
        tables: from `find_tables`.

    Returns:
        The figures: planes by learner, the plane at matched shares, scores over cases, ranks.
    """
    drawn = looks([*ANCHORS, BASELINE, *tables.methods["method"]])
    learners = tables.cases["learner"].unique(maintain_order=True).to_list()
    found = [
        Drawing(
            "planes",
            learner.replace("/", "-") if len(learners) > 1 else "",
            "Mean unassisted return against mean assisted return, a panel per task. Lines join the "
            "settings of a method, from much help to little; the cross is the best return. Dashed "
            "lines are the lower sides of the box in which methods are scored. Points beyond an "
            "axis are drawn on its end.",
            tables.points.filter(learner=learner),
            partial(planes_figure, tables, learner, drawn),
        )
        for learner in learners
    ]
    if not tables.scores.height:
        return found
    matched = normalised(tables)
    return [
        *found,
        Drawing(
            "matched",
            "",
            "Learning against performance at equal shares of overridden steps, interquartile means "
            "over the comparable cases that a method reaches. On each axis 0 is the reference, no "
            "assistance for performance and maximal assistance for learning, and 1 the best "
            "return. Small markers: the method reaches less than half of the cases. Points beyond "
            "an axis are drawn on its end.",
            matched,
            partial(matched_figure, matched, drawn),
        ),
        Drawing(
            "scores",
            "",
            "Normalised hypervolume over cases (interquartile mean) and the probability that a run "
            "of a method exceeds one of the bumpers; 95% intervals of a stratified bootstrap over "
            "runs.",
            tables.aggregates,
            partial(scores_figure, tables.aggregates, drawn),
        ),
        Drawing(
            "ranks",
            "",
            "Rank of each method in each comparable case, by normalised hypervolume; 1 is the "
            "largest. White: the method is not scored. Those in less than half of the cases come "
            "last.",
            tables.scores.select("task", "learner", "method", "rank", "hypervolume_mean"),
            partial(ranks_figure, tables),
        ),
    ]


def normalised(tables: Tables) -> pl.DataFrame:
    """Returns at matched shares, over scored cases, on scales from the reference to the best.

    Args:
        tables: from `find_tables`.

    Returns:
        A row per share and method: share, method, cases (that it reaches), of (that it has),
        assisted and unassisted, interquartile means; 0 is the reference, 1 the best return.
    """
    scored = tables.scores.select("task", "learner", "method")
    matched = tables.matched.join(
        scored, on=["task", "learner", "method"], maintain_order="left"
    ).join(tables.cases, on=["task", "learner"], maintain_order="left")
    columns = {
        measure: (pl.col(f"{measure}_mean") - pl.col(f"reference_{measure}"))
        / (pl.col("best") - pl.col(f"reference_{measure}"))
        for measure in ("assisted", "unassisted")
    }
    return (
        matched.with_columns(**columns)
        .group_by("share", "method", maintain_order=True)
        .agg(
            cases=pl.col("assisted").count(),
            of=pl.len(),
            assisted=_interquartile("assisted"),
            unassisted=_interquartile("unassisted"),
        )
        .sort("share", maintain_order=True)
    )


def _interquartile(column: str) -> pl.Expr:
    known = pl.col(column).drop_nulls().sort()
    left_out = known.len() // 4
    return known.slice(left_out, known.len() - 2 * left_out).mean()


def _grid(
    number: int, width: float, height: float, drawn: Mapping[str, Look], draw: Callable[..., None]
) -> Figure:
    """Panels row by row, with one legend of all methods below them."""
    down = -(-number // _ACROSS)
    across = min(number, _ACROSS)
    legend = -(-len(drawn) // _LEGEND_COLUMNS) * 0.22 + 0.2
    with figure(max(width * across, 9), height * down + legend) as drawing:
        panels = drawing.subplots(down, across, squeeze=False)
        for place, axes in enumerate(panels.flat):
            if place < number:
                draw(axes, place)
            else:
                axes.set_axis_off()
        handles = [
            Line2D([], [], color=look.colour, marker=look.marker, label=readable(name))
            for name, look in drawn.items()
        ]
        drawing.legend(
            handles=handles, loc="outside lower center", ncols=_LEGEND_COLUMNS, fontsize=8
        )
    return drawing


def planes_figure(tables: Tables, learner: str, drawn: Mapping[str, Look]) -> Figure:
    """Learning against performance, a panel per task.

    Args:
        tables: from `find_tables`.
        learner: whose cases are drawn.
        drawn: looks of the methods and anchors.
    """
    cases = tables.cases.filter(learner=learner).rows(named=True)

    def draw(axes: Axes, place: int) -> None:
        case = cases[place]
        farthest = case["best"] + 0.2 * (case["best"] - case["reference_assisted"])
        points = tables.points.filter(task=case["task"], learner=learner)
        for part in points.partition_by("method", maintain_order=True):
            name = str(part["method"][0])
            front = name in (*ANCHORS, BASELINE)
            axes.plot(
                part["assisted_mean"].clip(None, farthest), part["unassisted_mean"],
                color=drawn[name].colour, marker=drawn[name].marker,
                markersize=5.5 if front else 3.5,
                linewidth=1.8 if front else 0.8, alpha=1 if front else 0.75,
                zorder=3 if front else 2,
            )  # fmt: skip
        axes.plot(case["best"], case["best"], "x", color="#000000", markersize=8, zorder=4)
        axes.axvline(case["reference_assisted"], color="#888888", linewidth=0.8, linestyle="--")
        axes.axhline(case["reference_unassisted"], color="#888888", linewidth=0.8, linestyle="--")
        axes.set_title(case["task"] + ("" if case["comparable"] else " (no conflict)"))
        axes.set(xlabel="mean assisted return", ylabel="mean unassisted return")
        low, high = axes.get_ylim()
        axes.set_ylim(1.4 * low if low < -_FAR else low, high)
        show_returns(axes, "x")
        show_returns(axes, "y")

    return _grid(len(cases), _PANEL, 3.0, drawn, draw)


def matched_figure(matched: pl.DataFrame, drawn: Mapping[str, Look]) -> Figure:
    """Learning against performance, a panel per share of overridden steps.

    Args:
        matched: from `normalised`.
        drawn: looks of the methods.
    """
    shares = matched["share"].unique(maintain_order=True).to_list()
    known = matched.filter(pl.col("assisted").is_not_null())

    def draw(axes: Axes, place: int) -> None:
        for row in known.filter(share=shares[place]).iter_rows(named=True):
            look = drawn[row["method"]]
            axes.plot(
                *np.clip([row["assisted"], row["unassisted"]], *_SHOWN), look.marker,
                color=look.colour,
                markersize=8 if 2 * row["cases"] >= row["of"] else 4, markeredgecolor="white",
                markeredgewidth=0.6, zorder=3 if row["method"] == BASELINE else 2,
            )  # fmt: skip
        axes.set_title(f"{shares[place]:.0%} of steps overridden")
        axes.set(xlabel="performance", ylabel="learning", xlim=_LIMITS, ylim=_LIMITS)

    methods = {name: drawn[name] for name in known["method"].unique(maintain_order=True)}
    return _grid(len(shares), _PANEL, 2.9, methods, draw)


def scores_figure(aggregates: pl.DataFrame, drawn: Mapping[str, Look]) -> Figure:
    """Scores over cases, the best on top.

    Args:
        aggregates: a row per method, from `find_tables`.
        drawn: looks of the methods.
    """
    rows = aggregates.sort("iqm_mean", descending=True).rows(named=True)
    with figure(9.6, 1.1 + 0.28 * len(rows)) as drawing:
        panels = drawing.subplots(1, 2, sharey=True)
        labels = {
            "iqm": "normalised hypervolume",
            "improvement": "probability of exceeding the bumpers",
        }
        for axes, (measure, label) in zip(panels, labels.items(), strict=True):
            for height, row in enumerate(rows):
                look = drawn[row["method"]]
                mean, low, high = (row[f"{measure}_{part}"] for part in ("mean", "low", "high"))
                if mean is None:
                    continue
                if low is not None:
                    axes.hlines(height, low, high, color=look.colour, linewidth=3)
                axes.plot(
                    mean, height, look.marker, color=look.colour, markersize=7,
                    markeredgecolor="white",
                )  # fmt: skip
            axes.set_xlabel(label)
        panels[1].axvline(0.5, color="#555555", linewidth=1)
        panels[1].set_xlim(-0.02, 1.02)
        names = [readable(row["method"]) for row in rows]
        panels[0].set_yticks(range(len(rows)), names, fontsize=9)
        panels[0].set_ylim(len(rows) - 0.4, -0.6)
    return drawing


def ranks_figure(tables: Tables) -> Figure:
    """Ranks of methods, a column per comparable case.

    Args:
        tables: from `find_tables`.
    """
    few = 2 * pl.col("cases") < pl.col("cases").max()  # their ranks are of other cases
    methods = tables.aggregates.sort(few, "rank_mean")["method"].to_list()
    cases = tables.scores.select("task", "learner").unique(maintain_order=True).rows()
    ranks = np.full((len(methods), len(cases)), np.nan)
    for row in tables.scores.iter_rows(named=True):
        place = (methods.index(row["method"]), cases.index((row["task"], row["learner"])))
        ranks[place] = row["rank"]
    width = min(max(5.0, 2.6 + 0.52 * len(cases)), _WIDEST)
    with figure(width, 2.6 + 0.27 * len(methods)) as drawing:
        axes = drawing.subplots()
        axes.grid(visible=False)
        axes.imshow(ranks, cmap="viridis_r", aspect="auto", vmin=1, vmax=len(methods))
        for (place, case), rank in np.ndenumerate(ranks):
            if np.isfinite(rank):
                ink = "white" if rank > len(methods) / 2 else "black"
                axes.text(case, place, f"{rank:g}", ha="center", va="center", fontsize=8, color=ink)
        axes.set_yticks(range(len(methods)), [readable(name) for name in methods], fontsize=9)
        labels = [f"{task}\n{learner.replace('/perception=', ', ')}" for task, learner in cases]
        axes.set_xticks(range(len(cases)), labels, fontsize=8, rotation=60, ha="right")
        axes.set_rasterization_zorder(0)
    return drawing
