"""Whole methods compared: how much of performance and learning their settings cover together."""

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from qbumpers.analysis.resampling import function_interval, resampled_means
from qbumpers.analysis.statistics import RESAMPLES, IntervalEstimate


def hypervolume(points: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Area that points dominate above a reference point (Zitzler & Thiele, 1999).

    Args:
        points: float64 [..., N, 2], assisted and unassisted; larger is better.
        reference: float64 [2]; points that do not exceed it in both measures add nothing.

    Returns:
        float64 [...], in squared reward units.
    """
    above = np.maximum(points - reference, 0)
    order = np.argsort(-above[..., 0], axis=-1)
    wide, high = (np.take_along_axis(above[..., axis], order, axis=-1) for axis in (0, 1))
    steps = np.diff(np.maximum.accumulate(high, axis=-1), axis=-1, prepend=0)
    return np.sum(wide * steps, axis=-1)


def worst(samples: Mapping[str, np.ndarray]) -> np.ndarray:
    """The worst mean of each measure over all conditions: the reference point by default.

    Args:
        samples: float64 [T, 2], assisted and unassisted by trial, of each condition.

    Returns:
        float64 [2].
    """
    return np.min([values.mean(axis=0) for values in samples.values()], axis=0)


class Advantage(NamedTuple):
    """How much more one method covers than another.

    Attributes:
        estimate: difference of their hypervolumes, in squared reward units.
        probability: share of the resamples in which it is larger; ties count half. NaN if a
            condition has a single trial.
    """

    estimate: IntervalEstimate
    probability: float


class Hypervolumes(NamedTuple):
    """What methods cover.

    Attributes:
        reference: float64 [2], the point above which they are measured.
        methods: the hypervolume of each, in squared reward units.
        largest: share of the resamples in which a method's is the largest; ties are shared. NaN if
            a condition has a single trial.
        advantages: of a method over another, by both names; each pair once, the later method first.
    """

    reference: np.ndarray
    methods: dict[str, IntervalEstimate]
    largest: dict[str, float]
    advantages: dict[tuple[str, str], Advantage]


def compare_hypervolumes(
    samples: Mapping[str, np.ndarray],
    methods: Mapping[str, Sequence[str]],
    generator: np.random.Generator,
    reference: np.ndarray | None = None,
    paired: bool = False,
    resamples: int = RESAMPLES,
) -> Hypervolumes:
    """Hypervolumes of methods with intervals, and how they compare.

    The reference point stays as it is in all resamples.

    Args:
        samples: float64 [T, 2], assisted and unassisted by trial, of all conditions.
        methods: ids of the settings of each method.
        generator: draws the resamples.
        reference: float64 [2]; the worst of each measure over all conditions if None.
        paired: draw the same trials in all conditions (common random numbers).
        resamples: how many.

    Returns:
        The comparison.
    """
    below = worst(samples) if reference is None else reference
    names = list(samples)
    places = {method: [names.index(name) for name in ids] for method, ids in methods.items()}
    means = np.array([values.mean(axis=0) for values in samples.values()])
    resampled = resampled_means(list(samples.values()), generator, paired, resamples)

    def covered(method: str, points: np.ndarray) -> np.ndarray:
        """The area [...] that a method's conditions cover, of all points [..., C, 2]."""
        return hypervolume(points[..., places[method], :], below)

    def estimated(method: str) -> IntervalEstimate:
        """That area at the means, with its interval; an area is never negative."""
        found = function_interval(lambda points: covered(method, points), means, resampled)
        return found._replace(low=max(found.low, 0.0))  # NaN stays

    def advantage(first: str, second: str) -> Advantage:
        """How much more one method covers, and in which share of resamples it covers more."""
        found = function_interval(
            lambda points: covered(first, points) - covered(second, points), means, resampled
        )
        wins = np.sign(replicates[first] - replicates[second])
        return Advantage(found, float(np.mean(0.5 + wins / 2)))

    unknown = np.isnan(resampled).any()
    replicates = {
        method: np.full(resamples, np.nan) if unknown else covered(method, resampled)
        for method in places
    }
    largest = _largest(np.stack(list(replicates.values()), axis=-1))
    return Hypervolumes(
        reference=below,
        methods={method: estimated(method) for method in places},
        largest=dict(zip(places, largest.tolist(), strict=True)),
        advantages={
            (first, second): advantage(first, second)
            for second, first in itertools.combinations(places, 2)
        },
    )


def _largest(replicates: np.ndarray) -> np.ndarray:
    """Share [K] of the replicates [B, K] in which each is the largest; ties are shared."""
    if np.isnan(replicates).any():
        return np.full(replicates.shape[-1], np.nan)
    largest = replicates == replicates.max(axis=-1, keepdims=True)
    return np.mean(largest / largest.sum(axis=-1, keepdims=True), axis=0)
