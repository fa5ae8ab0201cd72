"""How long the pieces of learner-aware bumpers take; part of `run_learner_aware.py`."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from qbumpers import Situation, Step, make_assistant, solve
from qbumpers.assistants.learner_aware_bumpers import Awareness, foreseen, is_lesson, unaware
from qbumpers.assistants.mirrors import read, reflect
from qbumpers.simulation import make_condition, record
from qbumpers.tasks import cliff_walking

_LOSS, _TIMES, _ROUNDS = 87.0, 20_000, 5
_ABOVE_THE_CLIFF, _DOWN, _UP = 25, 2, 0


@njit
def _reflecting(memory: Awareness, step: Step, situation: Situation, times: int) -> float:
    for _ in range(times):
        reflect(memory.mirrors, step, memory.discount, _LOSS)
    return memory.mirrors.best[0, 0]


@njit
def _reading(memory: Awareness, step: Step, situation: Situation, times: int) -> float:
    total = 0.0
    for _ in range(times):
        total += read(memory.mirrors, situation.state, situation.proposed, _LOSS).rate
    return total


@njit
def _foreseeing(memory: Awareness, step: Step, situation: Situation, times: int) -> float:
    total = 0.0
    for _ in range(times):
        total += foreseen(memory, situation.state).targets[0, 0]
    return total


@njit
def _weighing_lessons(memory: Awareness, step: Step, situation: Situation, times: int) -> float:
    total, outlook = 0.0, foreseen(memory, situation.state)
    shares = read(memory.mirrors, situation.state, situation.proposed, _LOSS).shares
    for _ in range(times):
        total += is_lesson(situation, _UP, 100.0, _LOSS, memory.mirrors, shares, outlook)
    return total


PIECES: dict[str, Callable[..., float]] = {
    "the mirrors and the filter learn from a step": _reflecting,
    "a proposal is read": _reading,
    "it is looked ahead where the actions lead": _foreseeing,
    "a lesson is weighed": _weighing_lessons,
}
"""The first once per assisted step, the others once per proposal that is not best."""


def nanoseconds() -> dict[str, float]:
    """Of processor time that each piece takes once, the least of some rounds."""
    assistant = make_assistant("learner-aware-bumpers", alpha=0.2)
    condition = make_condition(cliff_walking(), assistant)
    steps, memory = record(condition), unaware(assistant.numbers, condition.model())
    step = Step(*(column[0] for column in steps))
    values: Any = np.asarray(solve(cliff_walking()).table)[_ABOVE_THE_CLIFF]
    situation = Situation(
        state=_ABOVE_THE_CLIFF, values=values, others=np.zeros((0, len(values))), proposed=_DOWN,
        earned=0.0, discount=1.0, start_value=_LOSS, episode=0, step=0,
    )  # fmt: skip
    found = {}
    for name, repeated in PIECES.items():
        repeated(memory, step, situation, 1)  # compiles
        rounds = []
        for _ in range(_ROUNDS):
            begin = time.process_time()
            repeated(memory, step, situation, _TIMES)
            rounds.append((time.process_time() - begin) / _TIMES * 1e9)
        found[name] = min(rounds)
    return found
