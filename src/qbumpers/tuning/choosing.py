"""Finding the assistant that teaches best above a required performance, with few trials.

A race of an experiment's conditions. *Teaching* is the unassisted return and *performance* the
assisted one, each the mean over the training episodes of a trial. Conditions look at their first
trials together; those that are confidently below the floor or teach confidently worse than the
best one so far stop early, so that trials are spent where the choice is close.

What is said of the choice does not rest on the race, whose winner looks better than it is. With N
trials per condition in the experiment, the race uses trials 0 to N - 1. Its winner is then measured
on trials N to 2N - 1, which had no part in choosing it. It is confirmed if the lower end of
Student's two-sided interval of its assisted return, at the stated confidence 1 - d, is above the
floor: the chance of that is at most d/2 for a condition that is not above it. A winner that is not
confirmed leaves, the race is decided again among the others, and the next winner's intervals have
confidence 1 - d/2, the one's after that 1 - d/4, and so on. So the chance that a condition is
chosen that is not above the floor is below d/2 + d/4 + ... = d, however many conditions there are.
"""

import io
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import polars as pl
import tomli_w

from qbumpers.analysis.statistics import CONFIDENCE, IntervalEstimate, mean_interval
from qbumpers.assistants import Assistant
from qbumpers.errors import RequestError
from qbumpers.experiments.design import NamedCondition
from qbumpers.experiments.plan import Plan
from qbumpers.experiments.run import Backend, backend_of
from qbumpers.experiments.writing import open_store
from qbumpers.files import open_folder
from qbumpers.tuning.race import CHOSEN, UNCONFIRMED, Race, quiet
from qbumpers.tuning.trials import Trials, TuningProgress

TABLE, CHOICE = "tuning.csv", "tuning.toml"
"""Files that are added to the output folder: a row per condition, and the choice."""


class Contender(NamedTuple):
    """What became of a condition.

    Attributes:
        condition: its readable id.
        assistant: rule and options.
        trials: how many were spent on it.
        assisted: return with the assistant, in reward units.
        unassisted: the same without it. Both are of fresh trials alone if the
            condition was measured anew (chosen, or not confirmed), else of those of the race.
        confidence: that these two intervals have, in (0, 1).
        verdict: for example "teaches worse".
    """

    condition: str
    assistant: Assistant
    trials: int
    assisted: IntervalEstimate
    unassisted: IntervalEstimate
    confidence: float
    verdict: str


class Tuning(NamedTuple):
    """What tuning found.

    Attributes:
        floor: the assisted return that is needed, in reward units.
        confidence: with which the choice is above the floor, in (0, 1).
        contenders: all conditions, in the order of the experiment.
        grid_trials: how many trials the whole experiment has.
    """

    floor: float
    confidence: float
    contenders: list[Contender]
    grid_trials: int

    @property
    def choice(self) -> Contender | None:
        """The condition that teaches best above the floor; None if none is confirmed above."""
        chosen = [each for each in self.contenders if each.verdict == CHOSEN]
        return chosen[0] if chosen else None

    @property
    def nearest(self) -> Contender:
        """The condition with the largest assisted return."""
        return max(self.contenders, key=lambda each: each.assisted.mean)

    @property
    def trials(self) -> int:
        """Spent on all conditions together, those that were there already included."""
        return sum(each.trials for each in self.contenders)

    @property
    def saved(self) -> float:
        """Share of the whole experiment's trials that were not needed; negative if more were."""
        return 1 - self.trials / self.grid_trials


