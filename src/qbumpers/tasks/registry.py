"""Tasks by name: the package's own, and Gymnasium environments of two kinds."""

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from typing import Any

import gymnasium

from qbumpers.errors import RequestError, in_short, suggestion, unknown_name
from qbumpers.imports import import_modules, module_and_name
from qbumpers.registration import is_written_here
from qbumpers.tasks.cliff_walking import cliff_walking, larger_cliff
from qbumpers.tasks.hidden_goal import hidden_goal
from qbumpers.tasks.identity import has_table
from qbumpers.tasks.inventory import inventory
from qbumpers.tasks.mountain_car import mountain_car
from qbumpers.tasks.random_mdp import random_mdp
from qbumpers.tasks.remapping import remapped
from qbumpers.tasks.stepping import environment_name, make_environment, maker_name
from qbumpers.tasks.tabular import TabularTask
from qbumpers.tasks.task import Task, check_task
from qbumpers.tasks.toy_text import frozen_lake, frozen_lake_8x8, taxi
from qbumpers.tasks.vector import VectorTask
from qbumpers.tasks.windy_gridworld import windy_gridworld


def _lunar_lander(seed: int | None = None) -> VectorTask:
    """Land between two flags (Section 4.3), on the same terrain in every episode."""
    from qbumpers.tasks.lunar_lander.stepper import lunar_lander  # Box2D loads when it is used

    return lunar_lander(seed)


def _remapped(of: str | Mapping[str, Any], keys: Sequence[int]) -> Task:
    """Any other task with its keys exchanged: of = "cliff-walking", keys = [1, 2, 3, 0].

    See `qbumpers.tasks.remapping.remapped`.

    Args:
        of: its name, or a table of its name and its arguments, as `make_task` takes them.
        keys: [A]; action a does what action keys[a] does in the other task.
    """
    given: dict[str, Any] = {"name": of} if isinstance(of, str) else dict(of)
    if "name" not in given:
        raise RequestError(f"task 'remapped': of = {of!r}; the name of a task is needed in it")
    return remapped(make_task(given.pop("name"), **given), keys)


_MODULE_MISSING = (
    "; if a package or module of yours registers it, have that imported: imports = ['MODULE'] in "
    "an experiment file, --import MODULE, or 'MODULE:NAME' as its name"
)

Maker = Callable[..., gymnasium.Env[Any, Any]]
"""A function or class that makes an environment."""

Named = str | gymnasium.Env[Any, Any] | Maker
"""What stands for a task: a name, an environment, or what makes one."""

_tasks: dict[str, Callable[..., Task]] = {
    "cliff-walking": cliff_walking,
    "larger-cliff": larger_cliff,
    "windy-gridworld": windy_gridworld,
    "frozen-lake": frozen_lake,
    "frozen-lake-8x8": frozen_lake_8x8,
    "taxi": taxi,
    "hidden-goal": hidden_goal,
    "inventory": inventory,
    "random-mdp": random_mdp,
    "lunar-lander": _lunar_lander,
    "mountain-car": mountain_car,
    "remapped": _remapped,
}


def register_task(name: str, make: Callable[..., Task]) -> None:
    """Register a task, so that experiments can name it.

    Args:
        name: how users will name it.
        make: makes the task; its parameters are the arguments that `make_task` takes for it.
    """
    _tasks[name] = make


def explanations() -> dict[str, str]:
    """What each registered task is, in a line: the first one of the docstring of what makes it."""
    return {name: (make.__doc__ or "").strip().partition("\n")[0] for name, make in _tasks.items()}


def own_tasks() -> dict[str, Callable[..., Task]]:
    """What makes each task that was registered from outside this package, by name."""
    return {name: make for name, make in _tasks.items() if not is_written_here(make)}


def task_names() -> list[str]:
    """Names of the registered tasks."""
    return list(_tasks)


