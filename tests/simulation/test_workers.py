"""Processes that simulate share the memory of what all of them have loaded."""

import multiprocessing
from pathlib import Path

import pytest

from qbumpers import make_task
from qbumpers.simulation import make_condition
from qbumpers.simulation.workers import make_pool
from tests.values.networks import network_of

ROLLUP = Path("/proc/self/smaps_rollup")


def memory(_):
    """Bytes of this process, and those that it alone has."""
    sizes: dict[str, int] = dict.fromkeys(("Rss", "Private_Clean", "Private_Dirty"), 0)
    for line in ROLLUP.read_text().splitlines()[1:]:
        name, size = line.split()[:2]
        if name[:-1] in sizes:
            sizes[name[:-1]] = int(size) * 1024
    return sizes["Rss"], sizes["Private_Clean"] + sizes["Private_Dirty"]


@pytest.mark.skipif(not ROLLUP.exists(), reason="the system does not tell what memory is shared")
def test_processes_share_the_libraries_that_they_need():
    condition = make_condition(
        make_task("CartPole-v1", discount=0.99), "none", values=network_of(inputs=4)
    )
    with make_pool({"": condition}, 2) as pool:
        sizes = list(pool.executor.map(memory, range(8)))
    assert multiprocessing.active_children() == []
    for resident, alone in sizes:
        assert resident > 70e6  # Numba and NumPy are loaded,
        assert alone < resident / 3  # but not by each process for itself
