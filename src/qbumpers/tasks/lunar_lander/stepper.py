"""The lunar lander for simulators: Gymnasium's discrete one, number for number, and faster.

Box2D moves the bodies; what Gymnasium computes around it in Python is compiled here, and chance is
drawn ahead, once, since every episode has the same.
"""

import dataclasses
import functools
import math
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding

from qbumpers.compilation import compiled
from qbumpers.errors import RequestError
from qbumpers.tasks.display import made_by
from qbumpers.tasks.displays.lunar_lander import lunar_lander_display
from qbumpers.tasks.dynamics import CRASH, SUCCESS, TERMINATED
from qbumpers.tasks.lunar_lander import bodies
from qbumpers.tasks.lunar_lander.bodies import (
    ANGLE,
    CRASHED,
    HEIGHT,
    LEFT_LEG,
    LEG_DOWN,
    RIGHT_LEG,
    SCALE,
    SPIN,
    VELOCITY_X,
    VELOCITY_Y,
    WIDTH,
    Contacts,
    X,
    Y,
    build,
    ground_of,
    motion_of,
)
from qbumpers.tasks.vector import VectorTask

REVISION = 1
"""Of the task: raised when it gives other numbers."""

ACTIONS = 4
OBSERVATION_SIZE = 8
DISCOUNT = 0.99
EPISODE_LIMIT = 1000

_PAPER_SEED = [547404849, 309914516]
_STEPS_PER_SECOND = 50
_VELOCITY_ITERATIONS, _POSITION_ITERATIONS = 180, 60
_FORCE = 1000.0  # newtons
_DRAWN = 1024  # pairs of dispersions at a time
_MAIN_POWER, _SIDE_POWER = 13.0, 0.6
_MAIN_FUEL, _SIDE_FUEL = 0.30, 0.03

_SHAPING = 8  # place in the state, after the observation
_STATE_SIZE = 10
_NOTHING, _LEFT, _MAIN, _RIGHT = range(ACTIONS)

_ENGINES = np.eye(ACTIONS)[:, 1:]  # [action, engine], whether it burns
_ENGINES_THAT_DIFFER = np.abs(_ENGINES[:, None] - _ENGINES).sum(axis=2)


def chance_of(seed: int | None) -> np.random.Generator:
    """What terrain, force and noise of an episode are drawn from.

    Args:
        seed: as Gymnasium's class is seeded, or None for the paper's episode, whose seed words are
            those that the authors' version of Gym made of its seed.

    Returns:
        A generator at the beginning of an episode.

    Raises:
        RequestError: if the seed is not a whole number, or negative.
    """
    if seed is None:
        bits = np.random.MT19937()
        state: Any = np.random.RandomState(_PAPER_SEED).get_state(legacy=False)
        bits.state = state
        return np.random.Generator(bits)
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise RequestError(f"seed = {seed!r}; a whole number of 0 or more is needed, or none")
    return seeding.np_random(seed)[0]


class Lander:
    """The lunar lander to be stepped through; every episode has the same terrain and noise.

    Observations, rewards and ends equal those of Gymnasium's `LunarLander` bit for bit, seeded
    alike at every reset. Standing still is the success (reward 100), touching the ground with the
    hull or leaving the picture the crash (reward -100).

    Args:
        seed: of Gymnasium's class, or None for the paper's terrain and noise.

    Raises:
        RequestError: if the seed is not a whole number, or negative.
    """

    def __init__(self, seed: int | None = None) -> None:
        self._chance = chance_of(seed)
        self._ground = ground_of(self._chance.uniform(0, HEIGHT / 2, size=12))
        self._force = (
            self._chance.uniform(-_FORCE, _FORCE),
            self._chance.uniform(-_FORCE, _FORCE),
        )
        self._dispersions = np.empty((0, 2))
        self.reset()

    def reset(self, chance: float = 0.0) -> np.ndarray:
        """Start the episode.

        Args:
            chance: unused; no chance is left.

        Returns:
            float32 [8], the observation after the step without engines that starts every episode.
        """
        self._state = np.zeros(_STATE_SIZE)
        self._contacts = Contacts(self._state)
        self._world, self._hull = build(self._ground, self._force, self._contacts)
        self._motion = motion_of(self._hull)
        self._actions: list[int] = []
        return self.step(_NOTHING)[0]

    def step(self, action: int) -> tuple[np.ndarray, float, int]:
        """Take an action: 0 nothing, 1 left engine, 2 main engine, 3 right engine.

        Args:
            action: in [0, 4).

        Returns:
            A new observation, float32 [8]; the reward; bits TERMINATED, SUCCESS and CRASH.

        Raises:
            RequestError: if there is no such action.
        """
        if not 0 <= action < ACTIONS:
            raise RequestError(f"action = {action!r}; it must lie in [0, {ACTIONS})")
        number = len(self._actions)
        if number == len(self._dispersions):
            self._draw_ahead()
        if action != _NOTHING:
            sideways, upwards, at_x, at_y = _impulse(
                self._motion(), self._dispersions, number, action
            )
            self._hull.ApplyLinearImpulse((sideways, upwards), (at_x, at_y), True)
        self._actions.append(action)
        self._world.Step(1.0 / _STEPS_PER_SECOND, _VELOCITY_ITERATIONS, _POSITION_ITERATIONS)
        observation = np.empty(OBSERVATION_SIZE, np.float32)
        reward, events = _outcome(
            self._motion(), self._state, observation, action, self._hull.awake
        )
        return observation, reward, events

    def snapshot(self) -> tuple[int, ...]:
        """The actions of the episode so far: all that its state comes from."""
        return tuple(self._actions[1:])  # the first one is of `reset`

    def restore(self, snapshot: tuple[int, ...]) -> None:
        """Take the episode back to a snapshot, bit for bit.

        Its actions are taken again: Box2D keeps more of bodies than it lets anyone write, so that
        bodies that were put back would move differently.

        Args:
            snapshot: from `snapshot`.
        """
        self.reset()
        for action in snapshot:
            self.step(action)

    def _draw_ahead(self) -> None:
        drawn = self._chance.uniform(-1.0, 1.0, size=(_DRAWN, 2)) / SCALE
        self._dispersions = np.concatenate([self._dispersions, drawn])


