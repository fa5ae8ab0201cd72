"""Cliff Walking as in Figure 1 of the paper."""

from qbumpers.tasks.display import Display, move_keys
from qbumpers.tasks.displays.grid import grid_display

ACTIONS = ("up", "right", "down", "left")
MAP = ("............", "............", "............", "SCCCCCCCCCCG")
"""S start, C cliff, G goal."""


def cliff_walking_display() -> Display:
    """The grid, the walker an orange dot."""
    return grid_display(MAP, ACTIONS, move_keys(ACTIONS))
