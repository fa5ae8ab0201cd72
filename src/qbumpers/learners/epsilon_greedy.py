"""Epsilon-greedy choice among action values (Sutton and Barto 2018, Section 2.2)."""

import numpy as np

from qbumpers.choice import best_value, pick
from qbumpers.compilation import compiled


@compiled
def greedy(values: np.ndarray, tie: float) -> int:
    """An action of the largest value in `values` [A], ties broken by `tie` in [0, 1)."""
    return pick(values, best_value(values), tie)


@compiled
def epsilon_greedy(values: np.ndarray, epsilon: float, coin: float, tie: float) -> int:
    """A random action with probability epsilon, else a greedy one.

    Args:
        values: float [A], the learner's values in this state.
        epsilon: probability of a random action.
        coin: in [0, 1), explore or not.
        tie: in [0, 1), which random action, or which of equally good ones.

    Returns:
        The action.
    """
    if coin < epsilon:
        return int(tie * len(values))
    return greedy(values, tie)


@compiled
def epsilon_greedy_policy(values: np.ndarray, epsilon: float, out: np.ndarray) -> None:
    """The probabilities with which `epsilon_greedy` chooses.

    Args:
        values: float [A], the learner's values in this state.
        epsilon: probability of a random action.
        out: float64 [A], overwritten; sums to 1.
    """
    best, equal = best_value(values), 0
    for value in values:
        equal += value == best
    for action in range(len(values)):
        out[action] = epsilon / len(values)
        if values[action] == best:
            out[action] += (1 - epsilon) / equal
