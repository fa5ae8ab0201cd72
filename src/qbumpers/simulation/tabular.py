"""Simulated people at tabular tasks: thousands of trials in seconds."""

import itertools
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from qbumpers.assistants import Assistant
from qbumpers.compilation import uncompiled
from qbumpers.errors import RequestError
from qbumpers.learners import QLearner
from qbumpers.learners import perception as named_perception
from qbumpers.random_streams import episode_streams, trial_streams
from qbumpers.simulation.condition import Condition, make_condition
from qbumpers.simulation.loops import (
    Outcomes,
    Script,
    StateCounts,
    Steps,
    run_trials,
    run_trials_for_session,
)
from qbumpers.tasks import TabularTask
from qbumpers.values import QValues


class Simulation(NamedTuple):
    """What a simulation found.

    Attributes:
        outcomes: by trial and episode, arrays [T, E].
        counts: by state, over all trials.
    """

    outcomes: Outcomes
    counts: StateCounts

    @property
    def steps(self) -> int:
        """Steps that the learners took, with help and without."""
        return int(self.outcomes.assisted_length.sum() + self.outcomes.unassisted_length.sum())


def simulate(
    task: TabularTask,
    assistant: Assistant | str,
    *,
    values: QValues | None = None,
    learner: QLearner | None = None,
    perception: str = "transition",
    episodes: int = 100,
    retention: int = 0,
    common_random_numbers: bool = False,
    trials: int | range = 100,
    seed: int = 0,
    workers: int = 1,
) -> Simulation:
    """Simulate people who learn a task with an assistant's help (Section 4.2).

    A trial is one person: `episodes` times an assisted episode from which they learn, then a greedy
    one without help from which they do not. Equal arguments give equal numbers, whatever the
    number of workers and whichever trials are run together.

    Args:
        task: the task.
        assistant: an assistant, or the name of one that needs no options.
        values: Q* of the assistant; the exact solution where None.
        learner: the simulated person; where None, the paper's, with the task's discount.
        perception: name of a learner model, see `qbumpers.learners.PERCEPTIONS`.
        episodes: of a trial, at least 1.
        retention: further episodes in which the learner goes on without the assistant, each
            followed by a greedy one.
        common_random_numbers: whether trials of equal number draw equal numbers in every condition.
        trials: how many, at least 1; or which.
        seed: of the experiment, not negative.
        workers: threads.

    Returns:
        Outcomes by trial and episode, and counts by state.

    Raises:
        RequestError: as `make_condition`, and for a number of trials below 1 or a negative seed.
    """
    condition = make_condition(
        task,
        assistant,
        values=values,
        learner=learner,
        perception=perception,
        episodes=episodes,
        retention=retention,
        common_random_numbers=common_random_numbers,
    )
    return run(condition, trials=trials, seed=seed, workers=workers)


def run(
    condition: Condition, *, trials: int | range, seed: int = 0, workers: int = 1
) -> Simulation:
    """Simulate a condition; `simulate` says what the arguments mean."""
    which = _checked_trials(trials, seed)
    if workers < 1:
        raise RequestError(f"workers = {workers!r}; at least 1 is needed")
    ends = np.linspace(0, len(which), min(workers, len(which)) + 1).astype(int).tolist()
    ranges = [which[first:last] for first, last in itertools.pairwise(ends)]
    if len(ranges) == 1:
        simulations = [_run_block(condition, ranges[0], seed)]
    else:
        with ThreadPoolExecutor(workers) as pool:
            simulations = list(pool.map(lambda block: _run_block(condition, block, seed), ranges))
    outcomes = Outcomes(*map(np.concatenate, zip(*(s.outcomes for s in simulations), strict=True)))
    counts = StateCounts(
        *map(np.sum, zip(*(s.counts for s in simulations), strict=True), (0, 0, 0))
    )
    return Simulation(outcomes, counts)


def record(
    condition: Condition, *, trial: int = 0, seed: int = 0, script: Script | None = None
) -> Steps:
    """Every assisted step of one trial.

    Args:
        condition: what to simulate.
        trial: which trial.
        seed: of the experiment.
        script: proposals and noise to be played again, in place of a learner's and fresh noise;
            the trial ends with the script.

    Returns:
        Step records, arrays [N].

    Raises:
        RequestError: where the trial, the seed or the script is out of range.
    """
    if script is not None:
        _check_script(script, condition.task.actions)
    room = (condition.episodes + condition.retention) * condition.task.episode_limit
    steps = Steps(
        episode=np.zeros(room, np.int64),
        state=np.zeros(room, np.int64),
        next_state=np.zeros(room, np.int64),
        events=np.zeros(room, np.uint8),
        proposed=np.zeros(room, np.int64),
        executed=np.zeros(room, np.int64),
        credited=np.zeros(room, np.int64),
        overridden=np.zeros(room, np.bool_),
        probability=np.zeros(room),
        coin=np.zeros(room),
        tie=np.zeros(room),
        values=np.zeros((room, condition.task.actions)),
        projected_return=np.zeros(room),
        reward=np.zeros(room),
    )
    trials = _checked_trials(range(trial, trial + 1), seed)
    used = _call_loops(condition, trials, seed, _room(condition, 1), None, steps, script)
    return Steps(*(array[:used] for array in steps))


def _checked_trials(trials: int | range, seed: int) -> range:
    if not isinstance(seed, int) or seed < 0:
        raise RequestError(f"seed = {seed!r}; a whole number, not negative, is needed")
    which = range(trials) if isinstance(trials, int) else trials
    if not isinstance(which, range) or len(which) < 1 or min(which) < 0:
        raise RequestError(f"trials = {trials!r}; at least 1, or a range from 0 up, is needed")
    return which


def _check_script(script: Script, actions: int) -> None:
    lengths = {len(part) for part in script}
    if len(lengths) != 1:
        raise RequestError(
            f"script: its parts have lengths {sorted(lengths)}; one length is needed"
        )
    proposed = np.asarray(script.proposed)
    if len(proposed) and not 0 <= proposed.min() <= proposed.max() < actions:
        raise RequestError(f"script: proposed actions must lie in [0, {actions})")
    noise = np.concatenate([script.coin, script.tie])
    if not ((noise >= 0) & (noise < 1)).all():
        raise RequestError("script: coin and tie must lie in [0, 1)")


def _run_block(condition: Condition, trials: range, seed: int) -> Simulation:
    outcomes = _room(condition, len(trials))
    counts = StateCounts(*(np.zeros(condition.task.states, np.int64) for _ in range(3)))
    _call_loops(condition, trials, seed, outcomes, counts, None, None)
    return Simulation(outcomes, counts)


def _room(condition: Condition, trials: int) -> Outcomes:
    kinds = (np.float64, np.float64, np.int32, np.int32, np.int32, np.uint8, np.uint8)
    shape = (trials, condition.episodes + condition.retention)
    return Outcomes(*(np.zeros(shape, kind) for kind in kinds))


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
        condition.task.dynamics(),
        condition.values,
        condition.discount,
        condition.learner,
        named_perception(condition.perception),
        condition.assistant.options,
        _streams(condition, trials, seed),
        condition.retention,
        (0,) * condition.task.actions,
        np.empty_like(condition.values),
        outcomes,
        counts,
        steps,
        script,
    )


def _streams(condition: Condition, trials: range, seed: int) -> np.ndarray:
    if condition.common_random_numbers:
        # Each episode begins anew: episodes of other length before it change nothing.
        episodes = condition.episodes + condition.retention
        return episode_streams(seed, {"common_random_numbers": True}, trials, episodes)
    return trial_streams(seed, condition.learning(), trials)[:, None]
