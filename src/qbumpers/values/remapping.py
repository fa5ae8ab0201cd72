"""Values of a task for the same task with its keys exchanged, so that nothing is trained anew."""

from dataclasses import replace
from typing import TypeVar

from qbumpers.errors import RequestError
from qbumpers.tasks.task import Task
from qbumpers.values.fitting import check_fit, use_at
from qbumpers.values.network import NetworkValues
from qbumpers.values.tabular import TabularValues

Values = TypeVar("Values", TabularValues, NetworkValues)


def remapped_values(values: Values, task: Task) -> Values:
    """Values of the other task, their actions in the order of a remapped one.

    Args:
        values: of the task that `task.remapping` holds, with any further ones.
        task: of `qbumpers.tasks.remapping.remapped`.

    Returns:
        Values of `task`: Q(s, a) is what the given ones say of action keys[a].

    Raises:
        RequestError: if the task is no remapped one, or the values do not fit the other one.
    """
    if task.remapping is None:
        raise RequestError(
            f"task {task.name}: its actions are those of no other task; make_task('remapped', "
            "of=..., keys=...) makes one"
        )
    inner, keys = task.remapping
    check_fit(values, use_at(inner))
    return replace(
        values.reordered(keys),
        task=task.name,
        method=f"{values.method}; for keys {', '.join(map(str, keys))}",
        made_for=task.identity() if values.made_for else "",
    )
