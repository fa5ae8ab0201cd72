"""Whether action values are any good at all: their greedy play against random play."""

import math
import warnings
from typing import NamedTuple

import numpy as np

from qbumpers.experts.episodes import play_several
from qbumpers.tasks.vector import VectorTask
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
        random: of uniformly random actions.
    """

    expert: MeanWithError
    random: MeanWithError

    @property
    def better(self) -> bool:
        """Whether the expert's mean return is above that of random actions."""
        return self.expert.mean > self.random.mean


def mean_with_error(numbers: np.ndarray) -> MeanWithError:
    """Mean and standard error of independent numbers [N]."""
    count = len(numbers)
    error = float(np.std(numbers, ddof=1)) / math.sqrt(count) if count > 1 else math.inf
    return MeanWithError(float(np.mean(numbers)), error)


def check_expert(
    task: VectorTask, values: QValues, *, episodes: int = 20, epsilon: float = 0.02, seed: int = 0
) -> ExpertCheck:
    """Compare greedy play by action values with random play; warn if it is no better.

    Args:
        task: what is played.
        values: of the expert.
        episodes: of each.
        epsilon: probability of a random action in the expert's episodes.
        seed: of the random numbers, not negative.

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
