"""Hard bumpers: the lower value of Stochastic Q Bumpers as a line that is never crossed.

Section 3 of Bragg and Brunskill (2019) has the lower value L = V*(s_0) - alpha (V*(s_0) - v_min)
before it lets chance decide about overrides. Here nothing is left to chance: an override happens
if and only if the projected return G(s, a) of the proposal lies below L.
"""

from typing import Annotated, NamedTuple

from pydantic import Field

from qbumpers.assistants.registry import register_assistant
from qbumpers.assistants.stochastic_q_bumpers import check_floor
from qbumpers.choice import candidate_value, pick
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Noise, Situation, projected_return


class HardBumpersOptions(NamedTuple):
    """Options of hard bumpers.

    Attributes:
        alpha: how far the projected return may fall, from V*(s_0) towards `v_min`; 0 overrides
            every action worse than the candidate that loses anything.
        v_min: a lower bound on the return of an episode, below V*(s_0).
        second: override with the second-best action instead of the best.
    """

    alpha: Annotated[float, Field(ge=0, le=1)]
    v_min: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    second: bool = False


@register_assistant("hard-bumpers", HardBumpersOptions, check_start=check_floor)
@compiled
def hard_bumpers(situation: Situation, noise: Noise, options: HardBumpersOptions) -> Decision:
    """Override surely once the projected return would fall below the lower value, never before.

    A proposal that loses nine tenths of what may be lost stays, whatever the coin;
    `stochastic-q-bumpers` overrides it nearly always.
    """
    values, proposed, start_value = situation.values, situation.proposed, situation.start_value
    candidate = candidate_value(values, options.second)
    if values[proposed] >= candidate:
        return Decision(proposed, 0.0)
    lower_value = start_value - options.alpha * (start_value - options.v_min)
    if projected_return(situation.earned, situation.discount, values[proposed]) >= lower_value:
        return Decision(proposed, 0.0)
    return Decision(pick(values, candidate, noise.tie), 1.0)
