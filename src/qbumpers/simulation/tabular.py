"""Simulated learners at tasks with a table: thousands of trials in seconds."""

from typing import Any

import numpy as np

from qbumpers.borrowing import read_only
from qbumpers.compilation import uncompiled
from qbumpers.decisions import Step
from qbumpers.learners import PowerLaw
from qbumpers.learners.forgetting import Practice, practice_for
from qbumpers.simulation.condition import Condition, compiled_learner, outcome_room, streams
from qbumpers.simulation.loops import (
    Assistance,
    LearnerStack,
    run_trials,
    run_trials_for_session,
)
from qbumpers.simulation.outcomes import Script, Simulation, Sinks, StateCounts, room_for_steps

REVISION: int = 1
"""Raised when trials give other numbers by anything that is no rule, learner or task: the loops,
the streams, the account of an episode, perception, motor noise, forgetting."""

PRECISION: str = "float64"


def run_block(condition: Condition, trials: range, seed: int) -> Simulation:
    """Simulate trials: `run_block` of `qbumpers.simulation.trials.Engine`."""
    outcomes = outcome_room(condition, len(trials))
    counts = StateCounts(*(np.zeros(condition.task.states, np.int64) for _ in range(3)))
    _call_loops(condition, trials, seed, Sinks(outcomes, counts, None, None))
    return Simulation(outcomes, counts)


def record(
    condition: Condition,
    trials: range,
    seed: int,
    script: Script | None,
    interpreted: bool = False,
) -> Step:
    """Every step of training of one trial: `record` of `qbumpers.simulation.trials.Engine`."""
    most = (condition.episodes + condition.retention) * condition.task.episode_limit
    steps = room_for_steps(most, np.zeros((), np.int64), condition.task.actions)
    sinks = Sinks(outcome_room(condition, 1), None, steps, script)
    used = _call_loops(condition, trials, seed, sinks, interpreted)
    return Step(*(array[:used] for array in steps))


def _call_loops(
    condition: Condition, trials: range, seed: int, sinks: Sinks, interpreted: bool = False
) -> int:
    assistant, learner = condition.assistant, condition.learner_type
    built_in = assistant.built_in and learner.built_in
    loops: Any = run_trials if built_in else run_trials_for_session
    if interpreted or not (assistant.compiled and learner.compiled):
        loops = uncompiled(run_trials)
    task = condition.task
    seen = None if task.seen is None else np.ascontiguousarray(task.seen, np.int64)
    return loops(
        condition.model(),
        Assistance(
            read_only(condition.values), read_only(condition.others), seen, condition.discount,
            assistant.numbers, (0,) * task.actions,
        ),
        LearnerStack(*compiled_learner(condition), *forgetting_of(condition)),
        streams(condition, trials, seed),
        condition.retention,
        sinks,
    )  # fmt: skip


def forgetting_of(condition: Condition) -> tuple[float | None, Practice | None]:
    """The share that is forgotten, and what is to be known of practice if that decides it.

    Args:
        condition: of a task with a table.

    Returns:
        None for each way in which nothing is forgotten.
    """
    forgetting, task = condition.forgetting, condition.task
    if isinstance(forgetting, PowerLaw):
        episodes = condition.episodes + condition.retention
        return None, practice_for(forgetting, task.states, task.actions, episodes)
    return float(forgetting) if forgetting else None, None
