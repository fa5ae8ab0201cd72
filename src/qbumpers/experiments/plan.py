"""An experiment made ready: checked as a whole, with nothing run yet."""

import dataclasses
import math
import time
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np

from qbumpers.errors import RequestError
from qbumpers.experiments.cells import Cell
from qbumpers.experiments.design import Experiment, NamedCondition
from qbumpers.experiments.identity import Identity, identity_of
from qbumpers.experiments.learner_designs import RecordedLearner
from qbumpers.experiments.record import Record, RecordedCondition, file_name, recorded
from qbumpers.experts import check_expert
from qbumpers.random_streams import content_digest
from qbumpers.simulation import Card, Condition, check_for_card, made_by, make_condition
from qbumpers.simulation import run as run_condition
from qbumpers.tasks import Task
from qbumpers.values import (
    NetworkValues,
    TabularValues,
    learn_values,
    load_values,
    shipped_values,
    solve,
)

_CALIBRATION, _DEEP_CALIBRATION = 0.01, 0.3  # seconds that a timing should last to mean something
_MOST_ON_CARD, _MORE_ON_CARD = 1 << 16, 16  # trials of a calibration on a card, and steps to them
_CALIBRATION_ON_CARD = 0.1  # seconds
_SHORT, _USUAL = 50, 250  # steps of an episode: of a calibration at most; assumed of a trial


_SOURCES: dict[str, Callable[[Task], TabularValues | NetworkValues]] = {
    "exact": solve,
    "q-learning": learn_values,
    "expert": shipped_values,
}
SOURCES = tuple(_SOURCES)
"""What `values` of an experiment may say in place of a path."""


class Plan(NamedTuple):
    """An experiment made ready.

    Attributes:
        experiment: what it was made from.
        task: what its learners learn.
        values: Q* of its assistants.
        named: the conditions as the experiment names them, each with the digest of its content.
        conditions: what the trials of each content need.
        record: what an output folder notes of the conditions.
        files: what is in the files that options and settings name, by the names under which an
            output folder keeps it.
        card: the graphics card that simulates; None for processors.
    """

    experiment: Experiment
    task: Task
    values: TabularValues | NetworkValues
    named: list[tuple[NamedCondition, str]]
    conditions: dict[str, Condition]
    record: Record
    files: dict[str, np.ndarray]
    card: Card | None = None


def make_plan(
    experiment: Experiment,
    values: TabularValues | NetworkValues | None = None,
    card: Card | None = None,
) -> Plan:
    """Check a whole experiment.

    Args:
        experiment: what it was made from.
        values: Q* in place of what the experiment names: what an output folder keeps of its run.
        card: the graphics card that is to simulate; processors if None.

    Returns:
        The plan.

    Raises:
        RequestError: if the task, values, a learner or an assistant is wrong, or not for a card.

    Warns:
        ExpertWarning: if the values of a network are no better than random play.
    """
    task = experiment.task.task()
    for learner in experiment.learners:
        if isinstance(learner, RecordedLearner):
            raise RequestError(
                f"learners.name = {learner.name!r}: no learner of that name with these settings is "
                "registered here"
            )
        if (learner.observes == "states") != (task.states > 0):
            raise RequestError(
                f"learners.name = {learner.name!r}; it observes {learner.observes}, and task "
                f"{task.name} is learned by {' or '.join(map(repr, task.learners))}"
            )
    values = _values(experiment.values, task) if values is None else values
    named, conditions = [], {}
    for each in experiment.conditions():
        condition = make_condition(
            task,
            each.assistant,
            values=values,
            **each.learner.setup(task.discount),
            episodes=experiment.episodes,
            retention=experiment.retention,
            common_random_numbers=experiment.common_random_numbers,
        )
        if card is not None:
            check_for_card(condition)
        content = content_digest([experiment.seed, condition.content()]).hex()
        named.append((each, content))
        conditions[content] = condition
    if not task.states:
        check_expert(task, values)
    files: dict[str, np.ndarray] = {}
    noted = _noted(made_by(task, card), task, named, conditions, files)
    record = noted._replace(
        task=task.digest(), values=values.digest(), discount=task.discount, starts=_starts(task)
    )
    return Plan(experiment, task, values, named, conditions, record, files, card)


def _starts(task: Task) -> list[int]:
    if not task.states:
        return []
    states = np.flatnonzero(task.start)
    return sorted({*(states if task.seen is None else task.seen[states]).tolist()})


