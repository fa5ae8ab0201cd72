"""Grids of cells, numbered row by row, in which actions are steps up, right, down and left."""

import numpy as np

_MOVES = np.array([(-1, 0), (0, 1), (1, 0), (0, -1)])


def moved(rows: int, columns: int, lift: np.ndarray | int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Where each action leads; moves off the grid end at its edge.

    Args:
        rows: R.
        columns: C.
        lift: by how many cells any action from a cell also leads upwards, int [R C], or the same
            from all of them.

    Returns:
        Row and column, int [R C, 4] each.
    """
    row, column = np.divmod(np.arange(rows * columns), columns)
    to_row = np.clip((row - lift)[:, None] + _MOVES[:, 0], 0, rows - 1)
    to_column = np.clip(column[:, None] + _MOVES[:, 1], 0, columns - 1)
    return to_row, to_column
