"""A budget of overrides over any other rule (after Torrey and Taylor 2013)."""

from typing import Annotated, Any, NamedTuple

from pydantic import Field

from qbumpers.assistants.dispatch import decide, declined, observe, overrides, start
from qbumpers.assistants.registry import Options, register_assistant
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Model, Noise, Situation, Step


class BudgetOptions(NamedTuple):
    """Options of a budget; a limit that is left out is none.

    Attributes:
        of: the assistant whose overrides are counted.
        per_episode: how many of them an episode may have.
        in_all: how many of them a learner or participant may have.
        share: of the assisted steps so far that may be overridden, at every moment.
    """

    of: Options
    per_episode: Annotated[int, Field(ge=0)] | None = None
    in_all: Annotated[int, Field(ge=0)] | None = None
    share: Annotated[float, Field(ge=0, le=1)] | None = None


class BudgetMemory(NamedTuple):
    """What a budget remembers.

    Attributes:
        of: what the other rule remembers; 0 if that is nothing.
        episode: the episode in which overrides were spent.
        spent: overrides in that episode.
        in_all: overrides in all episodes.
        steps: assisted steps in all episodes.
    """

    of: Any
    episode: int
    spent: int
    in_all: int
    steps: int


@compiled
def nothing_spent(options: BudgetOptions, model: Model) -> BudgetMemory:
    """The memory before the first episode."""
    return BudgetMemory(start(options.of, model), 0, 0, 0, 0)


@compiled
def spend(memory: BudgetMemory, step: Step, options: BudgetOptions) -> BudgetMemory:
    """The memory after a step; an episode's budget ends with it."""
    before = memory.spent if step.episode == memory.episode else 0
    overrides = 1 if step.overridden else 0
    return BudgetMemory(
        observe(memory.of, step, options.of),
        step.episode,
        before + overrides,
        memory.in_all + overrides,
        memory.steps + 1,
    )


# Compiled code leaves out the branch of an argument that is None, but of an argument alone.
@compiled
def _exhausted(spent: int, limit: int | None) -> bool:
    if limit is None:
        return False
    return spent >= limit


@compiled
def _above(overrides: int, share: float | None, steps: int) -> bool:
    if share is None:
        return False
    return overrides > share * steps


@register_assistant("budget", BudgetOptions, start=nothing_spent, observe=spend)
@compiled
def budget(
    situation: Situation, noise: Noise, options: BudgetOptions, memory: BudgetMemory
) -> Decision:
    """Do what another rule does while a budget of overrides lasts, then nothing.

    Once it is spent, a fall off the cliff happens; `stochastic-q-bumpers` by itself stops it.
    """
    decision = decide(situation, noise, options.of, memory.of)
    spent = memory.spent if situation.episode == memory.episode else 0
    exhausted = (
        _exhausted(spent, options.per_episode)
        or _exhausted(memory.in_all, options.in_all)
        or _above(memory.in_all + 1, options.share, memory.steps + 1)
    )
    if overrides(decision, situation.proposed) and exhausted:
        return declined(decision, situation.proposed)
    return decision