def make_task(
    name: Named,
    *,
    discount: float | None = None,
    episode_limit: int | None = None,
    max_episode_steps: int | None = None,
    observe: Sequence[str] | None = None,
    success_key: str | None = None,
    crash_key: str | None = None,
    estimated: int | None = None,
    **arguments: Any,
) -> Task:
    """A task by name, or of a Gymnasium environment.

    Args:
        name: a registered name such as "cliff-walking", or the id of a Gymnasium environment with
            a transition table such as "FrozenLake-v1", or with numbered actions such as
            "CartPole-v1"; after the module that registers it, if need be, as in
            "minigrid:MiniGrid-Empty-5x5-v0". Or such an environment itself, if Gymnasium can make
            it again, or a function or class that makes one.
        discount: of a Gymnasium environment, which states none; in (0, 1].
        episode_limit: of a Gymnasium environment, in steps; its own if None.
        max_episode_steps: what Gymnasium calls `episode_limit`; either may be given.
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
        RequestError: if no task or environment has the name, the module cannot be imported, the
            environment cannot be made again, or an argument does not suit it.
    """
    limit = _one_limit(episode_limit, max_episode_steps)
    asked = {
        "observe": observe, "success_key": success_key, "crash_key": crash_key,
        "estimated": estimated,
    }  # fmt: skip
    view = {field: value for field, value in asked.items() if value is not None}
    if isinstance(name, gymnasium.Env):
        return _of_environment(name, discount, limit, view, arguments)
    if callable(name):
        return _of_maker(name, discount, limit, view, arguments)
    name = _name_after_import(name)
    if name in _tasks:
        numbers = {"discount": discount, "episode_limit": limit}
        given = {field: value for field, value in numbers.items() if value is not None}
        given |= view
        return _registered(name, {**given, **arguments})
    if name not in gymnasium.registry:
        known = [*_tasks, *tabular_environments(), *vector_environments()]
        raise unknown_name("task", in_short(name)[1:-1], known, _MODULE_MISSING)
    return _of_maker(name, discount, limit, view, arguments)


def as_task(task: Task | Named, discount: float | None = None) -> Task:
    """A task from whatever is given in its place.

    Args:
        task: a task, which stays what it is, or what `make_task` takes.
        discount: for `make_task`.

    Raises:
        RequestError: as `make_task`; if it is nothing of the kind; or if there is a discount and
            the task states its own.
    """
    if isinstance(task, str | gymnasium.Env) or callable(task):
        return make_task(task, discount=discount)
    check_task(task)
    if discount is not None and discount != task.discount:
        raise RequestError(
            f"discount = {discount!r}; task {task.name} states its own, {task.discount:g}"
        )
    return task


def _one_limit(episode_limit: int | None, max_episode_steps: int | None) -> int | None:
    if episode_limit is None or max_episode_steps in (None, episode_limit):
        return max_episode_steps if episode_limit is None else episode_limit
    raise RequestError(
        f"max_episode_steps = {max_episode_steps!r}; episode_limit = {episode_limit!r} means the "
        "same: give one"
    )


def _name_after_import(task: Any) -> str:
    """The name of a task, once the module before a colon is imported."""
    module, name = module_and_name(str(task))
    if str(task) in _tasks or not module:
        return str(task)
    import_modules([module], f"task {task!r}")
    return name


def _of_maker(
    maker: str | Maker,
    discount: float | None,
    limit: int | None,
    view: Mapping[str, Any],
    arguments: dict[str, Any],
) -> Task:
    """A task of an environment that its id or a function makes."""
    name = repr(maker) if isinstance(maker, str) else maker_name(maker)
    numbers = {"discount": _needed(discount, name, arguments), "episode_limit": limit}
    with closing(make_environment(maker, **arguments)) as environment:
        found = _with_table(environment, name, numbers, view)
    return found or VectorTask.from_gymnasium(maker, **numbers, **view, **arguments)


def _of_environment(
    environment: Any,
    discount: float | None,
    limit: int | None,
    view: Mapping[str, Any],
    arguments: dict[str, Any],
) -> Task:
    """A task of an environment that is made already."""
    name = environment_name(environment)
    numbers = {"discount": _needed(discount, name, arguments), "episode_limit": limit}
    if arguments:
        raise RequestError(
            f"task {name}: {', '.join(arguments)} cannot be given; the environment is made already"
        )
    found = _with_table(environment, name, numbers, view)
    return found or VectorTask.from_gymnasium(environment, **numbers, **view)


def _with_table(
    environment: Any, name: str, numbers: Mapping[str, Any], view: Mapping[str, Any]
) -> TabularTask | None:
    """A task with the table that an environment has, or an estimated one; None if with neither."""
    if "estimated" in view:
        keys = {field: value for field, value in view.items() if field != "estimated"}
        _check_unused(name, "a table is estimated of numbered states", keys, ("observe",))
        return TabularTask.estimated(environment, steps=view["estimated"], **numbers, **keys)
    if not has_table(environment):  # a wrapper may show a numbered state as a vector
        return None
    _check_unused(name, "its table tells what happens", view, view)
    return TabularTask.from_gymnasium(environment, **numbers)


def _check_unused(name: str, why: str, given: Mapping[str, Any], unused: Iterable[str]) -> None:
    """RequestError if something was given that the task has no use for."""
    for field in unused:
        if field in given:
            raise RequestError(f"task {name}: {field} = {given[field]!r}; leave it out: {why}")


def _needed(discount: float | None, name: str, arguments: Mapping[str, Any]) -> float:
    if discount is None:
        for argument in arguments:
            if suggestion(argument, ("discount",)):
                raise unknown_name(f"argument of task {name}", argument, ("discount",))
        raise RequestError(
            f"task {name}: discount is missing; Gymnasium states none, give one in (0, 1]"
        )
    return discount


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
