"""Estimates with intervals over trials. The trial is the independent unit; episodes are not.

Intervals of means and of differences of means are Student's; bootstrap intervals are for what has
no such formula, and to check those that have.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri, stdtr, stdtrit

from qbumpers.errors import RequestError

CONFIDENCE = 0.95
RESAMPLES = 2000


class IntervalEstimate(NamedTuple):
    """A number with an interval.

    Attributes:
        mean: the number that the samples give.
        low: lower end of the interval; NaN if it is unknown.
        high: upper end.
    """

    mean: float
    low: float
    high: float


UNKNOWN = IntervalEstimate(float("nan"), float("nan"), float("nan"))
"""Neither a number nor an interval."""


class Difference(NamedTuple):
    """How much larger one mean is than another.

    Attributes:
        estimate: first minus second mean, with its interval.
        p_value: of the two-sided t test of no difference; NaN if it is unknown.
    """

    estimate: IntervalEstimate
    p_value: float


def standard_error(samples: np.ndarray) -> float:
    """Standard error of the mean of samples [T]; NaN for a single one."""
    if len(samples) < 2:
        return float("nan")
    return float(np.std(samples, ddof=1) / np.sqrt(len(samples)))


def mean_interval(samples: np.ndarray, confidence: float = CONFIDENCE) -> IntervalEstimate:
    """Mean of independent samples with Student's t interval.

    Args:
        samples: float64 [T], one per trial.
        confidence: that the interval is to have, in (0, 1).

    Returns:
        The mean, and mean -+ t standard errors; no interval for a single sample.
    """
    mean, error = float(np.mean(samples)), standard_error(samples)
    return _students_t(mean, error, len(samples) - 1, confidence).estimate


def difference(
    first: np.ndarray, second: np.ndarray, paired: bool = False, confidence: float = CONFIDENCE
) -> Difference:
    """Difference of the means of two conditions: the t test of pairs, or Welch's.

    Args:
        first: float64 [T], one per trial.
        second: float64 [U], one per trial; [T] in the same order if paired.
        paired: whether trials of equal place belong together (common random numbers).
        confidence: that the interval is to have, in (0, 1).

    Returns:
        First minus second. If neither condition varies, the interval has no width and the
        p-value is 0 or 1, the limits of the test's.

    Raises:
        RequestError: if pairs are asked for and the numbers of trials differ.
    """
    mean = float(np.mean(first) - np.mean(second))
    if paired:
        error = standard_error(first - _partners(first, second))
        return _students_t(mean, error, len(first) - 1, confidence)
    variances = np.square([standard_error(first), standard_error(second)])
    freedoms = np.array([len(first) - 1, len(second) - 1])
    total = float(variances.sum())
    spread = total > 0
    freedom = total**2 / np.sum(variances**2 / freedoms) if spread else freedoms.sum()
    return _students_t(mean, float(np.sqrt(total)), float(freedom), confidence)


def _partners(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """The second samples, if there is one to each of the first."""
    if len(first) != len(second):
        raise RequestError(
            f"paired = True: {len(first)} and {len(second)} trials; pairs need as many of both"
        )
    return second


def _students_t(mean: float, error: float, freedom: float, confidence: float) -> Difference:
    """A mean with its t interval, and the p-value of its being 0."""
    if np.isnan(error):
        return Difference(IntervalEstimate(mean, float("nan"), float("nan")), float("nan"))
    margin = float(stdtrit(freedom, (1 + confidence) / 2)) * error
    p_value = 2 * float(stdtr(freedom, -abs(mean) / error)) if error > 0 else float(mean == 0)
    return Difference(IntervalEstimate(mean, mean - margin, mean + margin), p_value)


def probability_of_improvement(
    first: np.ndarray, second: np.ndarray, paired: bool = False, confidence: float = CONFIDENCE
) -> IntervalEstimate:
    """Probability that a trial of one condition exceeds a trial of another; ties count half.

    The interval is Wilson's for a share, at the number of trials that would give a share as
    precise as this one: that keeps it within [0, 1], and wide enough if one condition always
    exceeds the other. The precision is that of DeLong, DeLong & Clarke-Pearson (Biometrics, 1988).

    Args:
        first: float64 [T], one per trial.
        second: float64 [U], one per trial; [T] in the same order if paired.
        paired: compare trials of equal place only, instead of every trial with every other.
        confidence: that the interval is to have, in (0, 1).

    Returns:
        P(first > second) + P(first = second) / 2; no interval for a single trial.

    Raises:
        RequestError: if pairs are asked for and the numbers of trials differ.
    """
    if paired:
        wins = 0.5 + np.sign(first - _partners(first, second)) / 2
        share, error = float(np.mean(wins)), standard_error(wins)
        return _wilson(share, error**2, len(wins), confidence)
    above, below = _share_below(second, first), 1 - _share_below(first, second)
    variance = standard_error(above) ** 2 + standard_error(below) ** 2
    return _wilson(float(np.mean(above)), variance, min(len(first), len(second)), confidence)


def _share_below(samples: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Share [V] of the samples that each value exceeds; ties count half."""
    ordered = np.sort(samples)
    below, up_to = (np.searchsorted(ordered, values, side) for side in ("left", "right"))
    return (below + up_to) / 2 / len(samples)


