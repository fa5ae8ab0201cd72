"""The experts that ship with the package."""

from importlib import resources
from typing import Any

from qbumpers.errors import RequestError
from qbumpers.tasks.task import Task
from qbumpers.values.network import NetworkValues
from qbumpers.values.remapping import remapped_values
from qbumpers.values.tabular import decoded_values

_FOLDER = resources.files("qbumpers.values").joinpath("built_in")


def shipped_experts() -> list[str]:
    """Names of the tasks that an expert ships for."""
    return sorted(_files())


def _files() -> dict[str, Any]:
    return {
        file.name.removesuffix(".npz"): file
        for file in (_FOLDER.iterdir() if _FOLDER.is_dir() else ())
        if file.name.endswith(".npz")
    }


def shipped_expert(task: str) -> NetworkValues:
    """The expert that ships with the package for a task.

    Args:
        task: name of the task.

    Returns:
        Its values.

    Raises:
        RequestError: if none ships.
    """
    shipped = _files()
    if task not in shipped:
        known = ", ".join(sorted(shipped)) or "no task"
        raise RequestError(
            f"no expert ships for task {task!r}; they do for: {known}. Train one by "
            f"'qbumpers expert {task}' and give its file"
        )
    values = decoded_values(shipped[task].read_bytes(), f"{task}.npz of the package")
    if not isinstance(values, NetworkValues):
        raise RequestError(f"the expert that ships for task {task!r} is a table, not a network")
    return values


def shipped_values(task: Task) -> NetworkValues:
    """The values of the expert that ships for a task, or for the one whose keys it exchanges.

    Args:
        task: any.

    Returns:
        Its values; of a remapped task, those of the other one with their actions in its order.

    Raises:
        RequestError: if none ships.
    """
    if task.remapping is None:
        return shipped_expert(task.name)
    return remapped_values(shipped_expert(task.remapping.of.name), task)
