"""Running an experiment: cells of trials over threads, each kept as soon as it is finished."""

import contextlib
import itertools
import os
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl

from qbumpers.errors import RequestError
from qbumpers.experiments.design import Experiment
from qbumpers.experiments.store import Cell, open_store
from qbumpers.random_streams import content_digest
from qbumpers.simulation import Condition, Simulation, make_condition
from qbumpers.simulation import run as run_condition
from qbumpers.tasks import TabularTask, make_task
from qbumpers.tasks.dynamics import CRASH, SUCCESS
from qbumpers.values import TabularValues, learn_values, load_values, solve

BLOCK = 50
"""Trials a cell: a fraction of a second of work, so little is lost when a run is killed."""


class Progress(NamedTuple):
    """How far a run is.

    Attributes:
        trials: finished, those of an earlier run included.
        of: trials of the whole experiment.
        steps: that learners took in this run.
    """

    trials: int
    of: int
    steps: int


class Plan(NamedTuple):
    """An experiment made ready: checked, with nothing run yet.

    Attributes:
        experiment: the design.
        task: its task.
        values: Q* of its assistants.
        conditions: by readable id.
        cells: all blocks of trials.
    """

    experiment: Experiment
    task: TabularTask
    values: TabularValues
    conditions: dict[str, Condition]
    cells: list[Cell]


def make_plan(experiment: Experiment) -> Plan:
    """Check a whole experiment and lay out its work.

    Args:
        experiment: the design.

    Returns:
        The plan.

    Raises:
        RequestError: where the task, values, learner or an assistant is wrong.
    """
    design = experiment.task
    task = make_task(
        design.name,
        discount=design.discount,
        episode_limit=design.episode_limit,
        **design.arguments,
    )
    values = _values(experiment.values, task)
    conditions = {
        name: make_condition(
            task,
            assistant,
            values=values,
            learner=experiment.learner.learner(task.discount),
            perception=experiment.learner.perception,
            episodes=experiment.episodes,
        )
        for name, assistant in experiment.named_assistants()
    }
    return Plan(experiment, task, values, conditions, list(_cells(experiment, conditions)))


def _cells(experiment: Experiment, conditions: dict[str, Condition]) -> Iterator[Cell]:
    for name, condition in conditions.items():
        content = content_digest([experiment.seed, condition.content()]).hex()
        for first in range(0, experiment.trials, BLOCK):
            yield Cell(name, content, first, min(BLOCK, experiment.trials - first))


def _values(source: str, task: TabularTask) -> TabularValues:
    if source == "exact":
        return solve(task)
    if source == "q-learning":
        return learn_values(task)
    values = load_values(source)
    if values.task != task.name:
        raise RequestError(f"values = {source!r}: they are of task {values.task}, not {task.name}")
    return values


def run_experiment(
    plan: Plan,
    folder: str | Path,
    *,
    workers: int | None = None,
    report: Callable[[Progress], None] = lambda progress: None,
) -> None:
    """Run an experiment into a folder, or what is missing of it.

    Args:
        plan: the experiment, made ready.
        folder: of the results; a killed run continues there.
        workers: threads; all cores where None.
        report: called with the progress after each cell, from the calling thread.

    Raises:
        RequestError: where the folder holds another experiment, another run is writing to it, or
            `workers` is below 1.
        StoreError: where results cannot be written; finished cells stay.
    """
    if workers is not None and workers < 1:
        raise RequestError(f"workers = {workers!r}; at least 1 is needed")
    with open_store(folder, plan.experiment) as store:
        store.write_values(plan.values)
        missing = [cell for cell in plan.cells if not store.finished(cell)]
        total = sum(cell.trials for cell in plan.cells)
        progress = Progress(total - sum(cell.trials for cell in missing), total, 0)
        report(progress)
        work = _simulated(plan, missing, workers or os.cpu_count() or 1)
        with contextlib.closing(work):
            for cell, simulation in work:
                tables = episode_table(plan, cell, simulation), state_table(plan.task, simulation)
                store.write(cell, *tables)
                done, steps = progress.trials + cell.trials, progress.steps + simulation.steps
                progress = Progress(done, total, steps)
                report(progress)
        store.assemble(plan.cells)


def _simulated(plan: Plan, cells: list[Cell], workers: int) -> Generator[tuple[Cell, Simulation]]:
    """Simulate cells in threads and yield each as it is finished, in any order."""
    remaining = iter(cells)
    waiting: dict[Future[Simulation], Cell] = {}
    with ThreadPoolExecutor(workers) as pool:
        while True:
            # Few at a time: whoever stops the run waits for those that have begun.
            for cell in itertools.islice(remaining, 2 * workers - len(waiting)):
                trials = range(cell.first, cell.first + cell.trials)
                future = pool.submit(
                    run_condition,
                    plan.conditions[cell.condition],
                    trials=trials,
                    seed=plan.experiment.seed,
                )
                waiting[future] = cell
            if not waiting:
                return
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                yield waiting.pop(future), future.result()


def episode_table(plan: Plan, cell: Cell, simulation: Simulation) -> pl.DataFrame:
    """A row an episode of one cell, without the name of its condition.

    Args:
        plan: the experiment.
        cell: whose trials these are.
        simulation: what happened.

    Returns:
        Columns as in `episodes.parquet`; success and crash are null where the task knows none.
    """
    outcomes = simulation.outcomes
    trials, episodes = outcomes.assisted_return.shape
    assistant = plan.conditions[cell.condition].assistant
    columns = {
        "trial": np.repeat(np.arange(cell.first, cell.first + trials, dtype=np.int32), episodes),
        "episode": np.tile(np.arange(episodes, dtype=np.int32), trials),
        "assisted_return": outcomes.assisted_return.ravel(),
        "unassisted_return": outcomes.unassisted_return.ravel(),
        "assisted_length": outcomes.assisted_length.ravel(),
        "unassisted_length": outcomes.unassisted_length.ravel(),
        "overrides": outcomes.overrides.ravel(),
    }
    table = pl.DataFrame(columns)
    known = {
        "success": (plan.task.success is not None, SUCCESS),
        "crash": (plan.task.crash is not None, CRASH),
    }
    events = {
        "assisted": outcomes.assisted_events.ravel(),
        "unassisted": outcomes.unassisted_events.ravel(),
    }
    for kind, (is_known, bit) in known.items():
        for who, happened in events.items():
            flags = pl.Series((happened & bit) > 0) if is_known else pl.lit(None, pl.Boolean)
            table = table.with_columns(flags.alias(f"{who}_{kind}"))
    alpha = assistant.options._asdict().get("alpha")
    return table.select(
        pl.lit(assistant.name).alias("assistant"),
        pl.lit(alpha, pl.Float64).alias("alpha"),
        pl.all(),
    )


def state_table(task: TabularTask, simulation: Simulation) -> pl.DataFrame:
    """A row a state of one cell: how often it was acted in.

    Args:
        task: the task.
        simulation: what happened.

    Returns:
        Columns state, row, column (null where the task is no grid), assisted, overridden and
        unassisted, in steps.
    """
    columns = {"state": np.arange(task.states), **simulation.counts._asdict()}
    table = pl.DataFrame(columns)
    place = (pl.lit(None, pl.Int64), pl.lit(None, pl.Int64))
    if task.grid is not None:
        place = (pl.col("state") // task.grid[1], pl.col("state") % task.grid[1])
    return table.select(
        "state", place[0].alias("row"), place[1].alias("column"), pl.exclude("state")
    )
