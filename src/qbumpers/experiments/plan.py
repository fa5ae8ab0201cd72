"""An experiment made ready: checked as a whole, with nothing run yet."""

import time
from collections.abc import Iterable
from typing import NamedTuple

from qbumpers.errors import RequestError
from qbumpers.experiments.cells import Cell
from qbumpers.experiments.design import Experiment, NamedCondition
from qbumpers.random_streams import content_digest
from qbumpers.simulation import Condition, make_condition
from qbumpers.simulation import run as run_condition
from qbumpers.tasks import TabularTask, make_task
from qbumpers.values import TabularValues, learn_values, load_values, solve

_CALIBRATION = 0.01  # seconds that a timing should last, so that it means something


class Plan(NamedTuple):
    """An experiment made ready.

    Attributes:
        experiment: the design.
        task: its task.
        values: Q* of its assistants.
        named: the conditions as the experiment names them, each with the digest of its content.
        conditions: what the trials of each content need.
    """

    experiment: Experiment
    task: TabularTask
    values: TabularValues
    named: list[tuple[NamedCondition, str]]
    conditions: dict[str, Condition]


def make_plan(experiment: Experiment) -> Plan:
    """Check a whole experiment.

    Args:
        experiment: the design.

    Returns:
        The plan.

    Raises:
        RequestError: where the task, values, a learner or an assistant is wrong.
    """
    design = experiment.task
    task = make_task(
        design.name,
        discount=design.discount,
        episode_limit=design.episode_limit,
        **design.arguments,
    )
    values = _values(experiment.values, task)
    named, conditions = [], {}
    for each in experiment.conditions():
        condition = make_condition(
            task,
            each.assistant,
            values=values,
            learner=each.learner.learner(task.discount),
            perception=each.learner.perception,
            episodes=experiment.episodes,
            retention=experiment.retention,
            common_random_numbers=experiment.common_random_numbers,
        )
        content = content_digest([experiment.seed, condition.content()]).hex()
        named.append((each, content))
        conditions[content] = condition
    return Plan(experiment, task, values, named, conditions)


def _values(source: str, task: TabularTask) -> TabularValues:
    if source == "exact":
        return solve(task)
    if source == "q-learning":
        return learn_values(task)
    values = load_values(source)
    if values.task != task.name:
        raise RequestError(f"values = {source!r}: they are of task {values.task}, not {task.name}")
    return values


def estimated_seconds(plan: Plan, cells: Iterable[Cell]) -> dict[Cell, float]:
    """How long cells will take on one core, from a short calibration of each assistant's speed.

    Compiles the assistants' loops where they are not compiled yet.

    Args:
        plan: the experiment.
        cells: what is to be done.

    Returns:
        Seconds of each cell, the longest first: the order in which workers end together.
    """
    seconds: dict[str, float] = {}
    estimates = {}
    for cell in cells:
        condition = plan.conditions[cell.content]
        name = condition.assistant.name
        if name not in seconds:
            seconds[name] = _seconds_a_trial(condition, plan.experiment.seed)
        estimates[cell] = seconds[name] * cell.trials
    return dict(sorted(estimates.items(), key=lambda item: -item[1]))


def _seconds_a_trial(condition: Condition, seed: int) -> float:
    run_condition(condition, trials=1, seed=seed)
    trials = 1
    while True:
        begun = time.perf_counter()
        run_condition(condition, trials=trials, seed=seed)
        seconds = time.perf_counter() - begun
        if seconds > _CALIBRATION:
            return seconds / trials
        trials *= 4
