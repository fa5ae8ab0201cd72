"""Control that does not flicker, over any other rule (after Hoque et al. 2021, LazyDAgger).

Switching control back and forth costs a person more than the help is worth. After an override of
the other rule, every proposal that is not a best action is overridden with one, until `calm` steps
in a row needed no override or the episode ends.
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
from qbumpers.choice import best_value, pick
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Model, Noise, Situation, Step


class HysteresisOptions(NamedTuple):
    """Options of hysteresis.

    Attributes:
        of: the assistant that takes over.
        calm: steps without an override after which it gives control back.
    """

    of: Options
    calm: Annotated[int, Field(ge=1)]


class HysteresisMemory(NamedTuple):
    """What hysteresis remembers.

    Attributes:
        of: what the other rule remembers; 0 if that is nothing.
        episode: that of the last step.
        left: steps without an override until control is given back, in that episode.
    """

    of: Any
    episode: int
    left: int


@compiled
def no_control(options: HysteresisOptions, model: Model) -> HysteresisMemory:
    """The memory before the first episode."""
    return HysteresisMemory(start(options.of, model), 0, 0)


@compiled
def count(memory: HysteresisMemory, step: Step, options: HysteresisOptions) -> HysteresisMemory:
    """The memory after a step; an override begins the count again."""
    left = memory.left if step.episode == memory.episode else 0
    left = options.calm if step.overridden else max(left - 1, 0)
    return HysteresisMemory(observe(memory.of, step, options.of), step.episode, left)


@register_assistant("hysteresis", HysteresisOptions, start=no_control, observe=count)
@compiled
def hysteresis(
    situation: Situation, noise: Noise, options: HysteresisOptions, memory: HysteresisMemory
) -> Decision:
    """After an override of another rule, go on overriding until some steps in a row are calm.

    A trifle right after a mended fall is mended, too; `stochastic-q-bumpers` by itself, which the
    fall cost nothing, lets nearly every one pass.
    """
    decision = decide(situation, noise, options.of, memory.of)
    values, proposed = situation.values, situation.proposed
    held = memory.left > 0 and memory.episode == situation.episode
    best = best_value(values)
    if not held or values[proposed] >= best:
        return decision
    if overrides(decision, proposed):
        return with_probability(decision, 1.0)
    return executing(decision, pick(values, best, noise.tie), 1.0)
