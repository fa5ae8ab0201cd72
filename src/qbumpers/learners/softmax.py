"""Softmax choice: the better, the likelier (Sutton and Barto 2018, Section 2.8)."""

import math

import numpy as np

from qbumpers.choice import best_value
from qbumpers.compilation import compiled


@compiled
def softmax_weights(
    values: np.ndarray, inverse_temperature: float, last: int, perseveration: float, out: np.ndarray
) -> float:
    """Weights in proportion to exp(inverse_temperature value + perseveration 1[action = last]).

    The largest is 1, whatever the values are: nothing overflows, and never are all of them 0.

    Args:
        values: float64 [A], finite.
        inverse_temperature: per unit of the values, at least 0.
        last: the action that perseveration is about; -1 if there is none.
        perseveration: what is added for it.
        out: float64 [A], overwritten by the weights.

    Returns:
        The sum of the weights.
    """
    best, top, total = best_value(values), -np.inf, 0.0
    for action in range(len(values)):
        out[action] = inverse_temperature * (values[action] - best)
        if action == last:
            out[action] += perseveration
        top = max(top, out[action])
    for action in range(len(values)):
        out[action] = math.exp(out[action] - top)
        total += out[action]
    return total


@compiled
def by_weight(weights: np.ndarray, total: float, actions: int, chance: float) -> int:
    """An action with probability in proportion to its weight.

    Args:
        weights: float64 [A], at least 0.
        total: their sum, above 0.
        actions: A.
        chance: in [0, 1).

    Returns:
        The action.
    """
    remaining, found = chance * total, 0
    for action in range(actions):
        if weights[action] > 0:
            if remaining < weights[action]:
                return action
            found = action  # if rounding leaves something, the last one that can happen
            remaining -= weights[action]
    return found


@compiled
def normalise(weights: np.ndarray, total: float) -> None:
    """Divide weights, float64 [A], by their sum."""
    for action in range(len(weights)):
        weights[action] /= total
