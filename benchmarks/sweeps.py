"""Whole sweeps: stored cells against the bare engine, and threads against processes."""

import multiprocessing
import statistics
import tempfile
import time
from collections.abc import Generator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from measuring import Row, Timed, alternate, compared, is_quick, seconds_of, show

from qbumpers.experiments.cells import Cell
from qbumpers.experiments.local import ThisMachine
from qbumpers.experiments.plan import Plan, estimated_seconds, make_plan
from qbumpers.experiments.run import Backend, run_experiment
from qbumpers.experiments.work import Finished, finish
from qbumpers.reproduction.experiments import reproduction
from qbumpers.simulation import run

UNIT = "million steps/s"


class Processes:
    """Two processes, started and warmed before anything is timed."""

    cores = 2

    def __init__(self, plan: Plan) -> None:
        context = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(2, context)
        warming = [Cell(content, 0, 1) for content in plan.conditions]
        for _ in range(2):  # so that both have loaded every loop
            list(self(plan, dict.fromkeys(warming, 0.0)))

    def __call__(self, plan: Plan, seconds: dict[Cell, float]) -> Generator[Finished]:
        """As `qbumpers.experiments.local.ThisMachine`."""
        futures = [
            self._pool.submit(finish, plan.conditions[cell.content], cell, plan.experiment.seed)
            for cell in seconds
        ]
        for future in futures:
            yield future.result()

    def close(self) -> None:
        """End the processes."""
        self._pool.shutdown()


def sweep(plan: Plan, backend: Backend, *, assembled: bool = True) -> Timed:
    """Million steps per second of a run into a fresh folder.

    Args:
        plan: the experiment.
        backend: what runs it.
        assembled: whether to time the whole call, with calibration before and tables of the whole
            experiment after; else from its first cell to the last that is kept.
    """

    def timed(_: int) -> float:
        begun, seen = time.perf_counter(), []
        with tempfile.TemporaryDirectory() as folder:
            run_experiment(
                plan,
                Path(folder),
                backend=backend,
                report=lambda progress: seen.append((time.perf_counter(), progress.steps)),
            )
            ended = time.perf_counter()
        seconds = ended - begun if assembled else seen[-1][0] - seen[0][0]
        return seen[-1][1] / seconds / 1e6

    return timed


def engine(plan: Plan) -> Timed:
    """Million steps per second of the same trials simulated on two threads, and thrown away."""
    trials = plan.experiment.trials

    def timed(_: int) -> float:
        steps = []
        seconds = seconds_of(
            lambda: steps.extend(
                run(condition, trials=trials, seed=plan.experiment.seed, workers=2).steps
                for condition in plan.conditions.values()
            )
        )
        return sum(steps) / seconds / 1e6

    return timed


def measure(quick: bool) -> list[Row]:
    """Every row of this benchmark."""
    plan = make_plan(reproduction("cliff-walking", trials=200 if quick else 1000))
    estimated_seconds(plan, [Cell(content, 0, 1) for content in plan.conditions])  # compiles
    processes = Processes(plan)
    timed = {
        "cells": sweep(plan, ThisMachine(2), assembled=False),
        "two threads": sweep(plan, ThisMachine(2)),
        "engine": engine(plan),
        "one thread": sweep(plan, ThisMachine(1)),
        "two processes": sweep(plan, processes),
    }
    rates = alternate(timed, 2 if quick else 7)
    processes.close()
    ours = rates["two threads"]
    efficiency = median_ratio(ours, rates["one thread"]) / 2
    kept, whole = (median_ratio(r, rates["engine"]) for r in (rates["cells"], ours))
    title = f"sweep of {len(plan.named)} x {plan.experiment.trials} trials"
    return [
        compared(
            f"{title}, cells kept, {kept:.0%} of the engine",
            rates["cells"],
            UNIT,
            "engine",
            rates["engine"],
        ),
        compared(
            f"{title}, whole call, {whole:.0%} of the engine", ours, UNIT, "engine", rates["engine"]
        ),
        compared(
            f"{title}, efficiency {efficiency:.0%}", ours, UNIT, "one thread", rates["one thread"]
        ),
        compared(f"{title}, threads", ours, UNIT, "two processes", rates["two processes"]),
    ]


def median_ratio(ours: Sequence[float], theirs: Sequence[float]) -> float:
    """Median over the rounds of ours to theirs."""
    return statistics.median(a / b for a, b in zip(ours, theirs, strict=True))


if __name__ == "__main__":
    show("Sweeps", measure(is_quick(__doc__)))
