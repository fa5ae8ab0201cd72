"""Lunar Lander with the same terrain and noise in every episode (Section 4.3)."""

import functools
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal

import gymnasium
import numpy as np

from qbumpers.decisions import Step
from qbumpers.tasks.display import unassisted_step
from qbumpers.tasks.displays.lunar_lander import lunar_lander_display
from qbumpers.tasks.drawing import Painter

# First, for its message if Box2D is missing.
from qbumpers.tasks.lunar_lander.stepper import chance_of

from gymnasium.envs.box2d import lunar_lander as original  # isort: skip


class LunarLander(original.LunarLander):
    """Gymnasium's discrete lunar lander as `qbumpers/LunarLander-v0`, the same in every episode.

    `info` of every step has `success` (it came to rest: reward 100) and `crash` (the hull touched
    the ground or it left the picture: reward -100).

    Args:
        seed: of Gymnasium's class, at every reset; None for the paper's terrain and noise.
        render_mode: "human", "rgb_array" or None.

    Raises:
        RequestError: if the seed is not a whole number, or negative.
    """

    def __init__(self, seed: int | None = None, render_mode: str | None = None) -> None:
        self._terrain_seed = seed
        self._chance = chance_of(seed)
        self._actions: list[int] = []
        self._observation = np.zeros(8, np.float32)
        self._last_step: Step | None = None
        super().__init__(render_mode=render_mode)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start the episode, always the same one.

        Args:
            seed: of `np_random`, which nothing here draws from: the constructor's seed decides
                terrain and noise.
            options: unused.

        Returns:
            The observation, float32 [8], and `info`.
        """
        gymnasium.Env.reset(self, seed=seed)
        self._chance = chance_of(self._terrain_seed)
        with self._drawing_from_chance(), self._without_smoke():
            observation, _ = super().reset(options=options)
        self._observation, self._last_step = observation, None
        self._actions = []  # without the one that Gymnasium's class begins with
        return observation, {"success": False, "crash": False}

    def step(self, action: int) -> tuple[np.ndarray, float, bool, Literal[False], dict[str, Any]]:
        """Take an action: 0 nothing, 1 left engine, 2 main engine, 3 right engine."""
        with self._drawing_from_chance(), self._without_smoke():
            observation, reward, terminated, truncated, _ = super().step(action)
        self._last_step = unassisted_step(
            self._observation, int(action), float(reward), observation
        )
        self._observation = observation
        self._actions.append(int(action))
        success = bool(terminated and reward > 0)
        info = {"success": success, "crash": bool(terminated and not success)}
        return observation, float(reward), terminated, truncated, info

    def render(self) -> Any:
        """For "rgb_array" the picture of the display, uint8 [H, W, 3]; Gymnasium's for "human"."""
        if self.render_mode != "rgb_array":
            return super().render()
        return self._painter.picture(self._observation, self._last_step)

    @functools.cached_property
    def _painter(self) -> Painter:
        return Painter(lunar_lander_display(self._terrain_seed))

    def snapshot(self) -> tuple[int, ...]:
        """The actions of the episode so far: all that its state comes from."""
        return tuple(self._actions)

    def restore(self, snapshot: tuple[int, ...]) -> None:
        """Take the episode back to a snapshot, bit for bit, by taking its actions again.

        Args:
            snapshot: from `snapshot`.
        """
        # Nothing is shown meanwhile; the smoke of earlier steps, which changes nothing, is gone.
        shown, self.render_mode = self.render_mode, None
        try:
            self.reset()
            for action in snapshot:
                self.step(action)
        finally:
            self.render_mode = shown

    @contextmanager
    def _drawing_from_chance(self) -> Iterator[None]:
        """What Gymnasium's class draws comes from the generator of terrain and noise."""
        seeded, self._np_random = self._np_random, self._chance
        try:
            yield
        finally:
            self._np_random = seeded

    @contextmanager
    def _without_smoke(self) -> Iterator[None]:
        """Gymnasium makes particles for its own pictures alone, and only those clear them."""
        shown = self.render_mode
        self.render_mode = shown if shown == "human" else None
        try:
            yield
        finally:
            self.render_mode = shown
