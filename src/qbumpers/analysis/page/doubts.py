"""Whether the numbers of a report mean much: doubts about the values behind its assistants."""

from collections.abc import Iterator

import numpy as np
import polars as pl

from qbumpers.analysis.figures.style import readable
from qbumpers.analysis.findings import Findings, LearnerFindings
from qbumpers.analysis.formatting import decimals_for, format_number, format_share
from qbumpers.analysis.page.headlines import named
from qbumpers.analysis.statistics import IntervalEstimate, difference
from qbumpers.experiments.record import RecordedCondition
from qbumpers.experiments.store import Results
from qbumpers.values import TabularValues

_MANY = 0.05  # of the start states: fewer without room for a loss change little
_HARDLY = 0.005  # of the steps: overriding fewer is hardly assistance


def doubts(findings: Findings, results: Results) -> list[str]:
    """What makes the numbers of a report mean little.

    Args:
        findings: what the tables say about a run.
        results: what its output folder holds.

    Returns:
        Sentences; empty if there is no such doubt.
    """
    return [
        *_of_an_estimate(results),
        *_of_the_discount(results),
        *_of_flat_values(results),
        *(sentence for about in findings.learners for sentence in _of_full_help(about)),
        *(sentence for about in findings.learners for sentence in _of_chance(about, results)),
        *_of_floors(results),
        *(sentence for about in findings.learners for sentence in _of_idle_assistants(about)),
    ]


def _of_an_estimate(results: Results) -> Iterator[str]:
    """A table of transitions that was estimated: learners are simulated in it, too."""
    steps = results.experiment.task.arguments.get("estimated")
    if isinstance(steps, int):
        yield (
            f"The task is an estimate of the environment from {steps:,} of its steps: learners "
            "are simulated in the estimate, and the values are exact for it alone. Intervals here "
            "are over learners, and know nothing of its error."
        )


def _of_the_discount(results: Results) -> Iterator[str]:
    discount = results.record.discount
    if discount is not None and discount != results.values.discount:
        yield (
            f"The values were made with discount {results.values.discount:g}, and the task has "
            f"discount {discount:g}: assistants judge actions by another goal than the task's."
        )


def _of_flat_values(results: Results) -> Iterator[str]:
    values = results.values
    if isinstance(values, TabularValues) and not np.ptp(values.table, axis=1).any():
        yield (
            "The values are the same for all actions in every state: they know nothing of the "
            "task, and no assistant that follows them can help."
        )


def _of_full_help(about: LearnerFindings) -> Iterator[str]:
    """Maximal assistance that performs worse than none."""
    maximal = about.summary.filter(assistant="maximal")["condition"].to_list()
    if about.control is None or not maximal:
        return
    rows = about.differences.filter(pl.col("condition").is_in(maximal), measure="assisted")
    for row in rows.filter(pl.col("difference_mean") < 0).iter_rows(named=True):
        found = IntervalEstimate(*(row[f"difference_{part}"] for part in IntervalEstimate._fields))
        sure = row["simultaneous_high"] is not None and row["simultaneous_high"] < 0
        verb = "performs" if sure else "seems to perform"
        yield (
            f"{readable(row['condition'])}{_with(about)} {verb} worse than no assistance: "
            f"{_interval(found, about.decimals)} in return per episode. The "
            "values, which it follows at every step, may be wrong, and then so is the help of "
            "every assistant here."
        )


def _of_chance(about: LearnerFindings, results: Results) -> Iterator[str]:
    """Values that lead maximal assistance no further than learners come who know nothing yet."""
    maximal = about.summary.filter(assistant="maximal")["condition"].to_list()
    if about.control is None or not maximal:
        return
    first = results.episodes.filter(pl.col("condition") == about.control, pl.col("episode") == 0)
    led = about.trials.filter(condition=maximal[0])["assisted"].to_numpy()
    ignorant = first["assisted_return"].cast(pl.Float64).to_numpy()
    ahead = difference(led, ignorant).estimate
    if ahead.low <= 0:
        yield (
            f"The values are perhaps no better than chance: {readable(maximal[0])}{_with(about)}, "
            "which follows them at every step, returns "
            f"{_interval(ahead, about.decimals)} more per episode than learners without assistance "
            "do in their first episode, when they know nothing."
        )


def _of_floors(results: Results) -> Iterator[str]:
    """Floors so near the value of the start that any worse action is overridden."""
    floors: dict[tuple[str, float], list[RecordedCondition]] = {}
    for each in results.conditions:
        if "v_min" in each.options:
            floors.setdefault((each.assistant, float(each.options["v_min"])), []).append(each)
    values = results.values
    if not (floors and results.record.starts and isinstance(values, TabularValues)):
        return
    starts = np.array([values(state).max() for state in results.record.starts])
    losses = values.table.max(axis=1, keepdims=True) - values.table
    usual = float(np.median(losses[losses > 0])) if (losses > 0).any() else 0.0
    for (assistant, floor), settings in floors.items():
        alpha = max(float(each.options.get("alpha", 1.0)) for each in settings)
        tight = float(np.mean(alpha * (starts - floor) < usual))
        if tight > _MANY:
            yield (
                f"{named(assistant)} has v_min = {floor:g}, hardly below what the values expect of "
                f"an episode: from {format_share(tight)} of the start states, even alpha = "
                f"{alpha:g} leaves less to lose than one usual worse action does, so it overrides "
                "nearly always, whatever its alpha. Choose a lower v_min."
            )


def _of_idle_assistants(about: LearnerFindings) -> Iterator[str]:
    """Assistants that hardly override although that is what they are for."""
    for part in about.summary.partition_by("assistant", maintain_order=True):
        name, most = str(part["assistant"][0]), float(part["override_rate_mean"].to_numpy().max())
        if name == "none" or most >= _HARDLY:
            continue
        often = f"overrode fewer than one step in {1 / _HARDLY:.0f}" if most else "never overrode"
        floor = " A v_min far below every return has that effect."
        has_floor = "v_min" in part.columns and part["v_min"].null_count() < part.height
        yield (
            f"{named(name)}{_with(about)} {often}, at any setting: its learners had hardly any "
            f"assistance.{floor * has_floor}"
        )


def _with(about: LearnerFindings) -> str:
    return f" (learners with {about.label})" if about.label else ""


def _interval(found: IntervalEstimate, decimals: int) -> str:
    if found.low is None or not np.isfinite(found.low):
        return format_number(found.mean, decimals)
    digits = decimals_for(found.low, found.high, decimals)
    mean, low, high = (format_number(value, digits) for value in found)
    return f"{mean} (95% interval {low} to {high})"
