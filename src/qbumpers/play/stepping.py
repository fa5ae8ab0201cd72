"""Tasks to be stepped through for one participant, whether their states are numbered or not."""

from typing import Any

import numpy as np

from qbumpers.tasks.dynamics import Dynamics, first_state, transition
from qbumpers.tasks.task import Task

_CHANCES = 2**53


class TabularStepper:
    """A tabular task, stepped through like a `qbumpers.tasks.stepping.Stepper`.

    Args:
        dynamics: where actions lead, and what for.
    """

    def __init__(self, dynamics: Dynamics) -> None:
        self._dynamics = dynamics
        self._chance = np.random.default_rng(0)
        self._state = 0

    def reset(self, chance: float) -> int:
        """Start an episode.

        Args:
            chance: in [0, 1), decides everything about the episode that is left to chance.

        Returns:
            The number of its first state.
        """
        self._chance = np.random.default_rng(int(chance * _CHANCES))
        self._state = int(first_state(self._dynamics, self._chance.random()))
        return self._state

    def step(self, action: int) -> tuple[int, float, int]:
        """Take an action.

        Args:
            action: in [0, A).

        Returns:
            The number of the next state, the reward, and bits of `qbumpers.tasks.dynamics`.
        """
        dynamics = self._dynamics
        index = transition(dynamics, self._state, action, self._chance.random())
        self._state = int(dynamics.next_state[index])
        return self._state, float(dynamics.reward[index]), int(dynamics.events[index])

    def snapshot(self) -> int:
        """The number of the state."""
        return self._state

    def restore(self, snapshot: int) -> None:
        """Put a state back; chance goes on.

        Args:
            snapshot: from `snapshot`.
        """
        self._state = snapshot


def stepper_of(task: Task) -> Any:
    """A task to be stepped through: a `TabularStepper` if its states are numbered.

    Args:
        task: any.
    """
    return TabularStepper(task.dynamics()) if task.states else task.make_stepper()


def chance_of(seed: int, episode: int) -> float:
    """What an episode's chances come from, by its number alone.

    Args:
        seed: one per session, not negative.
        episode: counted from 0.

    Returns:
        In [0, 1), the same for the same arguments.
    """
    return float(np.random.default_rng([seed, episode, *b"Episode"]).random())
