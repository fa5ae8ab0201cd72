"""Lunar Lander: hull, legs and flames above the terrain of the episode."""

import functools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from qbumpers.decisions import Step
from qbumpers.tasks.display import Display, Point, Shape, circle, line, polygon, rectangle
from qbumpers.tasks.lunar_lander.bodies import (
    CORNERS,
    HEIGHT,
    LEFT_LEG,
    LEG_AWAY,
    LEG_DOWN,
    LEG_HALF_HEIGHT,
    LEG_HALF_WIDTH,
    RIGHT_LEG,
    SCALE,
    WIDTH,
    ground_of,
)

ACTIONS = ("nothing", "left", "main", "right")
RATE = 50.0
"""Steps per second, as fast as the simulated time passes."""

HULL = "#8066e6"

_KEYS = {
    "ArrowLeft": 1, "KeyA": 1, "ArrowUp": 2, "KeyW": 2, "ArrowRight": 3, "KeyD": 3,
    "ArrowDown": 0, "KeyS": 0,
}  # fmt: skip
_ACROSS, _UP = WIDTH * SCALE, HEIGHT * SCALE  # 600 x 400
# To the hull, radians: held by its motor, to its limit.
_LEG_ANGLES = np.linspace(0.348, 0.9, 13).tolist()
_EDGE = "#4d4d80"
_STARS = 70

# Flames beside the middle of the hull, in pixels, y upwards; those of the engine on the right.
_MAIN_FLAME = [(-8, -13), (-11, -22), (-5, -32), (0, -44), (5, -32), (11, -22), (8, -13)]
_MAIN_HEART = [(-5, -13), (-6, -21), (0, -33), (6, -21), (5, -13)]
_SIDE_FLAME = [(14, 17), (23, 18), (32, 13), (23, 8), (15, 9)]
_SIDE_HEART = [(14, 15), (20, 15.5), (25, 13), (20, 10.5), (15, 11)]

Placed = Callable[[Iterable[Point]], list[tuple[float, float]]]


def lunar_lander_display(seed: int | None = None) -> Display:
    """Lunar Lander as of `qbumpers.tasks.lunar_lander`, with the terrain of its seed.

    Args:
        seed: of the task; None for the paper's terrain.

    Raises:
        RequestError: if the seed is not a whole number, or negative.
    """
    surface = _terrain(seed)
    return Display(
        width=_ACROSS, height=_UP, actions=ACTIONS, keys=_KEYS, rate=RATE, idle=0,
        backdrop=[*_sky(), *_ground(surface), *_pad()],
        scene=functools.partial(_scene, np.array(surface)),
        words=_words,
    )  # fmt: skip


def _terrain(seed: int | None) -> list[tuple[float, float]]:
    """Points of the surface from left to right, in pixels, y downwards."""
    # The module of the stepper names this display.
    from qbumpers.tasks.lunar_lander.stepper import chance_of

    edges = ground_of(chance_of(seed).uniform(0, HEIGHT / 2, size=12))[1:]
    ends = [edge.shape.vertices for edge in edges]
    points = [ends[0][0], *(end for _, end in ends)]
    return [_pixel((x * SCALE, y * SCALE)) for x, y in points]


def _sky() -> list[Shape]:
    chance = np.random.default_rng(7)
    places = chance.uniform((0, 0), (_ACROSS, 0.75 * _UP), size=(_STARS, 2))
    sizes = chance.choice([0.5, 0.7, 1.1], size=_STARS, p=[0.5, 0.35, 0.15])
    stars = zip(places.tolist(), sizes.tolist(), strict=True)
    return [
        rectangle((0, 0), (_ACROSS, _UP), "#0d0f1c"),
        *(circle(place, size, "#aab0d0") for place, size in stars),
    ]


def _ground(surface: list[tuple[float, float]]) -> list[Shape]:
    bottom = [(_ACROSS, _UP), (0, _UP)]
    below = [(x, y + 10) for x, y in surface]
    return [
        polygon([*surface, *bottom], "#d9dae0"),
        polygon([*below, *bottom], "#c3c5cf"),
        line(surface, "#f4f4f8", 2),
    ]


def _pad() -> list[Shape]:
    """The landing pad between its two flags."""
    left, right, top = 0.4 * _ACROSS, 0.6 * _ACROSS, _UP - 0.99 * HEIGHT / 4 * SCALE
    shapes = [rectangle((left, top), (right - left, 4), "#5a5f6e")]
    for x in (left, right):
        cloth = [(x, top - 50), (x, top - 38), (x + 25, top - 44)]
        shapes += [line([(x, top), (x, top - 51)], "#ffffff", 1.5), polygon(cloth, "#cccc00")]
    return shapes


