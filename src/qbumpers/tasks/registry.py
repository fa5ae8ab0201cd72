"""Tasks by name: the package's own, and Gymnasium environments of two kinds."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from typing import Any

import gymnasium

from qbumpers.errors import RequestError, unknown_name
from qbumpers.tasks.cliff_walking import cliff_walking
from qbumpers.tasks.identity import has_table
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


def task_names() -> list[str]:
    """Names of the registered tasks."""
    return list(_tasks)


def make_task(
    name: str,
    *,
    discount: float | None = None,
    episode_limit: int | None = None,
    observe: Sequence[str] | None = None,
    success_key: str | None = None,
    crash_key: str | None = None,
    estimated: int | None = None,
    **arguments: Any,
) -> Task:
    """A task by name.

    Args:
        name: a registered name such as "cliff-walking", or the id of a Gymnasium environment with
            a transition table such as "FrozenLake-v1", or with numbered actions such as
            "CartPole-v1".
        discount: of a Gymnasium environment, which states none; in (0, 1].
        episode_limit: of a Gymnasium environment, in steps; its own if None.
        observe: keys of a Gymnasium environment's Dict observation, the others being left out.
        success_key: key of a Gymnasium environment's `info`; see `VectorTask.from_gymnasium`.
        crash_key: the same for crashes.
        estimated: steps of a Gymnasium environment with numbered states, from which a table is
            estimated; see `TabularTask.estimated`.
        **arguments: of the task, for example `seed=0` of "lunar-lander", or of the Gymnasium
            environment, for example `is_slippery=True`.

    Returns:
        The task, a TabularTask if there is a transition table or one is estimated.

    Raises:
        RequestError: if no task or environment has the name, or an argument does not suit it.
    """
    common = {"discount": discount, "episode_limit": episode_limit}
    keys = {"success_key": success_key, "crash_key": crash_key}
    if str(name) in _tasks:
        asked = {**common, "observe": observe, **keys, "estimated": estimated}
        given = {field: value for field, value in asked.items() if value is not None}
        return _registered(name, {**given, **arguments})
    if str(name) not in gymnasium.registry:
        known = [*_tasks, *tabular_environments(), *vector_environments()]
        raise unknown_name("task", name, known)
    if discount is None:
        raise RequestError(
            f"task {name!r}: discount is missing; Gymnasium states none, give one in (0, 1]"
        )
    with closing(make_environment(name, **arguments)) as environment:
        if estimated is not None:
            _check_unused(name, "a table is estimated of numbered states", observe=observe)
            return TabularTask.estimated(
                environment, discount=discount, episode_limit=episode_limit, steps=estimated,
                success_key=success_key, crash_key=crash_key,
            )  # fmt: skip
        # A wrapper may show a numbered state as a vector.
        if has_table(environment):
            _check_unused(name, "its table tells what happens", observe=observe, **keys)
            return TabularTask.from_gymnasium(
                environment, discount=discount, episode_limit=episode_limit
            )
    return VectorTask.from_gymnasium(
        name, discount=discount, episode_limit=episode_limit, observe=observe or (), **keys,
        **arguments,
    )  # fmt: skip


def _check_unused(name: str, why: str, **given: Any) -> None:
    """RequestError if something was given that the task has no use for."""
    for field, value in given.items():
        if value is not None:
            raise RequestError(f"task {name!r}: {field} = {value!r}; leave it out: {why}")


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
