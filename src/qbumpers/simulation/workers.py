"""Several simulations at once on this machine, until they are done or stopped."""

import contextlib
import functools
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import types
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import (
    FIRST_COMPLETED,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from multiprocessing import resource_tracker
from typing import Any, NamedTuple, TypeVar

from qbumpers.kept_code import KeptCodeWarning
from qbumpers.simulation.condition import Condition
from qbumpers.simulation.packing import packed

Found = TypeVar("Found")

# Forked from a process that has loaded the libraries and nothing else, processes share their
# memory and begin at once; Windows cannot fork.
_START = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"

_LISTENING = 0.2  # seconds; a signal that another thread receives does not end a wait


class Pool(NamedTuple):
    """Threads or processes that know some conditions.

    Attributes:
        executor: of the threads or processes.
        conditions: by name, for threads; None for processes, which have them already.
    """

    executor: Executor
    conditions: Mapping[str, Condition] | None

    def submit(
        self, function: Callable[..., Found], condition: str, *arguments: Any
    ) -> Future[Found]:
        """Have a function called, in a thread or process that never hears Ctrl-C.

        Args:
            function: of this package; takes a condition and the arguments.
            condition: name of one that the pool was made with.
            *arguments: further ones.

        Returns:
            What the function will return.
        """
        with _interrupts_later():
            if self.conditions is not None:
                return self.executor.submit(function, self.conditions[condition], *arguments)
            with _without_main():
                return self.executor.submit(_call, function, condition, *arguments)


@contextlib.contextmanager
def make_pool(conditions: Mapping[str, Condition], workers: int) -> Iterator[Pool]:
    """A pool that suits the task of some conditions.

    Compiled loops over a table let each other run, so threads do; an environment in Python holds
    the interpreter, so it takes processes. They end with this process, however it ends. Processes
    get what was registered from outside the package once, when they begin.

    Args:
        conditions: what will be simulated, by any name; at least one, all of the same task.
        workers: how many threads or processes.

    Yields:
        The pool, to be used with `some_finished`. If the block is left before all is done, nothing
        waits for the rest: processes are ended, threads go on unheeded.

    Raises:
        RequestError: naming what cannot be sent to processes.
    """
    if all(condition.task.releases_gil for condition in conditions.values()):
        pool = Pool(ThreadPoolExecutor(workers), conditions)
    else:
        context = multiprocessing.get_context(_START)
        context.set_forkserver_preload(["qbumpers.simulation.shared_by_processes"])
        sent = (packed(conditions),)
        pool = Pool(ProcessPoolExecutor(workers, context, _begin_process, sent), None)
    try:
        yield pool
    finally:
        processes = list((getattr(pool.executor, "_processes", None) or {}).values())
        for process in processes:
            process.terminate()
        pool.executor.shutdown(wait=bool(processes), cancel_futures=True)


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
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    try:
        # An interrupt that came before is raised here, and must not leave the signal blocked.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _without_main() -> Iterator[None]:
    """Processes begun within the block do not run the script again that this one runs.

    What they need of it is sent to them. So scripts without a guard can have processes too, and
    notebooks and standard input, which could not be run again.
    """
    main = sys.modules["__main__"]
    sys.modules["__main__"] = types.ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


_sent: list[bytes] = []  # to this process


def _begin_process(conditions: bytes) -> None:
    """Leave Ctrl-C to the parent process, and end when it ends, even if it is killed."""
    _sent.append(conditions)
    warnings.simplefilter("ignore", KeptCodeWarning)  # the parent has said it
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_after_parent, daemon=True).start()


@functools.cache
def _conditions() -> Mapping[str, Condition]:
    """Unpacked at the first call, so that what goes wrong with it is an error of that call."""
    return pickle.loads(_sent[0])


def _call(function: Callable[..., Any], condition: str, *arguments: Any) -> Any:
    try:
        return function(_conditions()[condition], *arguments)
    except Exception as error:
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:  # a class of the user's own, whose name means nothing elsewhere
            raise RuntimeError(f"{type(error).__name__}: {error}") from None
        raise


def _end_after_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
