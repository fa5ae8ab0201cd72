"""What tasks are held to when they are made."""

from collections.abc import Callable
from typing import Any

import numpy as np

from qbumpers.errors import RequestError, counted, whole_number
from qbumpers.tasks.task import Task

_EXACT, _NEAR = 1e-8, 1e-6  # how far from 1 sums of float64 and of float32 numbers come


def check_common(task: Task, make_display: Callable[[Any], Any] | None) -> None:
    """Check what tables and vector tasks have in common.

    Args:
        task: what is checked.
        make_display: what the task was given to make its display; None if nothing.

    Raises:
        RequestError: if a number is out of range, distances have another shape than [A, A], are not
            finite, negative or not 0 on the diagonal, or `make_display` cannot be called.
    """
    place = f"task {task.name}"
    if not 0 < task.discount <= 1:
        raise RequestError(f"{place}: discount = {task.discount!r}; it must lie in (0, 1]")
    if task.episode_limit < 1:
        raise RequestError(f"{place}: episode_limit = {task.episode_limit!r}; at least 1 is needed")
    if task.no_op not in range(-1, task.actions):
        raise RequestError(
            f"{place}: no_op = {task.no_op!r}; it must lie in [0, {task.actions}), or be -1 if "
            "there is none"
        )
    distance, shape = task.distance, (task.actions, task.actions)
    if distance.shape != shape:
        raise RequestError(f"{place}: distance has shape {distance.shape}; {shape} is needed")
    if not np.isfinite(distance).all() or (distance < 0).any() or distance.diagonal().any():
        raise RequestError(
            f"{place}: distance holds a number that is no distance (negative, not finite, or not "
            "0 on the diagonal)"
        )
    if make_display is not None and not callable(make_display):
        raise RequestError(
            f"{place}: make_display = {make_display!r}; a function of the task is needed"
        )


def normalised_rows(name: str, probability: np.ndarray) -> np.ndarray:
    """Distributions, checked.

    Args:
        name: what messages call the array.
        probability: float [..., K].

    Returns:
        The same array; if it holds numbers that were rounded to float32, a float64 one whose rows
        sum to 1.

    Raises:
        RequestError: if a number is no probability, or those along the last axis do not sum to 1.
    """
    if not np.isfinite(probability).all() or (probability < 0).any():
        raise RequestError(f"{name} holds a number that is no probability (negative or not finite)")
    sums = probability.sum(axis=-1, dtype=np.float64)
    errors = np.abs(sums - 1)
    wrong = np.argwhere(errors > _NEAR)
    if len(wrong):
        where = ", ".join(str(i) for i in wrong[0])
        labels = "state, action" if sums.ndim == 2 else "distribution"
        place = f" for ({labels}) = ({where})" if sums.ndim else ""
        raise RequestError(f"{name}{place} sums to {sums[tuple(wrong[0])]!s}; it must sum to 1")
    if (errors > _EXACT).any():
        return probability / sums[..., None]
    return probability


def whole_in(value: Any, where: str, least: int, most: int) -> int:
    """A whole number within bounds, both included.

    Args:
        value: an int or one of NumPy's integers.
        where: for the message, for instance "task 'larger-cliff': rows".
        least: the smallest that is allowed.
        most: the largest.

    Raises:
        RequestError: if it is not whole, or out of bounds.
    """
    allowed = f"in [{least}, {most:,}]"
    number = whole_number(value, where, allowed)
    if not least <= number <= most:
        raise RequestError(f"{where} = {value!r}; it must lie {allowed}")
    return number


def check_arrays(task: Any) -> None:
    """Check the arrays [S, A, K] and the start of a table; RequestError names what is wrong."""
    place, shape = f"task {task.name}", np.shape(task.next_state)
    if len(shape) != 3 or 0 in shape:
        raise RequestError(f"{place}: next_state has shape {shape}; [S, A, K] is needed")
    for field in ("probability", "reward", "terminated", "success", "crash"):
        array = getattr(task, field)
        if array is not None and np.shape(array) != shape:
            raise RequestError(f"{place}: {field} has shape {np.shape(array)}; {shape} is needed")
    if np.shape(task.start) != shape[:1]:
        raise RequestError(
            f"{place}: start has shape {np.shape(task.start)}; {shape[:1]} is needed"
        )
    if not np.isfinite(task.reward).all():
        raise RequestError(f"{place}: reward holds a number that is not finite")
    if task.next_state.dtype.kind not in "iu":
        raise RequestError(
            f"{place}: next_state holds {task.next_state.dtype}; whole numbers are needed"
        )
    if task.next_state.min() < 0 or task.next_state.max() >= shape[0]:
        raise RequestError(f"{place}: next_state must lie in [0, {shape[0]})")
    for field in ("terminated", "success", "crash"):
        array = getattr(task, field)
        if array is not None and not np.isin(array, (0, 1)).all():
            raise RequestError(f"{place}: {field} must hold nothing but true and false")


def check_cells(task: Any) -> None:
    """Check what a table says of each state besides; RequestError names what is wrong."""
    place, states = f"task {task.name}", task.states
    if task.grid is not None and task.grid[0] * task.grid[1] != states:
        raise RequestError(f"{place}: grid {task.grid} does not hold {counted(states, 'state')}")
    if task.seen is None:
        return
    seen = np.asarray(task.seen)
    if seen.shape != (states,):
        raise RequestError(f"{place}: seen has shape {seen.shape}; {(states,)} is needed")
    if not np.issubdtype(seen.dtype, np.integer) or seen.min() < 0:
        raise RequestError(f"{place}: seen must hold whole numbers of 0 or more")
