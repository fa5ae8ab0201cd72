"""Learner-aware bumpers: the help that misleads a learner least, within the bumpers' floor.

An override teaches a learner who does not notice it that its own action led where the executed one
did. So with the floor of Stochastic Q Bumpers, x(e) = (V*(s_0) - G(s, e)) / (alpha (V*(s_0) - v_min)),
the rule keeps `qbumpers.assistants.mirrors` of the learner, with weights w_k, and looks ahead at the
credit that the proposal a would get if e were executed,

    C(e) = sum of w_k E[r + gamma (1 - terminal) max_b M_k(s', b) | s, e] over transition mirrors k.

1. A best action is executed.
2. Of the better actions within the floor, x(e) < 1, the candidate is that with the least
   C(e) - 0.1 Q*(s, e): what the learner proposed gets the worst credit that is safe.
3. The proposal is executed if it lies within the floor and its own credit is no larger.
4. A mistake that the learner means, and that it has hardly experienced, is a lesson: it is executed
   whatever the floor says. One fall that is meant settles what overriding would leave a tie.
5. Else the candidate is executed, and a best action if there is none.

N(s, a), what the learner has experienced of an action, grows by 1 if it is executed and fades when
an override is credited in its place. alpha may exceed 1: help is then rarer than v_min asks for.
"""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.assistants.mirrors import (
    Mirrors,
    Reading,
    between_episodes,
    blank_mirrors,
    misled_value,
    observant_share,
    read,
    reflect,
    transition_rate,
    transition_share,
)
from qbumpers.assistants.registry import register_assistant
from qbumpers.assistants.stochastic_q_bumpers import check_floor
from qbumpers.choice import best_value, pick
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Model, Noise, Situation, Step, projected_return
from qbumpers.tasks.dynamics import ENDS, TERMINATED, Dynamics

_LEANING = 0.1  # weight of the value against the credit, so that of equal credits the best wins
_MEANT = 0.7  # a lesson: the proposal is meant with at least this probability
_NOVEL = 0.5  # a lesson: the learner has experienced the action less often than this


class LearnerAwareBumpersOptions(NamedTuple):
    """Options of learner-aware bumpers.

    Attributes:
        alpha: how far the projected return may fall, from V*(s_0) towards `v_min`; smaller is more
            support, above 1 it may fall below `v_min`.
        v_min: a lower bound on the return of an episode, below V*(s_0).
    """

    alpha: Annotated[float, Field(ge=0, allow_inf_nan=False)]
    v_min: Annotated[float, Field(allow_inf_nan=False)] = 0.0


class Awareness(NamedTuple):
    """What the assistant remembers of a learner.

    Attributes:
        mirrors: what it may have learned.
        experience: float64 [S, A], how often it has experienced an action as its own doing.
        start_value: V*(s_0) of `episode`.
        episode: that of the last step.
        discount: gamma of the task.
        dynamics: transitions of the task.
    """

    mirrors: Mirrors
    experience: np.ndarray
    start_value: float
    episode: int
    discount: float
    dynamics: Dynamics


@compiled
def unaware(options: LearnerAwareBumpersOptions, model: Model) -> Awareness:
    """The memory before the first episode: nothing is known of the learner."""
    return Awareness(
        blank_mirrors(model.states, model.actions), np.zeros((model.states, model.actions)),
        0.0, -1, model.discount, model.dynamics,
    )  # fmt: skip


@compiled
def aware(memory: Awareness, step: Step, options: LearnerAwareBumpersOptions) -> Awareness:
    """The memory after a step."""
    start_value = memory.start_value
    if step.episode != memory.episode:
        start_value = best_value(step.values)
    shares = reflect(memory.mirrors, step, memory.discount, start_value - options.v_min)
    experienced(memory.experience, step, shares)
    if step.events & ENDS:
        between_episodes(memory.mirrors)
    return Awareness(
        memory.mirrors, memory.experience, start_value, step.episode, memory.discount,
        memory.dynamics,
    )  # fmt: skip


