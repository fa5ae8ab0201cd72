"""Pictures of tasks: the shapes of a display drawn by Pillow."""

import functools
from collections.abc import Iterable
from typing import Any

import numpy as np

from qbumpers.decisions import Step
from qbumpers.tasks.display import Display, Shape

_SMOOTH = 4  # drawn this many times larger, then reduced: Pillow's edges are jagged


class Painter:
    """Draws pictures of one display at one height; its backdrop is drawn once and copied.

    Args:
        display: how the task is shown.
        height: of the pictures, in pixels; the display's own if None.
    """

    def __init__(self, display: Display, height: int | None = None) -> None:
        from PIL import Image

        height = round(display.height) if height is None else height
        scale = height / display.height
        size = round(display.width * scale) * _SMOOTH, height * _SMOOTH
        self._scale, self._scene = scale * _SMOOTH, display.scene
        self._backdrop = Image.new("RGB", size)
        self._draw(self._backdrop, display.backdrop)

    def picture(self, state: Any, step: Step | None = None) -> np.ndarray:
        """What a state looks like.

        Args:
            state: number of the state, or the observation, float32 [D].
            step: the last one, for what it leaves to be seen (flames, rewards); None at the start.

        Returns:
            uint8 [height, W, 3], with W in the proportion of the display.
        """
        drawn = self._backdrop.copy()
        self._draw(drawn, self._scene(state, step))
        return np.asarray(drawn.reduce(_SMOOTH))

    def _draw(self, image: Any, shapes: Iterable[Shape]) -> None:
        from PIL import ImageDraw

        draw = ImageDraw.Draw(image)
        for shape in shapes:
            _DRAW[shape["kind"]](draw, shape, self._scale)


def picture(
    display: Display, state: Any, step: Step | None = None, height: int | None = None
) -> np.ndarray:
    """What a state looks like: one picture; a `Painter` draws many of them faster.

    Args:
        display: how the task is shown.
        state: number of the state, or the observation, float32 [D].
        step: the last one, for what it leaves to be seen (flames, rewards); None at the start.
        height: of the picture, in pixels; the display's own if None.

    Returns:
        uint8 [height, W, 3], with W in the proportion of the display.
    """
    return Painter(display, height).picture(state, step)


def _polygon(draw: Any, shape: Shape, scale: float) -> None:
    points = _scaled(shape, scale)
    draw.polygon(points, fill=shape["colour"])
    if "outline" in shape:
        # Through the first corner and on, so that every corner is joined.
        _stroke(draw, [*points, *points[:2]], shape["outline"], shape, scale)


def _line(draw: Any, shape: Shape, scale: float) -> None:
    _stroke(draw, _scaled(shape, scale), shape["colour"], shape, scale)


def _circle(draw: Any, shape: Shape, scale: float) -> None:
    (centre,) = _scaled(shape, scale)
    radius, border = shape.get("size", 0.0) * scale, 0.0
    if "outline" in shape:
        border = shape.get("width", 1.0) * scale / 2
        draw.circle(centre, radius + border, fill=shape["outline"])
    draw.circle(centre, radius - border, fill=shape["colour"])


def _text(draw: Any, shape: Shape, scale: float) -> None:
    (centre,) = _scaled(shape, scale)
    font = _font(shape.get("size", 0.0) * scale)
    draw.text(centre, shape.get("text", ""), fill=shape["colour"], font=font, anchor="mm")


_DRAW = {"polygon": _polygon, "line": _line, "circle": _circle, "text": _text}


def _scaled(shape: Shape, scale: float) -> list[tuple[float, float]]:
    return [(x * scale, y * scale) for x, y in shape["points"]]


def _stroke(
    draw: Any, points: list[tuple[float, float]], colour: str, shape: Shape, scale: float
) -> None:
    width = max(1, round(shape.get("width", 1.0) * scale))
    draw.line(points, fill=colour, width=width, joint="curve")


@functools.cache
def _font(size: float) -> Any:
    from PIL import ImageFont

    return ImageFont.load_default(size=size)
