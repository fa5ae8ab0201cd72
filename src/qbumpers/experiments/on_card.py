"""Cells on a graphics card: all of a condition together, for a card has many more threads."""

from collections import deque
from collections.abc import Generator, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

from qbumpers.cores import usable_cores
from qbumpers.experiments.cells import Cell
from qbumpers.experiments.plan import Plan
from qbumpers.experiments.work import Finished, finished
from qbumpers.simulation import Card, Simulation, run_on_card


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
        cores = usable_cores()
        with ThreadPoolExecutor(cores) as pool:
            waiting = deque[Future[Finished]]()
            for cell, simulation in self._simulated(plan, seconds):
                condition = plan.conditions[cell.content]
                waiting.append(pool.submit(finished, condition, cell, simulation))
                # The card does not run so far ahead that memory fills with what is not encoded.
                while waiting and (waiting[0].done() or len(waiting) > 2 * cores):
                    yield waiting.popleft().result()
            for work in waiting:
                yield work.result()

    def _simulated(
        self, plan: Plan, seconds: dict[Cell, float]
    ) -> Iterator[tuple[Cell, Simulation]]:
        cells: dict[str, list[Cell]] = {}
        for cell in seconds:
            cells.setdefault(cell.content, []).append(cell)
        for content, alike in cells.items():
            condition = plan.conditions[content]
            groups = [range(cell.first, cell.end) for cell in alike]
            found = run_on_card(condition, groups, plan.experiment.seed, self.card)
            yield from zip(alike, found, strict=True)
