"""Choosing among actions by their values: greedy choice with random ties, and `AgentAction`.

`AgentAction` of Algorithm 1, the action an assistant would put in place of the proposed one, is
split in two, since a rule compares values before it needs an action: `candidate_value` says how
good the replacement is, `pick` draws one of the actions of that value.
"""

import numpy as np

from qbumpers.compilation import compiled


@compiled
def best_value(values: np.ndarray) -> float:
    """V*(s): the largest of the values [A]."""
    best = values[0]
    for action in range(1, len(values)):
        best = max(best, values[action])
    return best


@compiled
def worst_value(values: np.ndarray) -> float:
    """The smallest of the values [A]."""
    worst = values[0]
    for action in range(1, len(values)):
        worst = min(worst, values[action])
    return worst


@compiled
def second_value(values: np.ndarray) -> float:
    """The largest of the values [A] strictly below the best; the best if all are equal."""
    best = best_value(values)
    second = -np.inf
    for value in values:
        if value < best:
            second = max(second, value)
    return second if second > -np.inf else best


@compiled
def candidate_value(values: np.ndarray, second: bool) -> float:
    """Value of the replacement action: second-best if `second` is set, else best."""
    return second_value(values) if second else best_value(values)


@compiled
def keep_only(values: np.ndarray, allowed: np.ndarray, out: np.ndarray) -> None:
    """Write down the values of the actions that are allowed, and minus infinity for the others.

    `best_value` and `pick` then choose among those actions.

    Args:
        values: float64 [A].
        allowed: bool [A].
        out: float64 [A], overwritten.
    """
    for action in range(len(values)):
        out[action] = values[action] if allowed[action] else -np.inf


@compiled
def pick(values: np.ndarray, target: float, tie: float) -> int:
    """One of the actions whose value is `target`, each with equal probability.

    Args:
        values: float64 [A].
        target: a value that occurs in `values`.
        tie: in [0, 1).

    Returns:
        The action.
    """
    equal = 0
    for value in values:
        equal += value == target
    remaining = int(tie * equal)
    for action in range(len(values)):
        if values[action] == target:
            if remaining == 0:
                return action
            remaining -= 1
    return 0
