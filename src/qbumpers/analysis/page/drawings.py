"""Which figures a report has: what each shows, the numbers behind it, and how to draw it."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import NamedTuple

import numpy as np
import polars as pl
from matplotlib.figure import Figure

from qbumpers.analysis.claims import telling
from qbumpers.analysis.figures import (
    curves,
    frontier,
    heatmaps,
    rows,
    sensitivity,
    thresholds,
    tradeoffs,
)
from qbumpers.analysis.figures.style import Look, looks
from qbumpers.analysis.findings import Findings, LearnerFindings
from qbumpers.analysis.published import published_numbers
from qbumpers.analysis.section_4_1 import KINDS, Move, cells, overridden, suboptimal_moves
from qbumpers.experiments.design import Experiment
from qbumpers.experiments.store import Results
from qbumpers.tasks.cliff_walking import ACTION_NAMES, state_of
from qbumpers.values import TabularValues

SHOWN_THRESHOLDS = (0.5, 0.499, 0.0195, 0.018)
"""Before and after each change of behaviour."""


class Drawing(NamedTuple):
    """A figure of a report.

    Attributes:
        kind: what it is, for instance "frontier".
        label: what tells its learner from others; empty where there is one, or it shows none.
        caption: what can be seen.
        numbers: behind it, a row a mark.
        draw: makes the figure.
    """

    kind: str
    label: str
    caption: str
    numbers: pl.DataFrame
    draw: Callable[[], Figure]

    @property
    def name(self) -> str:
        """Of its files, without ending."""
        return f"{self.kind}@{self.label}" if self.label else self.kind


def drawings(results: Results, findings: Findings, thresholding: bool) -> list[Drawing]:
    """Every figure of a report.

    Args:
        results: of the run.
        findings: its tables.
        thresholding: whether the run tells the story of Section 4.1.

    Returns:
        The figures, learner by learner.
    """
    drawn = looks(findings.summary["assistant"])
    claims = bool(findings.claims)
    found = [
        each for about in findings.learners for each in _of_learner(results, about, drawn, claims)
    ]
    values = results.values
    if thresholding and isinstance(values, TabularValues):
        found += _of_thresholds(values.table)
    return found


def _of_learner(
    results: Results, about: LearnerFindings, drawn: Mapping[str, Look], claims: bool
) -> Iterator[Drawing]:
    """What compares the conditions of one learner."""
    make = partial(_drawing, about.label)
    printed = published_numbers(results.experiment.reproduces or "")["number"]
    yield make(
        "frontier",
        "Mean return without the assistant against mean return with it, over all episodes of a "
        "trial; bars are 95% intervals. Ringed conditions are Pareto-optimal; crowded ones are "
        "enlarged below.",
        about.frontier,
        partial(frontier.frontier_figure, drawn=drawn, published=printed),
    )
    known = tradeoffs.tradeoffs(about.summary)
    if known.height:
        yield make(
            "tradeoffs",
            "Returns, successes and crashes without the assistant against those with it. Lines "
            "join the settings of a method, a few of which are labelled with α; bars are 95% "
            "intervals.",
            known,
            partial(tradeoffs.tradeoffs_figure, drawn=drawn),
        )
    if about.differences.height:
        yield make(
            "differences-from-none",
            "Difference from no assistance. Thick lines are 95% intervals of each condition alone, "
            "thin ones hold for all conditions at once.",
            about.differences.filter(pl.col("condition").is_in(_legible(about.summary))),
            partial(rows.differences_figure, drawn=drawn),
        )
    yield from _of_courses(results, about, drawn, claims)
    yield from _of_options(results, about, drawn)


def _of_courses(
    results: Results, about: LearnerFindings, drawn: Mapping[str, Look], claims: bool
) -> Iterator[Drawing]:
    """What happened in the course of training."""
    make = partial(_drawing, about.label)
    chosen = curves.representative(about.summary)
    shown = telling(about.trials) if claims else chosen
    end = _smoothed(results.experiment) + ", with 95% bands over trials; a few conditions."
    end += " Grey: the assistant is gone." * (results.experiment.retention > 0)
    yield make(
        "learning-curves",
        f"Mean return {end}",
        curves.learning_curves(results.episodes, shown),
        partial(curves.curves_figure, drawn=drawn),
    )
    if claims:
        yield make(
            "success-curves",
            f"Success rate {end}",
            curves.learning_curves(results.episodes, shown, "success"),
            partial(curves.curves_figure, drawn=drawn, measure="success"),
        )
    helped = about.summary.filter(
        pl.col("condition").is_in(chosen) & (pl.col("overrides_mean") > 0)
    )
    if helped.height:
        yield make(
            "override-course",
            f"Share of steps overridden in training {_smoothed(results.experiment)}, with 95% "
            "bands over trials.",
            curves.override_courses(results.episodes, helped["condition"].to_list()),
            partial(curves.courses_figure, drawn=drawn),
        )
    if results.states is not None and results.states["row"].null_count() == 0:
        episodes = results.experiment.trials * results.experiment.episodes
        yield make(
            "heatmaps",
            "Steps an episode in each cell, on a logarithmic scale: with the assistant, "
            "overridden, and without it. Grey cells were never entered.",
            heatmaps.cell_counts(results.states, chosen, episodes),
            heatmaps.heatmap_figure,
        )


def _smoothed(experiment: Experiment) -> str:
    size = curves.block_size(experiment.episodes)
    return "by episode" if size == 1 else f"by episode, averaged over blocks of {size}"


def _of_options(
    results: Results, about: LearnerFindings, drawn: Mapping[str, Look]
) -> Iterator[Drawing]:
    make = partial(_drawing, about.label)
    options = {
        option: None
        for named in results.experiment.conditions()
        for option in named.assistant.options._asdict()
    }
    swept = sensitivity.sensitivities(about.summary, list(options))
    if swept.height:
        yield make(
            "sensitivity",
            "Returns and overrides against each swept option, with 95% intervals. Values too close "
            "together to be told apart are spaced evenly.",
            swept,
            partial(sensitivity.sensitivity_figure, drawn=drawn),
        )
    yield make(
        "distribution",
        "Mean return of each trial. Markers are medians, thick lines hold the middle half of the "
        "trials, thin ones nine in ten; dots are single trials, up to 100 of a condition.",
        rows.spreads(about.trials, _legible(about.summary)),
        partial(rows.spreads_figure, trials=about.trials, drawn=drawn),
    )


def _legible(summary: pl.DataFrame) -> list[str]:
    """All conditions, or so many that stand for them that rows of a figure can be read."""
    if summary.height <= rows.MOST_ROWS:
        return summary["condition"].to_list()
    return curves.representative(summary, max(1, rows.MOST_ROWS // summary["assistant"].n_unique()))


def _drawing(
    label: str,
    kind: str,
    caption: str,
    numbers: pl.DataFrame,
    figure: Callable[[pl.DataFrame], Figure],
) -> Drawing:
    return Drawing(kind, label, caption, numbers, partial(figure, numbers))


def _of_thresholds(table: np.ndarray) -> Iterator[Drawing]:
    """Section 4.1 in pictures, from Q* [48, 4]."""
    moves = suboptimal_moves(table)
    yield Drawing(
        "q-values",
        "",
        "Q* of every move.",
        _by_move([table], "value"),
        partial(thresholds.values_figure, table),
    )
    decided = [overridden(table, alpha) for alpha in SHOWN_THRESHOLDS]
    yield Drawing(
        "threshold-maps",
        "",
        "What four thresholds override, with best-action overrides.",
        _by_move(decided, "overridden"),
        partial(thresholds.overrides_figure, table, SHOWN_THRESHOLDS),
    )
    yield Drawing(
        "threshold-shares",
        "",
        "To keep the walker from going backwards beside the cliff, α must be so "
        "small that away from it nothing suboptimal is left to try.",
        _critical(moves),
        partial(thresholds.shares_figure, moves),
    )


def _by_move(tables: list[np.ndarray], name: str) -> pl.DataFrame:
    """A row a move of each cell; of several tables [48, 4], those of `SHOWN_THRESHOLDS`."""
    found = [
        {
            "alpha": alpha,
            "row": row,
            "column": column,
            "action": action,
            name: table[state_of(row, column), index].item(),
        }
        for alpha, table in zip(SHOWN_THRESHOLDS, tables, strict=False)
        for row, column in cells()
        for index, action in enumerate(ACTION_NAMES)
    ]
    return pl.DataFrame(found) if len(tables) > 1 else pl.DataFrame(found).drop("alpha")


def _critical(moves: list[Move]) -> pl.DataFrame:
    """A row a suboptimal move: it is overridden where alpha is below `critical`."""
    return pl.DataFrame(
        [
            {**move._asdict(), "action": ACTION_NAMES[move.action], "kind": KINDS[move.kind]}
            for move in moves
        ]
    )
