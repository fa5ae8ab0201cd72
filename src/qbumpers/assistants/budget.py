"""A budget of overrides over any other rule (after Torrey and Taylor 2013)."""

from typing import Annotated, Any, NamedTuple

from pydantic import Field

from qbumpers.assistants.dispatch import decide, declined, observe, start, undoes
from qbumpers.assistants.registry import Options, register_assistant
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Model, Noise, Situation, Step


class BudgetOptions(NamedTuple):
    """Options of a budget.

    Attributes:
        of: the assistant whose overrides are counted.
        per_episode: how many of them an episode may have.
    """

    of: Options
    per_episode: Annotated[int, Field(ge=0)]


class BudgetMemory(NamedTuple):
    """What a budget remembers.

    Attributes:
        of: what the other rule remembers; 0 if that is nothing.
        episode: the episode in which overrides were spent.
        spent: overrides in that episode.
    """

    of: Any
    episode: int
    spent: int


@compiled
def nothing_spent(options: BudgetOptions, model: Model) -> BudgetMemory:
    """The memory before the first episode."""
    return BudgetMemory(start(options.of, model), 0, 0)


@compiled
def spend(memory: BudgetMemory, step: Step, options: BudgetOptions) -> BudgetMemory:
    """The memory after a step; an episode's budget ends with it."""
    before = memory.spent if step.episode == memory.episode else 0
    spent = before + 1 if step.overridden else before
    return BudgetMemory(observe(memory.of, step, options.of), step.episode, spent)


@register_assistant("budget", BudgetOptions, start=nothing_spent, observe=spend)
@compiled
def budget(
    situation: Situation, noise: Noise, options: BudgetOptions, memory: BudgetMemory
) -> Decision:
    """Do what the other rule does while the budget of the episode lasts, then nothing."""
    decision = decide(situation, noise, options.of, memory.of)
    spent = memory.spent if situation.episode == memory.episode else 0
    overrides = decision.action != situation.proposed or undoes(decision)
    if overrides and spent >= options.per_episode:
        return declined(decision, situation.proposed)
    return decision
