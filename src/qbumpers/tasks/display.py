"""How a task is shown and played: shapes, keys and names, for a browser's canvas or for Pillow."""

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal, NamedTuple, NotRequired, TypedDict

import numpy as np

from qbumpers.decisions import Step

Kind = Literal["polygon", "line", "circle", "text"]
Point = Sequence[float]

MOVES = {
    "up": ("ArrowUp", "KeyW"),
    "right": ("ArrowRight", "KeyD"),
    "down": ("ArrowDown", "KeyS"),
    "left": ("ArrowLeft", "KeyA"),
}
"""Keys of the four directions."""

_DECIMALS = 2  # of a coordinate: a hundredth of a pixel is not seen


class Shape(TypedDict):
    """One thing to draw; plain JSON, so that it can be sent as it is.

    Coordinates count from the upper left, x to the right and y downwards, in units of the display.

    Attributes:
        kind: "polygon", "line", "circle" or "text".
        points: [[x, y], ...]: corners; ends; one centre of a circle or of a text.
        colour: "#rrggbb", of the inside; of a line or a text, its own.
        outline: "#rrggbb", of the border of a polygon or circle; absent if there is none.
        width: how wide the border or line is, centred on the edge.
        text: what is written.
        size: radius of a circle; font size of a text.
    """

    kind: Kind
    points: list[list[float]]
    colour: str
    outline: NotRequired[str]
    width: NotRequired[float]
    text: NotRequired[str]
    size: NotRequired[float]


Scene = Callable[[Any, Step | None], Sequence[Shape]]
"""What changes, drawn over the backdrop: `(state, last step or None) -> shapes`."""


def plain_words(state: Any) -> str:
    """A state in words, if nothing better is known: its number, or its numbers."""
    numbers = np.asarray(state)
    if numbers.ndim == 0:
        return f"state {int(numbers)}"
    return "observed: " + ", ".join(f"{number:.2f}" for number in numbers.tolist())


class Display(NamedTuple):
    """How a task is shown and played; made from the task's arguments, never part of its digest.

    Attributes:
        width: largest x of the coordinates of shapes, in pixels at the display's own size.
        height: largest y, likewise.
        actions: a name for each action.
        keys: from a key (`KeyboardEvent.code`) to its action.
        rate: steps per second; 0 if every step waits for a key.
        idle: the action while no key is down, of tasks with a rate; -1 if there is none, so that
            all actions take turns.
        backdrop: what never changes, drawn first.
        scene: what shows the state (number or observation) and the last step.
        words: says the state, for who does not see the picture.
    """

    width: float
    height: float
    actions: tuple[str, ...]
    keys: Mapping[str, int]
    rate: float
    idle: int
    backdrop: Sequence[Shape]
    scene: Scene
    words: Callable[[Any], str] = plain_words


def polygon(
    points: Iterable[Point], colour: str, outline: str | None = None, width: float = 1.0
) -> Shape:
    """A filled polygon, closed by itself."""
    return _bordered(Shape(kind="polygon", points=_plain(points), colour=colour), outline, width)


def rectangle(
    corner: Point, size: Point, colour: str, outline: str | None = None, width: float = 1.0
) -> Shape:
    """A polygon with its upper left corner and its size (width, height)."""
    (left, top), (across, down) = corner, size
    right, bottom = left + across, top + down
    corners = [(left, top), (right, top), (right, bottom), (left, bottom)]
    return polygon(corners, colour, outline, width)


def line(points: Iterable[Point], colour: str, width: float = 1.0) -> Shape:
    """A line through two points or more."""
    return Shape(kind="line", points=_plain(points), colour=colour, width=width)


def circle(
    centre: Point, radius: float, colour: str, outline: str | None = None, width: float = 1.0
) -> Shape:
    """A filled circle."""
    shape = Shape(kind="circle", points=_plain([centre]), colour=colour, size=float(radius))
    return _bordered(shape, outline, width)


def text(centre: Point, words: str, colour: str, size: float) -> Shape:
    """Words around a point, in one line."""
    return Shape(kind="text", points=_plain([centre]), colour=colour, text=words, size=float(size))


def move_keys(actions: Sequence[str]) -> dict[str, int]:
    """Arrow keys and WASD for those of `actions` that are named up, right, down or left."""
    return {key: action for action, name in enumerate(actions) for key in MOVES.get(name, ())}


def unassisted_step(
    state: Any, action: int, reward: float, next_state: Any, events: int = 0
) -> Step:
    """The record of a step that no assistant had a say in, for environments that draw themselves.

    Args:
        state: where the step began; number or float32 [D].
        action: proposed and executed.
        reward: what the environment gave.
        next_state: where the action led.
        events: bits of `qbumpers.tasks.dynamics`.
    """
    return Step(
        episode=0, state=state, proposed=action, executed=action, undone=False, credited=action,
        overridden=False, probability=0.0, coin=0.0, tie=0.0, values=np.zeros(0),
        projected_return=0.0, reward=reward, next_state=next_state, events=events,
    )  # fmt: skip


def made_by(make: Callable[..., Display], *arguments: Any) -> Callable[[Any], Display]:
    """What a task keeps as its `make_display`: `make(*arguments)`, whatever the task.

    Args:
        make: a function of a module, so that the task can be pickled.
        arguments: what `make` takes, plain values.
    """
    return functools.partial(_make, make, arguments)


def _make(make: Callable[..., Display], arguments: tuple[Any, ...], task: Any) -> Display:
    return make(*arguments)


def _plain(points: Iterable[Point]) -> list[list[float]]:
    return [[round(float(x), _DECIMALS), round(float(y), _DECIMALS)] for x, y in points]


def _bordered(shape: Shape, outline: str | None, width: float) -> Shape:
    return shape if outline is None else {**shape, "outline": outline, "width": width}
