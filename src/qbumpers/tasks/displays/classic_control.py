"""CartPole and MountainCar as Gymnasium draws them."""

import math
from collections.abc import Callable, Sequence
from typing import Any

from qbumpers.decisions import Step
from qbumpers.tasks.display import (
    MOVES,
    Display,
    Scene,
    Shape,
    circle,
    line,
    move_keys,
    polygon,
    rectangle,
)

_WIDTH, _HEIGHT = 600.0, 400.0
_PAPER, _INK = "#f7f7f4", "#3a3f44"
_GROUND = 300.0  # of the track of the cart

CART_POLE_ACTIONS = ("left", "right")
MOUNTAIN_CAR_ACTIONS = ("left", "nothing", "right")


def cart_pole_display() -> Display:
    """CartPole at half its speed, which a person can follow.

    No action leaves the cart alone: while no key is down, left and right take turns.
    """
    edge = 2.4  # metres from the middle, where episodes end
    per_metre = _WIDTH / (2 * edge)
    backdrop = [
        rectangle((0, 0), (_WIDTH, _HEIGHT), _PAPER),
        line([(0, _GROUND), (_WIDTH, _GROUND)], "#9a9b95", 2),
    ]

    def scene(observation: Any, step: Step | None) -> list[Shape]:
        """The cart, and its pole on an axle."""
        x, angle = (float(observation[0]) + edge) * per_metre, float(observation[2])
        axle = x, _GROUND - 7.5
        tip = axle[0] + per_metre * math.sin(angle), axle[1] - per_metre * math.cos(angle)
        return [
            rectangle((x - 25, _GROUND - 15), (50, 30), _INK),
            line([axle, tip], "#ca9865", 10),
            circle(axle, 5, "#8184cb"),
        ]

    def words(observation: Any) -> str:
        """Where the cart is, and how the pole leans."""
        x, angle = float(observation[0]), math.degrees(float(observation[2]))
        return (
            f"cart {abs(x):.1f} m {_side(x)} of the middle, pole {abs(angle):.0f} degrees to the "
            f"{_side(angle)}"
        )

    return _display(CART_POLE_ACTIONS, 25.0, -1, backdrop, scene, words)


def mountain_car_display() -> Display:
    """MountainCar in real time; nothing is pushed while no key is down."""
    left, right, goal = -1.2, 0.6, 0.5
    per_unit = _WIDTH / (right - left)

    def place(position: float) -> tuple[float, float]:
        """Of the road, in units of the display."""
        above = math.sin(3 * position) * 0.45 + 0.55
        return (position - left) * per_unit, _HEIGHT - above * per_unit

    road = [place(left + (right - left) * i / 100) for i in range(101)]
    flag_x, flag_y = place(goal)
    top = flag_y - 50
    backdrop = [
        rectangle((0, 0), (_WIDTH, _HEIGHT), _PAPER),
        polygon([*road, (_WIDTH, _HEIGHT), (0, _HEIGHT)], "#d9ecd6"),
        line(road, "#6f8f6c", 2),
        line([(flag_x, flag_y), (flag_x, top)], _INK, 2),
        polygon([(flag_x, top), (flag_x, top + 12), (flag_x + 25, top + 6)], "#cccc00"),
    ]

    def scene(observation: Any, step: Step | None) -> list[Shape]:
        """The car on its wheels, leaning with the road."""
        position = float(observation[0])
        x, y = place(position)
        slope = 1.35 * math.cos(3 * position)  # of the road
        length = math.hypot(1, slope)
        along, up = (1 / length, -slope / length), (-slope / length, -1 / length)

        def on_car(ahead: float, above: float) -> tuple[float, float]:
            """A point of the car, in units of the display, from the middle of its bottom."""
            return x + along[0] * ahead + up[0] * above, y + along[1] * ahead + up[1] * above

        body = [(-20, 10), (-20, 20), (-10, 30), (8, 30), (20, 20), (20, 10)]
        return [
            polygon([on_car(*corner) for corner in body], "#d9534f", _INK, 1.5),
            *(circle(on_car(ahead, 8), 8, _INK, "#c9cac4", 2) for ahead in (-10, 10)),
        ]

    def words(observation: Any) -> str:
        """How far the flag is, and where the car goes."""
        position, velocity = float(observation[0]), float(observation[1])
        moving = f"rolling {_side(velocity)}" if abs(velocity) > 0.002 else "standing"
        return f"car {goal - position:.1f} left of the flag, {moving}"

    return _display(MOUNTAIN_CAR_ACTIONS, 30.0, 1, backdrop, scene, words)


def _side(number: float) -> str:
    return "right" if number > 0 else "left"


def _display(
    actions: tuple[str, ...],
    rate: float,
    idle: int,
    backdrop: Sequence[Shape],
    scene: Scene,
    words: Callable[[Any], str],
) -> Display:
    keys = move_keys(actions)
    if idle >= 0:
        keys |= dict.fromkeys(MOVES["down"], idle)
    return Display(
        width=_WIDTH, height=_HEIGHT, actions=actions, keys=keys, rate=rate,
        idle=idle, backdrop=backdrop, scene=scene, words=words,
    )  # fmt: skip
