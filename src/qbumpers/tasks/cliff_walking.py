"""Cliff Walking (Sutton and Barto 2018, p. 132) with a bonus at the goal (Section 4.1).

`larger_cliff` has the same rules on grids of other sizes.
"""

from typing import Any

import gymnasium
import numpy as np

from qbumpers.tasks.checking import whole_in
from qbumpers.tasks.display import made_by
from qbumpers.tasks.displays.cliff_walking import (
    ACTIONS,
    COLUMNS,
    ROWS,
    cliff_walking_display,
    cliff_walking_map,
)
from qbumpers.tasks.environment import TabularEnvironment
from qbumpers.tasks.grids import moved
from qbumpers.tasks.tabular import TabularTask

START, GOAL = (3, 0), (3, 11)
ACTION_NAMES = ACTIONS
EPISODE_LIMIT = 100

_BONUS = 100
_MOST = 100  # rows or columns


def state_of(row: int, column: int) -> int:
    """The state number of a cell of the paper's grid, counted from the upper left."""
    return row * COLUMNS + column


def is_cliff(row: Any, column: Any) -> Any:
    """Whether cells of the paper's grid lie on the cliff; numbers or arrays."""
    return _is_cliff(row, column, ROWS, COLUMNS)


def _is_cliff(row: Any, column: Any, rows: int, columns: int) -> Any:
    return (row == rows - 1) & (column > 0) & (column < columns - 1)


def cliff_walking() -> TabularTask:
    """Walk along a cliff, 4 x 12 cells; a fall costs 100 and leads back to the start.

    Actions are up, right, down and left. Every action is worth -1; one onto the cliff -100 and back
    to the start, without an end; one onto the goal 100 more, and the end. Moving off the grid
    leaves the position as it is.

    Returns:
        The task; reaching the goal is its success, falling off the cliff its crash.
    """
    return TabularTask(
        name="cliff-walking",
        episode_limit=EPISODE_LIMIT,
        make_display=made_by(cliff_walking_display),
        environment_spec=gymnasium.spec("qbumpers/CliffWalking-v0"),
        **_rules(ROWS, COLUMNS, _BONUS),
    )


def larger_cliff(rows: int = 8, columns: int = 24) -> TabularTask:
    """Cliff Walking on a grid of any size; V*(s0) is 87 on each.

    The bonus at the goal is 87 more than the shortest path is long, so that as much can be lost
    as on the paper's grid, whatever the size; the episode limit grows with the number of cells.

    Args:
        rows: in [2, 100]; the cliff lies along the last one.
        columns: in [3, 100].

    Returns:
        The task; of 4 rows and 12 columns, the paper's.

    Raises:
        RequestError: if the size is out of range.
    """
    rows = whole_in(rows, "task 'larger-cliff': rows", 2, _MOST)
    columns = whole_in(columns, "task 'larger-cliff': columns", 3, _MOST)
    return TabularTask(
        name="larger-cliff",
        episode_limit=-(-EPISODE_LIMIT * rows * columns // (ROWS * COLUMNS)),
        make_display=made_by(cliff_walking_display, rows, columns),
        **_rules(rows, columns, _BONUS + columns - COLUMNS),
    )


def _rules(rows: int, columns: int, bonus: int) -> dict[str, Any]:
    """All of a task that the rules of the game decide."""
    to_row, to_column = moved(rows, columns)
    falls = _is_cliff(to_row, to_column, rows, columns)
    arrives = (to_row == rows - 1) & (to_column == columns - 1)
    first = (rows - 1) * columns
    start = np.zeros(rows * columns)
    start[first] = 1
    deterministic = {
        "next_state": np.where(falls, first, to_row * columns + to_column),
        "reward": np.where(falls, -100.0, np.where(arrives, bonus - 1.0, -1.0)),
        "terminated": arrives,
        "success": arrives,
        "crash": falls,
        "probability": np.ones(falls.shape),
    }
    return {
        "start": start,
        "discount": 1.0,
        "grid": (rows, columns),
        **{field: array[:, :, None] for field, array in deterministic.items()},
    }


class CliffWalking(TabularEnvironment):
    """Cliff Walking as a Gymnasium environment, `qbumpers/CliffWalking-v0`.

    Args:
        render_mode: "ansi" for text, "rgb_array" for a picture, None for neither.
    """

    metadata = {"render_modes": ["ansi", "rgb_array"], "render_fps": 4}  # noqa: RUF012

    def __init__(self, render_mode: str | None = None) -> None:
        super().__init__(cliff_walking(), render_mode)

    def render(self) -> Any:
        """The current state: text for "ansi", uint8 [256, 768, 3] for "rgb_array"."""
        return as_text(self._state) if self.render_mode == "ansi" else super().render()


def as_text(state: int) -> str:
    """The grid as text: S start, C cliff, G goal, o the walker."""
    cells = np.array([list(row) for row in cliff_walking_map()])
    cells.flat[state] = "o"
    return "\n".join(" ".join(row) for row in cells) + "\n"