def tune(
    plan: Plan,
    folder: str | Path,
    floor: float,
    *,
    confidence: float = CONFIDENCE,
    backend: Backend | None = None,
    report: Callable[[TuningProgress], None] = lambda progress: None,
) -> Tuning:
    """Find the condition that teaches best among those that perform above a floor.

    Equal experiments and floors give equal choices, wherever the work is done and whatever of it
    was there already. A run of the same experiment into the folder uses the trials, and tuning
    uses those of a run.

    Args:
        plan: the experiment, made ready; its trials bound what a condition may take in the race.
        folder: of the results; tuning that was killed continues there.
        floor: assisted return that is needed, in reward units.
        confidence: that the choice is above the floor; the module says how it is meant.
        backend: where to run; if None, the card that the plan is made for, or all cores of this
            machine.
        report: called with the progress at first and after each cell, from the calling thread.

    Returns:
        The choice, if there is one, and what became of all conditions.

    Raises:
        RequestError: if Optuna is not installed, the experiment has several learners or a
            single trial, the floor or confidence is out of range, or as `run_experiment`.
        StoreError: if results cannot be written; finished cells stay.
    """
    _check(plan, floor, confidence)
    with quiet(), open_store(folder, plan.experiment, plan.record) as store:
        store.write_inputs(plan.values, plan.files)
        trials = Trials(plan, store, backend or backend_of(plan), report)
        verdicts, confidences = _decide(trials, floor, confidence)
        contenders = [
            _contender(trials, named, content, verdicts[content], confidences[content])
            for named, content in plan.named
        ]
        tuning = Tuning(floor, confidence, contenders, plan.experiment.trials * len(plan.named))
        open_folder(folder).write(TABLE, _table(tuning))
        open_folder(folder).write(CHOICE, _described(plan, tuning).encode())
    return tuning


def _check(plan: Plan, floor: float, confidence: float) -> None:
    learners, trials = len(plan.experiment.learners), plan.experiment.trials
    if learners > 1:
        raise RequestError(
            f"learners: there are {learners}; an assistant is chosen for one learner, keep one"
        )
    if trials < 2:
        raise RequestError(f"trials = {trials}; at least 2 are needed to tell how sure a choice is")
    if not math.isfinite(floor):
        raise RequestError(f"floor = {floor}; a finite return is needed")
    if not 0.5 <= confidence < 1:
        raise RequestError(f"confidence = {confidence}; at least 0.5 and below 1 is needed")


def _decide(
    trials: Trials, floor: float, confidence: float
) -> tuple[dict[str, str], dict[str, float]]:
    """Race and confirm until a condition is confirmed or none is left.

    Returns:
        The verdict on each condition, and the confidence of its intervals, by content.
    """
    verdicts = dict.fromkeys(trials.contents, "")
    confidences = dict.fromkeys(trials.contents, confidence)
    error = 1 - confidence
    entrants = trials.contents
    while True:
        race = Race(trials, entrants, floor, confidence)
        verdicts.update(race.run())
        winner = race.winner()
        if winner is None:
            return verdicts, confidences
        trials.measure_anew(winner)
        confidences[winner] = 1 - error
        if mean_interval(trials.of_fresh(winner)[0], 1 - error).low > floor:
            verdicts[winner] = CHOSEN
            return verdicts, confidences
        verdicts[winner] = UNCONFIRMED
        entrants = [content for content in entrants if content != winner]
        error /= 2


def _contender(
    trials: Trials, named: NamedCondition, content: str, verdict: str, confidence: float
) -> Contender:
    raced, fresh = trials.raced[content], trials.fresh[content]
    samples = trials.of_fresh(content) if fresh else trials.of_race(content, raced)
    assisted, unassisted = (mean_interval(values, confidence) for values in samples)
    return Contender(
        named.condition, named.assistant, raced + fresh, assisted, unassisted, confidence, verdict
    )


def _table(tuning: Tuning) -> bytes:
    rows = [
        {
            "condition": each.condition,
            "assistant": each.assistant.name,
            "trials": each.trials,
            **{f"assisted_{part}": value for part, value in each.assisted._asdict().items()},
            **{f"unassisted_{part}": value for part, value in each.unassisted._asdict().items()},
            "confidence": each.confidence,
            "verdict": each.verdict,
        }
        for each in tuning.contenders
    ]
    buffer = io.BytesIO()
    pl.DataFrame(rows).write_csv(buffer)
    return buffer.getvalue()


def _described(plan: Plan, tuning: Tuning) -> str:
    facts: dict[str, Any] = {
        "experiment": plan.experiment.name,
        "floor": tuning.floor,
        "confidence": tuning.confidence,
        "trials": tuning.trials,
        "grid_trials": tuning.grid_trials,
    }
    if tuning.choice is not None:
        assistant = tuning.choice.assistant
        facts["choice"] = tuning.choice.condition
        facts["assistants"] = [{"name": assistant.name, **assistant.described()}]
    return tomli_w.dumps(facts)
