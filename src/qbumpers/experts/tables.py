"""How exact the table of an expert is."""

from typing import NamedTuple

import numpy as np

from qbumpers.experts.quality import check_table
from qbumpers.tasks.task import Task
from qbumpers.values.tabular import TabularValues


class TableCheck(NamedTuple):
    """Action values beside the exact ones.

    Attributes:
        start_values: V of each state that an episode may start in.
        pairs: number of states that an episode can act in, times actions: those compared.
        largest_error: largest absolute difference from the exact value, in reward units.
        mean_error: mean of value minus exact value.
    """

    start_values: list[float]
    pairs: int
    largest_error: float
    mean_error: float


def check_exactness(task: Task, values: TabularValues) -> TableCheck:
    """Compare a table with the exact solution at its own discount.

    Args:
        task: what the table is of.
        values: the table that is checked, [S, A].

    Raises:
        RequestError: if the task has no table of transitions or the exact values do not exist.
    """
    found = check_table(task, values, discount=values.discount)
    errors = (found["value"] - found["exact"]).to_numpy()
    return TableCheck(
        start_values=[float(np.max(values(state))) for state in np.flatnonzero(task.start)],
        pairs=found.height,
        largest_error=float(np.abs(errors).max()),
        mean_error=float(errors.mean()),
    )
