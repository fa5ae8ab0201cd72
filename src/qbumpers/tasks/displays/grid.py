"""Grids walked cell by cell: Cliff Walking, FrozenLake, and any task whose states are cells."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from qbumpers.decisions import Step
from qbumpers.tasks.display import Display, Shape, circle, move_keys, rectangle, text

CELL = 64.0
"""Side of a cell, in units of the display."""

FROZEN_LAKE_ACTIONS = ("left", "down", "right", "up")

_LINE = 2.0


class Look(NamedTuple):
    """How a cell looks.

    Attributes:
        colour: what fills the cell, as "#rrggbb".
        ink: of its letter; none is written if empty.
        hole: colour of a hole in it; none if empty.
    """

    colour: str
    ink: str = ""
    hole: str = ""


_PLAIN = Look("#f7f7f4", "#9a9b95")
_NAMES = {"S": ", the start", "G": ", the goal", "C": ", the cliff", "H": ", a hole"}
_LOOKS: Mapping[str, Look] = {
    "S": Look("#dbe7f3", "#2c5f8f"),
    "G": Look("#d9ecd6", "#2f7031"),
    "C": Look("#4d5359", "#aab0b5"),
    "F": Look("#eef5fb"),
    "H": Look("#eef5fb", hole="#33648c"),
    ".": Look("#f7f7f4"),
}


def frozen_lake_display(desc: Sequence[str]) -> Display:
    """FrozenLake: ice, holes, start and goal.

    Args:
        desc: the map, a text of S, F, H and G per row.
    """
    return grid_display(desc, FROZEN_LAKE_ACTIONS, move_keys(FROZEN_LAKE_ACTIONS))


def grid_display(
    cells: Sequence[Sequence[str]], actions: tuple[str, ...], keys: Mapping[str, int]
) -> Display:
    """A grid on which an orange dot walks; states are numbered row by row.

    Args:
        cells: what stands in each cell, row by row: S start, G goal, C cliff, F ice, H hole,
            "." nothing; anything else is written as it is.
        actions: a name for each.
        keys: from keys to actions.
    """
    columns = len(cells[0])
    backdrop = [
        shape
        for row, texts in enumerate(cells)
        for column, words in enumerate(texts)
        for shape in _cell(row, column, words)
    ]

    def scene(state: Any, step: Step | None) -> list[Shape]:
        """The walker, a disc in the middle of its cell."""
        row, column = divmod(int(state), columns)
        return [circle(_centre(row, column), 0.27 * CELL, "#e8890c", "#8a4d00", _LINE)]

    def words(state: Any) -> str:
        """Row and column, counted from the upper left, and what is there."""
        row, column = divmod(int(state), columns)
        there = _NAMES.get(cells[row][column], "")
        return f"row {row + 1} of {len(cells)}, column {column + 1} of {columns}{there}"

    return Display(
        width=columns * CELL, height=len(cells) * CELL, actions=actions, keys=keys, rate=0.0,
        idle=-1, backdrop=backdrop, scene=scene, words=words,
    )  # fmt: skip


def _cell(row: int, column: int, words: str) -> list[Shape]:
    look = _LOOKS.get(words, _PLAIN)
    corner = (column * CELL, row * CELL)
    shapes = [rectangle(corner, (CELL, CELL), look.colour, "#c9cac4", _LINE)]
    if look.hole:
        shapes.append(circle(_centre(row, column), 0.36 * CELL, look.hole, "#a9c9e2", _LINE))
    if look.ink:
        size = 0.45 if len(words) == 1 else 0.3
        shapes.append(text(_centre(row, column), words, look.ink, size * CELL))
    return shapes


def _centre(row: int, column: int) -> tuple[float, float]:
    return (column + 0.5) * CELL, (row + 0.5) * CELL
