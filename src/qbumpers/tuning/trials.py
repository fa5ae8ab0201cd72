"""Trials for a race: run when it needs them, and kept as a run of the experiment keeps them."""

import contextlib
from collections.abc import Callable, Collection, Iterable
from typing import NamedTuple

import numpy as np
import polars as pl

from qbumpers.experiments.cells import Cell
from qbumpers.experiments.plan import Plan, estimated_seconds
from qbumpers.experiments.run import Backend
from qbumpers.experiments.tables import EPISODES
from qbumpers.experiments.writing import Store


class TuningProgress(NamedTuple):
    """How far the tuning is.

    Attributes:
        trials: looked at, those of an earlier run included.
        of: trials of the whole experiment, of which most will not be needed.
        steps: how many steps learners took in this run.
        damaged: files of an earlier run that were damaged; their trials are run again.
        changed: why finished trials of an earlier run are simulated again, a sentence each.
    """

    trials: int
    of: int
    steps: int
    damaged: list[str]
    changed: list[str]


class Trials:
    """The trials of a plan's conditions, run when they are needed and kept in the store.

    With N trials per condition in the experiment, trials 0 to N - 1 are for races, and trials N to
    2N - 1 for measuring anew.

    Args:
        plan: the experiment, made ready.
        store: where trials are kept, and found if they were run before.
        backend: where to run.
        report: called with the progress at first and after each cell.

    Attributes:
        contents: digests of the conditions, in the order of the experiment.
        length: N.
        raced: how many trials of a content were looked at in races.
        fresh: how many were looked at for measuring it anew.
    """

    def __init__(
        self, plan: Plan, store: Store, backend: Backend, report: Callable[[TuningProgress], None]
    ) -> None:
        self.contents = list(plan.conditions)
        self.length = plan.experiment.trials
        self.raced = dict.fromkeys(self.contents, 0)
        self.fresh = dict.fromkeys(self.contents, 0)
        self._plan, self._store, self._backend, self._report = plan, store, backend, report
        self._means = {c: np.full((2 * self.length, 2), np.nan) for c in self.contents}
        survey = store.survey(self.length)
        self._cells = survey.cells
        self._seconds = estimated_seconds(plan, [Cell(c, 0, 1) for c in self.contents])
        of = self.length * len(self.contents)
        self._progress = TuningProgress(0, of, 0, survey.damaged, survey.changed)
        report(self._progress)

    def race(self, contents: Collection[str], trials: int) -> None:
        """Look at the first trials of conditions."""
        self._look([Cell(c, self.raced[c], max(0, trials - self.raced[c])) for c in contents])
        for content in contents:
            self.raced[content] = max(self.raced[content], trials)

    def measure_anew(self, content: str) -> None:
        """Look at trials of a condition that are in no race."""
        self._look([Cell(content, self.length, self.length)])
        self.fresh[content] = self.length

    def of_race(self, content: str, trials: int) -> np.ndarray:
        """Assisted and unassisted returns of a condition's first trials, float64 [2, T]."""
        return self._means[content][:trials].T

    def of_fresh(self, content: str) -> np.ndarray:
        """The same of its fresh trials."""
        return self._means[content][self.length :].T

    def _look(self, wanted: list[Cell]) -> None:
        """Have trials read, and run first if they are missing."""
        size = self._plan.experiment.trials_a_cell()
        missing = [cell for span in wanted for cell in gaps(span, self._cells[span.content], size)]
        rates = {cell.content: seconds for cell, seconds in self._seconds.items()}
        seconds = {cell: rates[cell.content] * cell.trials for cell in missing}
        with contextlib.closing(self._backend(self._plan, seconds)) as work:
            for finished in work:
                self._store.write(finished.cell, finished.files)
                self._cells[finished.cell.content].append(finished.cell)
                self._advance(finished.cell.trials, finished.steps)
        for span in wanted:
            self._read(span)
        self._advance(sum(cell.trials for cell in wanted) - sum(cell.trials for cell in missing), 0)

    def _read(self, span: Cell) -> None:
        means = self._means[span.content]
        for cell in self._cells[span.content]:
            overlaps = cell.first < span.end and span.first < cell.end
            if overlaps and np.isnan(means[cell.first : cell.end]).any():
                found = trial_returns(self._store.read(cell, EPISODES))
                means[cell.first : cell.end] = found[: len(means) - cell.first]

    def _advance(self, trials: int, steps: int) -> None:
        self._progress = self._progress._replace(
            trials=self._progress.trials + trials, steps=self._progress.steps + steps
        )
        self._report(self._progress)


def trial_returns(episodes: pl.DataFrame) -> np.ndarray:
    """Assisted and unassisted return of each trial, means over its training episodes.

    Args:
        episodes: of one condition, as in `episodes.parquet`.

    Returns:
        float64 [T, 2], trials by number, in reward units.
    """
    returns = pl.col("assisted_return", "unassisted_return")
    training = episodes.filter(~pl.col("retention"))
    return training.group_by("trial").agg(returns.mean()).sort("trial").drop("trial").to_numpy()


def gaps(span: Cell, finished: Iterable[Cell], size: int) -> list[Cell]:
    """Cells for those trials of a span that no finished cell holds.

    Args:
        span: trials that are wanted, as one cell.
        finished: cells of its content; they may overlap.
        size: new cells end at multiples of it at the latest.

    Returns:
        Cells in the order of their trials, which neither overlap each other nor finished ones.
    """
    missing: list[Cell] = []
    finished, place = list(finished), span.first
    while place < span.end:
        here = [cell.end for cell in finished if cell.first <= place < cell.end]
        if here:
            place = max(here)
            continue
        later = [cell.first for cell in finished if cell.first > place]
        end = min([span.end, (place // size + 1) * size, *later])
        missing.append(Cell(span.content, place, end - place))
        place = end
    return missing