@compiled
def experienced(experience: np.ndarray, step: Step, shares: np.ndarray) -> None:
    """Count what a learner experiences of its actions, float64 [S, A], changed in place."""
    if step.proposed == step.executed:
        experience[step.state, step.proposed] += 1
    else:
        experience[step.state, step.proposed] *= 1 - transition_rate(shares)
        experience[step.state, step.executed] += observant_share(shares)


@compiled
def credits(memory: Awareness, state: int, shares: np.ndarray) -> np.ndarray:
    """C, float64 [A]: what a transition learner would believe of its proposal if e were executed.

    In reward units, times the probability that it is a transition learner.
    """
    dynamics, found = memory.dynamics, np.zeros(memory.experience.shape[1])
    noticed = transition_share(shares)
    for action in range(len(found)):
        first, before = (state * dynamics.actions + action) * dynamics.outcomes, 0.0
        for index in range(first, first + dynamics.outcomes):
            credit = noticed * dynamics.reward[index]
            if not dynamics.events[index] & TERMINATED:
                following = dynamics.next_state[index]
                credit += memory.discount * misled_value(memory.mirrors, shares, following)
            found[action] += (dynamics.cumulative[index] - before) * credit
            before = dynamics.cumulative[index]
    return found


@compiled
def within_floor(situation: Situation, action: int, options: LearnerAwareBumpersOptions) -> bool:
    """Whether the projected return after an action stays above the floor."""
    reached = projected_return(situation.earned, situation.discount, situation.values[action])
    room = options.alpha * (situation.start_value - options.v_min)
    return situation.start_value - reached < room


@compiled
def weighed(
    situation: Situation, noise: Noise, options: LearnerAwareBumpersOptions, reading: Reading,
    credit: np.ndarray, experience: float,
) -> Decision:  # fmt: skip
    """The decision about a proposal that is not best: steps 2 to 5.

    Args:
        situation: of the proposal.
        noise: chooses among equal actions.
        options: of the rule.
        reading: what the proposal says of the learner.
        credit: float64 [A], see `credits`.
        experience: N of the proposal.
    """
    values, proposed = situation.values, situation.proposed
    merit = _LEANING * values - credit
    allowed, best = np.full(len(values), -np.inf), -np.inf
    for action in range(len(values)):
        if values[action] > values[proposed] and within_floor(situation, action, options):
            allowed[action] = merit[action]
            best = max(best, merit[action])
    if best > -np.inf and merit[proposed] >= best and within_floor(situation, proposed, options):
        return Decision(proposed, 0.0)
    if experience < _NOVEL and reading.meant > _MEANT:
        return Decision(proposed, 0.0)
    if best > -np.inf:
        return Decision(pick(allowed, best, noise.tie), 1.0)
    return Decision(pick(values, best_value(values), noise.tie), 1.0)


@register_assistant(
    "learner-aware-bumpers", LearnerAwareBumpersOptions, start=unaware, observe=aware,
    check_start=check_floor, needs=("states", "dynamics"),
)  # fmt: skip
@compiled
def learner_aware_bumpers(
    situation: Situation, noise: Noise, options: LearnerAwareBumpersOptions, memory: Awareness
) -> Decision:
    """Replace a proposal by what misleads the learner least; let it make a mistake that it means.

    A learner that means to step off a cliff does so once, below the floor, and is not allowed to
    again; `stochastic-q-bumpers` never lets it, or by chance, whether it would learn from it or not.
    """
    values, proposed, state = situation.values, situation.proposed, situation.state
    if values[proposed] >= best_value(values):
        return Decision(proposed, 0.0)
    loss = situation.start_value - options.v_min
    reading = read(memory.mirrors, state, proposed, loss)
    credit = credits(memory, state, reading.shares)
    experience = memory.experience[state, proposed]
    return weighed(situation, noise, options, reading, credit, experience)
