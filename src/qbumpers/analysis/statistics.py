"""Means over trials with intervals. The trial is the independent unit; episodes are not."""

from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

CONFIDENCE = 0.95


class Estimate(NamedTuple):
    """A number with an interval.

    Attributes:
        mean: the estimate.
        low: lower end of the interval; NaN where it is unknown.
        high: upper end.
    """

    mean: float
    low: float
    high: float


def standard_error(samples: np.ndarray) -> float:
    """Standard error of the mean of samples [T]; NaN for a single one."""
    if len(samples) < 2:
        return float("nan")
    return float(np.std(samples, ddof=1) / np.sqrt(len(samples)))


def mean_interval(samples: np.ndarray, confidence: float = CONFIDENCE) -> Estimate:
    """Mean of independent samples with Student's t interval.

    Args:
        samples: float64 [T], one a trial.
        confidence: of the interval.

    Returns:
        The mean, and mean -+ t standard errors; no interval for a single sample.
    """
    mean = float(np.mean(samples))
    if len(samples) < 2:
        return Estimate(mean, float("nan"), float("nan"))
    margin = float(stdtrit(len(samples) - 1, (1 + confidence) / 2)) * standard_error(samples)
    return Estimate(mean, mean - margin, mean + margin)


def bootstrap_means(
    samples: np.ndarray, resamples: int, generator: np.random.Generator
) -> np.ndarray:
    """Means of resampled trials.

    Args:
        samples: float64 [T, M], M measures of each of T trials.
        resamples: B.
        generator: draws the resamples.

    Returns:
        float64 [B, M]; the measures of a trial stay together.
    """
    trials = len(samples)
    weights = generator.multinomial(trials, np.full(trials, 1 / trials), size=resamples)
    return weights @ samples / trials


def percentile_interval(
    estimate: float, replicates: np.ndarray, confidence: float = CONFIDENCE
) -> Estimate:
    """An estimate with the percentile interval of its bootstrap replicates.

    Args:
        estimate: from the samples themselves.
        replicates: float64 [B]; NaN where a replicate has no value.
        confidence: of the interval.

    Returns:
        The estimate; no interval where more than 1% of the replicates have no value.
    """
    known = replicates[np.isfinite(replicates)]
    if len(known) < 0.99 * len(replicates):
        return Estimate(estimate, float("nan"), float("nan"))
    low, high = np.quantile(known, [(1 - confidence) / 2, (1 + confidence) / 2])
    return Estimate(estimate, float(low), float(high))
