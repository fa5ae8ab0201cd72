"""Overrides at random: the same probability for every worse proposal.

a = c(s) with probability p if Q*(s, a^h) < Q*(s, c(s)), else a^h. What only the number of overrides
does, and not their choice, shows in it: it is what other assistants are compared with at an equal
share of overrides, as random advice is in Torrey and Taylor (2013).
"""

from typing import Annotated, NamedTuple

from pydantic import Field

from qbumpers.assistants.registry import register_assistant
from qbumpers.choice import candidate_value, pick
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Noise, Situation


class RandomOverrideOptions(NamedTuple):
    """Options of random overrides.

    Attributes:
        probability: of overriding a proposal worse than the candidate.
        second: override with the second-best action instead of the best.
    """

    probability: Annotated[float, Field(ge=0, le=1)]
    second: bool = False


@compiled
def overridden_with(
    situation: Situation, noise: Noise, candidate: float, probability: float
) -> Decision:
    """An override of a proposal worse than the candidate, with a probability.

    Args:
        situation: what is proposed, and what each action is worth.
        noise: of the decision; its coin decides.
        candidate: value of the action that an override executes.
        probability: with which a worse proposal is overridden.
    """
    if situation.values[situation.proposed] >= candidate:
        return Decision(situation.proposed, 0.0)
    if noise.coin < probability:
        return Decision(pick(situation.values, candidate, noise.tie), probability)
    return Decision(situation.proposed, probability)


@register_assistant("random-override", RandomOverrideOptions)
@compiled
def random_override(situation: Situation, noise: Noise, options: RandomOverrideOptions) -> Decision:
    """Override a proposal worse than the candidate with a fixed probability.

    With probability 1/2 it lets every other fall off the cliff happen, which
    `stochastic-q-bumpers` all but rules out.
    """
    candidate = candidate_value(situation.values, options.second)
    return overridden_with(situation, noise, candidate, options.probability)
