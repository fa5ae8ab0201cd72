"""Numbers as pages and sentences write them."""

import numpy as np

NONE = "–"
"""Written if a number is unknown."""


def format_number(value: float | None, digits: int = 1) -> str:
    """A number with separators, a true minus sign and so many decimals."""
    if value is None or not np.isfinite(value):
        return NONE
    return f"{value:,.{digits}f}".replace("-", "\N{MINUS SIGN}")


def format_share(value: float | None) -> str:
    """A share as a whole percentage."""
    if value is None or not np.isfinite(value):
        return NONE
    return f"{100 * value:.0f}%".replace("-", "\N{MINUS SIGN}")


def decimals_for(low: float | None, high: float | None, least: int = 1) -> int:
    """Decimals that an interval needs: three if it is narrower than 0.2.

    An interval of equal numbers needs no more, though rounding gives its ends another last bit.
    """
    if low is None or high is None:
        return least
    rounding = 1e-9 * max(abs(low), abs(high))
    return max(least, 3) if rounding < high - low < 0.2 else least
