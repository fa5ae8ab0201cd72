"""Cliff Walking as in Figure 1 of the paper, in any size."""

from qbumpers.tasks.display import Display, move_keys
from qbumpers.tasks.displays.grid import grid_display

ACTIONS = ("up", "right", "down", "left")
ROWS, COLUMNS = 4, 12
"""Of the paper's grid."""


def cliff_walking_map(rows: int = ROWS, columns: int = COLUMNS) -> tuple[str, ...]:
    """A text per row: S start, C cliff, G goal."""
    return (*("." * columns for _ in range(rows - 1)), "S" + "C" * (columns - 2) + "G")


def cliff_walking_display(rows: int = ROWS, columns: int = COLUMNS) -> Display:
    """The grid, the walker an orange dot."""
    return grid_display(cliff_walking_map(rows, columns), ACTIONS, move_keys(ACTIONS))
