"""How many cores this process may use, which may be fewer than the machine has."""

import math
import os
import sys
from collections.abc import Iterator
from pathlib import Path

_GROUPS, _MOUNTED = Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")


def usable_cores() -> int:
    """Cores that this process may use: those it may run on, as far as its quota pays for them.

    A scheduler or `taskset` pins processes to some of a machine's cores; a container often has a
    quota of their time (`cpu.max` of a control group, version 2).

    Returns:
        At least 1. A part of a core counts as one.
    """
    quota = min(_quotas(_GROUPS, _MOUNTED), default=math.inf)
    return max(1, min(_allowed(), math.ceil(quota) if math.isfinite(quota) else sys.maxsize))


def _allowed() -> int:
    if sys.version_info >= (3, 13):
        return os.process_cpu_count() or 1
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _quotas(groups: Path, mounted: Path) -> Iterator[float]:
    """Quotas in cores of this process's control group and of those that it is part of."""
    try:
        lines = groups.read_text(encoding="utf-8").splitlines()
    except OSError:  # not Linux
        return
    for place in (line.removeprefix("0::/") for line in lines if line.startswith("0::/")):
        group = mounted / place
        for folder in (group, *group.parents):
            try:
                quota, period = (folder / "cpu.max").read_text(encoding="utf-8").split()
                yield float(quota) / float(period) if quota != "max" else math.inf
            except (OSError, ValueError):  # the root group has none, nor have folders above
                continue
