"""What a method reaches at a share of overridden steps, between its settings."""

import numpy as np

SHARES = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4)
"""Shares of overridden steps at which methods are compared."""


def at_share(points: np.ndarray, share: float) -> np.ndarray:
    """The means of a method at a share of overridden steps.

    Linear between the two settings whose shares are nearest on either side. If some people get one
    of them and the others the other, means over people are just these: it is an assistant that
    exists. Nothing is assumed beyond the settings.

    Args:
        points: means of each of K settings, float64 [..., K, 3]: share, assisted and unassisted
            return.
        share: of steps to be overridden, in [0, 1].

    Returns:
        Assisted and unassisted return, float64 [..., 2]; NaN if no setting overrides as little, or
        as much.
    """
    shares = points[..., 0]
    below = np.where(shares <= share, shares, -np.inf)
    above = np.where(shares >= share, shares, np.inf)
    ends = [
        np.take_along_axis(points, place[..., np.newaxis, np.newaxis], axis=-2)[..., 0, :]
        for place in (below.argmax(axis=-1), above.argmin(axis=-1))
    ]
    reached = (shares.min(axis=-1) <= share) & (shares.max(axis=-1) >= share)
    width = ends[1][..., 0] - ends[0][..., 0]
    way = np.where(width > 0, (share - ends[0][..., 0]) / np.where(width > 0, width, 1.0), 0.0)
    found = ends[0][..., 1:] + way[..., np.newaxis] * (ends[1][..., 1:] - ends[0][..., 1:])
    return np.where(np.expand_dims(reached, -1), found, np.nan)
