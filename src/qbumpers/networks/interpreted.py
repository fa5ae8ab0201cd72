"""What `simd` does in a few instructions, as plain Python, if nothing is compiled.

The numbers are the same to the bit, for which multiplication and addition must be rounded once.
"""

from fractions import Fraction
from typing import Any

import numpy as np


def zeros(numbers: np.ndarray, width: int) -> Any:
    """So many zeros of an array's kind of number; of one, the number itself."""
    return np.zeros(width, numbers.dtype) if width > 1 else numbers.dtype.type(0)


def load(numbers: np.ndarray, at: int, like: Any) -> Any:
    """Numbers of a contiguous array from a place on, as many as `like` has."""
    flat = numbers.reshape(-1)
    return flat[at : at + like.size].copy() if like.ndim else flat[at]


def store(numbers: np.ndarray, at: int, vector: Any) -> None:
    """Write a vector into a contiguous array from a place on."""
    numbers.reshape(-1)[at : at + vector.size] = vector


def multiply_add(factor: Any, other: Any, total: Any) -> Any:
    """`factor` times `other` plus `total`, rounded once; each a number or a vector like `total`."""
    with np.errstate(all="ignore"):
        if total.dtype == np.float64:
            return _exactly(factor, other, total)[()]
        product = np.float64(factor) * np.float64(other)  # exact: 48 bits of 53
        addend = np.float64(total)
        found = product + addend
        part = found - product
        error = (product - (found - part)) + (addend - part)
        # Rounded to odd, the sum can be rounded once more without being rounded twice.
        even = np.asarray(found).view(np.int64) & 1 == 0
        inexact = (error > 0) | (error < 0)
        odd = np.where(even & inexact, np.nextafter(found, np.copysign(np.inf, error)), found)
        return odd.astype(np.float32)[()]


@np.vectorize(otypes=[np.float64])
def _exactly(factor: float, other: float, total: float) -> float:
    if not np.isfinite([factor, other]).all():
        return factor * other + total
    if not np.isfinite(total):
        return total
    exact = Fraction(float(factor)) * Fraction(float(other)) + Fraction(float(total))
    try:
        return float(exact) if exact else factor * other + total  # which knows the sign of zero
    except OverflowError:
        return np.inf if exact > 0 else -np.inf
