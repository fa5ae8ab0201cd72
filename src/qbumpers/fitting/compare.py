"""Which of several learners explains the proposals of participants best."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from qbumpers.analysis.statistics import UNKNOWN, bootstrap_interval
from qbumpers.decisions import Step
from qbumpers.errors import RequestError, counted, whole_number
from qbumpers.fitting.candidates import (
    Candidate,
    Likelihood,
    choices_of,
    make_candidate,
    suits,
)
from qbumpers.fitting.estimate import Estimate, estimate, interval, total_log_likelihood
from qbumpers.fitting.likelihood import Choices
from qbumpers.learners import Perception, learners
from qbumpers.learners.interface import Shape
from qbumpers.random_streams import content_words

PERCEPTIONS = ("transition", "observant", "interruption")
"""Perceptions that are compared if none are named; the others add a penalty of unknown size."""

FEWEST = 5
"""Participants without whom a bootstrap over them means nothing."""

CHANCE = "chance"
"""Name of the comparison with every action alike."""


class Progress(NamedTuple):
    """How far a fit is.

    Attributes:
        done: searches that are finished.
        of: searches of the whole fit.
    """

    done: int
    of: int


class Fitted(NamedTuple):
    """Which learner explains the proposals.

    Attributes:
        scores: a row per participant and model, see `qbumpers.fitting.fit`.
        parameters: a row per participant, model and estimated parameter.
        models: a row per model, the best one first.
    """

    scores: pl.DataFrame
    parameters: pl.DataFrame
    models: pl.DataFrame

    @property
    def best(self) -> str:
        """The model of the largest held-out log-likelihood over all participants."""
        return str(self.models["model"][0])


class _Person(NamedTuple):
    name: str
    choices: Choices
    training: int

    def folds(self, folds: int) -> np.ndarray:
        """In which fold each proposal is, by the place of its episode: int64 [N]."""
        return np.unique(self.choices.episode, return_inverse=True)[1] % folds


class _Search(NamedTuple):
    folds: int
    particles: int
    seed: int
    shape: Shape


def fit(
    participants: Mapping[str, Step],
    *,
    learners: Sequence[str] | None = None,
    perceptions: Sequence[str | Perception] | None = None,
    free: Sequence[str] = (),
    fixed: Mapping[str, float] | None = None,
    training: int | None = None,
    folds: int = 2,
    particles: int = 100,
    intervals: bool = True,
    seed: int = 0,
    report: Callable[[Progress], None] | None = None,
) -> Fitted:
    """Find the learner that explains the proposals of participants best.

    Every learner is fitted to every participant by maximum likelihood. What compares them is the
    log-likelihood of held-out proposals: a fold is every `folds`-th episode; its proposals are
    scored with the parameters that the other episodes give, while the learner lives through all.

    `scores` has the columns participant, model, learner, perception, steps, free (how many
    parameters), log_likelihood, error (of the particle filter), impossible (proposals that could
    not be), bic and held_out. `parameters` has participant, model, parameter, estimate, low and
    high, the interval at 95% for the best model. `models` has model, learner, perception,
    log_likelihood, bic and held_out summed over participants; probability, the geometric mean of
    what held-out proposals were given; behind, the mean difference of held_out per participant from
    the best model, with low and high from a bootstrap over participants if there are `FEWEST`; and
    best_for, for how many participants it is the best.

    Args:
        participants: a table of steps of each, for instance of `load_steps`.
        learners: registered names; every one of numbered states if None.
        perceptions: of overridden steps; `PERCEPTIONS` if None. If no step was overridden they
            cannot be told apart, and one is compared. Learners go without those that do not suit
            them.
        free: further parameters to be estimated, of the learners that have them.
        fixed: parameters that are not estimated, of the learners that have them, with their values.
        training: episodes over which schedules are counted; those that a participant has if None.
        folds: at least 2.
        particles: simulated learners, if something is hidden.
        intervals: whether to find them.
        seed: of starting points, particles and the bootstrap.
        report: called after each search.

    Returns:
        What was found.

    Raises:
        RequestError: if there is nobody, a name is unknown, a number is out of range, states are
            vectors, or somebody has fewer episodes than there are folds.
    """
    if not participants:
        raise RequestError("participants = {}; at least one is needed")
    _check_whole(folds=(folds, 2), particles=(particles, 1), seed=(seed, 0))
    people = [_person(name, steps, training, folds) for name, steps in participants.items()]
    shape = _shape(participants, people)
    candidates = list(_candidates(people, learners, perceptions, free, fixed or {}))
    search = _Search(folds, particles, seed, shape)
    found: dict[tuple[str, str], tuple[Estimate, float]] = {}
    for person in people:
        for candidate in candidates:
            found[person.name, candidate.name] = _explained(person, candidate, search)
            if report is not None:
                report(Progress(len(found), len(people) * len(candidates)))
    scores = _scores(people, candidates, found, len(shape.width))
    models = compare(scores, seed)
    parameters = pl.concat([
        _parameters(person, candidate, search, found[person.name, candidate.name][0],
                    intervals and candidate.name == models["model"][0])
        for person in people for candidate in candidates
    ])  # fmt: skip
    return Fitted(scores, parameters, models)


def _check_whole(**given: tuple[Any, int]) -> None:
    for name, (number, least) in given.items():
        if whole_number(number, name, f"from {least} up") < least:
            raise RequestError(f"{name} = {number!r}; at least {least} is needed")


def _person(name: str, steps: Step, training: int | None, folds: int) -> _Person:
    choices = choices_of(steps, f"participant {name}")
    episodes = len(np.unique(choices.episode))
    if episodes < folds:
        raise RequestError(
            f"folds = {folds}; participant {name} has {counted(episodes, 'episode')}, and each "
            "fold needs one"
        )
    if training is not None:
        _check_whole(training=(training, 1))
    return _Person(name, choices, training or int(choices.episode.max()) + 1)


def _shape(participants: Mapping[str, Step], people: Sequence[_Person]) -> Shape:
    widths = {np.asarray(steps.values).shape[1] for steps in participants.values()}
    if len(widths) > 1:
        raise RequestError(f"participants: {sorted(widths)} actions; all must have as many")
    columns = [c for p in people for c in (p.choices.state, p.choices.next_state)]
    return Shape(1 + max(int(c.max()) for c in columns), 0, (0,) * widths.pop())


def _candidates(
    people: Sequence[_Person], names: Sequence[str] | None,
    perceptions: Sequence[str | Perception] | None, free: Sequence[str], fixed: Mapping[str, float],
) -> Iterator[Candidate]:  # fmt: skip
    """Learners to be compared; each with what it has of the free and fixed parameters."""
    kinds = learners()
    chosen = names or [name for name, kind in kinds.items() if kind.observes == "states"]
    overridden = any(
        (p.choices.executed != p.choices.proposed).any() or p.choices.undone.any() for p in people
    )
    unknown = {*free, *fixed}
    for name in chosen:
        seen = perceptions or PERCEPTIONS
        suiting = [each for each in seen if name not in kinds or suits(name, each)]
        if not suiting:
            raise RequestError(f"perceptions = {list(seen)!r}; learner {name} suits none of them")
        for perception in suiting if overridden else suiting[:1]:
            every = make_candidate(name, perception)
            known = every.parameters()
            unknown -= known
            yield make_candidate(
                name, perception, [each for each in free if each in known],
                {each: value for each, value in fixed.items() if each in known},
            )  # fmt: skip
    if unknown:
        raise RequestError(
            f"parameter {', '.join(sorted(unknown))}: none of the learners {', '.join(chosen)} "
            "has it"
        )


def _explained(person: _Person, candidate: Candidate, search: _Search) -> tuple[Estimate, float]:
    """The estimate from all proposals, and the log-likelihood of held-out ones."""
    likelihood = _likelihood(person, candidate, search)
    folds, held_out = person.folds(search.folds), 0.0
    for fold in range(search.folds):
        parameters = estimate(likelihood, folds != fold, search.seed).parameters
        held_out += total_log_likelihood(likelihood, parameters, folds == fold)[0]
    return estimate(likelihood, seed=search.seed), held_out


def _likelihood(person: _Person, candidate: Candidate, search: _Search) -> Likelihood:
    return Likelihood(
        candidate, person.choices, search.shape, person.training, search.particles, search.seed
    )


def _scores(
    people: Sequence[_Person], candidates: Sequence[Candidate],
    found: Mapping[tuple[str, str], tuple[Estimate, float]], actions: int,
) -> pl.DataFrame:  # fmt: skip
    rows = []
    for person in people:
        steps = len(person.choices.episode)
        alike = -steps * math.log(actions)
        rows.append((person.name, CHANCE, CHANCE, "", steps, 0, alike, 0.0, 0, -2 * alike, alike))
        for candidate in candidates:
            best, held_out = found[person.name, candidate.name]
            rows.append((
                person.name, candidate.name, candidate.learner, candidate.perception, steps,
                len(candidate.free), best.log_likelihood, best.error, best.impossible, best.bic,
                held_out,
            ))  # fmt: skip
    columns = ("participant", "model", "learner", "perception", "steps", "free", "log_likelihood",
               "error", "impossible", "bic", "held_out")  # fmt: skip
    return pl.DataFrame(rows, columns, orient="row")


def _parameters(
    person: _Person, candidate: Candidate, search: _Search, best: Estimate, intervals: bool
) -> pl.DataFrame:
    likelihood = _likelihood(person, candidate, search) if intervals else None
    rows = [
        (person.name, candidate.name, name, value,
         *(interval(likelihood, best, name) if likelihood else (None, None)))
        for name, value in best.parameters.items()
    ]  # fmt: skip
    schema = {
        "participant": pl.String, "model": pl.String, "parameter": pl.String,
        "estimate": pl.Float64, "low": pl.Float64, "high": pl.Float64,
    }  # fmt: skip
    return pl.DataFrame(rows, schema, orient="row")


def compare(scores: pl.DataFrame, seed: int = 0) -> pl.DataFrame:
    """Models over all participants, the best one first.

    Args:
        scores: a row per participant and model, as `fit` makes them.
        seed: decides which participants are resampled.

    Returns:
        A row per model; `fit` says which columns. Where a model could not be, for one participant
        at least, its sums and its difference are infinite, and there is no interval.
    """
    held_out = {
        str(model): part.sort("participant")["held_out"].to_numpy()
        for (model,), part in scores.group_by("model", maintain_order=True)
    }
    order = sorted(held_out, key=lambda model: -float(held_out[model].sum()))
    most = np.max([*held_out.values()], axis=0)
    rows = []
    for model in order:
        part = scores.filter(pl.col("model") == model)
        steps = float(part["steps"].to_numpy().sum())
        behind = held_out[model] - held_out[order[0]]
        rows.append({
            "model": model, "learner": part["learner"][0], "perception": part["perception"][0],
            "log_likelihood": part["log_likelihood"].sum(), "bic": part["bic"].sum(),
            "held_out": part["held_out"].sum(),
            "probability": math.exp(float(held_out[model].sum()) / steps),
            **_behind(behind, [seed, *content_words({"behind": model})]),
            "best_for": int((held_out[model] == most).sum()),
        })  # fmt: skip
    return pl.DataFrame(rows)


def _behind(differences: np.ndarray, words: Sequence[int]) -> dict[str, float | None]:
    found = UNKNOWN._replace(mean=float(differences.mean()))
    if len(differences) >= FEWEST and np.isfinite(differences).all():
        generator = np.random.default_rng(words)
        found = bootstrap_interval([differences], np.mean, generator, method="percentile")
    low, high = (None if math.isnan(each) else each for each in found[1:])
    return {"behind": found.mean, "low": low, "high": high}
