"""Windy Gridworld against the words of Sutton and Barto (2018, Example 6.5)."""

import numpy as np
import pytest

from qbumpers.tasks import make_task
from qbumpers.tasks.drawing import picture
from qbumpers.tasks.windy_gridworld import windy_gridworld
from qbumpers.values import solve
from tests.narrowing import present
from tests.tasks.examples import outcomes
from tests.tasks.shown import near

UP, RIGHT, DOWN, LEFT = range(4)
WIND = "0001112210"  # as the figure shows it, below the columns


def number(row: int, column: int) -> int:
    return 10 * row + column


def described(row: int, column: int, action: int, wind: int) -> int:
    """The next cell in words: a step, and the wind of the cell that is left, within the grid."""
    row += {UP: -1, DOWN: 1}.get(action, 0) - wind
    column += {LEFT: -1, RIGHT: 1}.get(action, 0)
    return number(min(max(row, 0), 6), min(max(column, 0), 9))


def all_moves():
    return [(r, c, a) for r, c, a in np.ndindex(7, 10, 4) if (r, c) != (3, 7)]


def test_every_move_leads_where_the_book_says():
    task = windy_gridworld()
    for row, column, action in all_moves():
        to = described(row, column, action, int(WIND[column]))
        expected = {(to, -1.0, to == number(3, 7)): 1.0}
        assert outcomes(task, number(row, column), action) == expected


def test_a_stochastic_wind_is_one_weaker_or_stronger_a_third_of_the_time_each():
    task = windy_gridworld(stochastic=True)
    for row, column, action in all_moves():
        mean = int(WIND[column])
        winds = (mean - 1, mean, mean + 1) if mean else (0, 0, 0)
        expected: dict = {}
        for wind in winds:
            to = described(row, column, action, wind)
            outcome = (to, -1.0, to == number(3, 7))
            expected[outcome] = expected.get(outcome, 0.0) + 1 / 3
        assert outcomes(task, number(row, column), action) == pytest.approx(expected)


def test_the_best_path_takes_fifteen_steps():
    task = make_task("windy-gridworld")
    assert np.flatnonzero(task.start).tolist() == [number(3, 0)]
    assert solve(task)(number(3, 0)).max() == -15


def test_reaching_the_goal_is_its_success():
    task = windy_gridworld()
    assert task.events == {"success"}
    assert np.array_equal(present(task.success), task.terminated)


def test_the_picture_shows_the_walker_and_not_the_wind():
    display = windy_gridworld().display
    shown = picture(display, number(2, 4))
    assert shown.shape == (7 * 64, 10 * 64, 3)
    y, x = np.argwhere(near(shown, "#e8890c")).mean(axis=0)
    assert (int(y) // 64, int(x) // 64) == (2, 4)
    assert {shape["text"] for shape in display.backdrop if "text" in shape} == {"S", "G"}
