"""Processes of this machine that run no script again, and end with the one that began them."""

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import types
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from multiprocessing import resource_tracker
from typing import Any, TypeVar

Found = TypeVar("Found")

# Forked from a process that has loaded the libraries and nothing else, processes share their
# memory and begin at once; Windows cannot fork.
_START = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"


@contextlib.contextmanager
def process_pool(
    workers: int, loaded: str, begin: Callable[..., None] | None = None, *arguments: Any
) -> Iterator[Executor]:
    """Processes for calls by `submit_unheard`.

    Args:
        workers: how many.
        loaded: a module that all of them need; it is loaded once, if no processes were begun
            before.
        begin: called in each process before anything else.
        *arguments: of `begin`.

    Yields:
        The pool. If the block is left before all is done, nothing waits for the rest: the processes
        are ended.
    """
    context = multiprocessing.get_context(_START)
    context.set_forkserver_preload([loaded])
    pool = ProcessPoolExecutor(workers, context, _begin, (begin, arguments))
    try:
        yield pool
    finally:
        for process in list((getattr(pool, "_processes", None) or {}).values()):
            process.terminate()
        pool.shutdown(cancel_futures=True)


def submit_unheard(
    executor: Executor, function: Callable[..., Found], *arguments: Any
) -> Future[Found]:
    """Have a function called in a thread or process that never hears Ctrl-C.

    A process that this begins does not run the script again that this one runs: what it needs of it
    must be sent to it. So scripts without a guard can have processes too, and notebooks and
    standard input, which could not be run again.
    """
    with interrupts_later(), _without_main():
        return executor.submit(function, *arguments)


@contextlib.contextmanager
def interrupts_later() -> Iterator[None]:
    """Ctrl-C waits until the end of the block, and processes begun within it never hear it."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    resource_tracker.ensure_running()  # it unblocks the signal when it begins
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    try:
        # An interrupt that came before is raised here, and must not leave the signal blocked.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _without_main() -> Iterator[None]:
    main = sys.modules["__main__"]
    sys.modules["__main__"] = types.ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def _begin(begin: Callable[..., None] | None, arguments: Sequence[Any]) -> None:
    """Leave Ctrl-C to the parent process, and end when it ends, even if it is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_after_parent, daemon=True).start()
    if begin is not None:
        begin(*arguments)


def _end_after_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
