"""Numbers as pages and sentences write them."""

import numpy as np

NONE = "–"
"""Stands where a number is unknown."""


def written(value: float | None, digits: int = 1) -> str:
    """A number with separators and a true minus sign."""
    if value is None or not np.isfinite(value):
        return NONE
    return f"{value:,.{digits}f}".replace("-", "\N{MINUS SIGN}")


def per_cent(value: float | None) -> str:
    """A share as a whole percentage."""
    if value is None or not np.isfinite(value):
        return NONE
    return f"{100 * value:.0f}%".replace("-", "\N{MINUS SIGN}")


def digits_for(low: float | None, high: float | None, least: int = 1) -> int:
    """Decimals that an interval needs: three where it is narrower than 0.2.

    An interval of equal numbers needs no more, though rounding gives its ends another last bit.
    """
    if low is None or high is None:
        return least
    rounding = 1e-9 * max(abs(low), abs(high))
    return max(least, 3) if rounding < high - low < 0.2 else least
