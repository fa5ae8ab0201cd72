"""Advice on a budget (Torrey and Taylor 2013; Amir, Kamar, Kolobov and Grosz 2016).

A teacher may give n pieces of advice in all; advice is the best action, and it is executed. With
the importance of a state I(s) = max_a Q*(s, a) - min_a Q*(s, a), a unit of the budget is spent

    early         in every step, from the first one on,
    alternating   in every m-th step,
    importance    if I(s) > t,
    mistakes      if I(s) > t and the proposal is not a best action,
    predictive    if I(s) > t and a mistake is predicted: the last proposal here was one,
    jointly       if I(s) > t and the learner, unsure what to do here, asks (Amir et al.).

Only with `mistakes` it is never spent on advice that the learner would not have needed.
"""

from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.assistants.registry import register_assistant
from qbumpers.choice import best_value, pick, worst_value
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Model, Noise, Situation, Step

_EARLY, _ALTERNATING, _IMPORTANCE, _MISTAKES, _PREDICTIVE = range(5)


class AdviceOnABudgetOptions(NamedTuple):
    """Options of advice on a budget.

    Attributes:
        when: in which steps advice is given.
        budget: how often, over all episodes of a learner.
        every: m of `alternating`, in steps.
        threshold: t, how important a state must be, in reward units; not of `early` and
            `alternating`.
        sure: share of the proposals in a state from which on a learner does not ask `jointly`.
    """

    when: Literal["early", "alternating", "importance", "mistakes", "predictive", "jointly"]
    budget: Annotated[int, Field(ge=0)]
    every: Annotated[int, Field(ge=1)] = 2
    threshold: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    sure: Annotated[float, Field(ge=0, le=1)] = 0.5


class Advised(NamedTuple):
    """What a teacher remembers.

    Attributes:
        spent: pieces of advice so far.
        steps: assisted steps so far.
        mistaken: bool [S], whether the last proposal in a state was no best action.
        proposals: int64 [S, A], how often each action was proposed.
    """

    spent: int
    steps: int
    mistaken: np.ndarray
    proposals: np.ndarray


@compiled
def nothing_known(options: AdviceOnABudgetOptions, model: Model) -> Advised:
    """The memory before the first episode."""
    proposals = np.zeros((model.states, model.actions), np.int64)
    return Advised(0, 0, np.zeros(model.states, np.bool_), proposals)


@compiled
def advises(
    state: int, values: np.ndarray, proposed: int, memory: Advised, options: AdviceOnABudgetOptions
) -> bool:
    """Whether a unit of the budget is spent on a step."""
    if memory.spent >= options.budget:
        return False
    if options.when == _EARLY:
        return True
    if options.when == _ALTERNATING:
        return memory.steps % options.every == 0
    best = best_value(values)
    if not best - worst_value(values) > options.threshold:
        return False
    if options.when == _IMPORTANCE:
        return True
    if options.when == _MISTAKES:
        return values[proposed] < best
    if options.when == _PREDICTIVE:
        return memory.mistaken[state]
    most = total = 0
    for action in range(len(values)):
        most = max(most, memory.proposals[state, action])
        total += memory.proposals[state, action]
    return total == 0 or most < options.sure * total


@compiled
def spend(memory: Advised, step: Step, options: AdviceOnABudgetOptions) -> Advised:
    """The memory after a step."""
    advised = advises(step.state, step.values, step.proposed, memory, options)
    memory.mistaken[step.state] = step.values[step.proposed] < best_value(step.values)
    memory.proposals[step.state, step.proposed] += 1
    spent = memory.spent + 1 if advised else memory.spent
    return Advised(spent, memory.steps + 1, memory.mistaken, memory.proposals)


@register_assistant(
    "advice-on-a-budget", AdviceOnABudgetOptions, start=nothing_known, observe=spend,
    needs=("states",),
)  # fmt: skip
@compiled
def advice_on_a_budget(
    situation: Situation, noise: Noise, options: AdviceOnABudgetOptions, memory: Advised
) -> Decision:
    """Execute a best action where advice helps most, until the budget of advice is spent.

    Once it is spent, falls off the cliff happen, and before that a trifle may be mended;
    `stochastic-q-bumpers` stops falls in any episode and lets trifles pass.
    """
    values, proposed = situation.values, situation.proposed
    best = best_value(values)
    if values[proposed] >= best or not advises(situation.state, values, proposed, memory, options):
        return Decision(proposed, 0.0)
    return Decision(pick(values, best, noise.tie), 1.0)
