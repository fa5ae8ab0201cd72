"""Simulated people at tabular tasks: thousands of trials in seconds."""

from typing import Any, cast

import numpy as np

from qbumpers.compilation import uncompiled
from qbumpers.learners import perception as named_perception
from qbumpers.simulation.condition import Condition, outcome_room, streams
from qbumpers.simulation.loops import run_trials, run_trials_for_session
from qbumpers.simulation.outcomes import Outcomes, Script, Simulation, StateCounts, Steps
from qbumpers.tasks import TabularTask


def run_block(condition: Condition, trials: range, seed: int) -> Simulation:
    """Simulate trials of a condition, one after another in compiled code."""
    outcomes = outcome_room(condition, len(trials))
    states = cast(TabularTask, condition.task).states
    counts = StateCounts(*(np.zeros(states, np.int64) for _ in range(3)))
    _call_loops(condition, trials, seed, outcomes, counts, None, None)
    return Simulation(outcomes, counts)


def record(condition: Condition, trials: range, seed: int, script: Script | None) -> Steps:
    """Every assisted step of one trial; `qbumpers.simulation.record` says more."""
    most = (condition.episodes + condition.retention) * condition.task.episode_limit
    steps = Steps(
        episode=np.zeros(most, np.int64),
        state=np.zeros(most, np.int64),
        next_state=np.zeros(most, np.int64),
        events=np.zeros(most, np.uint8),
        proposed=np.zeros(most, np.int64),
        executed=np.zeros(most, np.int64),
        credited=np.zeros(most, np.int64),
        overridden=np.zeros(most, np.bool_),
        probability=np.zeros(most),
        coin=np.zeros(most),
        tie=np.zeros(most),
        values=np.zeros((most, condition.task.actions)),
        projected_return=np.zeros(most),
        reward=np.zeros(most),
    )
    used = _call_loops(condition, trials, seed, outcome_room(condition, 1), None, steps, script)
    return Steps(*(array[:used] for array in steps))


def _call_loops(
    condition: Condition,
    trials: range,
    seed: int,
    outcomes: Outcomes,
    counts: StateCounts | None,
    steps: Steps | None,
    script: Script | None,
) -> int:
    rule = condition.assistant.rule
    loops: Any = run_trials if rule.built_in else run_trials_for_session
    if not rule.compiled:
        loops = uncompiled(run_trials)
    return loops(
        cast(TabularTask, condition.task).dynamics(),
        condition.values,
        condition.discount,
        condition.learner,
        named_perception(condition.perception),
        condition.assistant.options,
        streams(condition, trials, seed),
        condition.retention,
        (0,) * condition.task.actions,
        np.empty_like(condition.values),
        outcomes,
        counts,
        steps,
        script,
    )
