"""Tasks by name: the package's own, and any Gymnasium environment with a transition table."""

from collections.abc import Callable
from typing import Any

import gymnasium

from qbumpers.errors import RequestError, unknown_name
from qbumpers.tasks.cliff_walking import cliff_walking
from qbumpers.tasks.tabular import TabularTask

_tasks: dict[str, Callable[[], TabularTask]] = {"cliff-walking": cliff_walking}


def register_task(name: str, make: Callable[[], TabularTask]) -> None:
    """Register a tabular task, so that experiments can name it.

    Args:
        name: how users will name it.
        make: makes the task.
    """
    _tasks[name] = make


def task_names() -> list[str]:
    """Names of the registered tasks."""
    return list(_tasks)


def make_task(
    name: str, *, discount: float | None = None, episode_limit: int | None = None, **arguments: Any
) -> TabularTask:
    """A tabular task by name.

    Args:
        name: a registered name such as "cliff-walking", or the id of a Gymnasium environment with
            a transition table such as "FrozenLake-v1".
        discount: of a Gymnasium environment, which states none; in (0, 1].
        episode_limit: of a Gymnasium environment, in steps; its own where None.
        **arguments: of the Gymnasium environment, for instance `is_slippery=True`.

    Returns:
        The task.

    Raises:
        RequestError: where no task or environment has the name, or an argument does not suit it.
    """
    if name in _tasks:
        if discount is not None or episode_limit is not None or arguments:
            raise RequestError(f"task {name!r} takes no arguments: its numbers are fixed")
        return _tasks[name]()
    if name not in gymnasium.registry:
        raise unknown_name("task", name, [*_tasks, *tabular_environments()])
    if discount is None:
        raise RequestError(
            f"task {name!r}: discount is missing; Gymnasium states none, give one in (0, 1]"
        )
    try:
        environment = gymnasium.make(name, disable_env_checker=True, **arguments)
    except (TypeError, ValueError, LookupError, gymnasium.error.Error, ImportError) as error:
        raise RequestError(f"task {name!r}: {error}") from error
    task = TabularTask.from_gymnasium(environment, discount=discount, episode_limit=episode_limit)
    environment.close()
    return task


def tabular_environments() -> list[str]:
    """Ids of the toy-text environments of Gymnasium that have a transition table."""
    return [i for i in gymnasium.registry if i.startswith(("FrozenLake", "Taxi", "CliffWalking"))]
