"""Steps on grids of cells."""

import numpy as np

from qbumpers.tasks.grids import moved


def test_steps_stop_at_the_edge():
    row, column = moved(2, 3)
    assert list(zip(row[0], column[0], strict=True)) == [(0, 0), (0, 1), (1, 0), (0, 0)]
    assert list(zip(row[5], column[5], strict=True)) == [(0, 2), (1, 2), (1, 2), (1, 1)]


def test_a_lift_comes_on_top_of_every_step():
    row, column = moved(3, 2, np.array([0, 0, 0, 0, 2, -1]))
    assert row[4].tolist() == [0, 0, 1, 0]
    assert column[4].tolist() == [0, 1, 0, 0]
    assert row[5].tolist() == [2, 2, 2, 2]  # one down, which the edge stops
