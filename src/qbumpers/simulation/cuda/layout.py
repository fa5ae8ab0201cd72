"""Where the arrays of trials lie on a card: what all trials share, and what each has of its own.

Threads run in step, `LANES` at a time. So arrays that each trial has of its own are laid out with
the trials of such a group innermost: what the group reads together lies together. Small ones are in
the *desk* of each thread, near memory that the card lays out in the same way by itself.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

LANES = 32
"""Threads that run in step."""

WORD = 8
"""Bytes of a word of the desk."""

DESK_BYTES = 4096
"""What a trial may have of its own in near memory: a table of 48 states and 4 actions, and more."""


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
        arrays: [G, ..., `LANES`], those of all trials, G groups of them.
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
        return parts.arrays[trial // LANES, ..., trial % LANES]
    if isinstance(parts, tuple):
        found: Any = [own_part(part, desk, trial) for part in parts]
        return getattr(parts, "_make", tuple)(found)
    return parts


def open_scratch(space: np.ndarray) -> None:
    """Let `qbumpers.borrowing.scratch` of this thread take its arrays from here.

    Args:
        space: float64 [N], near memory of the thread.
    """
