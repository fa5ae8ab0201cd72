"""Learner-aware bumpers: the help that misleads a learner least, and the lessons that pay.

An override teaches a learner who does not notice it that its own action led where the executed one
did. So the rule keeps `qbumpers.assistants.mirrors` of the learner, with probabilities w_k, and
looks ahead at what each would believe. A best action is executed. A proposal a that is not best is

1. a lesson, executed whatever it costs in this episode, if that is less than it is worth,

       Q*(s, e) - Q*(s, a) < alpha sum of w_k / rate_k (H_k(e) - H_k(a)),

   where H_k(e) is what the learner's own choices in s will cost once it has learned from e, and
   1 / rate_k how many updates that lasts; a choice that leads back to s is made again, so its cost
   counts up to 20 times more;
2. else let pass with probability p min(1, |1 - alpha^2|) (1 - f(x(a))): a trifle that happens
   misleads nobody. p is the probability that an override would be taken for the learner's own
   doing; f and x are those of Stochastic Q Bumpers, x(e) = (V*(s_0) - G(s, e)) / (alpha (V*(s_0) -
   v_min)). Near alpha = 1 enough happens by 3; with a still lower floor the learner is left alone;
3. else replaced by e, of the better actions within the floor, x(e) < 1, that with the least
   C(e) - 0.1 Q*(s, e), C the credit that a transition learner will give its own action: what it
   proposed looks as bad as is safe. The proposal itself is among them if x(a) < 0.5: what remains
   of the floor is for overrides to come. If there is none, e is a best action.

Once the learner hardly learns, its expected rate below 0.1, nothing passes by 2, or by 3.

alpha may exceed 1: then the floor lies below `v_min`.
"""

from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.assistants.mirrors import (
    LEARNS,
    MIRRORS,
    Mirrors,
    Reading,
    between_episodes,
    blank_mirrors,
    lasting_harm,
    misled_credit,
    read,
    reflect,
)
from qbumpers.assistants.registry import register_assistant
from qbumpers.assistants.stochastic_q_bumpers import check_floor, override_probability
from qbumpers.borrowing import scratch
from qbumpers.choice import best_value, pick
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Model, Noise, Situation, Step, projected_return
from qbumpers.tasks.dynamics import ENDS, TERMINATED, Dynamics

_LEANING = 0.1  # weight of the value against the credit, so that of equal credits the best wins
_SURE = 0.999  # p_max of the logistic
_SPENDABLE = 0.5  # of the floor, by a proposal that no override would make look worse
_REPEATS = 20.0  # how often a choice that leads back to its state is made again


class LearnerAwareBumpersOptions(NamedTuple):
    """Options of learner-aware bumpers.

    Attributes:
        alpha: how far the projected return may fall, from V*(s_0) towards `v_min`, and what lessons
            are worth; smaller is more support, above 1 the return may fall below `v_min`.
        v_min: a lower bound on the return of an episode, below V*(s_0).
    """

    alpha: Annotated[float, Field(ge=0, allow_inf_nan=False)]
    v_min: Annotated[float, Field(allow_inf_nan=False)] = 0.0


class Awareness(NamedTuple):
    """What the assistant remembers of a learner.

    Attributes:
        mirrors: what it may have learned.
        start_value: V*(s_0) of `episode`.
        episode: that of the last step.
        discount: gamma of the task.
        dynamics: transitions of the task.
    """

    mirrors: Mirrors
    start_value: float
    episode: int
    discount: float
    dynamics: Dynamics


@compiled
def unaware(options: LearnerAwareBumpersOptions, model: Model) -> Awareness:
    """The memory before the first episode: nothing is known of the learner."""
    mirrors = blank_mirrors(model.states, model.actions)
    return Awareness(mirrors, 0.0, -1, model.discount, model.dynamics)


@compiled
def mirrored(memory: Any, step: Step, v_min: float) -> float:
    """Let the mirrors of an assistant follow a step.

    Args:
        memory: of either rule, as it was before the step; its mirrors change.
        step: what happened.
        v_min: of the rule's options, in reward units.

    Returns:
        V*(s_0) of the step's episode, in reward units.
    """
    start_value = memory.start_value
    if step.episode != memory.episode:
        start_value = best_value(step.values)
    reflect(memory.mirrors, step, memory.discount, start_value - v_min)
    if step.events & ENDS:
        between_episodes(memory.mirrors)
    return start_value


@compiled
def aware(memory: Awareness, step: Step, options: LearnerAwareBumpersOptions) -> Awareness:
    """The memory after a step."""
    start_value = mirrored(memory, step, options.v_min)
    return Awareness(
        memory.mirrors, start_value, step.episode, memory.discount, memory.dynamics
    )  # fmt: skip


class Outlook(NamedTuple):
    """Where the actions in a state lead.

    Attributes:
        targets: float64 [A, K], what each is worth to each mirror.
        back: float64 [A], probability that it leads back to the same state.
    """

    targets: np.ndarray
    back: np.ndarray


