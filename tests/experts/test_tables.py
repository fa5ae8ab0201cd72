"""Tables against the exact solution, with errors that are known."""

import pytest

from qbumpers.experts.tables import check_exactness
from qbumpers.tasks import make_task
from qbumpers.values import TabularValues, solve

TASK = make_task("cliff-walking")
EXACT = solve(TASK)


def test_the_errors_of_a_table_are_found():
    table = EXACT.table.copy()
    table[36] -= 3  # the start: four of 148 moves
    found = check_exactness(TASK, TabularValues(table, 1.0, "cliff-walking", "made up"))
    assert found.start_values == [84]
    assert (found.pairs, found.largest_error) == (148, 3)
    assert found.mean_error == pytest.approx(-3 * 4 / 148)


def test_exact_values_have_no_error():
    assert check_exactness(TASK, EXACT) == ([87.0], 148, 0, 0)
