"""What Ray costs: for each batch of cells, and for a whole sweep against threads.

Ray runs on this machine alone, with as many workers as there are threads.
"""

import importlib.util
import tempfile
import time

from measuring import Row, Timed, alternate, compared, is_quick, seconds_of, show

from qbumpers.experiments.cells import Cell, tiles, trials_a_cell
from qbumpers.experiments.cluster import BATCH_SECONDS, LOCAL, RayCluster
from qbumpers.experiments.local import ThisMachine
from qbumpers.experiments.plan import Plan, estimated_seconds, make_plan
from qbumpers.experiments.run import Backend, run_experiment
from qbumpers.reproduction.experiments import reproduction

_SMALL = 400  # cells of one trial


def small_cells(plan: Plan) -> list[Cell]:
    """Cells whose work is next to nothing, so that what is around it shows."""
    content = plan.named[0][1]
    return [Cell(content, first, 1) for first in range(_SMALL)]


def a_cell(backend: Backend, plan: Plan, alone: bool) -> Timed:
    """Milliseconds a small cell.

    Args:
        backend: that does the work.
        plan: the experiment.
        alone: whether each cell is handed over by itself; otherwise in batches as they come.

    Returns:
        What measures it.
    """
    each = BATCH_SECONDS if alone else 1e-3
    seconds = dict.fromkeys(small_cells(plan), each)

    def timed(_: int) -> float:
        return seconds_of(lambda: list(backend(plan, seconds))) / _SMALL * 1e3

    return timed


def a_sweep(backend: Backend, plan: Plan) -> Timed:
    """Million steps per second of a whole run into a folder."""

    def timed(_: int) -> float:
        steps: list[int] = []
        with tempfile.TemporaryDirectory() as folder:
            begin = time.perf_counter()
            run_experiment(
                plan, folder, backend=backend, report=lambda done: steps.append(done.steps)
            )
            return steps[-1] / (time.perf_counter() - begin) / 1e6

    return timed


def bytes_a_cell(plan: Plan) -> Row:
    """What travels back for a cell of usual size, and is kept."""
    size = trials_a_cell(plan.experiment.episodes)
    cells = [tiles(content, size, size)[0] for content in plan.conditions]
    sizes = [
        sum(map(len, finished.files.values()))
        for finished in ThisMachine()(plan, estimated_seconds(plan, cells))
    ]
    title = f"a cell of {size} trials of {plan.experiment.episodes} episodes"
    return Row(title, sum(sizes) / len(sizes) / 1e3, "kB")


def against_threads(cluster: RayCluster, plan: Plan, rounds: int) -> list[Row]:
    """Cells and sweeps through Ray, against as many threads."""
    threads = ThisMachine(cluster.cores)
    small = {
        "alone": a_cell(cluster, plan, alone=True),
        "in batches": a_cell(cluster, plan, alone=False),
        "threads": a_cell(threads, plan, alone=False),
    }
    alternate(small, 1)  # compiles, and starts workers
    times = alternate(small, rounds)
    rates = alternate({"Ray": a_sweep(cluster, plan), "threads": a_sweep(threads, plan)}, rounds)
    title = f"{plan.experiment.trials} trials of each condition, Ray on {cluster.cores} cores"
    return [
        *(
            compared(f"a small cell, Ray, {how}", times[how], "ms", "threads", times["threads"])
            for how in ("alone", "in batches")
        ),
        compared(title, rates["Ray"], "M steps/s", "threads", rates["threads"]),
    ]


def measure(quick: bool) -> list[Row]:
    """Every row of this benchmark; none if Ray is not installed."""
    if importlib.util.find_spec("ray") is None:
        print("Ray is not installed: what it costs is left out.")
        return []
    rounds, trials = (2, 50) if quick else (5, 500)
    plan = make_plan(reproduction("cliff-walking", trials=trials))
    begin = time.perf_counter()
    with RayCluster(LOCAL) as cluster:
        start = Row("starting an own Ray", time.perf_counter() - begin, "s")
        return [start, *against_threads(cluster, plan, rounds), bytes_a_cell(plan)]


if __name__ == "__main__":
    show("Ray", measure(is_quick(__doc__)))
