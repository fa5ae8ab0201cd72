"""Environments under shared control, and ways to play them, that several test modules use."""

from typing import Any

import gymnasium
import numpy as np

from qbumpers import SharedControl, TabularTask, TabularValues, make_task, solve
from qbumpers.tasks import TabularEnvironment, cliff_walking

UP, RIGHT, DOWN, LEFT = range(4)
CLIFF = solve(cliff_walking())
LAKE = solve(make_task("FrozenLake-v1", discount=0.95, is_slippery=True))


def walking(assistant: Any = "none", values: Any = CLIFF, **options: Any) -> SharedControl:
    """Cliff Walking under shared control."""
    return SharedControl(gymnasium.make("qbumpers/CliffWalking-v0"), assistant, values, **options)


def skating(assistant: Any = "none", values: Any = LAKE, **options: Any) -> SharedControl:
    """The slippery Frozen Lake under shared control."""
    lake = gymnasium.make("FrozenLake-v1", is_slippery=True)
    return SharedControl(lake, assistant, values, **options)


def bumpers(alpha: float = 0.7, **options: Any) -> dict[str, Any]:
    """Arguments for Stochastic Q Bumpers."""
    return {"assistant": "stochastic-q-bumpers", "alpha": alpha, **options}


def play(environment: gymnasium.Env, actions: Any, **reset: Any) -> list[tuple]:
    """Everything that `reset` and `step` returned until the actions or the episode end."""
    returned: list[tuple] = [environment.reset(**reset)]
    for action in actions:
        returned.append(environment.step(action))
        if returned[-1][2] or returned[-1][3]:
            break
    return returned


def plain(returned: Any) -> Any:
    """The same with lists for arrays, so that `==` compares it."""
    if isinstance(returned, dict):
        return {key: plain(value) for key, value in returned.items()}
    if isinstance(returned, list | tuple):
        return [plain(value) for value in returned]
    return returned.tolist() if isinstance(returned, np.ndarray | np.generic) else returned


class Dial(gymnasium.Env[np.ndarray, np.int64]):
    """Actions 5, 6 and 7, an array as observation; remembers what it was asked to do."""

    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (2,))
    action_space = gymnasium.spaces.Discrete(3, start=5)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.asked: list[int] = []
        self.options = options
        return np.zeros(2, np.float32), {"temperature": 20}

    def step(self, action):
        self.asked.append(int(action))
        return np.full(2, 0.5, np.float32), 1.0, len(self.asked) == 4, False, {"temperature": 21}


def ladder() -> TabularEnvironment:
    """Three states in a row: action 0 waits for -3, action 1 climbs for +2; the top ends."""
    transition = np.zeros((3, 2, 3))
    transition[range(3), 0, range(3)] = 1
    transition[range(3), 1, [1, 2, 2]] = 1
    reward = np.array([[-3.0, 2.0]] * 3)
    return TabularEnvironment(
        TabularTask.from_arrays(
            transition, reward, [False, False, True], 0, discount=0.9, episode_limit=50
        )
    )


LADDER = TabularValues(
    np.array([[0.42, 3.8], [-1.2, 2.0], [0.0, 0.0]]), discount=0.9, task="ladder", method="by hand"
)
