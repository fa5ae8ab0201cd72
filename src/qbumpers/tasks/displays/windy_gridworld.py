"""Windy Gridworld: start and goal; the wind does not show, it is what is to be learned."""

from qbumpers.tasks.display import Display, move_keys
from qbumpers.tasks.displays.cliff_walking import ACTIONS
from qbumpers.tasks.displays.grid import grid_display

ROWS, COLUMNS = 7, 10
START, GOAL = (3, 0), (3, 7)


def windy_gridworld_display() -> Display:
    """The grid, the walker an orange dot."""
    letters = {START: "S", GOAL: "G"}
    cells = ["".join(letters.get((row, c), ".") for c in range(COLUMNS)) for row in range(ROWS)]
    return grid_display(cells, ACTIONS, move_keys(ACTIONS))