def _noted(
    engine: dict[str, Any],
    task: Task,
    named: list[tuple[NamedCondition, str]],
    conditions: dict[str, Condition],
    files: dict[str, np.ndarray],
) -> Record:
    """What is noted of conditions; their code is looked at here, once, by the one who asks.

    Args:
        engine: what simulates them.
        task: what every condition is simulated at.
        named: the conditions, each with its content.
        conditions: the same by content.
        files: is filled with what is in the files that they name.
    """
    found: dict[Any, Identity] = {}
    noted: list[RecordedCondition] = []
    for each, content in named:
        rules, learner = tuple(each.assistant.chain), conditions[content].learner_type
        key = (*map(id, rules), id(learner))
        if key not in found:
            found[key] = identity_of(each.assistant, learner, task, engine)
        read = {**each.assistant.files, **conditions[content].files}
        names = {name: file_name(numbers) for name, numbers in read.items()}
        files |= {names[name]: numbers for name, numbers in read.items()}
        noted.append(recorded(each, content, found[key].digest, names))
    return Record(noted, identities={one.digest: one.parts for one in found.values()})


def _values(source: str, task: Task) -> TabularValues | NetworkValues:
    if source in task.value_sources:
        return _SOURCES[source](task)
    if source in SOURCES:
        allowed = ", ".join(map(repr, task.value_sources))
        raise RequestError(
            f"values = {source!r}; for task {task.name}, {allowed} or the path of a values file "
            "is needed"
        )
    values = load_values(source)
    if values.task != task.name:
        raise RequestError(f"values = {source!r}: they are of task {values.task}, not {task.name}")
    return values


def estimated_seconds(plan: Plan, cells: Iterable[Cell]) -> dict[Cell, float]:
    """How long cells will take on one core, from a short calibration.

    Compiles loops if they are not compiled yet.

    Args:
        plan: the experiment that the cells belong to.
        cells: what is to be done.

    Returns:
        Seconds of each cell, in the order in which they are to be worked on: the longest first, so
        that workers end together; deep learners' by trial, so that a run that is stopped has
        something of every condition.
    """
    seconds: dict[Any, float] = {}
    estimates = {}
    for cell in cells:
        condition = plan.conditions[cell.content]
        tabular = condition.task.states > 0
        alike = (condition.assistant.name, condition.learner_type.name)
        alike = alike if tabular else condition.learner
        if alike not in seconds:
            seconds[alike] = _measured(condition, plan)
        estimates[cell] = seconds[alike] * cell.trials
    if plan.experiment.tabular:
        return dict(sorted(estimates.items(), key=lambda item: -item[1]))
    return dict(sorted(estimates.items(), key=lambda item: item[0].first))


def _measured(condition: Condition, plan: Plan) -> float:
    """Seconds of a trial."""
    seed = plan.experiment.seed
    if plan.card is not None:
        return _seconds_on_card(condition, seed, plan.card)
    return (_seconds_a_trial if condition.task.states else _seconds_a_deep_trial)(condition, seed)


def _seconds_on_card(condition: Condition, seed: int, card: Card) -> float:
    """From so many trials that time grows with their number: fewer take as long as one."""
    run_condition(condition, trials=1, seed=seed, card=card)
    trials, before = 1, math.inf
    while True:
        begun = time.perf_counter()
        run_condition(condition, trials=trials, seed=seed, card=card)
        seconds = time.perf_counter() - begun
        grows = seconds > _CALIBRATION_ON_CARD and seconds > before * _MORE_ON_CARD / 2
        if trials == _MOST_ON_CARD or grows:
            return seconds / trials
        trials, before = min(_MORE_ON_CARD * trials, _MOST_ON_CARD), seconds


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


def _learning_at_once(learner: Any) -> Any:
    """A learner that learns from its first step on, if that is a setting of its kind."""
    return learner._replace(learning_starts=1) if "learning_starts" in learner._fields else learner


def _seconds_a_deep_trial(condition: Condition, seed: int) -> float:
    """From a few short episodes of a learner that learns from its first step on."""
    task: Any = condition.task
    learner: Any = condition.learner
    short = condition._replace(
        task=dataclasses.replace(task, episode_limit=min(task.episode_limit, _SHORT)),
        learner=_learning_at_once(learner),
        retention=0,
    )
    run_condition(short._replace(episodes=1), trials=1, seed=seed)
    episodes = 2
    while True:
        begun = time.perf_counter()
        simulation = run_condition(short._replace(episodes=episodes), trials=1, seed=seed)
        seconds = time.perf_counter() - begun
        if seconds > _DEEP_CALIBRATION:
            break
        episodes *= 4
    steps = 2 * (condition.episodes + condition.retention) * min(task.episode_limit, _USUAL)
    return seconds / simulation.steps * steps
