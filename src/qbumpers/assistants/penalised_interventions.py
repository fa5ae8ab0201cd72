"""Interventions at a price that adapts (Tan et al. 2022).

Their soft constraint charges the assistant for each intervention, r' = r - lambda 1[override], so
that it intervenes if that gains more than it costs; their adaptive variant moves the price until
the share of steps with an intervention is the target. With exact values the gain of an override is
V*(s) - Q*(s, a^h), and after every step

    lambda <- max(0, lambda - rate (target - 1[override])).
"""

from typing import Annotated, NamedTuple

from pydantic import Field

from qbumpers.assistants.registry import register_assistant
from qbumpers.choice import best_value, pick
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Model, Noise, Situation, Step


class PenalisedInterventionsOptions(NamedTuple):
    """Options of penalised interventions.

    Attributes:
        target: share of the steps that are overridden in the long run.
        rate: how far the price moves per step, in reward units.
        price: of an override in the first step, in reward units.
    """

    target: Annotated[float, Field(ge=0, le=1)]
    rate: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.01
    price: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0


@compiled
def first_price(options: PenalisedInterventionsOptions, model: Model) -> float:
    """The price before the first step."""
    return options.price


@compiled
def next_price(price: float, step: Step, options: PenalisedInterventionsOptions) -> float:
    """The price after a step: higher after an override, lower after none."""
    happened = 1.0 if step.overridden else 0.0
    return max(0.0, price - options.rate * (options.target - happened))


@register_assistant(
    "penalised-interventions", PenalisedInterventionsOptions, start=first_price, observe=next_price
)
@compiled
def penalised_interventions(
    situation: Situation, noise: Noise, options: PenalisedInterventionsOptions, memory: float
) -> Decision:
    """Override if that gains more than its price, which adapts to a target share of overrides.

    While it has the target in reach, the price is 0 and every trifle is mended;
    `stochastic-q-bumpers` lets nearly all trifles of a good episode pass, whatever came before.
    """
    values, proposed = situation.values, situation.proposed
    best = best_value(values)
    if best - values[proposed] > memory:
        return Decision(pick(values, best, noise.tie), 1.0)
    return Decision(proposed, 0.0)
