"""Labels of points, placed so that they can be read."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

MOST_IN_A_COLUMN = 16
"""More labels than these do not fit beside a panel."""

_WIDTH, _HEIGHT = 0.076, 0.16  # of a character, of a line, in inches, at 9 points
_GAP, _POINT = 0.07, 0.06  # between a point and its label; half a point's size; in inches
# Where a label may stand: off the error bars first, then right, above, below and left.
_DIRECTIONS = ((1, 1), (-1, 1), (1, -1), (-1, -1), (1, 0), (0, 1), (0, -1), (-1, 0))


def room_for_labels(places: np.ndarray, labels: Sequence[str], size: np.ndarray) -> np.ndarray:
    """Where labels may stand beside their points, the first ones choosing first.

    Args:
        places: of points, float64 [N, 2], in inches from the lower left corner of the axes; no
            label covers any of them, or another label.
        labels: of the first points; the rest have none.
        size: width and height of the axes, in inches.

    Returns:
        float64 [len(labels), 2], centres of labels relative to their points, in inches; NaN if
        there is no room.
    """
    taken = [np.concatenate([place - _POINT, place + _POINT]) for place in places]
    offsets = np.full((len(labels), 2), np.nan)
    for index, label in enumerate(labels):
        for direction in _DIRECTIONS:
            offset = np.array(direction) * (_half(label) + _GAP)
            box = np.concatenate([-_half(label), _half(label)]) + np.tile(places[index] + offset, 2)
            inside = (box[:2] >= 0).all() and (box[2:] <= size).all()
            if inside and not any(_overlap(box, other) for other in taken):
                taken.append(box)
                offsets[index] = offset
                break
    return offsets


def _half(label: str) -> np.ndarray:
    return np.array([len(label) * _WIDTH, _HEIGHT]) / 2


def _overlap(one: np.ndarray, other: np.ndarray) -> bool:
    return bool((one[:2] < other[2:]).all() and (other[:2] < one[2:]).all())


def label_in_column(
    axes: Axes, points: np.ndarray, labels: Sequence[str], at: float, ink: str
) -> None:
    """Label a cluster of points in a column beside it, with a line to each point.

    Args:
        axes: to draw on, with its limits set.
        points: float64 [N, 2], in data units.
        labels: N of them, at most `MOST_IN_A_COLUMN` to be legible.
        at: horizontal place of the column, as a share of the width of the axes.
        ink: colour.
    """
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    order = np.argsort(points[:, 1])
    wanted = (points[order, 1] - low) / (high - low)
    heights = low + (high - low) * _spread_out(wanted, gap=min(0.062, 0.94 / max(1, len(labels))))
    column = left + at * (right - left)
    for height, index in zip(heights, order, strict=True):
        axes.text(column, height, f" {labels[index]}", fontsize=8, color=ink, va="center")
    ends = np.column_stack([np.full(len(heights), column), heights])
    lines = np.stack([points[order], ends], axis=1)
    axes.add_collection(
        LineCollection(list(lines), colors=ink, alpha=0.45, linewidths=0.7), autolim=False
    )


def _spread_out(wanted: np.ndarray, gap: float) -> np.ndarray:
    """Places near the wanted ones (sorted), at least a gap apart, within [0.03, 0.97]."""
    places = np.clip(wanted, 0.03, 0.97)
    for index in range(1, len(places)):
        places[index] = max(places[index], places[index - 1] + gap)
    overflow = places[-1] - 0.97
    if overflow > 0:
        places[-1] = 0.97
        for index in range(len(places) - 2, -1, -1):
            places[index] = min(places[index], places[index + 1] - gap)
    return places
