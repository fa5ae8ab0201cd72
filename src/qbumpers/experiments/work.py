"""The work of one cell: simulated, turned into tables, and encoded as it will be kept."""

from typing import NamedTuple

import numpy as np
import polars as pl

from qbumpers.experiments.cells import Cell
from qbumpers.experiments.tables import EPISODES, STATES, encoded
from qbumpers.simulation import Condition, Simulation, StateCounts
from qbumpers.simulation import run as run_condition
from qbumpers.tasks import Task
from qbumpers.tasks.dynamics import CRASH, SUCCESS


class Finished(NamedTuple):
    """A cell whose work is done.

    Attributes:
        cell: which one.
        files: what is to be kept, by kind of table.
        steps: how many steps its learners took.
    """

    cell: Cell
    files: dict[str, bytes]
    steps: int


def finish(condition: Condition, cell: Cell, seed: int) -> Finished:
    """Do the work of a cell; equal arguments give equal bytes, wherever it is done.

    Args:
        condition: what the cell's content digest stands for.
        cell: which trials.
        seed: the experiment's, for the random streams.

    Returns:
        The cell with its tables, encoded.
    """
    simulation = run_condition(condition, trials=range(cell.first, cell.end), seed=seed)
    return finished(condition, cell, simulation)


def finished(condition: Condition, cell: Cell, simulation: Simulation) -> Finished:
    """A cell with its tables.

    Args:
        condition: what the cell's content digest stands for.
        cell: which trials.
        simulation: what happened in them.
    """
    tables = {EPISODES: episode_table(condition, cell, simulation)}
    if simulation.counts is not None:
        tables[STATES] = state_table(condition.task, simulation.counts)
    return Finished(cell, {kind: encoded(t) for kind, t in tables.items()}, simulation.steps)


def episode_table(condition: Condition, cell: Cell, simulation: Simulation) -> pl.DataFrame:
    """A row per episode of one cell.

    Args:
        condition: what the cell's content digest stands for.
        cell: whose trials these are.
        simulation: what happened.

    Returns:
        Columns as in `episodes.parquet` from `trial` on; success and crash are null if the task
        knows none.
    """
    outcomes = simulation.outcomes
    trials, episodes = outcomes.assisted_return.shape
    number = np.arange(episodes, dtype=np.int32)
    columns = {
        "trial": np.repeat(np.arange(cell.first, cell.end, dtype=np.int32), episodes),
        "episode": np.tile(number, trials),
        "retention": np.tile(number >= condition.episodes, trials),
        "assisted_return": outcomes.assisted_return.ravel(),
        "unassisted_return": outcomes.unassisted_return.ravel(),
        "assisted_length": outcomes.assisted_length.ravel(),
        "unassisted_length": outcomes.unassisted_length.ravel(),
        "overrides": outcomes.overrides.ravel(),
    }
    known = known_events(condition.task)
    events = {
        "assisted": outcomes.assisted_events.ravel(),
        "unassisted": outcomes.unassisted_events.ravel(),
    }
    flags = {
        f"{who}_{kind}": pl.Series((happened & bit) > 0) if is_known else pl.lit(None, pl.Boolean)
        for kind, (is_known, bit) in known.items()
        for who, happened in events.items()
    }
    return pl.DataFrame(columns).with_columns(**flags)


def known_events(task: Task) -> dict[str, tuple[bool, int]]:
    """Whether a task announces each kind of event, and the bit of it."""
    bits = {"success": SUCCESS, "crash": CRASH}
    return {kind: (kind in task.events, bit) for kind, bit in bits.items()}


def state_table(task: Task, counts: StateCounts) -> pl.DataFrame:
    """A row per state of one cell: how often it was acted in.

    Args:
        task: a task with a table.
        counts: how often, by state.

    Returns:
        Columns state, row, column (null if the task is no grid), assisted, overridden and
        unassisted, in steps of the episodes with an assistant and of the greedy ones after them.
    """
    columns = {"state": np.arange(task.states), **counts._asdict()}
    table = pl.DataFrame(columns)
    place = (pl.lit(None, pl.Int64), pl.lit(None, pl.Int64))
    if task.grid is not None:
        place = (pl.col("state") // task.grid[1], pl.col("state") % task.grid[1])
    return table.select(
        "state", place[0].alias("row"), place[1].alias("column"), pl.exclude("state")
    )
