"""Values files that an expert of a task is kept in, checked against the task."""

from pathlib import Path

from qbumpers.errors import RequestError
from qbumpers.tasks.task import Task
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
    values = load_values(path)
    if not isinstance(values, NetworkValues):
        raise RequestError(f"values file {path}: a table; task {task.name} needs a network")
    found, needed = (values.inputs, values.actions), (task.observation_size, task.actions)
    if values.task != task.name or found != needed:
        raise RequestError(
            f"values file {path}: of task {values.task}, {found[0]} inputs and {found[1]} actions; "
            f"task {task.name} has {needed[0]} and {needed[1]}"
        )
    return values


def load_table(task: Task, path: str | Path) -> TabularValues:
    """The table of a values file.

    Args:
        task: whose states and actions it must have.
        path: where the file is.

    Raises:
        RequestError: if the file cannot be read, holds a network, or a table of another shape.
    """
    values = load_values(path)
    if isinstance(values, TabularValues) and values.table.shape == (task.states, task.actions):
        return values
    shape = list(values.table.shape) if isinstance(values, TabularValues) else None
    kind = "a network" if shape is None else f"a table {shape}"
    raise RequestError(
        f"values file {path}: {kind}; task {task.name} needs a table "
        f"[{task.states}, {task.actions}]"
    )
