"""What to keep in mind when reading a report, in plain sentences."""

from collections.abc import Iterator

import numpy as np
import polars as pl
from scipy.special import ndtri, stdtrit

from qbumpers.analysis.findings import Findings, LearnerFindings
from qbumpers.analysis.formatting import format_roughly
from qbumpers.analysis.page.headlines import named, overriding
from qbumpers.analysis.statistics import CONFIDENCE
from qbumpers.experiments.design import Experiment

FEW_TRIALS, MOST_NAMED = 20, 6
"""With fewer trials, intervals are rough; conditions that a sentence names."""


def cautions(findings: Findings, experiment: Experiment) -> list[str]:
    """What to keep in mind when reading the results.

    Args:
        findings: what the tables say about a run.
        experiment: as run.

    Returns:
        Sentences; empty if there is nothing to warn of.
    """
    return [
        *_of_what_is_missing(findings, experiment),
        *_of_size(findings, experiment),
        *findings.additions.cautions,
        *_of_ties(findings),
    ]


def _of_what_is_missing(findings: Findings, experiment: Experiment) -> Iterator[str]:
    if not findings.missing:
        return
    absent = findings.missing.keys() - set(findings.summary["condition"])
    conditions = findings.summary.height + len(absent)
    of, lacking = conditions * experiment.trials, list(findings.missing.items())
    there = of - sum(findings.missing.values())
    named = [f"{name} ({experiment.trials - n} of {experiment.trials})" for name, n in lacking]
    more = f" and {len(named) - MOST_NAMED} more" if len(named) > MOST_NAMED else ""
    yield (
        f"The run is not finished: {there:,} of {of:,} trials are there, and "
        f"{len(lacking)} of {conditions} conditions lack some: {', '.join(named[:MOST_NAMED])}"
        f"{more}. Run it again to continue."
    )


def _of_size(findings: Findings, experiment: Experiment) -> Iterator[str]:
    trials = findings.summary["trials"].to_list()
    if max(trials) == 1:
        yield "There is one trial per condition: nothing here has an interval."
    elif min(trials) == 1:
        yield "Conditions of a single trial have no interval, nor has what they enter into."
    elif min(trials) < FEW_TRIALS:
        yield _few(min(trials), findings.summary)
    if experiment.episodes == 1:
        yield "There is one episode per trial: no learner had the time to learn."


def _few(trials: int, summary: pl.DataFrame) -> str:
    """What a small number of trials means for intervals."""
    level = (1 + CONFIDENCE) / 2
    ends = summary.select("unassisted_low", "unassisted_high").drop_nulls().to_numpy()
    half = float(np.median(ends[:, 1] - ends[:, 0])) / 2
    unseen = (
        f"differences in unassisted return below about {format_roughly(np.sqrt(2) * half)} per "
        "episode cannot be seen; "
        if half > 0
        else ""
    )
    return (
        f"There are only {trials} trials per condition: a 95% interval of a mean reaches "
        f"{stdtrit(trials - 1, level):.1f} standard errors to each side, in place of "
        f"{ndtri(level):.1f} with many trials; {unseen}"
        "and intervals from resampling tend to be too narrow below "
        f"{FEW_TRIALS} trials."
    )


def _of_ties(findings: Findings) -> Iterator[str]:
    """Settings whose intervals overlap with the best one's."""
    close = [text for about in findings.learners for text in _close_settings(about)]
    if close:
        yield (
            "Which setting teaches best is uncertain: intervals overlap with the best one's for "
            f"{'; '.join(close)}. The best of several noisy means looks better than it is."
        )


def _close_settings(about: LearnerFindings) -> Iterator[str]:
    for part in about.summary.partition_by("assistant", maintain_order=True):
        settings = overriding(part)
        best = settings.sort("unassisted_mean", descending=True).row(0, named=True)
        if best["unassisted_low"] is None:
            continue
        close = settings.filter(pl.col("unassisted_high") >= best["unassisted_low"]).height
        if close > 1:
            where = f" with {about.label}" * bool(about.label)
            yield f"{close} of {settings.height} settings of {named(best['assistant'])}{where}"
