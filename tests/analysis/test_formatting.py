"""Numbers as readers see them."""

import math

import numpy as np
import pytest

from qbumpers.analysis.formatting import (
    decimals_for,
    decimals_of,
    format_number,
    format_roughly,
)
from qbumpers.analysis.statistics import mean_interval

MINUS = "\N{MINUS SIGN}"


@pytest.mark.parametrize(
    ("low", "high", "digits"),
    [
        (-4.0, 9.0, 1),
        (5.0, 5.0, 1),
        (None, None, 1),
        (math.nan, math.nan, 1),
        (0.9, 1.2, 1),
        (86.96, 87.04, 2),
        (0.712, 0.713, 4),
    ],
)
def test_half_of_a_narrow_interval_is_not_written_as_zero(low, high, digits):
    assert decimals_for(low, high) == digits
    if low is not None and high > low:
        assert float(f"{(high - low) / 2:.{digits}f}") > 0


@pytest.mark.parametrize(
    ("numbers", "digits", "shown"),
    [
        ([0.012, 0.871], 3, "0.871"),
        ([0.8701, 0.8742], 5, "0.87420"),
        ([1.0, 9.5], 2, "9.50"),
        ([-313.46, 87.0], 1, "87.0"),
        ([-7361.59, 87.0], 1, "87.0"),
        ([-73615.9, 87.0], 0, "87"),
        ([8.0e6, 8.4123e6], -3, "8,412,000"),
        ([0, 8.4123e6], -4, "8,410,000"),
        ([5.0, 5.0], 1, "5.0"),
        ([None, math.nan, 0.1, 0.2], 3, "0.200"),
        ([], 1, "–"),
    ],
)
def test_numbers_show_how_they_differ_whatever_their_size(numbers, digits, shown):
    assert decimals_of(numbers) == digits
    assert format_number(numbers[-1] if numbers else None, digits) == shown


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1, 1e3, 1e6, 1e9])
def test_numbers_that_differ_are_never_written_alike(scale):
    numbers = [scale * value for value in (1.0, 1.02, 3.0)]
    digits = decimals_of(numbers)
    assert len({format_number(value, digits) for value in numbers}) == 3


def test_rounded_to_nothing_a_number_has_no_sign():
    assert format_number(-0.04) == "0.0"
    assert format_number(-1.25e6, -5) == f"{MINUS}1,200,000"


@pytest.mark.parametrize(
    ("value", "text"), [(0.01325, "0.013"), (337.7, "340"), (8.4e6, "8,400,000"), (0.0, "0")]
)
def test_rough_numbers_have_two_digits(value, text):
    assert format_roughly(value) == text


@pytest.mark.parametrize("trials", [6, 8, 10])
def test_equal_returns_have_no_more_decimals_however_their_mean_is_rounded(trials):
    found = mean_interval(np.full(trials, 235.4773847239))
    assert decimals_for(found.low, found.high) == 1
