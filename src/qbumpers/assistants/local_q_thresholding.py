"""Local Q-Thresholding (Reddy, Dragan and Levine 2018), as the paper compares against it."""

from typing import Annotated, NamedTuple

from pydantic import Field

from qbumpers.assistants.registry import register_assistant
from qbumpers.choice import best_value, candidate_value, pick, worst_value
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Noise, Situation


class LocalQThresholdingOptions(NamedTuple):
    """Options of Local Q-Thresholding.

    Attributes:
        alpha: share of the range of values within which the learner is free; 1 never overrides.
        second: override with the second-best action instead of the best.
    """

    alpha: Annotated[float, Field(ge=0, le=1)]
    second: bool = False


@register_assistant("local-q-thresholding", LocalQThresholdingOptions)
@compiled
def local_q_thresholding(
    situation: Situation, noise: Noise, options: LocalQThresholdingOptions
) -> Decision:
    """Override when Q'(s, a) < (1 - alpha) max Q'(s, .), with Q' = Q* - min Q* (Section 4).

    An action that is no worse than its replacement stays, as in Algorithm 1.
    """
    values = situation.values
    own = values[situation.proposed]
    candidate = candidate_value(values, options.second)
    if own >= candidate:
        return Decision(situation.proposed, 0.0)
    lowest = worst_value(values)
    if own - lowest < (1 - options.alpha) * (best_value(values) - lowest):
        return Decision(pick(values, candidate, noise.tie), 1.0)
    return Decision(situation.proposed, 0.0)
