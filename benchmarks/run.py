"""Run every benchmark and print one table: `python benchmarks/run.py [--quick]`."""

import os
import platform

import cluster
import deep
import lander
import shared_control
import simulation
import sweeps
import whole_processes
from measuring import is_quick, show

from qbumpers.cores import usable_cores

BENCHMARKS = (simulation, shared_control, lander, deep, sweeps, cluster, whole_processes)


def main() -> None:
    quick = is_quick(__doc__)
    load = os.getloadavg()[0]
    rows = [row for benchmark in BENCHMARKS for row in benchmark.measure(quick)]
    machine = f"{platform.machine()}, {usable_cores()} cores, load {load:.1f} when begun"
    show(f"Medians of alternated rounds ({machine})", rows)


if __name__ == "__main__":
    main()
