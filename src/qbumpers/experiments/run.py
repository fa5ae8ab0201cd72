"""Running an experiment: what is missing of it, wherever it is done, kept cell by cell."""

import contextlib
from collections.abc import Callable, Generator
from pathlib import Path
from typing import NamedTuple, Protocol

from qbumpers.experiments.cells import Cell, tiles
from qbumpers.experiments.local import ThisMachine
from qbumpers.experiments.on_card import GraphicsCard
from qbumpers.experiments.plan import Plan, estimated_seconds
from qbumpers.experiments.work import Finished
from qbumpers.experiments.writing import open_store


class Backend(Protocol):
    """Where cells are worked on.

    Attributes:
        cores: how many work at once.
    """

    cores: int

    def __call__(self, plan: Plan, seconds: dict[Cell, float]) -> Generator[Finished]:
        """Do the work of cells, given how long each will take, and yield each when finished."""
        ...


def backend_of(plan: Plan) -> Backend:
    """Where a plan is worked on if nothing else is said: its card, or all cores of this machine."""
    return ThisMachine() if plan.card is None else GraphicsCard(plan.card)


class RunProgress(NamedTuple):
    """How far a run is.

    Attributes:
        trials: finished, those of an earlier run included.
        of: trials of the whole experiment.
        steps: how many steps learners took in this run.
        expected: seconds that this run will take, by calibration, from its start.
        damaged: files of an earlier run that were damaged; their trials are run again.
        changed: why finished trials of an earlier run are simulated again, a sentence each.
    """

    trials: int
    of: int
    steps: int
    expected: float
    damaged: list[str]
    changed: list[str]


def run_experiment(
    plan: Plan,
    folder: str | Path,
    *,
    backend: Backend | None = None,
    report: Callable[[RunProgress], None] = lambda progress: None,
) -> None:
    """Run an experiment into a folder, or what is missing of it.

    Args:
        plan: the experiment, made ready.
        folder: of the results; a killed run continues there.
        backend: where to run; if None, the card that the plan is made for, or all cores of this
            machine.
        report: called with the progress at first and after each cell, from the calling thread.

    Raises:
        RequestError: if the folder holds another experiment, or another run is writing to it.
        StoreError: if results cannot be written; finished cells stay.
    """
    backend = backend or backend_of(plan)
    design = plan.experiment
    with open_store(folder, design, plan.record) as store:
        store.write_inputs(plan.values, plan.files)
        found = store.survey(design.trials)
        cells = {
            content: tiles(content, design.trials, design.trials_a_cell(), found.cells[content])
            for content in plan.conditions
        }
        missing = [
            cell
            for content, chosen in cells.items()
            for cell in chosen
            if cell not in found.cells[content]
        ]
        total = design.trials * len(plan.conditions)
        seconds = estimated_seconds(plan, missing)
        expected = sum(seconds.values()) / backend.cores
        done = total - sum(cell.trials for cell in missing)
        progress = RunProgress(done, total, 0, expected, found.damaged, found.changed)
        report(progress)
        with contextlib.closing(backend(plan, seconds)) as work:
            for finished in work:
                store.write(finished.cell, finished.files)
                progress = progress._replace(
                    trials=progress.trials + finished.cell.trials,
                    steps=progress.steps + finished.steps,
                )
                report(progress)
        store.assemble(cells)
