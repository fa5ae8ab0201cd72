"""Cells on this machine: threads if compiled loops let each other run, else processes."""

import itertools
from collections.abc import Generator, Iterable
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool

from qbumpers.cores import usable_cores
from qbumpers.errors import RequestError
from qbumpers.experiments.cells import Cell
from qbumpers.experiments.plan import Plan
from qbumpers.experiments.work import Finished, finish
from qbumpers.simulation.workers import make_pool, some_finished


class ThisMachine:
    """Cores of this machine: threads of this process, or processes if a task needs them.

    Args:
        workers: how many; all usable cores if None.

    Raises:
        RequestError: if `workers` is below 1.
    """

    def __init__(self, workers: int | None = None) -> None:
        if workers is not None and workers < 1:
            raise RequestError(f"workers = {workers!r}; at least 1 is needed")
        self.cores = workers or usable_cores()

    def __call__(self, plan: Plan, seconds: dict[Cell, float]) -> Generator[Finished]:
        """Do the work of cells and yield each as it is finished, in any order.

        Args:
            plan: the experiment whose conditions the cells belong to.
            seconds: the cells to be done, with the seconds that each is expected to take.

        Yields:
            Finished cells; a closed generator leaves what has begun unfinished.

        Raises:
            ChildProcessError: if a process was lost, for instance for want of memory.
        """
        if not seconds:
            return
        remaining: Iterable[Cell] = iter(seconds)
        waiting: set[Future[Finished]] = set()
        try:
            with make_pool(plan.conditions, min(self.cores, len(seconds))) as pool:
                while True:
                    # Few at a time, so that little is thrown away when the run is stopped.
                    for cell in itertools.islice(remaining, 2 * self.cores - len(waiting)):
                        waiting.add(pool.submit(finish, cell.content, cell, plan.experiment.seed))
                    if not waiting:
                        return
                    done, waiting = some_finished(waiting)
                    for future in done:
                        yield future.result()
        except BrokenProcessPool as error:
            raise ChildProcessError(
                "a worker process was lost; was it killed, or is memory short?"
            ) from error
