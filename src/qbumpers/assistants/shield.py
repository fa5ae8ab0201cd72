"""A shield that corrects unsafe actions (Alshiekh et al. 2018).

Their post-posed shield watches the actions of a learner and replaces those that would violate a
safety specification. Here the specification is a probability: with S(s, a) that of never crashing
after action a under the safest policy (the row "safety" of the values), a proposal with
S(s, a^h) < threshold is replaced by

    argmax {Q*(s, a) : S(s, a) >= threshold},  or argmax S(s, a) if no action is safe enough.
"""

from typing import Annotated, NamedTuple

from pydantic import Field

from qbumpers.assistants.registry import register_assistant
from qbumpers.borrowing import scratch
from qbumpers.choice import best_value, keep_only, pick
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Noise, Situation


class ShieldOptions(NamedTuple):
    """Options of a shield.

    Attributes:
        threshold: probability of never crashing that is safe enough.
    """

    threshold: Annotated[float, Field(ge=0, le=1)]


@register_assistant("shield", ShieldOptions, values=("safety",))
@compiled
def shield(situation: Situation, noise: Noise, options: ShieldOptions) -> Decision:
    """Replace an action that is not safe enough by the best one that is; leave waste alone.

    Whoever walks up and down far from the cliff all day is never stopped; `stochastic-q-bumpers`
    takes over once too much return is lost.
    """
    values, proposed, safety = situation.values, situation.proposed, situation.others[0]
    safest = best_value(safety)
    if safety[proposed] >= min(options.threshold, safest):
        return Decision(proposed, 0.0)
    if safest < options.threshold:
        return Decision(pick(safety, safest, noise.tie), 1.0)
    allowed, safe = scratch(len(values), False), scratch(len(values), 0.0)
    for action in range(len(values)):
        allowed[action] = safety[action] >= options.threshold
    keep_only(values, allowed, safe)
    return Decision(pick(safe, best_value(safe), noise.tie), 1.0)
