"""Taxi: a town of walls and four stands, a passenger and where they want to go."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from qbumpers.decisions import Step
from qbumpers.tasks.display import (
    Display,
    Shape,
    circle,
    line,
    move_keys,
    polygon,
    rectangle,
    text,
)
from qbumpers.tasks.displays.grid import CELL

ACTIONS = ("down", "up", "right", "left", "pick up", "drop off")
STANDS = "RGYB"
"""Letters of the stands, in the order in which states number them."""

_KEYS = {"KeyP": 4, "Space": 4, "KeyO": 5, "Enter": 5}
_COLOURS = {"R": "#d9534f", "G": "#4f9d58", "Y": "#d8b526", "B": "#4878c0"}
_EDGE = 8.0  # around the town
_BODY, _INK = "#f2c230", "#3a3f44"

Place = tuple[float, float]


def taxi_display(desc: Sequence[str]) -> Display:
    """Taxi on a map; the stand with the flag is where the passenger wants to go.

    Args:
        desc: the map as Gymnasium keeps it: a frame, and in each row of 2 C + 1 letters the cells
            at odd places, with "|" between them for a wall and ":" for none.
    """
    rows, columns = len(desc) - 2, (len(desc[0]) - 1) // 2
    cells = [[desc[1 + row][1 + 2 * column] for column in range(columns)] for row in range(rows)]
    found = {cells[r][c]: _centre(r, c) for r, c in np.ndindex(rows, columns)}
    stands = [found[letter] for letter in STANDS]
    width, height = columns * CELL + 2 * _EDGE, rows * CELL + 2 * _EDGE

    def scene(state: Any, step: Step | None) -> list[Shape]:
        """The flag, the taxi, and the passenger beside it or in it."""
        places = np.unravel_index(int(state), (rows, columns, len(STANDS) + 1, len(STANDS)))
        row, column, passenger, destination = (int(place) for place in places)
        taxi = _centre(row, column)
        riding = passenger == len(STANDS)
        return [
            *_flag(stands[destination], _COLOURS[STANDS[destination]]),
            *_car(taxi, riding),
            *([] if riding else _person(stands[passenger])),
        ]

    def words(state: Any) -> str:
        """Where the taxi is, where the passenger is, and where they want to go."""
        places = np.unravel_index(int(state), (rows, columns, len(STANDS) + 1, len(STANDS)))
        row, column, passenger, destination = (int(place) for place in places)
        where = "in the taxi" if passenger == len(STANDS) else f"at stand {STANDS[passenger]}"
        return (
            f"taxi in row {row + 1}, column {column + 1}; the passenger is {where} and wants to go "
            f"to stand {STANDS[destination]}"
        )

    return Display(
        width=width, height=height, actions=ACTIONS, keys={**move_keys(ACTIONS), **_KEYS},
        rate=0.0, idle=-1, backdrop=_town(desc, cells, width, height), scene=scene, words=words,
    )  # fmt: skip


def _town(
    desc: Sequence[str], cells: Sequence[Sequence[str]], width: float, height: float
) -> list[Shape]:
    """Streets, stands and walls."""
    shapes = [rectangle((0, 0), (width, height), _INK)]
    for row, letters in enumerate(cells):
        for column, letter in enumerate(letters):
            x, y = _centre(row, column)
            corner = (x - CELL / 2, y - CELL / 2)
            stand = _COLOURS.get(letter)
            shapes.append(rectangle(corner, (CELL, CELL), stand or "#f1f1ec", "#d5d6d0", 2))
            if stand:
                shapes.append(text((x - 0.34 * CELL, y - 0.31 * CELL), letter, "#ffffff", 18))
    walls = [(row, c) for row in range(len(cells)) for c in range(1, len(cells[0]))]
    for row, column in walls:
        if desc[1 + row][2 * column] == "|":
            x, y = _centre(row, column)
            ends = [(x - CELL / 2, y - CELL / 2), (x - CELL / 2, y + CELL / 2)]
            shapes.append(line(ends, _INK, 6))
    return shapes


def _flag(place: Place, colour: str) -> list[Shape]:
    x, y = place
    pole = [(x + 14, y + 24), (x + 14, y - 26)]
    cloth = [(x + 14, y - 26), (x + 29, y - 19), (x + 14, y - 12)]
    return [line(pole, _INK, 2.5), polygon(cloth, "#ffffff", _INK, 1.5)]


def _person(place: Place) -> list[Shape]:
    x, y = place[0] - 16, place[1] + 10
    body = [(x - 7, y + 16), (x - 4, y), (x + 4, y), (x + 7, y + 16)]
    return [
        polygon(body, "#7b4fa3", "#ffffff", 1.5),
        circle((x, y - 5), 6, "#f0c9a4", "#ffffff", 1.5),
    ]


def _car(place: Place, riding: bool) -> list[Shape]:
    """A taxi from the side; with its passenger at the window, if one rides."""
    x, y = place[0], place[1] + 4
    body = [
        (x - 25, y + 8), (x - 25, y - 2), (x - 16, y - 4), (x - 10, y - 15),
        (x + 10, y - 15), (x + 17, y - 4), (x + 25, y - 1), (x + 25, y + 8),
    ]  # fmt: skip
    window = [(x - 12, y - 4), (x - 7.5, y - 12), (x + 7.5, y - 12), (x + 12.5, y - 4)]
    return [
        rectangle((x - 6, y - 21), (12, 6), "#ffffff", _INK, 1.5),
        polygon(body, _BODY, _INK, 2),
        polygon(window, "#cfe3ee", _INK, 1.5),
        *([circle((x, y - 7), 4, "#7b4fa3", "#f0c9a4", 2)] if riding else []),
        *(rectangle((x - 12 + 8 * i, y + (0 if i % 2 else 3)), (4, 3), _INK) for i in range(4)),
        circle((x - 14, y + 9), 6, _INK, "#c9cac4", 2),
        circle((x + 14, y + 9), 6, _INK, "#c9cac4", 2),
    ]


def _centre(row: int, column: int) -> Place:
    return _EDGE + (column + 0.5) * CELL, _EDGE + (row + 0.5) * CELL
