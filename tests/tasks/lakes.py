"""Gymnasium environments with transition tables that tests wrap, shift and falsify."""

from typing import Any

import gymnasium
from gymnasium import spaces
from gymnasium.envs.toy_text import FrozenLakeEnv

from tests.tasks.examples import outcomes, random_task


def frozen(**arguments) -> gymnasium.Env:
    """The lake without slipping: six steps from the start to the goal."""
    return gymnasium.make("FrozenLake-v1", is_slippery=False, **arguments)


class Paid(FrozenLakeEnv):
    """Pays a bonus at the goal that its table does not have."""

    def step(self, a):
        observation, reward, terminated, truncated, info = super().step(a)
        return observation, reward + 0.5 * (reward > 0), terminated, truncated, info


class Slipperier(FrozenLakeEnv):
    """Every fifth step is straight on, whatever the table says; all of it is possible."""

    def step(self, a):
        if self.np_random.random() < 0.2:
            straight = self.P[self.s][a][len(self.P[self.s][a]) // 2]
            _, self.s, reward, terminated = straight
            return int(self.s), reward, terminated, False, {}
        return super().step(a)


class Steadier(FrozenLakeEnv):
    """Down from the start nobody slips, whatever the table says."""

    def step(self, a):
        if (self.s, a) != (0, 1):
            return super().step(a)
        self.s = 4
        return 4, 0.0, False, False, {}


class Elsewhere(FrozenLakeEnv):
    """Begins beside the start."""

    def reset(self, *, seed=None, options=None):
        _, info = super().reset(seed=seed)
        self.s = 1
        return 1, info


class Impatient(FrozenLakeEnv):
    """Truncates its episodes itself, after 12 steps."""

    def reset(self, *, seed=None, options=None):
        self.steps = 0
        return super().reset(seed=seed)

    def step(self, a) -> Any:
        self.steps += 1
        observation, reward, terminated, _, info = super().step(a)
        return observation, reward, terminated, self.steps >= 12, info


class Tabled(gymnasium.Env[Any, Any]):
    """An environment of a task with a table, whose numbers may start anywhere."""

    def __init__(self, seed=0, first_state=0, first_action=0, table_counts_alike=True):
        self.task_of_table = task = random_task(seed, 6, 3)
        self.observation_space: Any = spaces.Discrete(6, start=first_state)
        self.action_space: Any = spaces.Discrete(3, start=first_action)
        state, action = (first_state, first_action) if table_counts_alike else (0, 0)
        self.P = {
            s + state: {
                a + action: [
                    (p, to + state, reward, end)
                    for (to, reward, end), p in outcomes(task, s, a).items()
                ]
                for a in range(3)
            }
            for s in range(6)
        }
        self.initial_state_distrib = task.start

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.now = int(self.np_random.choice(6, p=self.initial_state_distrib))
        return self.now + int(self.observation_space.start), {}

    def step(self, action):
        rows = list(
            outcomes(self.task_of_table, self.now, action - self.action_space.start).items()
        )
        drawn = self.np_random.choice(len(rows), p=[p for _, p in rows])
        self.now, reward, terminated = rows[drawn][0]
        return self.now + int(self.observation_space.start), reward, terminated, False, {}
