"""Cliff Walking (Sutton and Barto 2018, p. 132) with a bonus at the goal (Section 4.1)."""

from typing import Any

import gymnasium
import numpy as np

from qbumpers.tasks.display import made_by
from qbumpers.tasks.displays.cliff_walking import ACTIONS, MAP, cliff_walking_display
from qbumpers.tasks.environment import TabularEnvironment
from qbumpers.tasks.tabular import TabularTask

ROWS, COLUMNS = 4, 12
START, GOAL = (3, 0), (3, 11)
ACTION_NAMES = ACTIONS
EPISODE_LIMIT = 100

_MOVES = np.array([(-1, 0), (0, 1), (1, 0), (0, -1)])


def state_of(row: int, column: int) -> int:
    """The state number of a cell, counted from the upper left."""
    return row * COLUMNS + column


def is_cliff(row: Any, column: Any) -> Any:
    """Whether cells lie on the cliff; numbers or arrays."""
    return (row == START[0]) & (column > START[1]) & (column < GOAL[1])


def cliff_walking() -> TabularTask:
    """The task: 4 x 12 cells, actions up, right, down, left.

    Every action is worth -1; one onto the cliff -100 and back to the start, without an end; one
    onto the goal 100 more, and the end. Moving off the grid leaves the position as it is.

    Returns:
        The task; reaching the goal is its success, falling off the cliff its crash.
    """
    row, column = np.divmod(np.arange(ROWS * COLUMNS), COLUMNS)
    to_row = np.clip(row[:, None] + _MOVES[:, 0], 0, ROWS - 1)
    to_column = np.clip(column[:, None] + _MOVES[:, 1], 0, COLUMNS - 1)
    falls = is_cliff(to_row, to_column)
    arrives = (to_row == GOAL[0]) & (to_column == GOAL[1])
    start = np.zeros(ROWS * COLUMNS)
    start[state_of(*START)] = 1
    deterministic = {
        "next_state": np.where(falls, state_of(*START), to_row * COLUMNS + to_column),
        "reward": np.where(falls, -100.0, np.where(arrives, 99.0, -1.0)),
        "terminated": arrives,
        "success": arrives,
        "crash": falls,
        "probability": np.ones(falls.shape),
    }
    return TabularTask(
        name="cliff-walking",
        start=start,
        discount=1.0,
        episode_limit=EPISODE_LIMIT,
        grid=(ROWS, COLUMNS),
        make_display=made_by(cliff_walking_display),
        environment_spec=gymnasium.spec("qbumpers/CliffWalking-v0"),
        **{field: array[:, :, None] for field, array in deterministic.items()},
    )


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
    cells = np.array([list(row) for row in MAP])
    cells.flat[state] = "o"
    return "\n".join(" ".join(row) for row in cells) + "\n"
