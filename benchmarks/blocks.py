"""What processes of a benchmark do: by a module, as nothing of a script reaches them."""

import time
from pathlib import Path

from qbumpers.simulation import run
from qbumpers.simulation.condition import Condition


def block(condition: Condition, trial: int) -> tuple[float, float]:
    """In a process of its own: steps per second of the clock on the wall, and its peak memory.

    Memory is of the whole process, in MB; NaN if the system does not tell.
    """
    begin = time.perf_counter()
    steps = run(condition, trials=range(trial, trial + 1)).steps
    rate = steps / (time.perf_counter() - begin)
    status = Path("/proc/self/status")
    if not status.exists():
        return rate, float("nan")
    peak = status.read_text().split("VmHWM:")[1].split()[0]
    return rate, int(peak) * 1024 / 1e6
