"""Cells on a graphics card: all of a condition together, for a card has many more threads."""

from collections.abc import Generator

from qbumpers.experiments.cells import Cell
from qbumpers.experiments.plan import Plan
from qbumpers.experiments.work import Finished, finished
from qbumpers.simulation import Card, run_on_card


class GraphicsCard:
    """A graphics card of this machine.

    Args:
        card: which, from `qbumpers.simulation.device_of`; plans must be made for it.
    """

    def __init__(self, card: Card) -> None:
        self.card = card
        self.cores = 1

    def __call__(self, plan: Plan, seconds: dict[Cell, float]) -> Generator[Finished]:
        """Do the work of cells and yield each as it is finished, condition by condition.

        Args:
            plan: the experiment whose conditions the cells belong to.
            seconds: the cells to be done, with the seconds that each is expected to take.

        Yields:
            Finished cells; a closed generator leaves what has begun unfinished.
        """
        cells: dict[str, list[Cell]] = {}
        for cell in seconds:
            cells.setdefault(cell.content, []).append(cell)
        for content, alike in cells.items():
            condition = plan.conditions[content]
            groups = [range(cell.first, cell.end) for cell in alike]
            found = run_on_card(condition, groups, plan.experiment.seed, self.card)
            for cell, simulation in zip(alike, found, strict=True):
                yield finished(condition, cell, simulation)
