"""Values of a task for the same task with its keys exchanged, so that nothing is trained anew."""

from dataclasses import replace
from typing import Any, TypeVar

from qbumpers.errors import RequestError
from qbumpers.networks.network import named_parameters
from qbumpers.tasks.task import Task
from qbumpers.values.fitting import check_fit, use_at
from qbumpers.values.network import NetworkValues
from qbumpers.values.tabular import TabularValues

Values = TypeVar("Values", TabularValues, NetworkValues)

_LAST = ("values", "advantages")  # layers with an output per action


def remapped_values(values: Values, task: Task) -> Values:
    """Values of the other task, their actions in the order of a remapped one.

    Args:
        values: of the task that `task.remapping` names, with any further ones.
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
    others = {name: _permuted(each, keys) for name, each in values.others.items()}
    return replace(
        _permuted(values, keys),
        others={name: replace(each, task=task.name) for name, each in others.items()},
        task=task.name,
        method=f"{values.method}; for keys {', '.join(map(str, keys))}",
        made_for=task.identity() if values.made_for else "",
    )


def _permuted(values: Any, keys: tuple[int, ...]) -> Any:
    """The same values with the columns of their actions in another order."""
    if isinstance(values, TabularValues):
        return replace(values, table=values.table[:, keys], others={})
    parameters = values.parameters.copy()
    for name, numbers in named_parameters(values.layout, parameters).items():
        if name.partition(".")[0] in _LAST:
            numbers[:] = numbers[..., keys]
    return replace(values, parameters=parameters, others={})
