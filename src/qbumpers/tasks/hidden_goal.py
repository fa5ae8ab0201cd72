"""A goal that only the learner knows, as in Reddy, Dragan and Levine (2018)."""

import numpy as np

from qbumpers.tasks.display import made_by
from qbumpers.tasks.displays.hidden_goal import COLUMNS, GOALS, MAP, ROWS, hidden_goal_display
from qbumpers.tasks.grids import moved
from qbumpers.tasks.tabular import TabularTask

EPISODE_LIMIT = 50

_CELLS = np.array([list(row) for row in MAP]).ravel()
_START = int(np.flatnonzero(_CELLS == "S")[0])
_QUARTER_TURNS = np.array([[0, 1, 2, 1], [1, 0, 1, 2], [2, 1, 0, 1], [1, 2, 1, 0]], float)


def hidden_goal() -> TabularTask:
    """Walk to one of three goals around pits; which one it is, only the learner knows.

    A grid of 5 x 7 cells. Actions are up, right, down and left. Every action is worth -1; one into
    a pit -20 and back to the start, without an end. Any of the goals ends the episode: the one of
    this episode brings 30 more, another one costs 20. The goal is drawn anew for each episode.
    State s is cell s // 3 with goal s % 3; the assistant sees the cell alone. The distance between
    two actions is the number of quarter turns.

    Returns:
        The task; reaching its goal is its success, a pit or another goal its crash.
    """
    to_row, to_column = moved(ROWS, COLUMNS)
    to_cell = np.repeat(to_row * COLUMNS + to_column, len(GOALS), axis=0)
    goal = np.tile(np.arange(len(GOALS)), ROWS * COLUMNS)[:, None]
    falls, ends = (_CELLS == "H")[to_cell], (_CELLS == "G")[to_cell]
    arrives = to_cell == np.array(GOALS)[goal]
    crashes = falls | (ends & ~arrives)
    start = np.zeros(ROWS * COLUMNS * len(GOALS))
    start[_START * len(GOALS) + np.arange(len(GOALS))] = 1 / len(GOALS)
    deterministic = {
        "next_state": np.where(falls, _START, to_cell) * len(GOALS) + goal,
        "reward": np.where(crashes, -20.0, np.where(arrives, 29.0, -1.0)),
        "terminated": ends,
        "success": arrives,
        "crash": crashes,
        "probability": np.ones(falls.shape),
    }
    return TabularTask(
        name="hidden-goal",
        start=start,
        discount=1.0,
        episode_limit=EPISODE_LIMIT,
        seen=np.repeat(np.arange(ROWS * COLUMNS), len(GOALS)),
        action_distance=_QUARTER_TURNS,
        make_display=made_by(hidden_goal_display),
        **{field: array[:, :, None] for field, array in deterministic.items()},
    )
