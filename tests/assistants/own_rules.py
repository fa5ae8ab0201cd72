"""Rules as a user would write them."""

from typing import Annotated, NamedTuple

from pydantic import Field

from qbumpers.choice import best_value, pick
from qbumpers.decisions import Decision


class NoOptions(NamedTuple):
    pass


def guide(situation, noise, options):
    """Maximal assistance, written again."""
    best = best_value(situation.values)
    if situation.values[situation.proposed] >= best:
        return Decision(situation.proposed, 0.0)
    return Decision(pick(situation.values, best, noise.tie), 1.0)


def guide_with_a_dictionary(situation, noise, options):
    """The same decisions by means that Numba cannot compile."""
    by_value = {}
    for action, value in enumerate(situation.values.tolist()):
        by_value.setdefault(value, []).append(action)
    best = by_value[max(by_value)]
    if situation.proposed in best:
        return Decision(situation.proposed, 0.0)
    return Decision(best[int(noise.tie * len(best))], 1.0)


def watch(situation, noise, options):
    """No assistance, written again."""
    return Decision(situation.proposed, 0.0)


class BudgetOptions(NamedTuple):
    budget: Annotated[int, Field(ge=0)]


def full_budget(options, model):
    return options.budget


def spend(memory, step, options):
    return memory - step.overridden


def guide_within_budget(situation, noise, options, memory):
    """Maximal assistance until the advice is used up."""
    best = best_value(situation.values)
    if memory <= 0 or situation.values[situation.proposed] >= best:
        return Decision(situation.proposed, 0.0)
    return Decision(pick(situation.values, best, noise.tie), 1.0)


def no_sign(options, model):
    return 0


def follow_signs(situation, noise, options, memory):
    """Half of the time, the action that the numbers of the last places and this one add up to."""
    pointed = (situation.state + memory) % len(situation.values)
    return Decision(pointed if noise.coin < 0.5 else situation.proposed, 0.5)


def remember_signs(memory, step, options):
    return 3 * step.state + 5 * step.next_state


class TakeBackOptions(NamedTuple):
    tolerance: float = 1.5


def take_back(situation, noise, options):
    """Half of the proposals that give up more than the tolerance are undone."""
    best = best_value(situation.values)
    if situation.values[situation.proposed] >= best - options.tolerance:
        return Decision(situation.proposed, 0.0, False)
    return Decision(situation.proposed, 0.5, noise.coin < 0.5)


ABOVE_THE_GOAL, DOWN = 35, 2
"""State and action of Cliff Walking: this step arrives."""


def never_arrive(situation, noise, options):
    """Undo the step to the goal of Cliff Walking."""
    if situation.state == ABOVE_THE_GOAL and situation.proposed == DOWN:
        return Decision(situation.proposed, 1.0, True)
    return Decision(situation.proposed, 0.0, False)
