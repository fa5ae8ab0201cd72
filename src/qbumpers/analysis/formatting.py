"""Numbers as pages, sentences, figures and the command line write them."""

from collections.abc import Iterable

import numpy as np

NONE = "–"
"""Written if a number is unknown."""

_WHOLE, _ROUNDED = 1e4, 1e5  # numbers that differ by more need no decimals; are rounded further


def format_number(value: float | None, digits: int = 1) -> str:
    """A number with separators, a true minus sign and so many decimals.

    Args:
        value: to be written; a dash is if it is not known.
        digits: decimals; -3 for whole thousands.
    """
    if value is None or not np.isfinite(value):
        return NONE
    rounded = round(float(value), digits) + 0.0  # + 0.0 turns -0.0 into 0.0
    return f"{rounded:,.{max(digits, 0)}f}".replace("-", "\N{MINUS SIGN}")


def format_roughly(value: float) -> str:
    """A number to two digits, whatever its size."""
    return format_number(value, 1 - _power(abs(value)) if value else 0)


def format_share(value: float | None) -> str:
    """A share as a whole percentage."""
    if value is None or not np.isfinite(value):
        return NONE
    return f"{100 * value:.0f}%".replace("-", "\N{MINUS SIGN}")


def decimals_of(numbers: Iterable[float | None]) -> int:
    """Decimals of numbers that are compared: they show how far these differ to three digits.

    Returns of everyday size keep one decimal, and lose it only if they differ by 10,000.

    Args:
        numbers: those that are compared; None if unknown. Ends of intervals are none of them: those
            of few trials lie far apart.

    Returns:
        Decimals for `format_number`, negative if numbers differ by 100,000 or more.
    """
    known = [value for value in numbers if value is not None and np.isfinite(value)]
    apart = max(known, default=0.0) - min(known, default=0.0)
    if apart <= _rounding(known):
        return 1
    if apart >= _ROUNDED or apart < 10:
        return 2 - _power(apart)
    return 1 if apart < _WHOLE else 0


def decimals_for(low: float | None, high: float | None, least: int = 1) -> int:
    """Decimals of a number with an interval: enough that half of its width is not written as 0.

    Args:
        low: end of the interval; None if it has none.
        high: the other end.
        least: decimals of the numbers beside it, from `decimals_of`.
    """
    if low is None or high is None or not np.isfinite(high - low):
        return least
    if high - low <= _rounding([low, high]):  # an interval of equal numbers needs no more
        return least
    return max(least, -_power((high - low) / 2))


def _rounding(numbers: list[float]) -> float:
    """By how much numbers that are equal in truth may differ."""
    return 1e-9 * max(map(abs, numbers), default=0.0)


def _power(size: float) -> int:
    return int(np.floor(np.log10(size)))
