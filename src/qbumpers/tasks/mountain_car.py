"""Mountain Car (Moore 1990; Sutton and Barto 2018, Example 10.1) as Gymnasium has it.

A car too weak for its hill has to drive away from the goal, up the other side, to gather speed.
"""

import functools
from typing import Any, Literal

import gymnasium
import numpy as np
from gymnasium.envs.classic_control import mountain_car as original

from qbumpers.decisions import Step
from qbumpers.tasks.display import made_by, unassisted_step
from qbumpers.tasks.displays.classic_control import mountain_car_display
from qbumpers.tasks.drawing import Painter
from qbumpers.tasks.stepping import REVISION, GymnasiumStepper
from qbumpers.tasks.vector import VectorTask

DISCOUNT = 0.99
EPISODE_LIMIT = 200

_NOTHING = 1
_PUSHES = np.array([-1, 0, 1])  # of the actions left, nothing, right
_PUSHES_THAT_DIFFER = np.abs(_PUSHES[:, None] - _PUSHES).astype(float)


class MountainCar(original.MountainCarEnv):
    """Gymnasium's `MountainCar-v0` as `qbumpers/MountainCar-v0`, whose steps can be undone.

    `info` of every step has `success` (the car reached the flag) and `crash`, always false.

    Args:
        render_mode: "human", "rgb_array" or None.
    """

    def __init__(self, render_mode: str | None = None) -> None:
        self._last_step: Step | None = None
        super().__init__(render_mode=render_mode)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode at rest, at a random place in the valley."""
        observation, _ = super().reset(seed=seed, options=options)
        self._last_step = None
        return observation, {"success": False, "crash": False}

    def step(self, action: int) -> tuple[np.ndarray, float, bool, Literal[False], dict[str, Any]]:
        """Take an action: 0 pushes left, 1 does not push, 2 pushes right."""
        before = np.array(self.state, np.float32)
        observation, reward, terminated, _, _ = super().step(action)
        self._last_step = unassisted_step(before, int(action), reward, observation)
        info = {"success": terminated, "crash": False}
        return observation, reward, terminated, False, info

    def render(self) -> Any:
        """For "rgb_array" the picture of the display, uint8 [H, W, 3]; Gymnasium's for "human"."""
        if self.render_mode != "rgb_array":
            return super().render()
        return self._painter.picture(np.array(self.state, np.float32), self._last_step)

    @functools.cached_property
    def _painter(self) -> Painter:
        return Painter(mountain_car_display())

    def snapshot(self) -> tuple[float, float]:
        """Position and velocity, unrounded."""
        position, velocity = self.state
        return float(position), float(velocity)

    def restore(self, snapshot: tuple[float, float]) -> None:
        """Put the car back, bit for bit.

        Args:
            snapshot: from `snapshot`.
        """
        self.state = snapshot


def mountain_car() -> VectorTask:
    """Drive a weak car up a hill: it has to drive away from the goal first.

    Observed are position and velocity; actions are left, nothing and right. Every step costs 1
    until the car reaches the flag.

    Returns:
        The task; reaching the flag is its success.
    """
    return VectorTask(
        name="mountain-car",
        make_stepper=functools.partial(GymnasiumStepper, MountainCar),
        make_environment=functools.partial(gymnasium.make, "qbumpers/MountainCar-v0"),
        environment_spec=gymnasium.spec("qbumpers/MountainCar-v0"),
        observation_size=2,
        actions=3,
        discount=DISCOUNT,
        episode_limit=EPISODE_LIMIT,
        settings={},
        has_success=True,
        has_crash=False,
        undoable=True,
        no_op=_NOTHING,
        action_distance=_PUSHES_THAT_DIFFER,
        implied=(_NOTHING, _PUSHES_THAT_DIFFER),
        make_display=made_by(mountain_car_display),
        stepped_by=(original.MountainCarEnv, gymnasium),
        revision=REVISION,
    )