def _words(observation: Any) -> str:
    """Where the lander is, how it moves and how it leans."""
    x, y, across, down, angle = (float(number) for number in observation[:5])
    place = "above the pad" if abs(x) < 0.2 else f"to the {'right' if x > 0 else 'left'} of the pad"
    legs = int(observation[LEFT_LEG]) + int(observation[RIGHT_LEG])
    touching = f"{legs} of 2 legs on the ground" if legs else f"height {max(y, 0):.1f}"
    drift = "left" if across < 0 else "right"
    lean = "right" if angle < 0 else "left"
    return (
        f"{touching}, {place}, {'falling' if down < 0 else 'rising'} at {abs(down):.1f}, drifting "
        f"{drift} at {abs(across):.1f}, leaning {abs(math.degrees(angle)):.0f} degrees {lean}"
    )


def _scene(surface: np.ndarray, observation: Any, step: Step | None) -> list[Shape]:
    x, y = float(observation[0]), float(observation[1])
    centre = (x + 1) * _ACROSS / 2, y * _UP / 2 + _UP / 4 + LEG_DOWN * SCALE
    angle = float(observation[4])

    def placed(points: Iterable[Point]) -> list[tuple[float, float]]:
        """Points beside the middle of the hull, in pixels, y upwards, as they lie now."""
        return [_pixel(_beside(centre, point, angle)) for point in points]

    flames = [] if step is None else _flames(int(step.executed))
    return [
        *(polygon(placed(points), colour) for points, colour in flames),
        *(
            shape
            for side, place in ((-1, LEFT_LEG), (1, RIGHT_LEG))
            for shape in _leg(surface, placed, side, bool(observation[place]))
        ),
        polygon(placed([(-6, -9), (-9, -14), (9, -14), (6, -9)]), "#6b6f85", _EDGE, 1),
        polygon(placed(CORNERS), HULL, _EDGE, 1.5),
        polygon(placed([(-8, 12), (-10, 3), (10, 3), (8, 12)]), "#bfe0f5", _EDGE, 1),
    ]


def _leg(surface: np.ndarray, placed: Placed, side: int, touches: bool) -> list[Shape]:
    """A leg with its strut and its foot, lit while it touches the ground.

    The observation does not tell its angle: it is spread as far as the ground demands.

    Args:
        surface: points of the ground, float64 [N, 2], in pixels.
        placed: puts points beside the hull.
        side: -1 or 1, as Gymnasium counts; -1 is the leg on the right.
        touches: whether it has contact.
    """
    across, along = LEG_HALF_WIDTH * SCALE, LEG_HALF_HEIGHT * SCALE
    angle = _spread(surface, placed, side)

    def on_leg(*points: Point) -> list[tuple[float, float]]:
        return placed([_beside_leg(side, angle, point) for point in points])

    box = [(-across, along), (across, along), (across, -along), (-across, -along)]
    foot = [(-5, 3 - along), (5, 3 - along), (5, -along), (-5, -along)]
    strut = [*placed([(-side * 14, -6)]), *on_leg((0, 2))]
    return [
        line(strut, "#9a9fb5", 2),
        polygon(on_leg(*box), HULL, _EDGE, 0.8),
        polygon(on_leg(*foot), "#ffd24a" if touches else "#9a9fb5", _EDGE, 0.8),
    ]


def _spread(surface: np.ndarray, placed: Placed, side: int) -> float:
    """The angle of a leg to the hull, radians: the smallest that keeps its end above the ground."""
    end = 0, -LEG_HALF_HEIGHT * SCALE
    for angle in _LEG_ANGLES:  # mostly it is the first one
        [(x, y)] = placed([_beside_leg(side, angle, end)])
        if y <= np.interp(x, surface[:, 0], surface[:, 1]):
            return angle
    return _LEG_ANGLES[-1]


def _beside_leg(side: int, angle: float, point: Point) -> tuple[float, float]:
    """A point beside the middle of a leg as one beside the hull, from which the leg hangs."""
    hip = side * LEG_AWAY * SCALE, LEG_DOWN * SCALE
    return _beside((0, 0), (point[0] - hip[0], point[1] - hip[1]), -side * angle)


def _flames(action: int) -> Sequence[tuple[Sequence[Point], str]]:
    """Corners beside the hull, in pixels, and colours of what comes out of an engine."""
    if action == ACTIONS.index("main"):
        return [(_MAIN_FLAME, "#e8542c"), (_MAIN_HEART, "#ffc53d")]
    if action == ACTIONS.index("nothing"):
        return []
    # The left engine pushes to the left: its flame comes out on the right.
    side = 1 if action == ACTIONS.index("left") else -1
    return [
        ([(side * x, y) for x, y in corners], colour)
        for corners, colour in ((_SIDE_FLAME, "#e8542c"), (_SIDE_HEART, "#ffc53d"))
    ]


def _beside(centre: Point, point: Point, angle: float) -> tuple[float, float]:
    """Where a point beside a centre lies when turned anticlockwise, radians; y upwards."""
    sine, cosine = math.sin(angle), math.cos(angle)
    x, y = point
    return centre[0] + cosine * x - sine * y, centre[1] + sine * x + cosine * y


def _pixel(point: Point) -> tuple[float, float]:
    """From y upwards to y downwards, both in pixels."""
    return point[0], _UP - point[1]
