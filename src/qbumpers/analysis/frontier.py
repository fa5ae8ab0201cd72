"""Performance against learning: Pareto frontiers, and regret at matched performance or learning."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from qbumpers.analysis.statistics import Estimate, bootstrap_means, percentile_interval

RESAMPLES = 2000


def pareto(points: np.ndarray) -> np.ndarray:
    """The points that no other point beats in both measures.

    Args:
        points: float64 [N, 2], assisted and unassisted; larger is better.

    Returns:
        Indices of the frontier, by growing first measure.
    """
    order = np.lexsort((-points[:, 1], -points[:, 0]))
    second = points[order, 1]
    best_before = np.concatenate([[-np.inf], np.maximum.accumulate(second)[:-1]])
    return order[second > best_before][::-1]


def at_matched(points: np.ndarray, level: float, axis: int) -> float:
    """What a method reaches in one measure at a given level of the other.

    Interpolates linearly between neighbours on the frontier. Below the frontier's range the
    measure asked for is that of its nearest end, which gives at least the level; above it no
    setting of the method reaches the level.

    Args:
        points: float64 [N, 2], assisted and unassisted means of the settings of one method.
        level: of measure `axis`.
        axis: 0 matches assisted performance, 1 matches unassisted learning.

    Returns:
        The other measure; NaN where the level is out of reach.
    """
    frontier = points[pareto(points)]
    frontier = frontier[np.argsort(frontier[:, axis])]
    matched, asked = frontier[:, axis], frontier[:, 1 - axis]
    if level > matched[-1]:
        return float("nan")
    return float(np.interp(level, matched, asked))


class Regret(NamedTuple):
    """How much less a method loses than a baseline, where both are equally good otherwise.

    Attributes:
        axis: 0 where assisted performance is matched and learning compared, 1 the reverse.
        baseline_condition: the baseline's setting that is matched.
        level: the matched measure, at that setting.
        baseline: the other measure, at that setting.
        method: what the method reaches there.
        best: the best possible, from which regret is counted.
        reduction: 1 - (best - method) / (best - baseline).
    """

    axis: int
    baseline_condition: str
    level: float
    baseline: float
    method: Estimate
    best: float
    reduction: Estimate


def matched_regret(
    method: Mapping[str, np.ndarray],
    baseline: Mapping[str, np.ndarray],
    best: np.ndarray,
    axis: int,
    generator: np.random.Generator,
    resamples: int = RESAMPLES,
) -> Regret:
    """Regret of a method relative to a baseline at matched performance or matched learning.

    The baseline stands at its best setting in the compared measure. The interval is a percentile
    bootstrap over trials, with the frontier found anew in each resample.

    Args:
        method: samples float64 [T, 2], assisted and unassisted by trial, of each setting.
        baseline: the same of the baseline's settings.
        best: samples float64 [T, 2] of the condition that is best in the compared measure.
        axis: 0 matches assisted performance, 1 matches unassisted learning.
        generator: draws the resamples.
        resamples: number of bootstrap resamples.

    Returns:
        The regret.
    """
    names = list(baseline)
    means = np.array([samples.mean(axis=0) for samples in baseline.values()])
    chosen = int(np.argmax(means[:, 1 - axis]))

    def evaluate(points: np.ndarray, reference: np.ndarray, top: np.ndarray) -> tuple[float, float]:
        reached = at_matched(points, reference[axis], axis)
        gap = top[1 - axis] - reference[1 - axis]
        return reached, float(1 - (top[1 - axis] - reached) / gap) if gap > 0 else float("nan")

    points = np.array([samples.mean(axis=0) for samples in method.values()])
    reached, reduction = evaluate(points, means[chosen], best.mean(axis=0))
    replicates = _replicates(
        [*method.values(), baseline[names[chosen]], best], evaluate, generator, resamples
    )
    return Regret(
        axis=axis,
        baseline_condition=names[chosen],
        level=float(means[chosen, axis]),
        baseline=float(means[chosen, 1 - axis]),
        method=percentile_interval(reached, replicates[:, 0]),
        best=float(best.mean(axis=0)[1 - axis]),
        reduction=percentile_interval(reduction, replicates[:, 1]),
    )


def _replicates(
    samples: Sequence[np.ndarray],
    evaluate: Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[float, float]],
    generator: np.random.Generator,
    resamples: int,
) -> np.ndarray:
    """Evaluations [B, 2] of resampled means; the last two samples are the baseline and the best."""
    means = np.stack([bootstrap_means(s, resamples, generator) for s in samples], axis=1)
    return np.array([evaluate(row[:-2], row[-2], row[-1]) for row in means])
