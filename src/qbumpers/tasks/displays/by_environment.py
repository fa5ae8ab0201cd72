"""Which display suits a Gymnasium environment."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from qbumpers.tasks.display import Display, made_by
from qbumpers.tasks.displays.classic_control import cart_pole_display, mountain_car_display
from qbumpers.tasks.displays.cliff_walking import cliff_walking_display
from qbumpers.tasks.displays.grid import frozen_lake_display
from qbumpers.tasks.displays.taxi import taxi_display

MakeDisplay = Callable[[Any], Display]
"""Makes the display of a task; can be pickled, and keeps no environment."""


def _lunar_lander(seed: int | None) -> Display:
    from qbumpers.tasks.displays.lunar_lander import lunar_lander_display  # Box2D, when it is used

    return lunar_lander_display(seed)


DISPLAYS: Mapping[str, Callable[[Any], MakeDisplay]] = {
    "CliffWalking-": lambda environment: made_by(cliff_walking_display),
    "FrozenLake": lambda environment: made_by(frozen_lake_display, _map_of(environment)),
    "Taxi-": lambda environment: made_by(taxi_display, _map_of(environment)),
    "CartPole-": lambda environment: made_by(cart_pole_display),
    "MountainCar-": lambda environment: made_by(mountain_car_display),
    "qbumpers/CliffWalking-": lambda environment: made_by(cliff_walking_display),
    "qbumpers/MountainCar-": lambda environment: made_by(mountain_car_display),
    "qbumpers/LunarLander-": lambda environment: made_by(_lunar_lander, _seed_of(environment)),
}
"""By the beginning of an environment's id: from the environment without its wrappers to what makes
its display."""


def display_maker(environment: Any) -> MakeDisplay | None:
    """What a task made from an environment keeps as its `make_display`.

    Args:
        environment: a Gymnasium environment, with or without wrappers.

    Returns:
        A function of the task; None if no display of its own is known.
    """
    name = environment.spec.id if environment.spec else ""
    for beginning, of_environment in DISPLAYS.items():
        if name.startswith(beginning):
            return of_environment(environment.unwrapped)
    return None


def _map_of(environment: Any) -> Sequence[str]:
    """The environment's map, a text per row."""
    return tuple(b"".join(row).decode() for row in environment.desc.tolist())


def _seed_of(environment: Any) -> int | None:
    """The seed of the terrain that the environment was made with."""
    return environment.spec.kwargs.get("seed")
