"""Learner-aware bumpers without a model of the task.

The same rule, but it does not know where actions lead: it remembers the last outcomes of each, and
takes them in the place of the expectation. Of an action that was never executed it believes that
the learner will be as far from Q* after it as it is here.
"""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.assistants.learner_aware_bumpers import Outlook, mirrored, weighed
from qbumpers.assistants.mirrors import (
    MIRRORS,
    Mirrors,
    blank_mirrors,
)
from qbumpers.assistants.registry import register_assistant
from qbumpers.assistants.stochastic_q_bumpers import check_floor
from qbumpers.borrowing import scratch
from qbumpers.choice import best_value
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Model, Noise, Situation, Step
from qbumpers.tasks.dynamics import TERMINATED

_REMEMBERED = 10  # outcomes of an action
_UNKNOWN = 0.5  # probability that an action that was never executed leads back to its state


class ModelFreeLearnerAwareBumpersOptions(NamedTuple):
    """Options of learner-aware bumpers without a model.

    Attributes:
        alpha: as of learner-aware bumpers.
        v_min: as of learner-aware bumpers.
    """

    alpha: Annotated[float, Field(ge=0, allow_inf_nan=False)]
    v_min: Annotated[float, Field(allow_inf_nan=False)] = 0.0


class Experience(NamedTuple):
    """What the assistant remembers of a learner, and of the task.

    Attributes:
        mirrors: what the learner may have learned.
        start_value: V*(s_0) of `episode`.
        episode: that of the last step.
        discount: gamma of the task.
        seen: int64 [S, A], how often an action was executed.
        next_state: int64 [S, A, N], where it led the last times; -1 if that was the end.
        reward: float64 [S, A, N].
    """

    mirrors: Mirrors
    start_value: float
    episode: int
    discount: float
    seen: np.ndarray
    next_state: np.ndarray
    reward: np.ndarray


@compiled
def no_experience(options: ModelFreeLearnerAwareBumpersOptions, model: Model) -> Experience:
    """The memory before the first episode: nothing is known of the learner or the task."""
    shape = (model.states, model.actions, _REMEMBERED)
    return Experience(
        blank_mirrors(model.states, model.actions), 0.0, -1, model.discount,
        np.zeros((model.states, model.actions), np.int64), np.zeros(shape, np.int64),
        np.zeros(shape),
    )  # fmt: skip


@compiled
def experienced(
    memory: Experience, step: Step, options: ModelFreeLearnerAwareBumpersOptions
) -> Experience:
    """The memory after a step."""
    start_value = mirrored(memory, step, options.v_min)
    state, executed = step.state, step.executed
    place = memory.seen[state, executed] % _REMEMBERED
    memory.next_state[state, executed, place] = -1 if step.events & TERMINATED else step.next_state
    memory.reward[state, executed, place] = step.reward
    memory.seen[state, executed] += 1
    return Experience(
        memory.mirrors, start_value, step.episode, memory.discount, memory.seen, memory.next_state,
        memory.reward,
    )  # fmt: skip


@compiled
def recalled(memory: Experience, state: int, values: np.ndarray) -> Outlook:
    """Where actions led, by what is remembered of them.

    Args:
        memory: outcomes that the assistant has seen.
        state: where the actions are.
        values: float64 [A], Q*(s, .).
    """
    best, ideal = memory.mirrors.best, best_value(values)
    targets, back = scratch((len(values), MIRRORS), 0.0), scratch(len(values), 0.0)
    for action in range(len(values)):
        times = min(memory.seen[state, action], _REMEMBERED)
        if times == 0:
            back[action] = _UNKNOWN
            for k in range(MIRRORS):
                targets[action, k] = values[action] + memory.discount * (best[state, k] - ideal)
        for place in range(times):
            following = memory.next_state[state, action, place]
            reward = memory.reward[state, action, place]
            for k in range(MIRRORS):
                future = 0.0 if following < 0 else memory.discount * best[following, k]
                targets[action, k] += (reward + future) / times
            if following == state:
                back[action] += 1 / times
    return Outlook(targets, back)


@register_assistant(
    "model-free-learner-aware-bumpers", ModelFreeLearnerAwareBumpersOptions, start=no_experience,
    observe=experienced, check_start=check_floor, needs=("states",), revision=2,
)  # fmt: skip
@compiled
def model_free_learner_aware_bumpers(
    situation: Situation,
    noise: Noise,
    options: ModelFreeLearnerAwareBumpersOptions,
    memory: Experience,
) -> Decision:
    """As `learner-aware-bumpers`, by experience of the task in the place of its transitions.

    As there, a mistake that teaches is let happen, which `stochastic-q-bumpers` does by chance or
    never.
    """
    if situation.values[situation.proposed] >= best_value(situation.values):
        return Decision(situation.proposed, 0.0)
    outlook = recalled(memory, situation.state, situation.values)
    return weighed(situation, noise, options.alpha, options.v_min, memory.mirrors, outlook)
