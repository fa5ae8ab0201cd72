"""Small environments that are observed in ways of their own."""

import copy
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.envs.toy_text import FrozenLakeEnv


class Mission(spaces.Space[str]):
    """Texts that Gymnasium cannot flatten, as in MiniGrid."""

    def __init__(self):
        super().__init__(dtype=str)

    def sample(self, mask: Any = None, probability: Any = None) -> str:
        return "go"

    def contains(self, x: Any) -> bool:
        return isinstance(x, str)


PICTURE = spaces.Box(0, 255, (2, 3, 3), np.uint8)
SPACES: dict[str, spaces.Space[Any]] = {
    "number": spaces.Discrete(4, start=2),
    "numbers": spaces.MultiDiscrete([2, 3]),
    "bits": spaces.MultiBinary(3),
    "pair": spaces.Tuple((spaces.Discrete(3), spaces.Box(-1, 1, (2,), np.float32))),
    "picture": PICTURE,
    "parts": spaces.Dict({"where": spaces.Discrete(4), "view": PICTURE}),
    "mission": spaces.Dict({"where": spaces.Discrete(4), "view": PICTURE, "mission": Mission()}),
    "texts": spaces.Dict({"mission": Mission()}),
}


class World(gymnasium.Env[Any, Any]):
    """Shows an observation drawn from a space; ends after three steps, or earlier by chance.

    `told` are keys of `info`, by when it has them: "always", or at the "end" of an episode.
    """

    def __init__(self, shown: str = "number", **told: str) -> None:
        self.observation_space = copy.deepcopy(SPACES[shown])
        self.action_space = spaces.Discrete(2, start=1)
        self.told = told

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.observation_space.seed(seed)
        self.steps = 0
        return self.observation_space.sample(), self._info(False)

    def step(self, action):
        self.steps += 1
        ended = self.steps == 3 or bool(self.np_random.random() < 0.2)
        return self.observation_space.sample(), float(action), ended, False, self._info(ended)

    def _info(self, ended: bool) -> dict[str, Any]:
        return {key: ended for key, when in self.told.items() if when == "always" or ended}


class Hidden(gymnasium.Env[Any, Any]):
    """FrozenLake without its table, its numbers shown from `first` on."""

    def __init__(self, first: int = 0, **arguments: Any) -> None:
        self._lake: Any = FrozenLakeEnv(**arguments)
        self._first = first
        self.observation_space = spaces.Discrete(int(self._lake.observation_space.n), start=first)
        self.action_space = spaces.Discrete(4)

    def reset(self, *, seed=None, options=None):
        state, info = self._lake.reset(seed=seed)
        return state + self._first, info

    def step(self, action):
        state, reward, terminated, truncated, info = self._lake.step(action)
        return state + self._first, reward, terminated, truncated, info
