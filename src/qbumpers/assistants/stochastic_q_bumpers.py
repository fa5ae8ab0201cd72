"""Stochastic Q Bumpers (Bragg and Brunskill 2019, Algorithm 1)."""

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from qbumpers.assistants.registry import register_assistant
from qbumpers.choice import best_value, candidate_value, pick
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Noise, Situation, projected_return


class StochasticQBumpersOptions(NamedTuple):
    """Options of Stochastic Q Bumpers.

    Attributes:
        alpha: how far the projected return may fall, from V*(s_0) towards `v_min`; smaller is
            more support. At 0 every action worse than the candidate is overridden.
        v_min: a lower bound on the return of an episode, below V*(s_0).
        p_max: probability of an override when the fall is complete, f(1).
        second: override with the second-best action instead of the best.
        escalate: override with the best action, surely, once even the candidate would not keep
            the projected return above the lower value.
        clip: no override at ratio 0 or less and a sure one at ratio 1 or more; otherwise the
            logistic applies to every ratio.
    """

    alpha: Annotated[float, Field(ge=0, le=1)]
    v_min: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    p_max: Annotated[float, Field(gt=0.5, lt=1)] = 0.999
    second: bool = False
    escalate: bool = True
    clip: bool = True


def check_floor(options: StochasticQBumpersOptions, start_value: float) -> None:
    """Raise ValueError if `v_min` is not below V*(s_0)."""
    if not options.v_min < start_value:
        raise ValueError(
            f"v_min = {options.v_min:g} must be below the value of the start state, "
            f"V*(s_0) = {start_value:g}: choose a lower return that an episode could have"
        )


@compiled
def logistic(ratio: float, p_max: float) -> float:
    """f(x) = 1 / (1 + exp(k (x - 1/2))), k = 2 (log(1 - p_max) - log(p_max)), so f(1) = p_max."""
    steepness = 2 * (math.log(1 - p_max) - math.log(p_max))
    return 1 / (1 + math.exp(steepness * (ratio - 0.5)))


@compiled
def override_probability(lost: float, room: float, p_max: float, clip: bool) -> float:
    """Probability of overriding, from the return that the action would lose.

    Args:
        lost: V*(s_0) - G(s_t, a), in reward units.
        room: alpha (V*(s_0) - v_min), how much may be lost, in reward units.
        p_max: f(1).
        clip: no override at ratio 0 or less, a sure one at ratio 1 or more.

    Returns:
        f(lost / room), clipped outside (0, 1) if `clip` is set; 1 if nothing may be lost.
    """
    if room <= 0:
        return 1.0
    ratio = lost / room
    if clip and ratio <= 0:
        return 0.0
    if clip and ratio >= 1:
        return 1.0
    return logistic(ratio, p_max)


@register_assistant("stochastic-q-bumpers", StochasticQBumpersOptions, check_start=check_floor)
@compiled
def stochastic_q_bumpers(
    situation: Situation, noise: Noise, options: StochasticQBumpersOptions
) -> Decision:
    """Override with a probability that grows as the projected return falls (Algorithm 1)."""
    values, proposed = situation.values, situation.proposed
    earned, discount, start_value = (
        situation.earned, situation.discount, situation.start_value,
    )  # fmt: skip
    candidate = candidate_value(values, options.second)
    if values[proposed] >= candidate:
        return Decision(proposed, 0.0)
    room = options.alpha * (start_value - options.v_min)
    if options.escalate and start_value - projected_return(earned, discount, candidate) >= room:
        return Decision(pick(values, best_value(values), noise.tie), 1.0)
    lost = start_value - projected_return(earned, discount, values[proposed])
    probability = override_probability(lost, room, options.p_max, options.clip)
    if noise.coin < probability:
        return Decision(pick(values, candidate, noise.tie), probability)
    return Decision(proposed, probability)
