"""What came out of an experiment, and what to keep in mind, in plain sentences."""

from collections.abc import Iterator, Mapping, Sequence
from math import isfinite, isnan
from typing import Any

import polars as pl

from qbumpers.analysis.figures.style import NAMES, readable, setting
from qbumpers.analysis.findings import Findings, LearnerFindings, Sentences
from qbumpers.analysis.formatting import decimals_for, decimals_of, format_number, format_share
from qbumpers.analysis.frontier import Regret
from qbumpers.analysis.leaders import Leader, Trade
from qbumpers.analysis.statistics import IntervalEstimate

MOST_NAMED = 3
"""Conditions that a sentence names."""

_EPISODES = {"assisted": "assisted", "unassisted": "greedy unassisted"}
_VERBS = {"assisted": "performs", "unassisted": "teaches"}


def headlines(findings: Findings) -> list[Sentences]:
    """What came out, the most important first.

    Args:
        findings: what the tables say about a run.

    Returns:
        What is added, then what there is to say about each kind of learner.
    """
    added = findings.additions.headlines
    return [
        *([Sentences("", added)] if added else []),
        *(Sentences(about.label, list(_about(about))) for about in findings.learners),
    ]


def _about(about: LearnerFindings) -> Iterator[str]:
    if about.summary.height > 1:
        for measure, leader in about.leaders.items():
            yield _leads(about, measure, leader)
        yield _traded(about)
    for matched, regret in about.regrets.items():
        yield _regret(about, matched, regret)
    if about.methods.height > 1 and about.summary["trials"].to_numpy().min() > 1:
        yield from _largest(about.methods)
    for part in about.summary.partition_by("assistant", maintain_order=True):
        rows = overriding(part)
        if rows.height > 1 or about.summary.height == 1:
            yield _best_settings(rows, about.decimals)
    if about.control and about.differences["simultaneous_low"].null_count() == 0:
        yield _against_control(about.differences)


def _leads(about: LearnerFindings, measure: str, leader: Leader) -> str:
    """Which condition is best in a measure, and how sure that is."""
    row = about.summary.row(by_predicate=pl.col("condition") == leader.condition, named=True)
    returned = f"{_interval(row, measure, about.decimals)} per {_EPISODES[measure]} episode."
    if leader.contenders is not None and len(leader.contenders) == leader.others > 1:
        return (
            f"Which condition {_VERBS[measure]} best cannot be told from {leader.trials} learners "
            f"per condition: each of {leader.others} others may be as good (95% for all at once) "
            f"as {readable(leader.condition)}, whose learners return the most, {returned}"
        )
    idle = row["overrides_mean"] == 0 and row["assistant"] != "none"
    which = ", which never overrode," * idle
    return (
        f"{readable(leader.condition)}{which} {_VERBS[measure]} best: its learners return "
        f"{returned} {_how_sure(leader, 'condition that overrides' if idle else 'other condition')}"
    )


def _how_sure(leader: Leader, other: str) -> str:
    others = leader.others
    if leader.contenders is None:
        return "Single learners leave it open how sure that is."
    learners = f"with {leader.trials} learners per condition, 95% for all at once"
    if not others:
        return "There is nothing else to compare it with."
    if not leader.contenders:
        return f"That is sure: no {other} is as good ({learners})."
    named = [readable(condition) for condition in leader.contenders[:MOST_NAMED]]
    more = len(leader.contenders) - len(named)
    return (
        f"It is not sure to be the best: of {others} others, {len(named) + more} may be as good "
        f"({learners}): {listed(named, more)}."
    )


def listed(named: Sequence[str], more: int = 0) -> str:
    """Names of several conditions, which have commas in them, and how many more there are."""
    return "; ".join([*named, *([f"and {more} more"] if more else [])])


def _traded(about: LearnerFindings) -> str:
    """What is gained and lost between the condition that teaches and the one that performs best."""
    if about.trade is None:
        if all(leader.contenders == [] for leader in about.leaders.values()):
            return "One condition both performs and teaches best, so these results show no trade."
        return (
            "One condition has the best mean of both, so these results show no trade; it is not "
            "sure to be the best, so there may be one."
        )
    found: Trade = about.trade
    between = about.frontier.filter("pareto").height - 2
    gained, lost = (_amount(one, about.decimals) for one in (found.gained, found.lost))
    more = f" Between the two, {between} more are Pareto-optimal." if between > 0 else ""
    return (
        f"The trade: from {readable(found.teaching)} to {readable(found.performing)}, assisted "
        f"episodes return {gained} more and unassisted ones {lost} less.{more}"
    )


