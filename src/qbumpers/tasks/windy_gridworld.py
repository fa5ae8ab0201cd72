"""Windy Gridworld (Sutton and Barto 2018, Example 6.5), also with a stochastic wind."""

import numpy as np

from qbumpers.tasks.display import made_by
from qbumpers.tasks.displays.windy_gridworld import (
    COLUMNS,
    GOAL,
    ROWS,
    START,
    windy_gridworld_display,
)
from qbumpers.tasks.grids import moved
from qbumpers.tasks.tabular import TabularTask

WIND = (0, 0, 0, 1, 1, 1, 2, 2, 1, 0)
"""Cells by which each column's wind lifts whoever leaves a cell of it."""

EPISODE_LIMIT = 200


def windy_gridworld(stochastic: bool = False) -> TabularTask:
    """Walk through a wind that lifts, which has to be found out; 7 x 10 cells.

    Actions are up, right, down and left, and each costs 1 until the goal is reached. From columns
    with a wind they also lead upwards, by as many cells as it is strong. Moving off the grid ends
    at its edge.

    Args:
        stochastic: whether a wind is one cell weaker 1 time in 3 and one stronger 1 time in 3
            (Exercise 6.10).

    Returns:
        The task; reaching the goal is its success.
    """
    wind = np.tile(WIND, ROWS)
    gusts = (0, -1, 1) if stochastic else (0,)
    leads = [moved(ROWS, COLUMNS, wind + gust * (wind > 0)) for gust in gusts]
    next_state = np.stack([row * COLUMNS + column for row, column in leads], axis=2)
    arrives = next_state == GOAL[0] * COLUMNS + GOAL[1]
    return TabularTask(
        name="windy-gridworld",
        next_state=next_state,
        probability=np.full(next_state.shape, 1 / len(gusts)),
        reward=np.full(next_state.shape, -1.0),
        terminated=arrives,
        success=arrives,
        start=np.eye(ROWS * COLUMNS)[START[0] * COLUMNS + START[1]],
        discount=1.0,
        episode_limit=EPISODE_LIMIT,
        grid=(ROWS, COLUMNS),
        make_display=made_by(windy_gridworld_display),
    )