@compiled
def foreseen(memory: Awareness, state: int) -> Outlook:
    """Where actions lead by the transitions of the task."""
    dynamics, best = memory.dynamics, memory.mirrors.best
    targets, back = scratch((dynamics.actions, MIRRORS), 0.0), scratch(dynamics.actions, 0.0)
    for action in range(dynamics.actions):
        first, before = (state * dynamics.actions + action) * dynamics.outcomes, 0.0
        for index in range(first, first + dynamics.outcomes):
            chance, following = dynamics.cumulative[index] - before, dynamics.next_state[index]
            before = dynamics.cumulative[index]
            lasts = 0.0 if dynamics.events[index] & TERMINATED else 1.0
            for k in range(MIRRORS):
                future = lasts * memory.discount * best[following, k]
                targets[action, k] += chance * (dynamics.reward[index] + future)
            if following == state:
                back[action] += lasts * chance
    return Outlook(targets, back)


@compiled
def lost_with(situation: Situation, action: int) -> float:
    """Return that the episode has lost if an action is executed, in reward units."""
    value = situation.values[action]
    return situation.start_value - projected_return(situation.earned, situation.discount, value)


@compiled
def least_misleading(
    situation: Situation, noise: Noise, allowed: float, reading: Reading, targets: np.ndarray
) -> int:
    """What misleads least of the better actions within the floor, else a best action.

    The proposal is one of them if it costs little of the floor and the learner still learns.
    """
    values, proposed = situation.values, situation.proposed
    merits = scratch(len(values), -np.inf)
    for action in range(len(values)):
        limit = allowed if values[action] > values[proposed] else -np.inf
        if action == proposed and reading.rate >= LEARNS:
            limit = _SPENDABLE * allowed
        if lost_with(situation, action) < limit:
            credit = misled_credit(reading.shares, targets[action])
            merits[action] = _LEANING * values[action] - credit
    best = best_value(merits)
    if best == -np.inf:
        return pick(values, best_value(values), noise.tie)
    return pick(merits, best, noise.tie)


@compiled
def is_lesson(
    situation: Situation, action: int, alpha: float, loss: float, mirrors: Mirrors,
    shares: np.ndarray, outlook: Outlook,
) -> bool:  # fmt: skip
    """Whether a mistake teaches more than it costs.

    Args:
        situation: in which the mistake is proposed.
        action: the override in its place.
        alpha: of the rule's options.
        loss: what an episode may lose, in reward units.
        mirrors: what the learner may believe.
        shares: float64 [K], their probabilities.
        outlook: where the actions lead.
    """
    values, proposed, state = situation.values, situation.proposed, situation.state
    targets, cost = outlook.targets, values[action] - values[proposed]
    best, harms = best_value(values), scratch(len(values), 0.0)
    for choice in range(len(values)):
        harms[choice] = (best - values[choice]) * (1 + _REPEATS * outlook.back[choice])
    helped = lasting_harm(mirrors, shares, state, proposed, action, targets[action], harms, loss)
    if cost >= alpha * helped:  # no lesson does more than to take all harm away
        return False
    taught = lasting_harm(
        mirrors, shares, state, proposed, proposed, targets[proposed], harms, loss
    )
    return cost < alpha * (helped - taught)


@compiled
def weighed(
    situation: Situation, noise: Noise, alpha: float, v_min: float, mirrors: Mirrors,
    outlook: Outlook,
) -> Decision:  # fmt: skip
    """The decision about a proposal that is not best.

    Args:
        situation: in which it is proposed.
        noise: decides whether a trifle passes, and among equal actions.
        alpha: of the rule's options.
        v_min: of the rule's options, in reward units.
        mirrors: what the learner may believe.
        outlook: where the actions lead.
    """
    proposed, loss = situation.proposed, situation.start_value - v_min
    allowed = alpha * loss
    reading = read(mirrors, situation.state, proposed, loss)
    action = least_misleading(situation, noise, allowed, reading, outlook.targets)
    if action == proposed:
        return Decision(proposed, 0.0)
    if is_lesson(situation, action, alpha, loss, mirrors, reading.shares, outlook):
        return Decision(proposed, 0.0)
    lenient = min(1.0, abs(1 - alpha * alpha)) if reading.rate >= LEARNS else 0.0
    due = override_probability(lost_with(situation, proposed), allowed, _SURE, True)
    probability = 1 - reading.unaware * lenient * (1 - due)
    return Decision(action if noise.coin < probability else proposed, probability)


@register_assistant(
    "learner-aware-bumpers", LearnerAwareBumpersOptions, start=unaware, observe=aware,
    check_start=check_floor, needs=("states", "dynamics"), revision=2,
)  # fmt: skip
@compiled
def learner_aware_bumpers(
    situation: Situation, noise: Noise, options: LearnerAwareBumpersOptions, memory: Awareness
) -> Decision:
    """Replace a proposal by what misleads the learner least; let it make mistakes that teach.

    A learner that would go on stepping off a cliff does so once, below the floor;
    `stochastic-q-bumpers` never lets it there, whatever it goes on believing.
    """
    if situation.values[situation.proposed] >= best_value(situation.values):
        return Decision(situation.proposed, 0.0)
    outlook = foreseen(memory, situation.state)
    return weighed(situation, noise, options.alpha, options.v_min, memory.mirrors, outlook)
