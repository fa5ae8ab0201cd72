"""What the filter of learner-aware bumpers believes, and the same rule with the truth in its place.

Part of `run_learner_aware.py`, which prints what comes of it.
"""

from typing import Annotated, Any, NamedTuple

import numpy as np
from numba import njit
from pydantic import Field

from qbumpers import Decision, Noise, Situation, Step, make_assistant, register_assistant
from qbumpers.assistants.learner_aware_bumpers import (
    Awareness,
    LearnerAwareBumpersOptions,
    aware,
    learner_aware_bumpers,
    unaware,
)
from qbumpers.assistants.mirrors import MIRRORS, PERCEPTIONS
from qbumpers.decisions import Model
from qbumpers.simulation import make_condition, record
from qbumpers.tasks import Task

TOLD = "told-learner-aware-bumpers"
_PER_PERCEPTION = MIRRORS // len(PERCEPTIONS)
_REST = 1e-9  # of the other perceptions: with none at all their mirrors could not be mixed


class ToldOptions(NamedTuple):
    """Options of learner-aware bumpers, and what they are told.

    Attributes:
        alpha: as of learner-aware bumpers.
        v_min: as of learner-aware bumpers.
        perception: place of the learner's in `PERCEPTIONS`.
    """

    alpha: Annotated[float, Field(ge=0)]
    v_min: float = 0.0
    perception: Annotated[int, Field(ge=0, lt=len(PERCEPTIONS))] = 0


@njit
def share_of(weights: np.ndarray, perception: int) -> float:
    """Weight [B, E, K] of the mirrors of a perception."""
    first, total = perception * _PER_PERCEPTION, 0.0
    for k in range(first, first + _PER_PERCEPTION):
        total += weights[:, :, k].sum()
    return total


@njit
def _told(memory: Awareness, perception: int) -> Awareness:
    weights = memory.mirrors.weights
    share = share_of(weights, perception)
    for k in range(MIRRORS):
        own = k // _PER_PERCEPTION == perception
        weights[:, :, k] *= (1 - _REST) / share if own else _REST / (1 - share)
    return memory


@njit
def _plain(options: ToldOptions) -> LearnerAwareBumpersOptions:
    return LearnerAwareBumpersOptions(options.alpha, options.v_min)


@njit
def told(options: ToldOptions, model: Model) -> Awareness:
    """The memory before the first episode: only how the learner takes overrides is known."""
    return _told(unaware(_plain(options), model), options.perception)


@njit
def still_told(memory: Awareness, step: Step, options: ToldOptions) -> Awareness:
    """The memory after a step, the weight of the other perceptions taken away again."""
    return _told(aware(memory, step, _plain(options)), options.perception)


@register_assistant(
    TOLD, ToldOptions, start=told, observe=still_told, needs=("states", "dynamics")
)  # fmt: skip
@njit
def told_learner_aware_bumpers(
    situation: Situation, noise: Noise, options: ToldOptions, memory: Awareness
) -> Decision:
    """Learner-aware bumpers that are told what overrides are to the learner."""
    return learner_aware_bumpers(situation, noise, _plain(options), memory)


@njit
def _follow(
    memory: Awareness, steps: Step, options: LearnerAwareBumpersOptions, perception: int,
    shares: np.ndarray,
) -> None:  # fmt: skip
    """Put the weight of a perception at the end of each episode into `shares` [episodes]."""
    for i in range(len(steps.episode)):
        step = Step(
            steps.episode[i], steps.state[i], steps.proposed[i], steps.executed[i],
            steps.undone[i], steps.credited[i], steps.overridden[i], steps.probability[i],
            steps.coin[i], steps.tie[i], steps.values[i], steps.projected_return[i],
            steps.reward[i], steps.next_state[i], steps.events[i],
        )  # fmt: skip
        memory = aware(memory, step, options)
        shares[step.episode] = share_of(memory.mirrors.weights, perception)


def shares_by_episode(
    task: Task, learner: Any, perception: str, alpha: float, trials: int, seed: int
) -> np.ndarray:
    """Weight of a learner's true perception at the end of each episode, float64 [T, episodes]."""
    assistant = make_assistant("learner-aware-bumpers", alpha=alpha)
    condition = make_condition(task, assistant, learner=learner, perception=perception)
    place, found = PERCEPTIONS.index(perception), np.zeros((trials, condition.episodes))
    for trial in range(trials):
        steps = record(condition, trial=trial, seed=seed)
        memory = unaware(assistant.numbers, condition.model())
        _follow(memory, steps, assistant.numbers, place, found[trial])
    return found
