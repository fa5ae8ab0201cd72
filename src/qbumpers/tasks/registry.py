"""Tasks by name: the package's own, and Gymnasium environments of two kinds."""

import inspect
from collections.abc import Callable, Mapping
from contextlib import closing
from typing import Any

import gymnasium
from gymnasium import spaces

from qbumpers.errors import RequestError, unknown_name
from qbumpers.registration import is_written_here
from qbumpers.tasks.cliff_walking import cliff_walking
from qbumpers.tasks.stepping import make_environment
from qbumpers.tasks.tabular import TabularTask
from qbumpers.tasks.task import Task
from qbumpers.tasks.vector import VectorTask


def _lunar_lander(seed: int | None = None) -> VectorTask:
    from qbumpers.tasks.lunar_lander.stepper import lunar_lander  # Box2D loads when it is used

    return lunar_lander(seed)


_tasks: dict[str, Callable[..., Task]] = {
    "cliff-walking": cliff_walking,
    "lunar-lander": _lunar_lander,
}


def register_task(name: str, make: Callable[..., Task]) -> None:
    """Register a task, so that experiments can name it.

    Args:
        name: how users will name it.
        make: makes the task; its parameters are the arguments that `make_task` takes for it.
    """
    _tasks[name] = make


def own_tasks() -> dict[str, Callable[..., Task]]:
    """What makes each task that was registered from outside this package, by name."""
    return {name: make for name, make in _tasks.items() if not is_written_here(make)}


def task_names() -> list[str]:
    """Names of the registered tasks."""
    return list(_tasks)


def make_task(
    name: str, *, discount: float | None = None, episode_limit: int | None = None, **arguments: Any
) -> Task:
    """A task by name.

    Args:
        name: a registered name such as "cliff-walking", or the id of a Gymnasium environment with
            a transition table such as "FrozenLake-v1", or with numbered actions and a vector
            observation such as "CartPole-v1".
        discount: of a Gymnasium environment, which states none; in (0, 1].
        episode_limit: of a Gymnasium environment, in steps; its own if None.
        **arguments: of the task, for example `seed=0` of "lunar-lander", or of the Gymnasium
            environment, for example `is_slippery=True`.

    Returns:
        The task, a TabularTask if there is a transition table.

    Raises:
        RequestError: if no task or environment has the name, or an argument does not suit it.
    """
    if str(name) in _tasks:
        numbers = {"discount": discount, "episode_limit": episode_limit}
        given = {field: value for field, value in numbers.items() if value is not None}
        return _registered(name, {**given, **arguments})
    if str(name) not in gymnasium.registry:
        known = [*_tasks, *tabular_environments(), *vector_environments()]
        raise unknown_name("task", name, known)
    if discount is None:
        raise RequestError(
            f"task {name!r}: discount is missing; Gymnasium states none, give one in (0, 1]"
        )
    with closing(make_environment(name, **arguments)) as environment:
        # A wrapper may show a numbered state as a vector.
        if isinstance(environment.observation_space, spaces.Discrete):
            return TabularTask.from_gymnasium(
                environment, discount=discount, episode_limit=episode_limit
            )
    return VectorTask.from_gymnasium(
        name, discount=discount, episode_limit=episode_limit, **arguments
    )


def _registered(name: str, given: Mapping[str, Any]) -> Task:
    signature = inspect.signature(_tasks[name])
    if given and not signature.parameters:
        raise RequestError(f"task {name!r} takes no arguments: its numbers are fixed")
    try:
        signature.bind(**given)
    except TypeError as error:
        taken = ", ".join(signature.parameters)
        raise RequestError(f"task {name!r}: {error}; its arguments are: {taken}") from error
    return _tasks[name](**given)


def tabular_environments() -> list[str]:
    """Ids of the toy-text environments of Gymnasium that have a transition table."""
    return _ids("FrozenLake", "Taxi", "CliffWalking")


def vector_environments() -> list[str]:
    """Ids of Gymnasium's environments with numbered actions and a vector observation."""
    return _ids("CartPole", "Acrobot", "MountainCar-", "LunarLander-")


def _ids(*beginnings: str) -> list[str]:
    return [name for name in gymnasium.registry if name.startswith(beginnings)]
