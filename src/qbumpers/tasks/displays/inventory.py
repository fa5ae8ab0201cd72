"""A shop's stock: a place per item, and what the last day brought."""

from typing import Any

from qbumpers.decisions import Step
from qbumpers.tasks.display import Display, Shape, rectangle, text

CAPACITY = 9
"""Items that the shop has place for."""

_PLACE, _EDGE = 56.0, 16.0
_WIDTH, _HEIGHT = CAPACITY * _PLACE + 2 * _EDGE, 200.0
_TOP = 84.0  # of the shelf
_QUIET = "#60645f"


def inventory_display() -> Display:
    """The shelf in the evening; the key of a digit orders so many items."""
    actions = tuple(f"order {items}" for items in range(CAPACITY + 1))
    keys = {f"Digit{items}": items for items in range(CAPACITY + 1)}
    places = [
        rectangle(_corner(place), (_PLACE - 8, _PLACE - 8), "#ffffff", "#c9cac4", 2)
        for place in range(CAPACITY)
    ]
    shelf = rectangle((_EDGE - 6, _TOP + _PLACE - 4), (_WIDTH - 2 * _EDGE + 4, 8), "#8a6d4b")
    paper = rectangle((0, 0), (_WIDTH, _HEIGHT), "#f7f7f4")
    return Display(
        width=_WIDTH, height=_HEIGHT, actions=actions, keys=keys, rate=0.0, idle=-1,
        backdrop=[paper, shelf, *places], scene=_scene, words=_words,
    )  # fmt: skip


def _scene(state: Any, step: Step | None) -> list[Shape]:
    """The items on the shelf, and what was ordered, sold and earned."""
    stock = int(state)
    items = [
        rectangle(_corner(place), (_PLACE - 8, _PLACE - 8), "#e0b070", "#8a5a1e", 2)
        for place in range(stock)
    ]
    title = text((_WIDTH / 2, 36), f"in stock: {stock}", "#2c5f8f", 30)
    if step is None:
        return [title, *items]
    before, ordered = int(step.state), int(step.executed)
    sold = min(before + ordered, CAPACITY) - stock
    words = f"ordered {ordered}, sold {sold}, earned {float(step.reward):g}"
    return [title, *items, text((_WIDTH / 2, 176), words, _QUIET, 22)]


def _words(state: Any) -> str:
    return f"{int(state)} of {CAPACITY} in stock"


def _corner(place: int) -> tuple[float, float]:
    return _EDGE + place * _PLACE + 4, _TOP
