"""The pieces of `simd` in plain Python: the bits that compiled code has."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qbumpers.networks import interpreted
from tests.networks.test_simd import fused

KINDS = {np.float32: np.uint32, np.float64: np.uint64}
SPECIAL = [0.0, -0.0, 1.0, math.inf, -math.inf, math.nan, 1e-45, -3e38, 5e-324, 1.7e308]


def same_bits(first, second):
    return first.dtype == second.dtype and (
        first.tobytes() == second.tobytes() or bool(np.isnan(first) and np.isnan(second))
    )


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_a_number_is_multiplied_and_added_to_the_bit(kind, data):
    bits = st.integers(0, np.iinfo(KINDS[kind]).max).map(
        lambda number: KINDS[kind](number).view(kind)
    )
    with np.errstate(over="ignore"):
        numbers = st.one_of(bits, st.sampled_from([kind(number) for number in SPECIAL]))
    factor, other, total = (data.draw(numbers) for _ in range(3))
    if data.draw(st.booleans()):  # as large as the product, so that the sum is rounded closely
        with np.errstate(all="ignore"):
            total = -kind(factor * other) * kind(1 + data.draw(st.integers(-2, 2)) * 2.0**-20)
    expected = kind(fused(factor, other, total))
    assert same_bits(interpreted.multiply_add(factor, other, total), expected)


@pytest.mark.parametrize("kind", KINDS)
def test_a_sum_is_rounded_once(kind):
    one, little = kind(1), kind(2.0 ** (-12 if kind == np.float32 else -27))
    # (1 + e)(1 - e) - 1 is - e * e; a product that is rounded by itself gives 0.
    found = interpreted.multiply_add(one + little, one - little, -one)
    assert (found, found.dtype) == (-little * little, kind)


def test_vectors_are_loaded_and_stored_as_copies():
    matrix = np.arange(12, dtype=np.float32).reshape(3, 4)
    vector = interpreted.load(matrix, 3, interpreted.zeros(matrix, 4))
    assert (vector.tolist(), vector.dtype) == ([3, 4, 5, 6], np.float32)
    number = interpreted.load(matrix, 5, interpreted.zeros(matrix, 1))
    assert (number, number.dtype) == (5, np.float32)
    interpreted.store(matrix, 0, vector)
    interpreted.store(matrix, 8, number)
    assert matrix.tolist() == [[3, 4, 5, 6], [4, 5, 6, 7], [5, 9, 10, 11]]
