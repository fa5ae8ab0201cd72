"""Scores of methods over several cases, as rliable has them (Agarwal et al., NeurIPS 2021).

Scores are float64 [R, C]: R runs of each of C cases. Intervals are percentiles of a bootstrap that
draws runs anew within each case.
"""

from collections.abc import Callable

import numpy as np

from qbumpers.analysis.statistics import (
    CONFIDENCE,
    IntervalEstimate,
    interquartile_mean,
    percentile_interval,
)

RESAMPLES = 10_000
"""Enough for the tails of intervals that hold for all methods at once."""


def iqm(scores: np.ndarray) -> np.ndarray:
    """Mean of the middle half of all scores [..., R, C], of runs and cases alike."""
    return interquartile_mean(scores.reshape(*scores.shape[:-2], -1))


def median(scores: np.ndarray) -> np.ndarray:
    """Median over cases of the mean over runs, of scores [..., R, C]."""
    return np.median(scores.mean(axis=-2), axis=-1)


def improvement(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Probability that a run of one method exceeds a run of another, mean over cases.

    Args:
        first: float64 [..., R, C].
        second: float64 [..., Q, C].

    Returns:
        float64 [...]; ties count half.
    """
    signs = np.sign(first[..., :, np.newaxis, :] - second[..., np.newaxis, :, :])
    return (0.5 + signs / 2).mean(axis=(-3, -2, -1))


def resampled_runs(
    scores: np.ndarray, resamples: int, generator: np.random.Generator
) -> np.ndarray:
    """Scores [B, R, C] of which runs are drawn anew, in each case by itself."""
    runs, cases = scores.shape
    drawn = generator.integers(0, runs, (resamples, runs, cases))
    return scores[drawn, np.arange(cases)]


def aggregate(
    function: Callable[..., np.ndarray],
    scores: tuple[np.ndarray, ...],
    generator: np.random.Generator,
    confidence: float = CONFIDENCE,
) -> IntervalEstimate:
    """A function of the scores of one or more methods, with its stratified bootstrap interval.

    Args:
        function: of scores [..., R, C] of each method.
        scores: float64 [R, C] of each method.
        generator: draws the resamples, of each method by itself.
        confidence: that the interval is to have, in (0, 1).

    Returns:
        The number; no interval if there is a single run.
    """
    found = float(function(*scores))
    if min(len(each) for each in scores) < 2:
        return IntervalEstimate(found, float("nan"), float("nan"))
    replicates = function(*(resampled_runs(each, RESAMPLES, generator) for each in scores))
    return percentile_interval(found, replicates, confidence)
