"""Several simulations at once on this machine, until they are done or stopped."""

import contextlib
import multiprocessing
import os
import signal
import threading
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from multiprocessing import resource_tracker
from typing import Any, TypeVar

from qbumpers.kept_code import KeptCodeWarning
from qbumpers.tasks import Task

Found = TypeVar("Found")

# Forked from a process that has loaded the libraries and nothing else, processes share their
# memory and begin at once; Windows cannot fork.
_START = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"

_LISTENING = 0.2  # seconds; a signal that another thread receives does not end a wait


@contextlib.contextmanager
def make_pool(task: Task, workers: int) -> Iterator[Executor]:
    """A pool that suits a task.

    Compiled loops over a table let each other run, so threads do; an environment in Python holds
    the interpreter, so it takes processes. They end with this process, however it ends.

    Args:
        task: what is simulated.
        workers: how many threads or processes.

    Yields:
        The pool, to be used with `submit` and `some_finished`. If the block is left before all
        is done, nothing waits for the rest: processes are ended, threads go on unheeded.
    """
    if task.releases_gil:
        pool: Executor = ThreadPoolExecutor(workers)
    else:
        context = multiprocessing.get_context(_START)
        context.set_forkserver_preload(["qbumpers.simulation.shared_by_processes"])
        pool = ProcessPoolExecutor(workers, context, initializer=_follow_parent)
    try:
        yield pool
    finally:
        processes = list((getattr(pool, "_processes", None) or {}).values())
        for process in processes:
            process.terminate()
        pool.shutdown(wait=bool(processes), cancel_futures=True)


def submit(pool: Executor, function: Callable[..., Found], *arguments: Any) -> Future[Found]:
    """Have a pool call a function, in a thread or process that never hears Ctrl-C."""
    with _interrupts_later():
        return pool.submit(function, *arguments)


def some_finished(waiting: set[Future[Found]]) -> tuple[set[Future[Found]], set[Future[Found]]]:
    """Wait for the first of some calls; those that are finished, and the others.

    Args:
        waiting: at least one.

    Raises:
        KeyboardInterrupt: at once on Ctrl-C, whichever thread the system tells.
    """
    while True:
        done, others = wait(waiting, _LISTENING, FIRST_COMPLETED)
        if done:
            return done, others


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


def _follow_parent() -> None:
    """Leave Ctrl-C to the parent process, and end when it ends, even if it is killed."""
    warnings.simplefilter("ignore", KeptCodeWarning)  # the parent has said it
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_after_parent, daemon=True).start()


def _end_after_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