def _wilson(share: float, variance: float, least: int, confidence: float) -> IntervalEstimate:
    """A share with Wilson's interval; its variance says how many trials it is worth."""
    if np.isnan(variance):
        return IntervalEstimate(share, float("nan"), float("nan"))
    worth = max(least, share * (1 - share) / variance) if variance > 0 else least
    z = float(ndtri((1 + confidence) / 2))
    centre = (share + z**2 / (2 * worth)) / (1 + z**2 / worth)
    margin = np.sqrt(share * (1 - share) / worth + (z / (2 * worth)) ** 2) * z / (1 + z**2 / worth)
    low, high = max(0.0, centre - margin), min(1.0, centre + margin)
    return IntervalEstimate(share, min(share, float(low)), max(share, float(high)))


def holm(p_values: np.ndarray) -> np.ndarray:
    """P-values of several tests, adjusted so that all may be read at once.

    Holm's step-down method (Scandinavian Journal of Statistics, 1979): the chance of any false
    rejection is at most the level, however the tests depend on each other.

    Args:
        p_values: float64 [N].

    Returns:
        float64 [N], in the same order.
    """
    order = np.argsort(p_values)
    stepped = np.maximum.accumulate(p_values[order] * np.arange(len(p_values), 0, -1))
    adjusted = np.empty(len(p_values))
    adjusted[order] = np.minimum(stepped, 1)
    return adjusted


def bonferroni(comparisons: int, confidence: float = CONFIDENCE) -> float:
    """Confidence of each of several intervals that all hold at once with the given confidence.

    Needs neither equal variances nor independence, unlike Dunnett's intervals, and is hardly wider.

    Args:
        comparisons: how many intervals.
        confidence: with which all of them are to hold at once, in (0, 1).

    Returns:
        The confidence to ask of each.
    """
    return 1 - (1 - confidence) / comparisons


def interquartile_mean(samples: np.ndarray, axis: int = -1) -> np.ndarray:
    """Mean of the middle half of the samples: a quarter, rounded down, is left out at each end.

    Args:
        samples: float64 [..., T, ...].
        axis: along which the T trials lie.

    Returns:
        float64, without that axis.
    """
    trials = samples.shape[axis]
    cut = trials // 4
    middle = np.partition(samples, (cut, trials - cut - 1), axis=axis)
    return np.asarray(middle.take(range(cut, trials - cut), axis=axis).mean(axis=axis))


def interquartile_influence(samples: np.ndarray) -> np.ndarray:
    """What each sample adds to the interquartile mean of all of them.

    Its influence function (Huber, Robust Statistics, 1981, Section 3.3): the mean of these numbers
    over resampled samples is, to first order, how far their interquartile mean lies from this one.

    Args:
        samples: float64 [T].

    Returns:
        float64 [T], with mean 0.
    """
    within = np.clip(samples, *np.quantile(samples, (0.25, 0.75)))
    return 2 * (within - within.mean())


def bootstrap_interval(
    samples: Sequence[np.ndarray],
    statistic: Callable[..., np.ndarray],
    generator: np.random.Generator,
    method: str = "BCa",
    paired: bool = False,
    resamples: int = RESAMPLES,
    confidence: float = CONFIDENCE,
) -> IntervalEstimate:
    """A statistic of one or more conditions with SciPy's bootstrap interval over trials.

    Args:
        samples: float64 [T] of each condition.
        statistic: of the samples, one argument per condition, along the keyword `axis`.
        generator: draws the resamples.
        method: "BCa" (Efron, JASA, 1987) or "percentile".
        paired: whether trials of equal place are drawn together.
        resamples: how many.
        confidence: that the interval is to have, in (0, 1).

    Returns:
        The statistic; no interval for a single trial, one without width if no condition varies.
    """
    found = float(statistic(*samples, axis=-1))
    if min(map(len, samples)) < 2:
        return IntervalEstimate(found, float("nan"), float("nan"))
    if all(np.ptp(values) == 0 for values in samples):
        return IntervalEstimate(found, found, found)
    import scipy.stats  # 0.3 s that a report does without

    low, high = scipy.stats.bootstrap(
        samples,
        statistic,
        n_resamples=resamples,
        batch=max(1, 2**22 // max(map(len, samples))),
        vectorized=True,
        paired=paired,
        axis=-1,
        confidence_level=confidence,
        method=method,  # type: ignore[arg-type]
        rng=generator,
    ).confidence_interval
    return IntervalEstimate(found, float(low), float(high))


def percentile_interval(
    estimate: float, replicates: np.ndarray, confidence: float = CONFIDENCE
) -> IntervalEstimate:
    """An estimate with the percentile interval of its bootstrap replicates.

    Args:
        estimate: from the samples themselves.
        replicates: float64 [B]; NaN if a replicate has no value.
        confidence: that the interval is to have, in (0, 1).

    Returns:
        The estimate; no interval if more than 1% of the replicates have no value.
    """
    known = replicates[np.isfinite(replicates)]
    if len(known) < 0.99 * len(replicates):
        return IntervalEstimate(estimate, float("nan"), float("nan"))
    low, high = np.quantile(known, [(1 - confidence) / 2, (1 + confidence) / 2])
    return IntervalEstimate(estimate, float(low), float(high))
