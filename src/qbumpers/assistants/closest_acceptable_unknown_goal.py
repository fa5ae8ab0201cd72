"""The closest acceptable action if only the learner knows the goal (Reddy, Dragan and Levine 2018).

The assistant's values are learned with a pilot in the loop, on the state augmented with the
proposal a^h: what a pilot proposes tells something of the goal. With the row of the proposal, one
of "proposals" of the values, in the place of Q*, it does what `closest-acceptable` does: of

    {a : Q'(s, a^h, a) >= (1 - alpha) max_b Q'(s, a^h, b)}

the action with the smallest distance d(a, a^h) is executed.
"""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.assistants.closest_acceptable import distances, nearest_acceptable
from qbumpers.assistants.registry import register_assistant, unchanged
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Noise, Situation


class ClosestAcceptableUnknownGoalOptions(NamedTuple):
    """Options of the closest acceptable action for an unknown goal.

    Attributes:
        alpha: share of the range of values within which an action is acceptable; at 0 only best
            ones are, at 1 all.
    """

    alpha: Annotated[float, Field(ge=0, le=1)]


@register_assistant(
    "closest-acceptable-unknown-goal", ClosestAcceptableUnknownGoalOptions, start=distances,
    observe=unchanged, values=("proposals",),
)  # fmt: skip
@compiled
def closest_acceptable_unknown_goal(
    situation: Situation,
    noise: Noise,
    options: ClosestAcceptableUnknownGoalOptions,
    memory: np.ndarray,
) -> Decision:
    """Replace an unacceptable proposal by the nearest action acceptable for what it tells.

    A step towards one of several goals is taken for what it says and passes; the mean over goals,
    which `stochastic-q-bumpers` goes by, may be best for another one.
    """
    return nearest_acceptable(
        situation.others[situation.proposed], situation.proposed, options.alpha, memory, noise.tie
    )