def lunar_lander(seed: int | None = None) -> VectorTask:
    """The task, without chance: every episode has the same terrain and noise.

    Args:
        seed: of Gymnasium's class, at every reset; None for the paper's terrain and noise.

    Returns:
        The task; coming to rest is its success, touching the ground with the hull or leaving the
        picture its crash.

    Raises:
        RequestError: if the seed is not a whole number, or negative.
    """
    chance_of(seed)
    return VectorTask(
        name="lunar-lander",
        make_stepper=functools.partial(Lander, seed),
        make_environment=functools.partial(gymnasium.make, "qbumpers/LunarLander-v0", seed=seed),
        environment_spec=dataclasses.replace(
            gymnasium.spec("qbumpers/LunarLander-v0"), kwargs={"seed": seed}
        ),
        observation_size=OBSERVATION_SIZE,
        actions=ACTIONS,
        discount=DISCOUNT,
        episode_limit=EPISODE_LIMIT,
        settings={"seed": seed},
        has_success=True,
        has_crash=True,
        undoable=True,
        no_op=_NOTHING,
        action_distance=_ENGINES_THAT_DIFFER,
        implied=(_NOTHING, _ENGINES_THAT_DIFFER),
        make_display=made_by(lunar_lander_display, seed),
        stepped_by=(bodies.Box2D, gymnasium),
        revision=REVISION,
    )


@compiled
def _impulse(
    motion: np.ndarray, dispersions: np.ndarray, step: int, action: int
) -> tuple[float, float, float, float]:
    """What an engine gives the hull: two components, newton-seconds; two of the place, metres."""
    angle = np.float64(motion[ANGLE])
    x, y = np.float64(motion[X]), np.float64(motion[Y])
    sine, cosine = math.sin(angle), math.cos(angle)
    first, second = dispersions[step, 0], dispersions[step, 1]
    if action == _MAIN:
        along = 4 / SCALE + 2 * first
        right = sine * along + -cosine * second
        up = -cosine * along - sine * second
        return -right * _MAIN_POWER, -up * _MAIN_POWER, x + right, y + up
    across = 3 * second + (action - _MAIN) * 12 / SCALE
    right = sine * first + -cosine * across
    up = -cosine * first - sine * across
    at_x = x + right - sine * 17 / SCALE
    at_y = y + up + cosine * 14 / SCALE
    return -right * _SIDE_POWER, -up * _SIDE_POWER, at_x, at_y


@compiled
def _outcome(
    motion: np.ndarray, state: np.ndarray, observation: np.ndarray, action: int, awake: bool
) -> tuple[float, int]:
    """Reward and events of a step; fills the observation and remembers the shaping."""
    state[0] = (np.float64(motion[X]) - WIDTH / 2) / (WIDTH / 2)
    state[1] = (np.float64(motion[Y]) - (HEIGHT / 4 + LEG_DOWN)) / (HEIGHT / 2)
    state[2] = np.float64(motion[VELOCITY_X]) * (WIDTH / 2) / _STEPS_PER_SECOND
    state[3] = np.float64(motion[VELOCITY_Y]) * (HEIGHT / 2) / _STEPS_PER_SECOND
    state[4] = np.float64(motion[ANGLE])
    state[5] = 20.0 * np.float64(motion[SPIN]) / _STEPS_PER_SECOND
    for place in range(OBSERVATION_SIZE):
        observation[place] = state[place]
    shaping = (
        -100 * math.sqrt(state[0] * state[0] + state[1] * state[1])
        - 100 * math.sqrt(state[2] * state[2] + state[3] * state[3])
        - 100 * abs(state[4])
        + 10 * state[LEFT_LEG]
        + 10 * state[RIGHT_LEG]
    )
    reward = shaping - state[_SHAPING]
    state[_SHAPING] = shaping
    if not awake:
        return 100.0, TERMINATED | SUCCESS
    if state[CRASHED] or abs(state[0]) >= 1.0:
        return -100.0, TERMINATED | CRASH
    if action == _MAIN:
        reward -= _MAIN_FUEL
    elif action != _NOTHING:
        reward -= _SIDE_FUEL
    return reward, 0
