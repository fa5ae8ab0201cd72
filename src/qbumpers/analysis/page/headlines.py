"""What came out of an experiment, and what to keep in mind, in plain sentences."""

from collections.abc import Iterator, Mapping
from math import isnan
from typing import Any

import polars as pl

from qbumpers.analysis.figures.style import NAMES, readable, setting
from qbumpers.analysis.findings import Findings, LearnerFindings
from qbumpers.analysis.formatting import decimals_for, format_number, format_share
from qbumpers.analysis.frontier import Regret
from qbumpers.experiments.design import Experiment

FEW_TRIALS, MOST_NAMED = 20, 6
"""With fewer trials, intervals are rough; conditions that a sentence names."""


def headlines(findings: Findings) -> list[str]:
    """What came out, the most important first.

    Args:
        findings: what the tables say about a run.

    Returns:
        Sentences; those on one of several learners begin with what distinguishes it.
    """
    return [
        *findings.additions.headlines,
        *(
            f"With {about.label}: {sentence}" if about.label else sentence
            for about in findings.learners
            for sentence in _about(about)
        ),
    ]


def _about(about: LearnerFindings) -> Iterator[str]:
    for matched, regret in about.regrets.items():
        yield _regret(matched, regret, *(about.compared or ("", "")))
    if about.methods.height > 1 and about.summary["trials"].to_numpy().min() > 1:
        yield from _largest(about.methods)
    for part in about.summary.partition_by("assistant", maintain_order=True):
        yield _best_settings(_overriding(part))
    if about.control and about.differences["simultaneous_low"].null_count() == 0:
        yield _against_control(about.differences)


def _overriding(rows: pl.DataFrame) -> pl.DataFrame:
    """Settings that override at all; every one if none does."""
    overriding = rows.filter(pl.col("overrides_mean") > 0)
    return overriding if overriding.height else rows


def _name(assistant: str) -> str:
    return NAMES.get(assistant, assistant)


def _largest(methods: pl.DataFrame) -> Iterator[str]:
    """Which method covers most, as a share of what all conditions cover together."""
    best = methods.sort("hypervolume_mean", descending=True).row(0, named=True)
    if best["share"]:
        name, largest = _name(best["assistant"]), format_share(best["largest"])
        yield (
            f"{name} covers {format_share(best['share'])} of the performance and learning that all "
            f"conditions cover together, the most of all methods (in {largest} of the resamples)."
        )


def _best_settings(rows: pl.DataFrame) -> str:
    """At which settings an assistant teaches best and performs best."""
    name = _name(str(rows["assistant"][0]))
    learning = rows.sort("unassisted_mean", descending=True).row(0, named=True)
    performing = rows.sort("assisted_mean", descending=True).row(0, named=True)
    if rows.height == 1:
        return f"{readable(learning['condition'])} returns {_returns(learning)}."
    at_learning, at_performing = (setting(row["condition"]) for row in (learning, performing))
    if at_learning == at_performing:
        return f"{name} both teaches and performs best at {at_learning}: {_returns(learning)}."
    return (
        f"{name} teaches best at {at_learning}: {_returns(learning)}; and performs best at "
        f"{at_performing}: {_returns(performing)}."
    )


def _returns(row: Mapping[str, Any]) -> str:
    assisted, unassisted = (_interval(row, measure) for measure in ("assisted", "unassisted"))
    if row["assistant"] == "none":
        return f"{assisted} in training and {unassisted} in greedy episodes"
    return f"{assisted} assisted, {unassisted} unassisted"


def _interval(row: Mapping[str, Any], measure: str) -> str:
    """A mean return and half the width of its interval."""
    mean, low, high = (row[f"{measure}_{part}"] for part in ("mean", "low", "high"))
    digits = decimals_for(low, high)
    if low is None:
        return format_number(mean, digits)
    return f"{format_number(mean, digits)} ± {format_number((high - low) / 2, digits)}"


def _regret(matched: str, regret: Regret, method: str, baseline: str) -> str:
    ours, theirs = _name(method), _name(baseline)
    reduction = regret.reduction
    if isnan(regret.method.mean):
        return f"At matched {matched}, no setting of {ours} reaches the level of {theirs}."
    if isnan(reduction.mean):
        return f"At matched {matched}, {theirs} is itself the best: it leaves no regret to reduce."
    compared = {"performance": "learning", "learning": "performance"}[matched]
    amount = f"{abs(100 * reduction.mean):.0f}% {'less' if reduction.mean >= 0 else 'more'}"
    interval = "its interval is not known"
    if not isnan(reduction.low):
        ends = f"{format_share(reduction.low)} to {format_share(reduction.high)}"
        interval = f"95% interval of the reduction {ends}"
    return (
        f"At matched {matched}, {ours} has {amount} regret in {compared} than {theirs} "
        f"({interval})."
    )


def _against_control(differences: pl.DataFrame) -> str:
    """How many settings differ significantly from no assistance."""
    counts = {
        (measure, sign): rows.filter(end).height
        for (measure,), rows in differences.partition_by("measure", as_dict=True).items()
        for sign, end in (
            ("better", pl.col("simultaneous_low") > 0),
            ("worse", pl.col("simultaneous_high") < 0),
        )
    }
    total = differences.filter(measure="assisted").height
    plural = "s" * (total != 1)
    return (
        f"Against no assistance, of {total} condition{plural} {counts['assisted', 'better']} "
        f"perform significantly better and {counts['assisted', 'worse']} worse, "
        f"{counts['unassisted', 'better']} teach significantly better and "
        f"{counts['unassisted', 'worse']} worse (95% for all at once)."
    )


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
        yield (
            f"There are only {min(trials)} trials per condition: intervals are wide, and "
            f"those from resampling tend to be too narrow below {FEW_TRIALS} trials."
        )
    if experiment.episodes == 1:
        yield "There is one episode per trial: no learner had the time to learn."


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
        settings = _overriding(part)
        best = settings.sort("unassisted_mean", descending=True).row(0, named=True)
        if best["unassisted_low"] is None:
            continue
        close = settings.filter(pl.col("unassisted_high") >= best["unassisted_low"]).height
        if close > 1:
            where = f" with {about.label}" * bool(about.label)
            yield f"{close} of {settings.height} settings of {_name(best['assistant'])}{where}"
