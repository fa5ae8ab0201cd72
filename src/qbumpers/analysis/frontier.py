"""Performance against learning: Pareto frontiers, and regret at matched performance or learning."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from qbumpers.analysis.resampling import function_interval, resampled_means
from qbumpers.analysis.statistics import RESAMPLES, IntervalEstimate


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


def is_optimal(points: np.ndarray) -> np.ndarray:
    """Which points no other point beats: none is as good in both measures and better in one.

    Args:
        points: float64 [..., N, 2], assisted and unassisted; larger is better.

    Returns:
        bool [..., N]; of equal points, all or none.
    """
    first, second = points[..., 0], points[..., 1]
    beaten = np.zeros(first.shape, np.bool_)
    for index in range(first.shape[-1]):
        x, y = first[..., index, np.newaxis], second[..., index, np.newaxis]
        beaten |= (x >= first) & (y >= second) & ((x > first) | (y > second))
    return ~beaten


def optimal_probability(
    samples: Mapping[str, np.ndarray],
    generator: np.random.Generator,
    paired: bool = False,
    resamples: int = RESAMPLES,
) -> dict[str, float]:
    """How often each condition is Pareto-optimal among resamples of the trials.

    Args:
        samples: float64 [T, 2], assisted and unassisted by trial, of each condition.
        generator: draws the resamples.
        paired: draw the same trials in all conditions (common random numbers).
        resamples: how many.

    Returns:
        The share of the resamples, by condition; NaN if a condition has a single trial.
    """
    points = resampled_means(list(samples.values()), generator, paired, resamples)
    if np.isnan(points).any():
        return dict.fromkeys(samples, float("nan"))
    return dict(zip(samples, is_optimal(points).mean(axis=0).tolist(), strict=True))


def at_matched(points: np.ndarray, level: np.ndarray | float, axis: int) -> np.ndarray:
    """What a method reaches in one measure at a given level of the other.

    Interpolates linearly between neighbours on the frontier. Below the frontier's range the
    measure asked for is that of its nearest end, which gives at least the level; above it no
    setting of the method reaches the level.

    Args:
        points: float64 [..., N, 2], assisted and unassisted means of the settings of one method.
        level: float64 [...], of measure `axis`.
        axis: 0 matches assisted performance, 1 matches unassisted learning.

    Returns:
        float64 [...], the other measure; NaN if the level is out of reach.
    """
    matched, asked = points[..., axis], points[..., 1 - axis]
    levels = np.asarray(level, np.float64)[..., np.newaxis]
    enough = matched >= levels
    possible = np.any(enough, axis=-1, keepdims=True)
    above = np.where(possible, _best(matched, asked, enough), np.nan)
    short = ~enough & (asked > above[..., 1, np.newaxis])
    between = np.any(short, axis=-1, keepdims=True)
    start = np.where(between, _best(asked, matched, short)[..., ::-1], above)
    way = above - start
    share = (levels - start)[..., 0] / np.where(between, way, 1.0)[..., 0]
    return start[..., 1] + np.where(between[..., 0], share, 1.0) * way[..., 1]


def _best(other: np.ndarray, value: np.ndarray, among: np.ndarray) -> np.ndarray:
    """(other, value) [..., 2] of the largest value among some; of equal ones, the largest other."""
    top = np.where(among, value, -np.inf).max(axis=-1)
    equal = among & (value == top[..., np.newaxis])
    return np.stack([np.where(equal, other, -np.inf).max(axis=-1), top], axis=-1)


def beaten_share(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """Share of the points of one method that some point of another beats.

    Args:
        ours: float64 [..., N, 2], assisted and unassisted; larger is better.
        theirs: float64 [..., M, 2].

    Returns:
        float64 [...], the share of theirs that one of ours is as good as in both measures and
        better than in one.
    """
    counts = np.zeros(theirs.shape[:-2])
    for index in range(theirs.shape[-2]):
        one = theirs[..., index, np.newaxis, :]
        beats = np.all(ours >= one, axis=-1) & np.any(ours > one, axis=-1)
        counts += np.any(beats, axis=-1)
    return counts / theirs.shape[-2]


def lead(ours: np.ndarray, theirs: np.ndarray, axis: int) -> np.ndarray:
    """How far one method leads in one measure, if both are equal in the other.

    Args:
        ours: float64 [..., N, 2], assisted and unassisted; larger is better.
        theirs: float64 [..., M, 2].
        axis: of the equal measure: 0 matches assisted performance, 1 unassisted learning.

    Returns:
        float64 [...], what ours reach at the level of each of theirs, minus what that one has, on
        average over those whose level ours reach; NaN if that is none.
    """
    leads = np.stack(
        [
            at_matched(ours, theirs[..., index, axis], axis) - theirs[..., index, 1 - axis]
            for index in range(theirs.shape[-2])
        ],
        axis=-1,
    )
    reached = np.isfinite(leads)
    total = np.where(reached, leads, 0.0).sum(axis=-1)
    number = reached.sum(axis=-1)
    return np.where(number > 0, total / np.maximum(number, 1), np.nan)


class Regret(NamedTuple):
    """How much less a method loses than a baseline, if both are equally good otherwise.

    Attributes:
        axis: 0 if assisted performance is matched and learning compared, 1 the reverse.
        baseline_condition: the baseline's setting that is matched.
        best_condition: the condition that is best in the compared measure.
        level: the matched measure, at the baseline's setting.
        baseline: the other measure, at that setting.
        method: what the method reaches there.
        best: the best possible, from which regret is counted.
        reduction: 1 - (best - method) / (best - baseline).
        gap: best - baseline, the baseline's own regret, of which the reduction is a share.
    """

    axis: int
    baseline_condition: str
    best_condition: str
    level: float
    baseline: float
    method: IntervalEstimate
    best: float
    reduction: IntervalEstimate
    gap: IntervalEstimate

    @property
    def is_known(self) -> bool:
        """Whether the baseline's regret is surely above zero: no share of less means anything.

        Even the lower end of its interval must be a quarter of it.
        """
        return self.gap.low > self.gap.mean / 4 > 0


def matched_regret(
    samples: Mapping[str, np.ndarray],
    method: Sequence[str],
    baseline: Sequence[str],
    axis: int,
    generator: np.random.Generator,
    paired: bool = False,
    resamples: int = RESAMPLES,
) -> Regret:
    """Regret of a method relative to a baseline at matched performance or matched learning.

    The baseline stands at its best setting in the compared measure; regret is counted from the
    best condition of all. Both, and the method's frontier, are found anew in each resample of the
    trials, so that the intervals know that they were picked.

    Args:
        samples: float64 [T, 2], assisted and unassisted by trial, of all conditions.
        method: ids of its settings.
        baseline: ids of its settings.
        axis: 0 matches assisted performance, 1 matches unassisted learning.
        generator: draws the resamples.
        paired: draw the same trials in all conditions (common random numbers).
        resamples: how many.

    Returns:
        The regret.
    """
    names = list(samples)
    ours, theirs = ([names.index(name) for name in chosen] for chosen in (method, baseline))
    means = np.array([values.mean(axis=0) for values in samples.values()])
    resampled = resampled_means(list(samples.values()), generator, paired, resamples)

    def reached(points: np.ndarray) -> np.ndarray:
        """The method's other measure, [...], at the baseline's level; points are [..., C, 2]."""
        return at_matched(points[..., ours, :], _standing(points, theirs, axis)[..., axis], axis)

    def regret(points: np.ndarray) -> np.ndarray:
        """The baseline's regret, [...]."""
        best = points[..., 1 - axis].max(axis=-1)
        return best - _standing(points, theirs, axis)[..., 1 - axis]

    def reduction(points: np.ndarray) -> np.ndarray:
        """The share of the baseline's regret that the method is without; NaN if there is none."""
        best, gap = points[..., 1 - axis].max(axis=-1), regret(points)
        return 1 - (best - reached(points)) / np.where(gap > 0, gap, np.nan)

    chosen = theirs[int(np.argmax(means[theirs, 1 - axis]))]
    best = int(np.argmax(means[:, 1 - axis]))
    share = function_interval(reduction, means, resampled)
    return Regret(
        axis=axis,
        baseline_condition=names[chosen],
        best_condition=names[best],
        level=float(means[chosen, axis]),
        baseline=float(means[chosen, 1 - axis]),
        method=function_interval(reached, means, resampled),
        best=float(means[best, 1 - axis]),
        # All of the regret is the most that can be avoided. NaN stays.
        reduction=share._replace(high=float(np.minimum(share.high, 1.0))),
        gap=function_interval(regret, means, resampled),
    )


def _standing(points: np.ndarray, settings: Sequence[int], axis: int) -> np.ndarray:
    """The setting [..., 2] that is best in the measure that is not matched."""
    among = points[..., settings, :]
    best = np.argmax(among[..., 1 - axis], axis=-1)[..., np.newaxis, np.newaxis]
    return np.take_along_axis(among, best, axis=-2)[..., 0, :]
