"""Which figures a report has: what each shows, the numbers behind it, and how to draw it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import polars as pl
from matplotlib.figure import Figure

from qbumpers.analysis.additions import Additions
from qbumpers.analysis.figures import (
    curves,
    frontier,
    heatmaps,
    rows,
    sensitivity,
    tradeoffs,
)
from qbumpers.analysis.figures.style import Look, looks
from qbumpers.analysis.findings import Findings, LearnerFindings
from qbumpers.analysis.page.elements import Drawing
from qbumpers.experiments.design import Experiment
from qbumpers.experiments.store import Results


def drawings(results: Results, findings: Findings) -> list[Drawing]:
    """Every figure of a report.

    Args:
        results: what the run's output folder holds.
        findings: what the tables say about these results.

    Returns:
        The figures, learner by learner; those that are added come last.
    """
    drawn = looks(findings.summary["assistant"])
    added = findings.additions
    found = [
        each for about in findings.learners for each in _of_learner(results, about, drawn, added)
    ]
    return [*found, *added.drawings]


def _without_intervals(summary: pl.DataFrame) -> str:
    """What a caption adds if there are conditions of a single trial."""
    single = (summary["trials"] < 2).sum()
    if single == summary.height:
        return " There is one trial per condition, which has no interval: none is drawn."
    return " Conditions of a single trial have no interval." if single else ""


def _of_learner(
    results: Results, about: LearnerFindings, drawn: Mapping[str, Look], added: Additions
) -> Iterator[Drawing]:
    """What compares the conditions of one learner."""
    make = partial(_drawing, about)
    yield make(
        "frontier",
        "Mean unassisted return against mean assisted return, over all episodes of a trial; bars "
        "are 95% intervals. Ringed conditions are Pareto-optimal; crowded ones, if any, have a "
        "panel of their own.",
        about.frontier,
        partial(frontier.frontier_figure, drawn=drawn, marks=added.marks),
    )
    known = tradeoffs.tradeoffs(about.summary)
    if known.height:
        yield make(
            "tradeoffs",
            "Unassisted returns, successes and crashes against assisted ones. Lines join the "
            "settings of a method, a few of which are labelled with α; bars are 95% intervals.",
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
    yield from _of_learning(results, about, drawn, added.curves)
    yield from _of_overrides(results, about, drawn)
    yield from _of_options(results, about, drawn)


def _of_learning(
    results: Results, about: LearnerFindings, drawn: Mapping[str, Look], chosen: Sequence[str]
) -> Iterator[Drawing]:
    """Returns and successes of chosen conditions by episode, or returns of a few of all."""
    make = partial(_drawing, about)
    shown = list(chosen) or curves.representative(about.summary)
    end = _smoothed(results.experiment) + ", with 95% bands over trials; a few conditions."
    end += " Grey: the assistant is gone." * (results.experiment.retention > 0)
    yield make(
        "learning-curves",
        f"Mean return {end}",
        curves.learning_curves(results.episodes, shown),
        partial(curves.curves_figure, drawn=drawn),
    )
    if chosen:
        yield make(
            "success-curves",
            f"Success rate {end}",
            curves.learning_curves(results.episodes, shown, "success"),
            partial(curves.curves_figure, drawn=drawn, measure="success"),
        )


def _of_overrides(
    results: Results, about: LearnerFindings, drawn: Mapping[str, Look]
) -> Iterator[Drawing]:
    """When and where assistants overrode."""
    make = partial(_drawing, about)
    chosen = curves.representative(about.summary)
    overridden = about.summary.filter(
        pl.col("condition").is_in(chosen) & (pl.col("overrides_mean") > 0)
    )
    if overridden.height:
        yield make(
            "override-course",
            f"Share of steps overridden in training {_smoothed(results.experiment)}, with 95% "
            "bands over trials.",
            curves.override_courses(results.episodes, overridden["condition"].to_list()),
            partial(curves.courses_figure, drawn=drawn),
        )
    if results.states is not None and results.states["row"].null_count() == 0:
        trials = dict(about.summary.select("condition", "trials").iter_rows())
        episodes = {c: trials[c] * results.experiment.episodes for c in chosen}
        yield make(
            "heatmaps",
            "Steps per episode in each grid cell, on a logarithmic scale: assisted, overridden, "
            "and unassisted. Grey cells were never entered.",
            heatmaps.visit_counts(results.states, episodes),
            heatmaps.heatmap_figure,
        )


def _smoothed(experiment: Experiment) -> str:
    size = curves.block_size(experiment.episodes)
    return "by episode" if size == 1 else f"by episode, averaged over blocks of {size}"


def _of_options(
    results: Results, about: LearnerFindings, drawn: Mapping[str, Look]
) -> Iterator[Drawing]:
    make = partial(_drawing, about)
    options = dict.fromkeys(option for each in results.conditions for option in each.options)
    swept = sensitivity.sensitivities(about.summary, list(options))
    if swept.height:
        yield make(
            "sensitivity",
            "Returns and overrides against each swept option, with 95% intervals. Values too close "
            "together to be distinguished are spaced evenly.",
            swept,
            partial(sensitivity.sensitivity_figure, drawn=drawn),
        )
    yield make(
        "distribution",
        "Mean return of each trial. Markers are medians, thick lines hold the middle half of the "
        "trials, thin ones nine in ten; dots are single trials, up to 100 per condition.",
        rows.spreads(about.trials, _legible(about.summary)),
        partial(rows.spreads_figure, trials=about.trials, drawn=drawn),
    )


def _legible(summary: pl.DataFrame) -> list[str]:
    """All conditions, or so many that stand for them that rows of a figure can be read."""
    if summary.height <= rows.MOST_ROWS:
        return summary["condition"].to_list()
    return curves.representative(summary, max(1, rows.MOST_ROWS // summary["assistant"].n_unique()))


def _drawing(
    about: LearnerFindings,
    kind: str,
    caption: str,
    numbers: pl.DataFrame,
    figure: Callable[[pl.DataFrame], Figure],
) -> Drawing:
    if kind != "heatmaps":
        caption += _without_intervals(about.summary)
    return Drawing(kind, about.label, caption, numbers, partial(figure, numbers))
