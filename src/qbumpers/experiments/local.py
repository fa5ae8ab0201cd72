"""Cells on this machine: threads, since the compiled loops let each other run."""

import itertools
import os
from collections.abc import Generator, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait

from qbumpers.errors import RequestError
from qbumpers.experiments.cells import Cell
from qbumpers.experiments.plan import Plan
from qbumpers.experiments.work import Finished, finish


class Threads:
    """Threads of this process.

    Args:
        workers: how many; all cores where None.

    Raises:
        RequestError: where `workers` is below 1.
    """

    def __init__(self, workers: int | None = None) -> None:
        if workers is not None and workers < 1:
            raise RequestError(f"workers = {workers!r}; at least 1 is needed")
        self.cores = workers or os.cpu_count() or 1

    def __call__(self, plan: Plan, seconds: dict[Cell, float]) -> Generator[Finished]:
        """Do the work of cells and yield each as it is finished, in any order.

        Args:
            plan: the experiment.
            seconds: the cells, with how long each will take.

        Yields:
            Finished cells; a closed generator leaves what has begun unfinished.
        """
        remaining: Iterable[Cell] = iter(seconds)
        waiting: set[Future[Finished]] = set()
        pool = ThreadPoolExecutor(self.cores)
        try:
            while True:
                # Few at a time, so that little is thrown away when the run is stopped.
                for cell in itertools.islice(remaining, 2 * self.cores - len(waiting)):
                    condition = plan.conditions[cell.content]
                    waiting.add(pool.submit(finish, condition, cell, plan.experiment.seed))
                if not waiting:
                    return
                done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                for future in done:
                    yield future.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
