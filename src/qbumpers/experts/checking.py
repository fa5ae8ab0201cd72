"""Whether action values are any good at all: their greedy play against random play."""

import math
import warnings
from typing import NamedTuple

import gymnasium
import numpy as np

from qbumpers.experts.episodes import play_several
from qbumpers.tasks.task import Task
from qbumpers.values.tabular import QValues


class ExpertWarning(UserWarning):
    """The assistant's action values are no better than none, or may not be the model's."""


class MeanWithError(NamedTuple):
    """A mean over episodes and its standard error, infinite for a single episode."""

    mean: float
    error: float


class ExpertCheck(NamedTuple):
    """How an expert fares against random play.

    Attributes:
        expert: mean undiscounted return of the expert.
        random: mean undiscounted return of uniformly random actions.
    """

    expert: MeanWithError
    random: MeanWithError

    @property
    def better(self) -> bool:
        """Whether the expert's mean return is above that of random actions."""
        return self.expert.mean > self.random.mean


class ThresholdCheck(NamedTuple):
    """How an expert fares by the threshold that Gymnasium states for its environment.

    Attributes:
        returned: mean undiscounted return of greedy episodes.
        threshold: from which on the environment counts as solved.
    """

    returned: MeanWithError
    threshold: float

    @property
    def reached(self) -> bool:
        """Whether the environment counts as solved."""
        return self.returned.mean >= self.threshold


def mean_with_error(numbers: np.ndarray) -> MeanWithError:
    """Mean and standard error of independent numbers [N]."""
    count = len(numbers)
    error = float(np.std(numbers, ddof=1)) / math.sqrt(count) if count > 1 else math.inf
    return MeanWithError(float(np.mean(numbers)), error)


def check_expert(
    task: Task, values: QValues, *, episodes: int = 20, epsilon: float = 0.02, seed: int = 0
) -> ExpertCheck:
    """Compare greedy play by action values with random play; warn if it is no better.

    Args:
        task: what is played.
        values: Q* of the expert, any callable from an observation to a value per action.
        episodes: how many each of the two plays, at least 1.
        epsilon: probability of a random action in the expert's episodes.
        seed: decides chance of the environment and random actions; not negative.

    Returns:
        Both returns.

    Raises:
        RequestError: as `play_several`.

    Warns:
        ExpertWarning: if the expert's mean return is not above that of random actions.
    """
    returns = [
        mean_with_error(
            np.array(
                [
                    played.rewards.sum()
                    for played in play_several(task, values, episodes, epsilon=chance, seed=seed)
                ]
            )
        )
        for chance in (epsilon, 1.0)
    ]
    found = ExpertCheck(*returns)
    if not found.better:
        warnings.warn(
            f"values of task {task.name}: their greedy policy returns {found.expert.mean:.1f} "
            f"per episode and random actions {found.random.mean:.1f}, so assistance by them steers "
            "towards worse actions, and results say nothing about the method",
            ExpertWarning,
            stacklevel=2,
        )
    return found


def check_threshold(
    task: Task, values: QValues, *, episodes: int = 100, seed: int = 0
) -> ThresholdCheck | None:
    """Compare greedy play with `reward_threshold` of a Gymnasium environment; warn if it is below.

    Args:
        task: what is played.
        values: Q* of the expert.
        episodes: how many, at least 1.
        seed: decides chance of the environment; not negative.

    Returns:
        What was found; None if no threshold is stated, or the task's episodes are shorter than
        those that it is stated for.

    Warns:
        ExpertWarning: if the mean return is below the threshold.
    """
    made = task.environment_spec
    spec = gymnasium.registry.get(made.id if made else task.name)
    stated = None if spec is None else spec.reward_threshold
    if spec is None or stated is None or task.episode_limit < (spec.max_episode_steps or 0):
        return None
    played = play_several(task, values, episodes, seed=seed)
    returns = np.array([episode.rewards.sum() for episode in played])
    found = ThresholdCheck(mean_with_error(returns), stated)
    if not found.reached:
        warnings.warn(
            f"values of task {task.name}: their greedy policy returns {found.returned.mean:.1f} "
            f"per episode, and the environment counts as solved from {stated:g} on; try more "
            "steps, more seeds, another learning rate or other hidden layers",
            ExpertWarning,
            stacklevel=2,
        )
    return found
