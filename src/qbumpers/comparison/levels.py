"""Methods at equal levels: of help, or of performance."""

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np

from qbumpers.analysis.frontier import at_matched
from qbumpers.analysis.resampling import function_interval, resampled_means
from qbumpers.analysis.statistics import (
    UNKNOWN,
    IntervalEstimate,
    bonferroni,
    percentile_interval,
)
from qbumpers.comparison.matched import SHARES, at_share
from qbumpers.comparison.methods import BASELINE
from qbumpers.comparison.results import MEASURES, CaseResults

FLOORS = (0.5, 0.75, 0.9)
"""Levels of performance, on the way from no assistance to the best return."""


def case_columns(case: CaseResults) -> dict[str, str]:
    """What says of which case a row is."""
    return {"task": case.task, "learner": case.learner}


def estimate_columns(name: str, estimate: IntervalEstimate) -> dict[str, float]:
    """A number with its interval as three columns."""
    return {f"{name}_{part}": number for part, number in estimate._asdict().items()}


def share_rows(case: CaseResults, generator: np.random.Generator) -> list[dict[str, Any]]:
    """A row per method and share of overridden steps, each method beside the bumpers.

    Args:
        case: its trials.
        generator: draws resamples of them.

    Returns:
        Rows of the table `matched`, see `qbumpers.comparison.scores.Tables`.
    """
    found, replicates = {}, {}
    for name, samples in case.methods.items():
        means, resampled = samples.mean(axis=1), resampled_means([*samples], generator)
        found[name] = {share: at_share(means, share) for share in SHARES}
        replicates[name] = {share: at_share(resampled, share) for share in SHARES}
    confidence = bonferroni(max(1, len(found) - 1))
    beside = {name for name in found if BASELINE in found and not case.beyond(name)} - {BASELINE}
    rows = []
    for name, share in itertools.product(found, SHARES):
        row: dict[str, Any] = {**case_columns(case), "method": name, "share": share}
        for place, measure in enumerate(MEASURES[1:]):
            here, drawn = found[name][share][place], replicates[name][share][:, place]
            row |= estimate_columns(measure, percentile_interval(float(here), drawn))
            lead = UNKNOWN
            if name in beside:
                here = here - found[BASELINE][share][place]
                drawn = drawn - replicates[BASELINE][share][:, place]
                lead = percentile_interval(float(here), drawn, confidence)
            row |= estimate_columns(f"{measure}_lead", lead)
        rows.append(row)
    return rows


def floor_rows(case: CaseResults, generator: np.random.Generator) -> list[dict[str, Any]]:
    """A row per method and floor: how much is learned if performance must not be lower.

    Args:
        case: its trials; comparable.
        generator: draws resamples of them.

    Returns:
        Rows of the table `floors`, see `qbumpers.comparison.scores.Tables`.
    """
    returns = {name: each[..., 1:] for name, each in case.methods.items() if not case.beyond(name)}
    means = {name: each.mean(axis=1) for name, each in returns.items()}
    resampled = {name: resampled_means([*each], generator) for name, each in returns.items()}
    confidence = bonferroni(max(1, len(means) - 1))
    rows = []
    for name, floor in itertools.product(means, FLOORS):
        level = float((1 - floor) * case.reference[0] + floor * case.best)
        learned = function_interval(_learned(level), means[name], resampled[name])
        lead = UNKNOWN
        if BASELINE in means and name != BASELINE:
            lead = function_interval(
                _learned(level, len(means[name])),
                np.concatenate([means[name], means[BASELINE]]),
                np.concatenate([resampled[name], resampled[BASELINE]], axis=1),
                confidence,
            )
        rows.append(
            {
                **case_columns(case),
                "method": name,
                "floor": floor,
                "level": level,
                **estimate_columns("unassisted", learned),
                **estimate_columns("unassisted_lead", lead),
            }
        )
    return rows


def _learned(level: float, settings: int | None = None) -> Callable[[np.ndarray], np.ndarray]:
    """Unassisted return [...] at a level of the assisted one, of points [..., K, 2].

    Args:
        level: in reward units.
        settings: how many of the points are of the method itself; what the others reach, those of
            the bumpers, is then taken off.
    """

    def learned(points: np.ndarray) -> np.ndarray:
        own = at_matched(points[..., :settings, :], level, axis=0)
        return own if settings is None else own - at_matched(points[..., settings:, :], level, 0)

    return learned