def _amount(found: IntervalEstimate, decimals: int) -> str:
    """By how much, with its interval, and a remark if that may be nothing at all."""
    digits = decimals_for(found.low, found.high, decimals)
    mean, low, high = (format_number(value, digits) for value in found)
    if not isfinite(found.low):
        return f"{mean} (no interval)"
    doubt = ", perhaps nothing" if found.low <= 0 else ""
    return f"{mean} (95% interval {low} to {high}{doubt})"


def overriding(rows: pl.DataFrame) -> pl.DataFrame:
    """Settings that override at all; every one if none does."""
    overriding = rows.filter(pl.col("overrides_mean") > 0)
    return overriding if overriding.height else rows


def named(assistant: str) -> str:
    """An assistant as readers call it."""
    return NAMES.get(assistant, assistant)


def _largest(methods: pl.DataFrame) -> Iterator[str]:
    """Which method covers most, as a share of what all conditions cover together."""
    best = methods.sort("hypervolume_mean", descending=True).row(0, named=True)
    if best["share"] and best["conditions"] > 1:
        name, largest = named(best["assistant"]), format_share(best["largest"])
        yield (
            f"Over all its settings, {name} covers {format_share(best['share'])} of the area "
            "of performance and learning that all conditions cover, the most of all methods (in "
            f"{largest} of the resamples)."
        )


def _best_settings(rows: pl.DataFrame, decimals: int) -> str:
    """At which settings an assistant teaches best and performs best."""
    name = named(str(rows["assistant"][0]))
    learning = rows.sort("unassisted_mean", descending=True).row(0, named=True)
    performing = rows.sort("assisted_mean", descending=True).row(0, named=True)
    if rows.height == 1:
        return f"{readable(str(learning['condition']))} returns {_returns(learning, decimals)}."
    at_learning, at_performing = (setting(row["condition"]) for row in (learning, performing))
    at_best = _returns(learning, decimals)
    if at_learning == at_performing:
        return f"{name} both teaches and performs best at {at_learning}: {at_best}."
    return (
        f"{name} teaches best at {at_learning}: {at_best}; and performs best at {at_performing}: "
        f"{_returns(performing, decimals)}."
    )


def _returns(row: Mapping[str, Any], decimals: int) -> str:
    assisted, unassisted = (_interval(row, m, decimals) for m in ("assisted", "unassisted"))
    if row["assistant"] == "none":
        return f"{assisted} in training and {unassisted} in greedy episodes"
    return f"{assisted} assisted, {unassisted} unassisted"


def _interval(row: Mapping[str, Any], measure: str, decimals: int) -> str:
    """A mean return and half the width of its interval."""
    mean, low, high = (row[f"{measure}_{part}"] for part in ("mean", "low", "high"))
    digits = decimals_for(low, high, decimals)
    if low is None:
        return format_number(mean, digits)
    return f"{format_number(mean, digits)} ± {format_number((high - low) / 2, digits)}"


def _regret(about: LearnerFindings, matched: str, regret: Regret) -> str:
    ours, theirs = (named(name) for name in about.compared or ("", ""))
    reduction = regret.reduction
    if isnan(regret.method.mean):
        return f"At matched {matched}, no setting of {ours} reaches the level of {theirs}."
    if regret.gap.mean == 0:
        return f"At matched {matched}, {theirs} is itself the best: it leaves no regret to reduce."
    compared = {"performance": "learning", "learning": "performance"}[matched]
    if not regret.is_known:
        return (
            f"At matched {matched}, how much regret in {compared} {ours} saves over {theirs} is "
            f"not known: the regret of {theirs} itself, {_plain(regret.gap, about.decimals)}, is "
            "not surely above zero."
        )
    if reduction.low <= 0 <= reduction.high:
        return (
            f"At matched {matched}, it is open whether {ours} has less regret in {compared} than "
            f"{theirs} or more: the reduction is {format_share(reduction.mean)} (95% interval "
            f"{format_share(reduction.low)} to {format_share(reduction.high)})."
        )
    amount = f"{abs(100 * reduction.mean):.0f}% {'less' if reduction.mean >= 0 else 'more'}"
    interval = "in many resamples no setting reaches that level, so this has no interval"
    if not isnan(reduction.low):
        ends = f"{format_share(reduction.low)} to {format_share(reduction.high)}"
        interval = f"95% interval of the reduction {ends}"
    return (
        f"At matched {matched}, {ours} has {amount} regret in {compared} than {theirs} "
        f"({interval})."
    )


def _plain(found: IntervalEstimate, decimals: int) -> str:
    """A number with its interval, if that is known."""
    digits = decimals_for(found.low, found.high, max(decimals, decimals_of([0.0, found.mean])))
    mean, low, high = (format_number(value, digits) for value in found)
    return f"{mean} (95% interval {low} to {high})" if isfinite(found.low) else mean


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
