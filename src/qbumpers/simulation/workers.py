"""Several simulations at once on this machine, until they are done or stopped."""

import contextlib
import functools
import pickle
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from typing import Any, NamedTuple, TypeVar

from qbumpers.kept_code import KeptCodeWarning
from qbumpers.processes import process_pool, submit_unheard
from qbumpers.simulation.condition import Condition
from qbumpers.simulation.packing import packed

Found = TypeVar("Found")

_SHARED = "qbumpers.simulation.shared_by_processes"

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
        if self.conditions is not None:
            known = self.conditions[condition]
            return submit_unheard(self.executor, function, known, *arguments)
        return submit_unheard(self.executor, _call, function, condition, *arguments)


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
    if not all(condition.task.releases_gil for condition in conditions.values()):
        with process_pool(workers, _SHARED, _begin_process, packed(conditions)) as executor:
            yield Pool(executor, None)
        return
    executor = ThreadPoolExecutor(workers)
    try:
        yield Pool(executor, conditions)
    finally:
        executor.shutdown(wait=False, cancel_futures=True)


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


_sent: list[bytes] = []  # to this process


def _begin_process(conditions: bytes) -> None:
    _sent.append(conditions)
    warnings.simplefilter("ignore", KeptCodeWarning)  # the parent has said it


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
