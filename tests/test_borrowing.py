"""Borrowed arrays: the same memory, the same numbers, no references counted."""

import sys
from typing import NamedTuple

import numpy as np
import pytest
from numba.core.errors import TypingError

from qbumpers.borrowing import borrow, read_only, row
from qbumpers.compilation import compiled_for_session, uncompiled


class Tables(NamedTuple):
    first: np.ndarray
    factor: float
    second: np.ndarray


@compiled_for_session
def weighted_sum(tables):
    tables = borrow(tables)
    total = 0.0
    for index in range(len(tables.first)):
        total += tables.factor * tables.first[index] * tables.second[index]
    return total


@compiled_for_session
def sum_and_double(table, width):
    """The sum of every row; each is doubled in place."""
    table = borrow(table)
    sums = np.zeros(len(table))
    for index in range(len(table)):
        values = row(table, index, width)
        for action in range(len(values)):
            sums[index] += values[action]
            values[action] *= 2
    return sums


@compiled_for_session
def sums_and_double(tables, width):
    """The sums of the rows of every table; each row is doubled in place."""
    tables = borrow(tables)
    sums = np.zeros(tables.shape[:2])
    for index in range(len(tables)):
        values = row(tables, index, width)
        for place in range(len(values)):
            sums[index, place] = values[place].sum()
            values[place] *= 2
    return sums


@compiled_for_session
def is_nothing(thing):
    return borrow(thing) is None


@pytest.fixture(params=["compiled", "interpreted"])
def as_host_runs_it(request):
    return (lambda f: f) if request.param == "compiled" else (lambda f: f.py_func)


def some_tables():
    generator = np.random.default_rng(3)
    return Tables(generator.random(50), 0.5, generator.random(50))


def test_borrowed_tables_hold_the_same_numbers(as_host_runs_it):
    tables = some_tables()
    expected = tables.factor * (tables.first @ tables.second)
    assert as_host_runs_it(weighted_sum)(tables) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("shape", [(1, 1), (5, 2), (48, 4)])
def test_a_row_is_a_view_of_the_right_part_of_its_table(as_host_runs_it, shape):
    table = np.random.default_rng(4).integers(-9, 9, shape).astype(float)
    before = table.copy()
    sums = as_host_runs_it(sum_and_double)(table, (0,) * shape[1])
    assert np.array_equal(sums, before.sum(axis=1))
    assert np.array_equal(table, 2 * before)


@pytest.mark.parametrize("shape", [(1, 1, 1), (5, 3, 2), (48, 2, 4), (3, 0, 4)])
def test_rows_are_a_view_of_the_right_part_of_their_tables(as_host_runs_it, shape):
    tables = np.random.default_rng(5).integers(-9, 9, shape).astype(float)
    before = tables.copy()
    sums = as_host_runs_it(sums_and_double)(tables, (0,) * shape[2])
    assert np.array_equal(sums, before.sum(axis=2))
    assert np.array_equal(tables, 2 * before)


def test_nothing_can_be_borrowed(as_host_runs_it):
    assert as_host_runs_it(is_nothing)(None)
    assert not as_host_runs_it(is_nothing)(some_tables())


def test_arrays_outlive_any_number_of_loans():
    tables = some_tables()
    counts = [sys.getrefcount(tables.first), sys.getrefcount(tables.second)]
    expected = weighted_sum(tables)
    assert all(weighted_sum(tables) == expected for _ in range(100))
    assert [sys.getrefcount(tables.first), sys.getrefcount(tables.second)] == counts


@compiled_for_session
def double_first(numbers):
    numbers = read_only(numbers)
    numbers[0] *= 2
    return numbers[0]


@compiled_for_session
def double_a_row(table, width):
    values = row(read_only(table), 0, width)
    values[0] *= 2
    return values[0]


@compiled_for_session
def sum_read_only(numbers):
    numbers = read_only(numbers)
    return numbers.sum() + numbers[0]


def test_what_is_read_only_cannot_be_changed():
    numbers, table = np.arange(3.0), np.ones((2, 3))
    with pytest.raises(TypingError, match="readonly array"):
        double_first(numbers)
    with pytest.raises(TypingError, match="readonly array"):
        double_a_row(table, (0, 0, 0))
    with pytest.raises(ValueError, match="read-only"):
        uncompiled(double_first)(numbers)
    with pytest.raises(ValueError, match="read-only"):
        uncompiled(double_a_row)(table, (0, 0, 0))
    assert numbers.tolist() == [0, 1, 2]
    assert (table == 1).all()
    numbers[0] = 5  # the caller's own array stays as it was
    assert sum_read_only(numbers) == uncompiled(sum_read_only)(numbers) == 5 + 1 + 2 + 5


def test_a_tuple_is_read_only_in_all_its_arrays():
    tables = read_only(Tables(np.arange(3.0), 2.0, np.ones(2)))
    assert isinstance(tables, Tables)
    assert tables.factor == 2.0
    assert not tables.first.flags.writeable
    assert not tables.second.flags.writeable
    assert read_only((None, 3)) == (None, 3)


def test_a_read_only_view_lets_the_array_go():
    numbers = np.arange(3.0)
    before = sys.getrefcount(numbers)
    for _ in range(3):
        sum_read_only(numbers)
    assert sys.getrefcount(numbers) == before
