"""A corridor that is seen as a vector: small enough to be simulated in no time."""

import functools

import gymnasium
import numpy as np

from qbumpers.assistants import make_assistant
from qbumpers.learners import DoubleDQN
from qbumpers.networks import Network
from qbumpers.simulation import make_condition
from qbumpers.tasks import VectorTask
from qbumpers.tasks.dynamics import CRASH, SUCCESS, TERMINATED, TRUNCATED
from qbumpers.values import NetworkValues

NETWORK = Network((8,), "relu")
LEARNER = DoubleDQN(
    network=NETWORK,
    discount=0.9,
    learning_rate=0.01,
    batch_size=8,
    replay_size=64,
    learning_starts=16,
    target_every=20,
)


class Corridor:
    """Seven places; the left end is a pit (-1), the right one the goal (+1); a step costs 0.1.

    Args:
        broken: number of the step whose reward is not a number; never where 0.
        stops: whether it gives up by itself after six steps.
    """

    def __init__(self, broken: int = 0, stops: bool = False) -> None:
        self._broken, self._stops = broken, stops
        self._steps = self._place = 0

    def reset(self, chance: float) -> np.ndarray:
        self._place, self._steps = 2 + int(chance * 3), 0
        return self._seen()

    def step(self, action: int) -> tuple[np.ndarray, float, int]:
        self._place += 1 if action == 1 else -1
        self._steps += 1
        reward, events = -0.1, 0
        if self._place in (0, 6):
            reward += 1 if self._place else -1
            events = TERMINATED | (SUCCESS if self._place else CRASH)
        elif self._stops and self._steps == 6:
            events = TRUNCATED
        return self._seen(), np.nan if self._steps == self._broken else reward, events

    def _seen(self) -> np.ndarray:
        return np.array([self._place / 6, 1.0, self._steps / 10], np.float32)


def no_environment(*, render_mode: str | None = None) -> gymnasium.Env:
    raise AssertionError("simulators need none")


def corridor(**settings) -> VectorTask:
    return VectorTask(
        name="corridor",
        make_stepper=functools.partial(Corridor, **settings),
        make_environment=no_environment,
        observation_size=3,
        actions=2,
        discount=0.9,
        episode_limit=12,
        settings=settings,
        has_success=True,
        has_crash=True,
    )


def guide(**changes) -> NetworkValues:
    """Values that prefer the right, by a linear network with some noise."""
    layout = Network((), "tanh").layout(3, 2)
    parameters = np.array([0.2, 0.5, 0.1, 0.3, 0.02, -0.04, 0.3, 0.5])
    assert layout.parameters() == len(parameters)
    settings = {"discount": 0.9, "task": "corridor", "method": "written down", **changes}
    return NetworkValues(Network((), "tanh"), 3, 2, parameters, **settings)


def in_the_corridor(assistant="none", options=None, *, task=None, **settings):
    settings = {"values": guide(), "learner": LEARNER, "episodes": 12, **settings}
    return make_condition(
        task or corridor(), make_assistant(assistant, **(options or {})), **settings
    )
