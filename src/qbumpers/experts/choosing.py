"""Several experts trained alike, judged by a rule fixed beforehand, and the best of them kept."""

import math
import uuid
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from qbumpers.errors import RequestError
from qbumpers.experts.checking import ExpertWarning, MeanWithError, mean_with_error
from qbumpers.experts.episodes import Episode, discounted_return, play_several
from qbumpers.experts.training import Recipe, train_expert
from qbumpers.random_streams import content_digest
from qbumpers.source import meaning_of
from qbumpers.tasks.task import Task
from qbumpers.values.network import NetworkValues
from qbumpers.values.tabular import load_values

SETTINGS = ((0.02, 0), (0.1, 0), (0.02, 50))
"""Epsilon and random actions at the start of the episodes that judge, in turn."""

EPISODES = 100
"""That judge, of each setting."""

_FAR = 0.2  # share of what is achieved by which values may be off at the start


class Judgement(NamedTuple):
    """How an expert fares.

    Attributes:
        merits: in the episodes of each of `SETTINGS`, the share of successes, or the mean return
            if the task tells no success.
        greedy_return: undiscounted, of greedy episodes.
        start_value: V(s_0).
        start_return: discounted return of greedy episodes.
        crash_value: mean Q of the action that crashed, in the episodes that judge; None if
            nothing crashed.
    """

    merits: tuple[MeanWithError, ...]
    greedy_return: MeanWithError
    start_value: MeanWithError
    start_return: MeanWithError
    crash_value: MeanWithError | None


def check_claim(task: Task, judgement: Judgement) -> bool:
    """Whether values promise what greedy episodes achieve; warn if they do not.

    Args:
        task: what was played.
        judgement: what the values promised and achieved.

    Returns:
        Whether V(s_0) is within three standard errors of the discounted return, or within a fifth
        of it.

    Warns:
        ExpertWarning: if it is not.
    """
    claimed, achieved = judgement.start_value, judgement.start_return
    error = math.hypot(claimed.error, achieved.error)
    allowed = max(3 * error, _FAR * abs(achieved.mean))
    if abs(claimed.mean - achieved.mean) <= allowed:
        return True
    warnings.warn(
        f"values of task {task.name}: they predict a discounted return of {claimed.mean:.1f} from "
        f"the start, and greedy episodes achieve {achieved.mean:.1f}; assistants that go by the "
        "projected return, as bumpers do, override too late or too often by such values: correct "
        "them, qbumpers expert --check FILE --corrected FILE",
        ExpertWarning,
        stacklevel=2,
    )
    return False


def judge(task: Task, values: NetworkValues, *, episodes: int = EPISODES) -> Judgement:
    """Judge an expert.

    Args:
        task: what it is to be good at.
        values: Q* of the expert.
        episodes: how many are played in each of `SETTINGS`, at least 1.

    Returns:
        The judgement; equal values are judged alike.
    """
    played = [
        play_several(task, values, episodes, epsilon=epsilon, random_start=start)
        for epsilon, start in SETTINGS
    ]
    plain = play_several(task, values, min(10, episodes))
    crashes = [episode for several in played for episode in several if episode.crash]
    returns = [discounted_return(episode.rewards, values.discount) for episode in plain]
    return Judgement(
        merits=tuple(_merit(task, several) for several in played),
        greedy_return=mean_with_error(np.array([episode.rewards.sum() for episode in plain])),
        start_value=mean_with_error(np.array([values(e.observations[0]).max() for e in plain])),
        start_return=mean_with_error(np.array(returns)),
        crash_value=_last_value(values, crashes) if crashes else None,
    )


def _merit(task: Task, episodes: Iterable[Episode]) -> MeanWithError:
    if "success" in task.events:
        return mean_with_error(np.array([float(episode.success) for episode in episodes]))
    return mean_with_error(np.array([episode.rewards.sum() for episode in episodes]))


def _last_value(values: NetworkValues, episodes: Iterable[Episode]) -> MeanWithError:
    last = [values(episode.observations[-2])[episode.actions[-1]] for episode in episodes]
    return mean_with_error(np.array(last))


def best(judgements: Sequence[Judgement]) -> int:
    """Place of the best: by the first merit, among equals by the second, then by the third."""
    merits = [tuple(merit.mean for merit in judgement.merits) for judgement in judgements]
    return merits.index(max(merits))


def train_several(
    task: Task,
    recipe: Recipe,
    seeds: Iterable[int],
    folder: Path,
    report: Callable[[int, int], None] = lambda seed, steps: None,
) -> list[NetworkValues]:
    """Train an expert with each of several seeds; finished ones are kept and not trained again.

    Those of a task of a user's own are trained again if the code that steps it has changed, or
    cannot be known.

    Args:
        task: what they are to be good at.
        recipe: how each of them is trained.
        seeds: one per expert; each decides all chance of its training; not negative.
        folder: where each is kept.
        report: called with a seed and its steps done.

    Returns:
        The experts, in the order of the seeds.

    Raises:
        RequestError: as `train_expert`, and if a kept file is damaged.
    """
    experts: list[NetworkValues] = []
    for seed in seeds:
        content = content_digest([task.digest(), recipe.words(seed), *_own_code(task)]).hex()
        path = folder / f"seed-{seed}-{content[:12]}.npz"
        if not path.exists():
            train_expert(task, recipe, seed=seed, report=partial(report, seed)).save(path)
        values = load_values(path)
        if not isinstance(values, NetworkValues):
            raise RequestError(f"{path}: a table of values; delete it, it is not of this training")
        experts.append(values)
        report(seed, recipe.steps)
    return experts


def _own_code(task: Task) -> list[Any]:
    """What code of a user's own steps a task means; other code than this is another training."""
    meaning = meaning_of({"task": task.code})
    if not meaning.modules:
        return []
    unknown = [uuid.uuid4().hex] if meaning.unknown else []
    return [meaning.code, meaning.packages, *unknown]


def with_provenance(
    task: Task, values: NetworkValues, judgement: Judgement, seeds: Sequence[int]
) -> NetworkValues:
    """The same values, with how they were chosen and what they reach in their provenance."""
    kind = "success" if "success" in task.events else "return"
    reached = ", ".join(
        f"{merit.mean:.2f} at epsilon {epsilon:g}"
        + (f" after {start} random actions" if start else "")
        for merit, (epsilon, start) in zip(judgement.merits, SETTINGS, strict=True)
    )
    chosen = f"the best of seeds {', '.join(map(str, seeds))}; " if len(seeds) > 1 else ""
    return replace(values, method=f"{values.method}; {chosen}{kind} {reached}")
