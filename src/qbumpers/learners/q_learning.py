"""Tabular Q-learning with epsilon-greedy exploration and the paper's schedules (Section 4.2)."""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.choice import best_value, pick
from qbumpers.compilation import compiled


class Schedule(NamedTuple):
    """A number that changes linearly over the first episodes and then stays.

    Attributes:
        start: value in the first episode.
        end: value once the decay is over.
        fraction: share of all episodes over which it decays.
    """

    start: Annotated[float, Field(ge=0, le=1)] = 1.0
    end: Annotated[float, Field(ge=0, le=1)] = 0.02
    fraction: Annotated[float, Field(ge=0, le=1)] = 0.9


class QLearner(NamedTuple):
    """A tabular Q-learner; its table of values lives with the trial.

    Attributes:
        discount: of the learner's own values.
        epsilon: probability of a random action, by episode.
        learning_rate: step size, by episode.
        initial_value: of every action in every state, in reward units.
        penalty: what an override feels like, in reward units, to a learner whose perception
            includes disruption.
    """

    discount: Annotated[float, Field(gt=0, le=1)] = 1.0
    epsilon: Schedule = Schedule()
    learning_rate: Schedule = Schedule()
    initial_value: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    penalty: Annotated[float, Field(allow_inf_nan=False)] = 1.0


@compiled
def scheduled(schedule: Schedule, episode: int, episodes: int) -> float:
    """Value in one episode: start + min(e / n, 1) (end - start), n = int(fraction * episodes).

    Args:
        schedule: the schedule.
        episode: e, counted from 0.
        episodes: of the whole trial.

    Returns:
        The value; `end` at once where n is 0.
    """
    decay = int(schedule.fraction * episodes)
    progress = min(episode / decay, 1.0) if decay > 0 else 1.0
    return schedule.start + progress * (schedule.end - schedule.start)


@compiled
def choose_greedily(row: np.ndarray, tie: float) -> int:
    """An action of the largest value in `row` [A], ties broken by `tie` in [0, 1)."""
    return pick(row, best_value(row), tie)


@compiled
def choose(row: np.ndarray, epsilon: float, coin: float, tie: float) -> int:
    """Epsilon-greedy choice.

    Args:
        row: float64 [A], the learner's values in this state.
        epsilon: probability of a random action.
        coin: in [0, 1), explore or not.
        tie: in [0, 1), which random action, or which of equally good ones.

    Returns:
        The action.
    """
    if coin < epsilon:
        return int(tie * len(row))
    return choose_greedily(row, tie)


@compiled
def learned(old: float, reward: float, next_value: float, learning_rate: float) -> float:
    """The Q-learning update: old + rate * (reward + next_value - old).

    Args:
        old: value of the credited action.
        reward: as perceived.
        next_value: discounted value of the next state; 0 where it is terminal.
        learning_rate: step size in [0, 1].

    Returns:
        The new value of the credited action.
    """
    return old + learning_rate * (reward + next_value - old)
