"""Any task with its actions in another order: keys that do something else than they say."""

import functools
import operator
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium.wrappers import TransformAction

from qbumpers.decisions import Step
from qbumpers.errors import RequestError, action_number, in_short
from qbumpers.random_streams import content_digest
from qbumpers.tasks.display import Display, Shape
from qbumpers.tasks.stepping import Stepper
from qbumpers.tasks.tabular import TabularTask
from qbumpers.tasks.task import Remapping, Task
from qbumpers.tasks.vector import VectorTask


def remapped(task: Task, keys: Sequence[int]) -> Task:
    """A task in which each action does what another one does in the given task.

    For studies of how people learn keys anew: the key and the name of an action stay, so that "up"
    is pressed as before, and what it does changes; nothing shows that before it is pressed.
    What stands for no key at all stays what it was: no action while no key is down, and `no_op`,
    are those that do in this task what they did in the given one. Distances between actions follow
    what actions do.

    Args:
        task: any.
        keys: [A]; action a does what action keys[a] does in the given task. For Cliff Walking's
            up, right, down and left, (1, 2, 3, 0) turns everything to the right by 90 degrees.

    Returns:
        The task; if nothing is exchanged, the given one.

    Raises:
        RequestError: if `keys` is no permutation of the actions.
    """
    order = _checked(task, keys)
    if task.remapping is not None:
        inner, through = task.remapping
        return remapped(inner, [through[key] for key in order])
    if order == tuple(range(task.actions)):
        return task
    common: dict[str, Any] = {
        "name": f"remapped-{task.name}",
        "no_op": _place(task.no_op, order),
        "action_distance": _both(task.distance if task.has_distance else None, order),
        "make_display": _display_maker(task, order),
        "environment_spec": None,
        "remapping": Remapping(task, order),
    }
    if task.states:
        return _remapped_table(cast(TabularTask, task), order, common)
    return _remapped_vectors(cast(VectorTask, task), order, common)


def _checked(task: Task, keys: Sequence[int]) -> tuple[int, ...]:
    try:
        order = tuple(operator.index(key) for key in keys)
    except TypeError:
        order = ()
    if sorted(order) != list(range(task.actions)):
        raise RequestError(
            f"task 'remapped': keys = {in_short(keys)}; each of the actions 0 to "
            f"{task.actions - 1} of task {task.name} is needed once"
        )
    return order


def _place(action: int, order: tuple[int, ...]) -> int:
    """The action that does what one did; -1 stays, there is none."""
    return order.index(action) if action >= 0 else -1


def _both(distance: np.ndarray | None, order: tuple[int, ...]) -> np.ndarray | None:
    return None if distance is None else distance[np.ix_(order, order)]


def _remapped_table(
    task: TabularTask, order: tuple[int, ...], common: dict[str, Any]
) -> TabularTask:
    fields = ("next_state", "probability", "reward", "terminated", "success", "crash")
    arrays = {field: getattr(task, field) for field in fields}
    permuted = {field: None if a is None else a[:, order] for field, a in arrays.items()}
    estimate = task.estimate and task.estimate._replace(visits=task.estimate.visits[:, order])
    return replace(task, **common, **permuted, estimate=estimate)


def _remapped_vectors(
    task: VectorTask, order: tuple[int, ...], common: dict[str, Any]
) -> VectorTask:
    no_op, distance = task.implied
    return replace(
        task,
        **common,
        make_stepper=functools.partial(_RemappedStepper, task.make_stepper, order),
        make_environment=functools.partial(
            _environment, task.make_environment, task.first_action, order
        ),
        settings={"of": dict(task.settings), "keys": list(order)},
        implied=(_place(no_op, order), _both(distance, order)),
        origin=content_digest([task.identity(), list(order)]).hex(),
    )


class _RemappedStepper:
    """A stepper whose actions do what others do in the given one; as `UndoableStepper`."""

    def __init__(self, make: Callable[[], Stepper], order: tuple[int, ...]) -> None:
        self._stepper: Any = make()
        self._order = order

    def reset(self, chance: float) -> np.ndarray:
        return self._stepper.reset(chance)

    def step(self, action: int) -> tuple[np.ndarray, float, int]:
        return self._stepper.step(self._order[action])

    def snapshot(self) -> Any:
        return self._stepper.snapshot()

    def restore(self, snapshot: Any) -> None:
        self._stepper.restore(snapshot)


def _environment(
    make: Callable[..., gymnasium.Env[Any, Any]],
    first: int,
    order: tuple[int, ...],
    *,
    render_mode: str | None = None,
) -> gymnasium.Env[Any, Any]:
    environment = make(render_mode=render_mode)

    def inner_action(action: Any) -> int:
        return first + order[action_number(action, "action", first, len(order)) - first]

    return TransformAction(environment, inner_action, environment.action_space)


def _display_maker(task: Any, order: tuple[int, ...]) -> Callable[[Any], Display] | None:
    make = task.make_display
    return None if make is None else functools.partial(_display, make, order)


def _display(make: Callable[[Any], Display], order: tuple[int, ...], task: Any) -> Display:
    """The display of the given task; what the last step did is shown, not which key it was."""
    inner = make(task)

    def scene(state: Any, step: Step | None) -> Sequence[Shape]:
        done = step and step._replace(executed=order[int(step.executed)])
        return inner.scene(state, done)

    idle = order.index(inner.idle) if inner.idle >= 0 else -1
    return inner._replace(idle=idle, scene=scene)
