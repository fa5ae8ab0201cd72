"""Running a comparison into a folder, or what is missing of it."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import qbumpers
from qbumpers.comparison.cases import Case, command
from qbumpers.comparison.methods import METHODS
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import Backend, RunProgress, run_experiment
from qbumpers.files import write_atomically
from qbumpers.simulation import Card

COMPARISON = "comparison.json"
"""What an output folder notes of the cases that were compared."""

ANCHOR_FOLDER, METHOD_FOLDER = "anchors", "methods"
"""The two experiments of a case, within its folder."""


class ComparisonProgress(NamedTuple):
    """How far a comparison is.

    Attributes:
        trials: finished, those of an earlier run included.
        of: trials of all cases.
        steps: how many steps learners took in this run.
        damaged: files of an earlier run that were damaged; their trials are run again.
        changed: why finished trials of an earlier run are simulated again, a sentence each.
    """

    trials: int
    of: int
    steps: int
    damaged: list[str]
    changed: list[str]


def run_cases(
    cases: Sequence[Case],
    folder: str | Path,
    backend: Backend,
    card: Card | None = None,
    report: Callable[[ComparisonProgress], None] = lambda progress: None,
) -> None:
    """Run the experiments of all cases: every anchor first, so that reference points stand.

    Args:
        cases: from `make_cases`.
        folder: of the results; a run that was stopped continues there.
        backend: where to run.
        card: the graphics card, if that is where.
        report: called with the progress after each cell.

    Raises:
        RequestError: if a learner does not suit a task, the folder holds other cases of the same
            name, or another run is writing to it.
        StoreError: if results cannot be written; finished cells stay.
    """
    place = Path(folder)
    parts = [(f"{case.folder}/{ANCHOR_FOLDER}", case.anchors) for case in cases]
    parts += [(f"{case.folder}/{METHOD_FOLDER}", case.methods) for case in cases]
    plans = {name: make_plan(design, card=card) for name, design in parts}
    write_atomically(place / COMPARISON, lambda path: path.write_text(noted(cases), "utf-8"))
    total = sum(design.trials * design.condition_count() for _, design in parts)
    before = ComparisonProgress(0, total, 0, [], [])
    for name, plan in plans.items():
        now = before

        def advance(done: RunProgress, before: ComparisonProgress = before) -> None:
            nonlocal now
            now = ComparisonProgress(
                before.trials + done.trials,
                before.of,
                before.steps + done.steps,
                done.damaged,
                done.changed,
            )
            report(now)

        run_experiment(plan, place / name, backend=backend, report=advance)
        before = now


def noted(cases: Sequence[Case]) -> str:
    """What a folder notes of cases, as JSON."""
    content: dict[str, Any] = {
        "version": qbumpers.__version__,
        "command": command(cases),
        "methods": {
            name: {"dial": method.dial, "formula": method.formula}
            for name, method in METHODS.items()
        },
        "cases": [
            {
                "task": case.task,
                "learner": case.learner,
                "folder": case.folder,
                "best": case.best,
                "spread": case.spread,
                "settings": [each._asdict() for each in case.settings],
                "left_out": dict(case.left_out),
            }
            for case in cases
        ],
    }
    return json.dumps(content, indent=1)
