"""What helps training on any task: held random actions, standardised observations, snapshots."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from qbumpers.experts.episodes import play, play_several
from qbumpers.experts.normalisation import Normalisation
from qbumpers.networks.network import named_parameters
from qbumpers.random_streams import draw
from qbumpers.tasks.task import Task
from qbumpers.values.network import NetworkValues

JUDGING = 20
"""Snapshots of the second half of a training, and greedy episodes that judge each of them."""

_EPISODES = 20  # random ones, whose observations are standardised


class HeldActions:
    """Random actions that go on for a while, so that exploration gets somewhere.

    How long has the probabilities 1 / (n (n + 1)) (Dabney, Ostrovski and Barreto 2021, whose tail
    is as heavy).

    Args:
        actions: A.
        stream: uint64 [4], random stream.
    """

    def __init__(self, actions: int, stream: np.ndarray) -> None:
        self._actions, self._stream = actions, stream
        self._left, self._action = 0, 0

    def begin(self) -> None:
        """An episode begins: nothing is held."""
        self._left = 0

    def action(self, epsilon: float) -> int:
        """The action that is held, or one that is from now on; -1 if none is.

        Args:
            epsilon: probability of a new one.
        """
        if not self._left:
            if draw(self._stream) >= epsilon:
                return -1
            self._action = int(draw(self._stream) * self._actions)
            self._left = int(1 / (1 - draw(self._stream)))
        self._left -= 1
        return self._action


def observed_spread(task: Task, stream: np.ndarray) -> Normalisation:
    """Mean and spread of the observations of random episodes.

    Args:
        task: whose stepper plays 20 of them, with held actions.
        stream: uint64 [4], random stream.

    Returns:
        The normalisation. A number that is nearly always the same has a tenth of its range as its
        spread, one that never changes 1.
    """
    stepper, held = task.make_stepper(), HeldActions(task.actions, stream)
    played: list[np.ndarray] = []
    for _ in range(_EPISODES):
        held.begin()
        episode = play(task, stepper, lambda _, step: held.action(1.0), draw(stream))
        played.append(episode.observations)
    seen = np.concatenate(played).astype(np.float64)
    spread = np.maximum(seen.std(axis=0), np.ptp(seen, axis=0) / 10)
    return Normalisation(seen.mean(axis=0), np.where(spread > 0, spread, 1.0), np.inf)


def for_plain_observations(values: NetworkValues, seen: Normalisation) -> NetworkValues:
    """Values of observations as they are, of a network that was trained on standardised ones."""
    parameters = values.parameters.copy()
    named = named_parameters(values.layout, parameters)
    weight, bias = list(named.values())[:2]
    weight[:], bias[:] = seen.folded(weight.copy(), bias.copy())
    return replace(values, parameters=parameters)


class Snapshot(NamedTuple):
    """Values as they were at some step, and how well they played: successes, then return."""

    merit: tuple[float, float]
    values: NetworkValues


class Snapshots:
    """The best of the values that a training goes through in its second half.

    Args:
        task: what they are judged by.
        steps: how long the training is.
        now: makes the values of the moment.
    """

    def __init__(self, task: Task, steps: int, now: Callable[[], NetworkValues]) -> None:
        self._task, self._now = task, now
        places = np.linspace(steps / 2, steps, JUDGING + 1)[1:]
        self._when = frozenset(np.ceil(places).astype(int).tolist())
        self.best: Snapshot | None = None

    def look(self, done: int) -> None:
        """Judge the values of the moment, if it is time; of equal ones the first are kept."""
        if done not in self._when:
            return
        values = self._now()
        episodes = play_several(self._task, values, JUDGING)
        merit = (
            float(np.mean([episode.success for episode in episodes])),
            float(np.mean([episode.rewards.sum() for episode in episodes])),
        )
        if self.best is None or merit > self.best.merit:
            self.best = Snapshot(merit, values)
