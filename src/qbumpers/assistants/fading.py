"""Help that fades from episode to episode, over any other rule.

The guidance hypothesis (Winstein, Pohl and Lewthwaite 1994): help in every trial is leant on, help
in fewer and fewer trials teaches. An override of the other rule is kept with probability
k = 2**(-episode / half_life).

A rule overrides if coin < p, with p the probability that it states. Given that it did, the coin is
uniform in [0, p), so that coin < k p keeps just the share k of its overrides, of every kind alike,
and the other rule has met the same coin as by itself.
"""

from typing import Annotated, Any, NamedTuple

from pydantic import Field

from qbumpers.assistants.dispatch import (
    decide,
    executing,
    observe,
    overrides,
    start,
    with_probability,
)
from qbumpers.assistants.registry import Options, register_assistant
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Model, Noise, Situation, Step


class FadingOptions(NamedTuple):
    """Options of fading.

    Attributes:
        of: the assistant whose help fades.
        half_life: episodes in which the probability of keeping an override falls by half.
    """

    of: Options
    half_life: Annotated[float, Field(gt=0, allow_inf_nan=False)]


@compiled
def start_other(options: FadingOptions, model: Model) -> Any:
    """The memory of the other rule before the first episode."""
    return start(options.of, model)


@compiled
def observe_other(memory: Any, step: Step, options: FadingOptions) -> Any:
    """The memory of the other rule after a step."""
    return observe(memory, step, options.of)


@register_assistant("fading", FadingOptions, start=start_other, observe=observe_other)
@compiled
def fading(situation: Situation, noise: Noise, options: FadingOptions, memory: Any) -> Decision:
    """Keep an override of another rule with a probability that halves every so many episodes.

    In late episodes a fall off the cliff happens more often than not; `stochastic-q-bumpers` by
    itself goes on stopping it.
    """
    decision = decide(situation, noise, options.of, memory)
    probability = decision.probability * 2.0 ** (-situation.episode / options.half_life)
    if overrides(decision, situation.proposed) and noise.coin >= probability:
        return executing(decision, situation.proposed, probability)
    return with_probability(decision, probability)
