"""Which condition is best in a measure, which others may be as good, and what is traded."""

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from qbumpers.analysis.statistics import IntervalEstimate, bonferroni, difference


class Leader(NamedTuple):
    """The condition that is best in a measure.

    Attributes:
        condition: its id.
        trials: how many it has.
        others: how many other treatments there are.
        contenders: ids of those that may be as good, the best of them first; None if single trials
            leave that open. The truly best condition is the leader or one of them with 95%
            confidence.
        ahead: how much better the leader is than the second, with its 95% interval; None without a
            second.
        second: id of the second; empty without one.
    """

    condition: str
    trials: int
    others: int
    contenders: Sequence[str] | None
    ahead: IntervalEstimate | None
    second: str = ""


class Trade(NamedTuple):
    """What is gained and lost from the condition that teaches best to the one that performs best.

    Attributes:
        teaching: id of the one that teaches best.
        performing: id of the one that performs best.
        gained: assisted return, with its 95% interval, in reward units per episode.
        lost: unassisted return, the same.
    """

    teaching: str
    performing: str
    gained: IntervalEstimate
    lost: IntervalEstimate


def leader(
    samples: Mapping[str, np.ndarray], alike: Collection[str] = (), paired: bool = False
) -> Leader:
    """The best condition, and those that may be as good.

    A condition may be as good if the interval of its difference from the best one reaches zero;
    the intervals hold for all conditions at once (Bonferroni), so the truly best condition is
    among those that are named, whichever of several looked best by chance.

    Args:
        samples: float64 [T] by condition, one number per trial; larger is better.
        alike: ids of conditions that are the same treatment, since they never override; if one of
            them is the best, the rest are not compared with it.
        paired: whether trials of equal place belong together (common random numbers).
    """
    means = {name: float(values.mean()) for name, values in samples.items()}
    best, *others = sorted(means, key=means.__getitem__, reverse=True)
    others = [name for name in others if best not in alike or name not in alike]
    if not others:
        return Leader(best, len(samples[best]), 0, [], None)
    confidence = bonferroni(len(others))
    highs = [
        difference(samples[name], samples[best], paired, confidence).estimate.high
        for name in others
    ]
    ahead = difference(samples[best], samples[others[0]], paired).estimate
    contenders = [name for name, high in zip(others, highs, strict=True) if high >= 0]
    known = bool(np.isfinite(highs).all())
    return Leader(
        best, len(samples[best]), len(others), contenders if known else None, ahead, others[0]
    )


def trade(
    samples: Mapping[str, np.ndarray], performing: str, teaching: str, paired: bool = False
) -> Trade:
    """What is gained and lost between two conditions.

    Args:
        samples: float64 [T, 2], assisted and unassisted by trial, by condition.
        performing: id of the one that performs best.
        teaching: id of the one that teaches best.
        paired: whether trials of equal place belong together (common random numbers).
    """
    first, second = samples[performing], samples[teaching]
    gained = difference(first[:, 0], second[:, 0], paired).estimate
    lost = difference(second[:, 1], first[:, 1], paired).estimate
    return Trade(teaching, performing, gained, lost)
