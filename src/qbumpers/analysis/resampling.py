"""Bootstrap over trials if several conditions enter one number.

A number such as the best of several means comes out too high, since chance picks the best; the
bootstrap repeats that and, added naively, doubles it. `function_interval` takes it off instead.

Of more than 10,000 trials, groups are resampled in the place of single ones: since trials are
independent, 2,000 groups say within 2% by how much the mean of all trials varies.
"""

from collections.abc import Callable, Sequence

import numpy as np

from qbumpers.analysis.statistics import (
    CONFIDENCE,
    RESAMPLES,
    IntervalEstimate,
    interquartile_influence,
    interquartile_mean,
    percentile_interval,
)
from qbumpers.errors import RequestError

MANY = 10_000
"""Trials above which groups of them are resampled."""

_GROUPS = 2_000
_BLOCK = 2**22  # numbers held at once

_DILATIONS = (1.0, 0.1, 4.0)


def _pairable(lengths: set[int]) -> None:
    if len(lengths) > 1:
        raise RequestError(
            f"paired = True: conditions have {', '.join(map(str, sorted(lengths)))} trials; "
            "pairs need as many in each"
        )


def _blocks(resamples: int, size: int) -> list[int]:
    """Numbers of resamples to draw at once."""
    most = max(1, _BLOCK // size)
    return [min(most, resamples - start) for start in range(0, resamples, most)]


def _counts(trials: int, resamples: int, generator: np.random.Generator) -> np.ndarray:
    """How often each trial is drawn: int64 [B, T], each row T draws in all."""
    drawn = generator.integers(0, trials, (resamples, trials), dtype=np.int32).astype(np.int64)
    drawn += trials * np.arange(resamples)[:, np.newaxis]
    return np.bincount(drawn.ravel(), minlength=resamples * trials).reshape(resamples, trials)


def _means(samples: np.ndarray, resamples: int, generator: np.random.Generator) -> np.ndarray:
    """Means [B, M] of resampled trials of samples [T, M], or of groups of them if they are many."""
    trials = len(samples)
    if trials <= MANY:
        counts = (_counts(trials, block, generator) for block in _blocks(resamples, trials))
        return np.concatenate([block @ samples / trials for block in counts])
    first = np.linspace(0, trials, _GROUPS, endpoint=False).astype(int)
    sums, sizes = np.add.reduceat(samples, first), np.diff(first, append=trials)
    counts = _counts(_GROUPS, resamples, generator)
    return counts @ sums / (counts @ sizes)[:, np.newaxis]


def resampled_means(
    samples: Sequence[np.ndarray],
    generator: np.random.Generator,
    paired: bool = False,
    resamples: int = RESAMPLES,
) -> np.ndarray:
    """Means of resampled trials of each condition.

    Args:
        samples: float64 [T, M] of each of C conditions, M measures of each of its trials.
        generator: draws the resamples.
        paired: draw the same trials in all conditions (common random numbers).
        resamples: B.

    Returns:
        float64 [B, C, M]; the measures of a trial stay together. NaN for conditions of a single
        trial, which do not say how much chance decides.

    Raises:
        RequestError: if pairs are asked for and the numbers of trials differ.
    """
    if paired:
        _pairable({len(values) for values in samples})
        together = _means(np.concatenate(samples, axis=1), resamples, generator)
        means = together.reshape(resamples, len(samples), -1)
    else:
        means = np.stack([_means(values, resamples, generator) for values in samples], axis=1)
    means[:, [len(values) < 2 for values in samples]] = np.nan
    return means


def function_interval(
    function: Callable[[np.ndarray], np.ndarray],
    means: np.ndarray,
    resampled: np.ndarray,
    confidence: float = CONFIDENCE,
) -> IntervalEstimate:
    """A function of means that picks the best of several, with its bootstrap interval.

    Basic bootstrap intervals, the estimate minus the quantiles of how far resamples deviate from
    it, take off what chance in picking adds. How much that is depends on how close the best are,
    which the sample does not show. So deviations are judged from near, resampled means a tenth as
    far from the means and their effect times ten, where the pick stays; from as far as resamples
    reach; and from four times as far, where nearly equal ones all get picked (the numerical delta
    method: Hong & Li, Journal of Econometrics, 2018). The interval spans all three, and the
    estimate. In simulations of the largest of several means, 95% intervals hold the truth in 93%
    to 98% of cases; if all are exactly equal, in 93% with 3 of them, 92% with 5, 89% with 13.

    Args:
        function: of means float64 [..., C, M], returning float64 [...]; NaN if it has no value.
        means: float64 [C, M], of the samples themselves.
        resampled: float64 [B, C, M], from `resampled_means`.
        confidence: that the interval is to have, in (0, 1).

    Returns:
        The function at the means; no interval if it has no value at more than 1% of the
        resamples, or a condition has no resamples.
    """
    found = float(function(means))
    if np.isnan(resampled).any():
        return IntervalEstimate(found, float("nan"), float("nan"))
    spans = [
        _basic(found, (function(means + far * (resampled - means)) - found) / far, confidence)
        for far in _DILATIONS
    ]
    if np.isnan(spans[0].low):  # as far as resamples reach
        return spans[0]
    known = [span for span in spans if not np.isnan(span.low)]
    low, high = min(span.low for span in known), max(span.high for span in known)
    return IntervalEstimate(found, min(found, low), max(found, high))


def _basic(found: float, deviations: np.ndarray, confidence: float) -> IntervalEstimate:
    _, low, high = percentile_interval(0.0, deviations, confidence)
    return IntervalEstimate(found, found - high, found - low)


def stratified_interval(
    strata: Sequence[np.ndarray],
    statistic: Callable[[np.ndarray], np.ndarray],
    generator: np.random.Generator,
    paired: bool = False,
    resamples: int = RESAMPLES,
    confidence: float = CONFIDENCE,
) -> IntervalEstimate:
    """A statistic of pooled conditions with a percentile interval, each resampled by itself.

    Args:
        strata: float64 [T] of each condition.
        statistic: of pooled samples float64 [..., N], along the last axis.
        generator: draws the resamples.
        paired: draw the same trials in all conditions (common random numbers).
        resamples: how many.
        confidence: that the interval is to have, in (0, 1).

    Returns:
        The statistic of all samples; no interval for a single trial.

    Raises:
        RequestError: if pairs are asked for and the numbers of trials differ.
    """
    found = float(statistic(np.concatenate(strata)))
    if min(map(len, strata)) < 2:
        return IntervalEstimate(found, float("nan"), float("nan"))
    blocks = _blocks(resamples, sum(map(len, strata)))
    pooled = (_pooled(strata, block, generator, paired) for block in blocks)
    replicates = np.concatenate([statistic(values) for values in pooled])
    return percentile_interval(found, replicates, confidence)


def interquartile_interval(
    strata: Sequence[np.ndarray], generator: np.random.Generator, paired: bool = False
) -> IntervalEstimate:
    """The interquartile mean of pooled conditions, as `stratified_interval` has it.

    Of many trials the bootstrap is that of its linear part, the mean of what each trial adds to it.

    Args:
        strata: float64 [T] of each condition.
        generator: draws the resamples.
        paired: draw the same trials in all conditions (common random numbers).

    Raises:
        RequestError: if pairs are asked for and the numbers of trials differ.
    """
    if max(map(len, strata)) <= MANY:
        return stratified_interval(strata, interquartile_mean, generator, paired)
    pooled, ends = np.concatenate(strata), np.cumsum([len(values) for values in strata])
    found = float(interquartile_mean(pooled))
    if min(map(len, strata)) < 2:
        return IntervalEstimate(found, float("nan"), float("nan"))
    influence = np.split(interquartile_influence(pooled)[:, np.newaxis], ends[:-1])
    means = resampled_means(influence, generator, paired)[..., 0]
    return percentile_interval(found, found + means @ np.diff(ends, prepend=0) / ends[-1])


def _pooled(
    strata: Sequence[np.ndarray], resamples: int, generator: np.random.Generator, paired: bool
) -> np.ndarray:
    """Resamples [B, N] of pooled conditions, as many trials of each as it has."""
    lengths = [len(values) for values in strata]
    if paired:
        _pairable(set(lengths))
        lengths = lengths[:1]
    drawn = [generator.integers(0, n, (resamples, n), dtype=np.int32) for n in lengths]
    chosen = drawn * len(strata) if paired else drawn
    return np.concatenate([v[i] for v, i in zip(strata, chosen, strict=True)], axis=1)
