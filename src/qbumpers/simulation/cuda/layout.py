"""Where the arrays of trials lie on a card: what all trials share, and what each has of its own.

Threads run in step, `LANES` at a time. So the trials of such a group have their arrays side by
side, row by row: what the group reads together lies together, and so does the row of one trial.
Small arrays are in the *desk* of each thread, near memory that the card lays out by itself.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

LANES = 32
"""Threads that run in step."""

WORD = 8
"""Bytes of a word of the desk."""

DESK_BYTES = 1536
"""What a trial may have of its own in near memory.

That is a table of 48 states and 4 actions with counts of states, in float32. On one H200 it made
bumpers a seventh faster there than with everything in the card's memory; in float64, where the
threads of a multiprocessor would have more in near memory than its cache holds, a quarter slower.
"""


class Near(NamedTuple):
    """An array that each trial has in its desk.

    Attributes:
        first: what it holds at first.
        place: where it begins in the desk, in words.
    """

    first: Any
    place: int


class Far(NamedTuple):
    """An array that each trial has in the card's memory.

    Attributes:
        arrays: [G, ..., `LANES`, W], those of all trials, G groups of them, in rows of W numbers;
            of arrays with one axis, [G, N, `LANES`].
    """

    arrays: Any


class Space(NamedTuple):
    """How much near memory a kernel has for each trial, in words of float64.

    Attributes:
        desk: for arrays of its own, at least 1.
        scratch: for intermediate results, at least 1.
    """

    desk: int
    scratch: int


def room_for_all(shape: tuple[int, ...], groups: int) -> tuple[int, ...]:
    """Shape of the arrays of `Far`, if a trial's own has this shape.

    Args:
        shape: of at least one axis.
        groups: of `LANES` trials.
    """
    row = shape[-1:] if len(shape) > 1 else ()
    return (groups, *shape[: len(shape) - len(row)], LANES, *row)


def of_all(first: np.ndarray, groups: int) -> np.ndarray:
    """The arrays of `Far`, each of which holds what `first` does.

    Args:
        first: what a trial begins with, of at least one axis.
        groups: of `LANES` trials.
    """
    lane = max(1, first.ndim - 1)
    return np.broadcast_to(np.expand_dims(first, lane), room_for_all(first.shape, groups)).copy()


def of_one(arrays: np.ndarray, trial: int) -> np.ndarray:
    """The array of one trial, a view into those of all.

    Args:
        arrays: as `Far` has them.
        trial: its place in the block.
    """
    group = arrays[trial // LANES]
    return group[:, trial % LANES] if group.ndim == 2 else group[..., trial % LANES, :]


def changed(kinds: Any, change: Callable[[Any], Any], value: Any) -> Any:
    """Tuples within tuples with some parts changed.

    Args:
        kinds: class, or tuple of classes, of the parts that are changed.
        change: what becomes of one.
        value: such a part, or a NamedTuple or tuple of them, of tuples, and of all else.
    """
    if isinstance(value, kinds):
        return change(value)
    if isinstance(value, tuple):
        parts: Any = [changed(kinds, change, part) for part in value]
        return getattr(value, "_make", tuple)(parts)
    return value


def parts_of(kinds: Any, value: Any) -> list[Any]:
    """The parts of some classes in tuples within tuples, one after another."""
    found: list[Any] = []
    changed(kinds, found.append, value)
    return found


def words_of(array: np.ndarray) -> int:
    """How many words of a desk an array takes."""
    return -(-array.nbytes // WORD)


def own_part(parts: Any, desk: np.ndarray, trial: int) -> Any:
    """What a trial has of its own in the place of each `Near` and `Far`.

    Args:
        parts: as `changed` takes it, in which arrays that differ from trial to trial are such.
        desk: float64 [N], near memory of the trial; what is in it begins with this call.
        trial: its place in the block.

    Returns:
        The same with views of the trial's own arrays; all else as it is.
    """
    if isinstance(parts, Near):
        words = desk[parts.place : parts.place + words_of(parts.first)]
        view = words.view(parts.first.dtype)[: parts.first.size].reshape(parts.first.shape)
        view[...] = parts.first
        return view
    if isinstance(parts, Far):
        return of_one(parts.arrays, trial)
    if isinstance(parts, tuple):
        found: Any = [own_part(part, desk, trial) for part in parts]
        return getattr(parts, "_make", tuple)(found)
    return parts


def open_scratch(space: np.ndarray) -> None:
    """Let `qbumpers.borrowing.scratch` of this thread take its arrays from here.

    Args:
        space: float64 [N], near memory of the thread.
    """
