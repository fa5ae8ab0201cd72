"""A walk on a line as a vector task, with values that are known by hand."""

import functools

import numpy as np

from qbumpers.tasks.dynamics import CRASH, SUCCESS, TERMINATED
from qbumpers.tasks.vector import VectorTask

DISCOUNT = 0.9
LENGTH = 10
GOAL, PIT = LENGTH, 0


class Line:
    """Place 5 at first; action 1 goes right, 0 left; the goal pays 10, the pit costs 100."""

    def reset(self, chance):
        self.place = LENGTH // 2
        return np.array([self.place, 1.0], np.float32)

    def step(self, action):
        self.place += 1 if action else -1
        reward = {GOAL: 10.0, PIT: -100.0}.get(self.place, -1.0)
        events = {GOAL: TERMINATED | SUCCESS, PIT: TERMINATED | CRASH}.get(self.place, 0)
        return np.array([self.place, 1.0], np.float32), reward, events


def line(episode_limit=200, **changes) -> VectorTask:
    fields = {
        "name": "line", "make_stepper": Line, "make_environment": functools.partial(print),
        "observation_size": 2, "actions": 2, "discount": DISCOUNT, "episode_limit": episode_limit,
        "settings": {}, "has_success": True, "has_crash": True,
    }  # fmt: skip
    return VectorTask(**{**fields, **changes})


def worth(place):
    """Exact V of going right all the way."""
    left = GOAL - place
    return 10 * DISCOUNT ** (left - 1) - sum(DISCOUNT**k for k in range(left - 1))


def exact(observation):
    """Exact Q*."""
    place = int(observation[0])

    def value(following, reward):
        end = following in (GOAL, PIT)
        return reward + (0 if end else DISCOUNT * worth(following))

    left = value(place - 1, -100.0 if place - 1 == PIT else -1.0)
    right = value(place + 1, 10.0 if place + 1 == GOAL else -1.0)
    return np.array([left, right])


def flattering(observation):
    """Q* whose claims grow by 2 a place to the left; the policy stays the same."""
    return exact(observation) + 2 * (GOAL - int(observation[0]))


def random_policy(seed=0):
    generator = np.random.default_rng(seed)
    return lambda observation, step: int(generator.integers(2))
