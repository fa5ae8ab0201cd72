"""Displays of Gymnasium's environments, and what pictures show, measured in pixels."""

import functools
from typing import Any

import gymnasium
import numpy as np

import qbumpers  # noqa: F401 - registers the environments
from qbumpers.tasks.display import Display
from qbumpers.tasks.displays.by_environment import display_maker

ENVIRONMENTS = [
    "qbumpers/CliffWalking-v0",
    "qbumpers/LunarLander-v0",
    "qbumpers/MountainCar-v0",
    "CliffWalking-v1",
    "FrozenLake-v1",
    "FrozenLake8x8-v1",
    "Taxi-v4",
    "CartPole-v1",
    "MountainCar-v0",
]


@functools.cache
def environment_of(name: str) -> Any:
    return gymnasium.make(name)


@functools.cache
def display_of(name: str) -> Display:
    make = display_maker(environment_of(name))
    assert make is not None
    return make(None)


def near(picture: np.ndarray, colour: str, tolerance: int = 12) -> np.ndarray:
    """Bool [H, W]: which pixels have a colour, "#rrggbb"."""
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return np.all(np.abs(picture.astype(int) - wanted) <= tolerance, axis=2)


def middle(mask: np.ndarray) -> tuple[float, float]:
    """Mean (x, y) of the pixels in a mask, in pixels from the upper left corner."""
    y, x = np.nonzero(mask)
    return float(x.mean() + 0.5), float(y.mean() + 0.5)
