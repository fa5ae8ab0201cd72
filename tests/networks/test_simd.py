"""Products of small matrices against plain ones, and their bits on other processors."""

import os
import platform
import subprocess
import sys
from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qbumpers.networks.simd import column_sums, multiply, multiply_add, sum_of_squares, transposed
from tests.learners.several_updates import NETWORKS

SIZES = st.integers(1, 70)
PRECISIONS = [np.float32, np.float64]


@numba.njit(error_model="numpy")
def fused(factor, other, total):
    return multiply_add(factor, other, total)


@numba.njit(error_model="numpy")
def one_by_one(left, right, out):
    """The product by its definition, each sum in ascending order, rounded once per term."""
    for row in range(out.shape[0]):
        for column in range(out.shape[1]):
            out[row, column] = 0
            for k in range(left.shape[1]):
                out[row, column] = multiply_add(left[row, k], right[k, column], out[row, column])


def drawn(shape, precision, seed=0):
    return np.random.default_rng(seed).normal(size=shape).astype(precision)


@settings(max_examples=60, deadline=None)
@given(
    rows=SIZES,
    depth=SIZES,
    columns=SIZES,
    precision=st.sampled_from(PRECISIONS),
    transpose=st.booleans(),
)
def test_a_product_has_the_sums_of_its_definition_bit_for_bit(
    rows, depth, columns, precision, transpose
):
    left, right = drawn((rows, depth), precision), drawn((depth, columns), precision, 1)
    out, expected = np.full((2, rows, columns), np.nan, precision)
    multiply(left.T.copy() if transpose else left, transpose, right, out)
    one_by_one(left, right, expected)
    assert np.array_equal(out, expected)
    exact = left.astype(np.float64) @ right.astype(np.float64)
    error = depth * np.finfo(precision).eps * (np.abs(left) @ np.abs(right)).max()
    assert np.abs(out - exact).max() <= error


def test_whole_numbers_multiply_exactly():
    left, right = np.arange(99.0).reshape(9, 11) - 50, np.arange(440.0).reshape(11, 40) % 7
    out = np.empty((9, 40))
    multiply(left, False, right, out)
    assert np.array_equal(out, left @ right)


@pytest.mark.parametrize(("precision", "half"), [(np.float32, 13), (np.float64, 27)])
def test_a_product_and_a_sum_are_rounded_once(precision, half):
    small = precision(2.0**-half)
    one = precision(1)
    assert (one + small) * (one - small) - one == 0  # rounded twice, nothing is left
    assert fused(one + small, one - small, -one) == -(small * small)


@given(size=st.integers(0, 200))
def test_squares_are_summed(size):
    numbers = np.arange(size) - 30.0
    assert sum_of_squares(numbers) == (numbers**2).sum()


@given(rows=SIZES, columns=SIZES, precision=st.sampled_from(PRECISIONS))
def test_columns_are_summed_row_after_row(rows, columns, precision):
    numbers = drawn((rows, columns), precision)
    sums, expected = np.full(columns, np.nan, precision), np.zeros(columns, precision)
    column_sums(numbers, sums)
    for row in numbers:
        expected += row
    assert np.array_equal(sums, expected)


def test_a_transposed_matrix_is_contiguous():
    numbers = drawn((5, 33), np.float32)
    turned = transposed(numbers)
    assert turned.flags.c_contiguous
    assert np.array_equal(turned, numbers.T)


OTHERS: list[Any] = ["generic"]  # on x86-64 one without fused operations
if platform.machine() == "x86_64":  # registers half as wide as those of later ones
    OTHERS.append("haswell")


@pytest.mark.slow
@pytest.mark.parametrize("processor", OTHERS)
def test_learners_have_the_same_bits_on_other_processors(processor):
    here, there = digests({}), digests({"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": ""})
    assert len(set(here)) == len(NETWORKS)
    assert there == here


def digests(settings):
    """What learners become in a process with these settings of the compiler."""
    plain = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_CPU")}
    command = [sys.executable, "-m", "tests.learners.several_updates"]
    found = subprocess.run(command, capture_output=True, text=True, env=plain | settings)
    assert found.returncode == 0, found.stderr
    return found.stdout.split()
