"""Cells: the blocks of trials into which an experiment is cut, each finished and kept by itself."""

from collections.abc import Iterable
from typing import NamedTuple

EPISODES_A_CELL = 50_000
"""A fraction of a second of tabular work: little is lost when a run is killed."""

MANY_CELLS = 10_000
"""More cells of work than this are not begun unless they are asked for."""

MOST_CELLS = 1_000_000
"""More cells of work than this, each some files, are never begun."""


class Cell(NamedTuple):
    """A block of trials of one condition.

    Attributes:
        content: digest of everything that decides its numbers, in hexadecimal.
        first: number of its first trial.
        trials: how many.
    """

    content: str
    first: int
    trials: int

    @property
    def end(self) -> int:
        """The trial after the last."""
        return self.first + self.trials


def trials_a_cell(episodes: int) -> int:
    """How many trials of so many episodes make a cell; at least one."""
    return max(1, EPISODES_A_CELL // episodes)


def tiles(content: str, trials: int, size: int, finished: Iterable[Cell] = ()) -> list[Cell]:
    """Cells that together hold the trials of a condition, finished ones if there are any.

    Args:
        content: digest of the condition, see `Cell`.
        trials: how many trials are wanted.
        size: trials of a new cell; new cells end at multiples of it.
        finished: cells of this content that are there already; they may overlap, as those of a run
            that was continued with more trials and then fewer.

    Returns:
        Cells in the order of their trials, without gap or overlap.
    """
    usable = [cell for cell in finished if cell.end <= trials]
    chosen, place = [], 0
    while place < trials:
        here = [cell for cell in usable if cell.first == place]
        if here:
            chosen.append(max(here, key=lambda cell: cell.trials))
        else:
            later = [cell.first for cell in usable if cell.first > place]
            end = min([trials, (place // size + 1) * size, *later])
            chosen.append(Cell(content, place, end - place))
        place = chosen[-1].end
    return chosen
