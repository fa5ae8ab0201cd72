"""Conditions race each other: those that are clearly no choice stop early."""

import contextlib
import math
import warnings
from collections.abc import Collection, Generator, Sequence
from typing import TYPE_CHECKING

from qbumpers.analysis.statistics import mean_interval
from qbumpers.errors import RequestError
from qbumpers.tuning.trials import Trials

if TYPE_CHECKING:
    from optuna import Study

CHOSEN, UNCONFIRMED, KEPT, WORSE, BELOW, UNSURE = (
    "chosen",
    "not confirmed",
    "kept to the end",
    "teaches worse",
    "below the floor",
    "not significantly above the floor",
)
"""What became of a condition."""

CAUTION = 0.01
"""Significance, one-sided, at which a condition leaves the race at any one look."""

FIRST_LOOK = 8
"""The fewest trials whose Wilcoxon test can be significant: eight of one sign have 2**-8."""


class Race:
    """Conditions against each other: an Optuna study whose trials are conditions.

    The steps that Optuna's Wilcoxon pruner pairs are the trials of the experiment. It compares with
    the best condition that is complete, so the one that teaches best at the first look goes first.
    """

    def __init__(
        self, trials: Trials, entrants: Sequence[str], floor: float, confidence: float
    ) -> None:
        self._trials, self._floor, self._confidence = trials, floor, confidence
        self._study = _study()
        self._entries = {content: self._study.ask() for content in entrants}
        self._looked = dict.fromkeys(entrants, 0)
        self._racing = list(entrants)
        self._verdicts: dict[str, str] = {}

    def run(self) -> dict[str, str]:
        """Race to the end; the verdict on each condition."""
        first, *later = looks(self._trials.length)
        self._look(self._racing, first)
        while self._racing and KEPT not in self._verdicts.values():
            self._finish(max(self._racing, key=self._teaching))
        for trials in later:
            self._drop_worse()
            self._look(self._racing, trials)
        self._drop_worse()
        for content in list(self._racing):
            self._finish(content)
        return self._verdicts

    def winner(self) -> str | None:
        """The condition that teaches best of those that were kept to the end."""
        kept = [content for content in self._looked if self._verdicts[content] == KEPT]
        return max(kept, key=self._teaching, default=None)

    def _teaching(self, content: str) -> float:
        return float(self._trials.of_race(content, self._looked[content])[1].mean())

    def _look(self, contents: Collection[str], trials: int) -> None:
        """Look at more trials of conditions, and drop those that are below the floor."""
        self._trials.race(contents, trials)
        for content in list(contents):
            assisted, unassisted = self._trials.of_race(content, trials)
            for number in range(self._looked[content], trials):
                self._entries[content].report(float(unassisted[number]), number)
            self._looked[content] = trials
            if mean_interval(assisted, 1 - 2 * CAUTION).high < self._floor:
                self._leave(content, BELOW)

    def _drop_worse(self) -> None:
        for content in list(self._racing):
            if self._entries[content].should_prune():
                self._leave(content, WORSE)

    def _finish(self, content: str) -> None:
        """Look at all trials of a condition; it is kept if it is significantly above the floor."""
        self._look([content], self._trials.length)
        if content not in self._racing:
            return
        assisted, _ = self._trials.of_race(content, self._trials.length)
        sure = mean_interval(assisted, self._confidence).low > self._floor
        self._leave(content, KEPT if sure else UNSURE)
        if sure:
            self._study.tell(self._entries[content], self._teaching(content))

    def _leave(self, content: str, verdict: str) -> None:
        self._racing.remove(content)
        self._verdicts[content] = verdict


def looks(trials: int) -> list[int]:
    """After how many trials the conditions of a race are compared.

    Args:
        trials: how many trials per condition the experiment has.

    Returns:
        A twentieth of the trials (at least `FIRST_LOOK`), then twice as many each time, to all.
    """
    counts = [max(FIRST_LOOK, math.ceil(trials / 20))]
    while counts[-1] < trials:
        counts.append(2 * counts[-1])
    return [*counts[:-1], trials]


def _study() -> "Study":
    import optuna

    pruner = optuna.pruners.WilcoxonPruner(p_threshold=CAUTION)
    return optuna.create_study(direction="maximize", pruner=pruner)


@contextlib.contextmanager
def quiet() -> Generator[None, None, None]:
    """Optuna without its log, and without the warning that its pruner may change one day."""
    try:
        import optuna
    except ImportError as error:
        raise RequestError("tuning needs Optuna: pip install 'qbumpers[tune]'") from error
    before = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            yield
    finally:
        optuna.logging.set_verbosity(before)
