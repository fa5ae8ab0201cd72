"""A pilot for the lunar lander, and Gymnasium's own lander on the terrain of a test."""

from typing import Any

import numpy as np
from gymnasium.envs.box2d.lunar_lander import LunarLander

PAPER_SEED = [547404849, 309914516]


class OriginalLander:
    """Gymnasium's class, begun anew on the same terrain; RandomState is the paper's generator."""

    def __init__(self, seed, render_mode=None):
        self.environment: Any = LunarLander(render_mode=render_mode)
        self.seed = seed

    def reset(self):
        if self.seed is not None:
            return self.environment.reset(seed=self.seed)[0]
        self.environment._np_random = np.random.RandomState(PAPER_SEED)
        return self.environment.reset()[0]

    def step(self, action):
        return self.environment.step(action)[:3]


def pilot(observation, height=None):
    """An action that lands, or that keeps the lander at a height."""
    x, y, speed_x, speed_y, angle, spin, left, right = observation
    wanted = np.clip(0.5 * x + speed_x, -0.4, 0.4)
    turn = 0.5 * (wanted - angle) - spin
    lift = 0.5 * ((0.55 * abs(x) if height is None else height) - y) - 0.5 * speed_y
    if left or right:
        turn, lift = 0.0, -0.5 * speed_y
    if lift > max(abs(turn), 0.05):
        return 2
    return 3 if turn < -0.05 else 1 if turn > 0.05 else 0


def actions_of(policy, seed):
    """A policy by name: a function of the observation."""
    generator = np.random.default_rng(seed)
    return {
        "random": lambda observation: int(generator.integers(4)),
        "landing": pilot,
        "unsteady": lambda observation: (
            int(generator.integers(4)) if generator.random() < 0.1 else pilot(observation)
        ),
        "hovering": lambda observation: pilot(observation, height=0.8),
    }[policy]
