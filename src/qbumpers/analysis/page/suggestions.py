"""What to try next after an experiment, in plain sentences."""

from collections.abc import Iterator

import numpy as np
import polars as pl

from qbumpers.analysis.figures.style import readable
from qbumpers.analysis.findings import Findings, LearnerFindings
from qbumpers.analysis.page.cautions import FEW_TRIALS
from qbumpers.analysis.page.headlines import named, overriding

_MOST = 100  # times as many learners: nobody runs more to tell two conditions apart
_LIMITS = (0.0, 1.0)  # of alpha


def suggestions(findings: Findings) -> list[str]:
    """What to try next; what would decide most comes first.

    Args:
        findings: what the tables say about a run.

    Returns:
        Sentences; empty if nothing suggests itself.
    """
    found = [
        sentence
        for about in findings.learners
        for sentence in (*_to_tell_apart(about), *_at_edges(about))
    ]
    return [*found, *_what_is_not_there(findings)]


def _to_tell_apart(about: LearnerFindings) -> Iterator[str]:
    """How many learners would decide which condition teaches best."""
    best = about.leaders["unassisted"]
    if not best.contenders or best.ahead is None:
        return
    pair = f"whether {readable(best.condition)} teaches better than {readable(best.second)}"
    half = (best.ahead.high - best.ahead.low) / 2
    # Intervals narrow with the square root of the trials. As many again as bring the interval to
    # the difference itself, since chance may make the next one smaller.
    needed = 2 * best.trials * (half / best.ahead.mean) ** 2 if best.ahead.mean > 0 else np.inf
    if needed <= best.trials:  # these two are told apart: it is others that are not
        needed = 2.0 * best.trials
    if needed > _MOST * best.trials:
        most = _MOST * best.trials
        pair += _with(about)
        yield (
            f"Do not try to find out {pair}: they are so much alike that it would need more than "
            f"{most:,} learners per condition."
            if best.trials >= FEW_TRIALS
            else f"To find out {pair}, run {FEW_TRIALS} learners per condition first: "
            f"{best.trials} do not even tell how many are needed."
        )
        return
    rounded = int(np.ceil(needed / 10) * 10)
    yield f"To find out {pair}{_with(about)}, run about {rounded:,} learners per condition."


def _at_edges(about: LearnerFindings) -> Iterator[str]:
    """Sweeps whose best setting is their last one: the next might be better still."""
    if "alpha" not in about.summary.columns:
        return
    for part in about.summary.partition_by("assistant", maintain_order=True):
        rows = overriding(part).drop_nulls("alpha")
        alphas = part["alpha"].drop_nulls().unique().sort().to_list()
        if len(alphas) < 2:
            continue
        best = rows.sort("unassisted_mean", descending=True)["alpha"][0]
        if best in (alphas[0], alphas[-1]) and best not in _LIMITS:
            side = "smaller" if best == alphas[0] else "larger"
            yield (
                f"Try α {side} than {best:g} of {named(str(part['assistant'][0]))}{_with(about)}: "
                "it teaches best at the end of what was tried."
            )


def _what_is_not_there(findings: Findings) -> Iterator[str]:
    assistants = set(findings.summary["assistant"])
    if "none" not in assistants:
        yield "Add the assistant none: without it nobody knows what learners reach unassisted."
    if "maximal" not in assistants and assistants != {"none"}:
        yield "Add the assistant maximal: it shows how good the values are that assistants follow."
    swept = findings.summary.filter(pl.col("overrides_mean") > 0)["assistant"].value_counts()
    if (swept["count"] > 1).any() and any(about.trade for about in findings.learners):
        yield (
            "To choose a setting for learners who have to reach a certain assisted return, use "
            "qbumpers tune, which looks for the one that teaches best among those that reach it."
        )


def _with(about: LearnerFindings) -> str:
    return f" (learners with {about.label})" if about.label else ""
