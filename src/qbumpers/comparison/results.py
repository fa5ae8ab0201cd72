"""What a comparison left in its folder, read back: trials of every setting in every case."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from qbumpers.analysis.measures import trial_measures, trial_samples
from qbumpers.analysis.statistics import mean_interval
from qbumpers.comparison.running import ANCHOR_FOLDER, COMPARISON, METHOD_FOLDER
from qbumpers.errors import RequestError
from qbumpers.experiments.design import Experiment
from qbumpers.experiments.store import load

MEASURES = ("override_rate", "assisted", "unassisted")
"""What is known of a trial: share of overridden steps, and both returns."""


NARROW = 0.1
"""Share of the spread of Q* below which a side of a box is too narrow to compare in."""


class CaseResults(NamedTuple):
    """The trials of one case.

    Attributes:
        task: its name.
        learner: a kind, with what differs from its defaults.
        experiment: as run.
        best: the largest mean return that any policy has, in reward units.
        spread: of Q*, in reward units.
        left_out: why the task cannot carry a method, by its name.
        anchors: float64 [T, 3] of `none` and of `maximal`, the `MEASURES` of each trial.
        methods: float64 [K, T, 3] of each method, settings from much help to little.
        conditions: ids of those settings.
    """

    task: str
    learner: str
    experiment: Experiment
    best: float
    spread: float
    left_out: Mapping[str, str]
    anchors: Mapping[str, np.ndarray]
    methods: Mapping[str, np.ndarray]
    conditions: Mapping[str, list[str]]

    @property
    def reference(self) -> np.ndarray:
        """Assisted return of `none` and unassisted return of `maximal`, float64 [2]."""
        return np.array([self.anchors["none"][:, 1].mean(), self.anchors["maximal"][:, 2].mean()])

    @property
    def comparable(self) -> bool:
        """Whether performance and learning conflict: whether the box has two sides to speak of.

        Each must be at least `NARROW` of the spread of Q*, and three times the standard error that
        its anchor would have with as few trials as the methods.
        """
        sides = self.best - self.reference
        anchors = (self.anchors["none"][:, 1], self.anchors["maximal"][:, 2])
        errors = [each.std(ddof=1) / np.sqrt(self.experiment.trials) for each in anchors]
        return bool((sides > np.maximum(NARROW * self.spread, 3 * np.array(errors))).all())

    def beyond(self, method: str) -> bool:
        """Whether some setting of a method returns more than any policy, surely.

        One that takes steps back can: their rewards count.
        """
        lowest = [mean_interval(trials[:, 1]).low for trials in self.methods[method]]
        return max(lowest) > self.best + 1e-9


class Comparison(NamedTuple):
    """All that a folder holds.

    Attributes:
        version: of the package that ran it.
        command: repeats it.
        methods: dial and formula of each method, in words.
        cases: task by task.
    """

    version: str
    command: str
    methods: Mapping[str, Mapping[str, str]]
    cases: list[CaseResults]

    @property
    def names(self) -> list[str]:
        """Methods that some case has."""
        return [name for name in self.methods if any(name in each.methods for each in self.cases)]


def load_comparison(folder: str | Path) -> Comparison:
    """What a comparison left in its folder.

    Raises:
        RequestError: if there is none, or it is not finished.
    """
    place = Path(folder)
    try:
        noted = json.loads((place / COMPARISON).read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise RequestError(f"results folder {folder}: it holds no {COMPARISON}") from error
    cases = [_case(place, each) for each in noted["cases"]]
    return Comparison(noted["version"], noted["command"], noted["methods"], cases)


def _case(place: Path, noted: Mapping[str, Any]) -> CaseResults:
    anchors, _ = _samples(place / noted["folder"] / ANCHOR_FOLDER)
    samples, experiment = _samples(place / noted["folder"] / METHOD_FOLDER)
    conditions: dict[str, list[str]] = {}
    for setting in noted["settings"]:
        conditions.setdefault(setting["method"], []).append(setting["condition"])
    return CaseResults(
        task=noted["task"],
        learner=noted["learner"],
        experiment=experiment,
        best=noted["best"],
        spread=noted["spread"],
        left_out=noted["left_out"],
        anchors=anchors,
        methods={
            name: np.stack([samples[condition] for condition in ids])
            for name, ids in conditions.items()
        },
        conditions=conditions,
    )


def _samples(folder: Path) -> tuple[dict[str, np.ndarray], Experiment]:
    found = load(folder)
    return trial_samples(trial_measures(found.episodes), *MEASURES), found.experiment
