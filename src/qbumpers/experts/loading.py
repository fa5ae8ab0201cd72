"""Values files that an expert of a task is kept in, checked against the task."""

from pathlib import Path
from typing import Any, cast

from qbumpers.errors import RequestError
from qbumpers.tasks.task import Task
from qbumpers.values.fitting import check_fit, use_at
from qbumpers.values.network import NetworkValues
from qbumpers.values.tabular import TabularValues, load_values


def load_network(task: Task, path: str | Path) -> NetworkValues:
    """The network of a values file.

    Args:
        task: whose observations, actions and name it must have.
        path: where the file is.

    Raises:
        RequestError: if the file cannot be read, holds a table, or is of another task or shape.
    """
    return cast(NetworkValues, _values_of(task, path))


def load_table(task: Task, path: str | Path) -> TabularValues:
    """The table of a values file.

    Args:
        task: that it must be of.
        path: where the file is.

    Raises:
        RequestError: if the file cannot be read, holds a network, or is of another task or shape.
    """
    return cast(TabularValues, _values_of(task, path))


def _values_of(task: Any, path: str | Path) -> TabularValues | NetworkValues:
    values = load_values(path)
    try:
        check_fit(values, use_at(task))
    except RequestError as error:
        raise RequestError(f"values file {path}: {error}") from error
    # The name is all that is known of values that do not state what they were made for.
    if not values.made_for and values.task != task.name:
        raise RequestError(f"values file {path}: of task {values.task}, not {task.name}")
    return values
