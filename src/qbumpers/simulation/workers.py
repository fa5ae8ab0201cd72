"""Several simulations at once on this machine."""

import multiprocessing
import os
import signal
import threading
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor

from qbumpers.tasks import TabularTask, Task

# Forked from a process that has loaded the libraries and nothing else, processes share their
# memory and begin at once; Windows cannot fork.
_START = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"


def make_pool(task: Task, workers: int) -> Executor:
    """A pool that suits a task.

    Compiled loops over a table let each other run, so threads do; an environment in Python holds
    the interpreter, so it takes processes. They end with this process, however it ends.

    Args:
        task: that is simulated.
        workers: how many threads or processes.

    Returns:
        The pool, to be shut down by the caller.
    """
    if isinstance(task, TabularTask):
        return ThreadPoolExecutor(workers)
    context = multiprocessing.get_context(_START)
    context.set_forkserver_preload(["qbumpers.simulation.shared_by_processes"])
    return ProcessPoolExecutor(workers, context, initializer=_follow_parent)


def _follow_parent() -> None:
    """Leave Ctrl-C to the parent process, and end when it ends, even where it is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_after_parent, daemon=True).start()


def _end_after_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
