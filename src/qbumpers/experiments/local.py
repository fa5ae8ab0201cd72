"""Cells on this machine: threads where compiled loops let each other run, else processes."""

import contextlib
import itertools
import os
import signal
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import resource_tracker

from qbumpers.errors import RequestError
from qbumpers.experiments.cells import Cell
from qbumpers.experiments.plan import Plan
from qbumpers.experiments.work import Finished, finish
from qbumpers.simulation import make_pool


class ThisMachine:
    """Cores of this machine: threads of this process, or processes where a task needs them.

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

        Raises:
            ChildProcessError: where a process was lost, for instance for want of memory.
        """
        remaining: Iterable[Cell] = iter(seconds)
        waiting: set[Future[Finished]] = set()
        pool = make_pool(plan.task, min(self.cores, max(1, len(seconds))))
        try:
            while True:
                # Few at a time, so that little is thrown away when the run is stopped.
                for cell in itertools.islice(remaining, 2 * self.cores - len(waiting)):
                    condition = plan.conditions[cell.content]
                    with _interrupts_later():
                        waiting.add(pool.submit(finish, condition, cell, plan.experiment.seed))
                if not waiting:
                    return
                done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                for future in done:
                    yield future.result()
        except BrokenProcessPool as error:
            raise ChildProcessError(
                "a worker process was lost; was it killed, or is memory short?"
            ) from error
        finally:
            _stop(pool)


@contextlib.contextmanager
def _interrupts_later() -> Iterator[None]:
    """Ctrl-C waits until the end of the block, and processes begun within it never hear it."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    resource_tracker.ensure_running()  # it unblocks the signal when it begins
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _stop(pool: Executor) -> None:
    """End a pool without waiting for what it has begun; its threads go on, its processes end."""
    processes = list((getattr(pool, "_processes", None) or {}).values())
    for process in processes:
        process.terminate()
    pool.shutdown(wait=bool(processes), cancel_futures=True)  # at once, and nothing is left over
