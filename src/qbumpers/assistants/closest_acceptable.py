"""The acceptable action nearest to the proposed one (Reddy, Dragan and Levine 2018).

With Q'(s, a) = Q*(s, a) - min_b Q*(s, b), acceptable are

    {a : Q'(s, a) >= (1 - alpha) max_b Q'(s, b)},

and of these the one with the smallest distance d(a, a^h) is executed. `local-q-thresholding` has
the same set, but replaces what is outside of it by the best action.
"""

from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.assistants.registry import register_assistant, unchanged
from qbumpers.borrowing import scratch
from qbumpers.choice import best_value, keep_only, pick, worst_value
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Model, Noise, Situation


@compiled
def nearest_acceptable(
    values: np.ndarray, proposed: int, alpha: float, distance: np.ndarray, tie: float
) -> Decision:
    """The proposal if it is acceptable, else the nearest acceptable action, of equals the best.

    Args:
        values: float64 [A], by which actions are acceptable.
        proposed: in [0, A).
        alpha: share of the range of values within which an action is acceptable.
        distance: float64 [A, A], between actions.
        tie: in [0, 1), which of equally good ones.
    """
    lowest = worst_value(values)
    needed = (1 - alpha) * (best_value(values) - lowest)
    if values[proposed] - lowest >= needed:
        return Decision(proposed, 0.0)
    nearest = np.inf
    for action in range(len(values)):
        if values[action] - lowest >= needed:
            nearest = min(nearest, distance[proposed, action])
    allowed = scratch(len(values), False)
    for action in range(len(values)):
        acceptable = values[action] - lowest >= needed
        allowed[action] = acceptable and distance[proposed, action] == nearest
    found = scratch(len(values), 0.0)
    keep_only(values, allowed, found)
    return Decision(pick(found, best_value(found), tie), 1.0)


class ClosestAcceptableOptions(NamedTuple):
    """Options of the closest acceptable action.

    Attributes:
        alpha: share of the range of values within which an action is acceptable; at 0 only best
            ones are, at 1 all.
    """

    alpha: Annotated[float, Field(ge=0, le=1)]


@compiled
def distances(options: Any, model: Model) -> np.ndarray:
    """The distance between actions, float64 [A, A]; all alike if the task states none."""
    return model.distance.copy()


@register_assistant(
    "closest-acceptable", ClosestAcceptableOptions, start=distances, observe=unchanged,
    needs=("distance",),
)  # fmt: skip
@compiled
def closest_acceptable(
    situation: Situation, noise: Noise, options: ClosestAcceptableOptions, memory: np.ndarray
) -> Decision:
    """Replace an unacceptable proposal by the nearest acceptable action, of equals the best.

    If a neighbouring action will do, it is executed, although a better one is farther away;
    an override of `stochastic-q-bumpers` executes the best one.
    """
    return nearest_acceptable(
        situation.values, situation.proposed, options.alpha, memory, noise.tie
    )
