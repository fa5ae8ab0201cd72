"""Simulated learners at any task: `simulate`, and its parts for prepared conditions."""

import importlib.metadata
import itertools
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from typing import Any, Protocol, Unpack

import numpy as np

from qbumpers.assistants import Assistant
from qbumpers.compilation import compiles, compiling_together, shortened
from qbumpers.decisions import Step
from qbumpers.errors import RequestError, whole_number
from qbumpers.simulation import deep, tabular
from qbumpers.simulation.condition import Condition, Setup, make_condition
from qbumpers.simulation.cuda.devices import (
    PROCESSOR,
    REVISION,
    Card,
    device_of,
    why_not_compiled,
)
from qbumpers.simulation.outcomes import Script, Simulation, TrialMeans, joined, trial_means
from qbumpers.simulation.workers import make_pool, some_finished
from qbumpers.tasks import Task
from qbumpers.tasks.registry import Named


def simulate(
    task: Task | Named,
    assistant: Assistant | str,
    *,
    trials: int | range = 100,
    seed: int = 0,
    workers: int = 1,
    device: str = PROCESSOR,
    precision: str = "float64",
    **setup: Unpack[Setup],
) -> Simulation:
    """Simulate learners who learn a task with an assistant (Section 4.2).

    A trial is one learner: `episodes` times an assisted episode from which it learns, then a greedy
    unassisted one from which it does not. Equal arguments give equal numbers, whatever the number
    of workers and whichever trials are run together.

    Args:
        task: what is to be learned: a task, or what `make_task` makes one of, for instance
            "cliff-walking"; of a Gymnasium environment, give its `discount` too.
        assistant: an assistant, or the name of one that needs no options.
        trials: how many, at least 1; or which.
        seed: decides, with the condition and the number of a trial, all chance; not negative.
        workers: threads, or processes if a task steps in Python.
        device: "gpu" for a graphics card, "gpu:1" for the second one, if the task has a table.
        precision: on a card, "float32" keeps tables, values and rewards in half the memory.
        **setup: `learner`, `perception`, `episodes` and others, see `Setup`.

    Returns:
        Outcomes by trial and episode, and counts by state.

    Raises:
        RequestError: as `make_condition`, for a number of trials below 1 or a negative seed, and if
            there is no such device or the condition cannot be simulated there.
    """
    card = device_of(device, precision)
    condition = make_condition(task, assistant, **setup)
    return run(condition, trials=trials, seed=seed, workers=workers, card=card)


def simulate_means(
    task: Task | Named,
    assistant: Assistant | str,
    *,
    trials: int | range = 100,
    seed: int = 0,
    workers: int = 1,
    device: str = PROCESSOR,
    precision: str = "float64",
    **setup: Unpack[Setup],
) -> TrialMeans:
    """The means of each trial that `simulate` simulates, for many trials: no episode is kept.

    A graphics card finds them itself, which spares it to send what each of a million learners did
    in every episode. Sums may be taken in another order than on a processor.

    Args:
        task: as for `simulate`.
        assistant: likewise.
        trials: likewise.
        seed: likewise.
        workers: likewise.
        device: likewise.
        precision: likewise.
        **setup: likewise; episodes of `retention` have no part in the means.

    Raises:
        RequestError: as `simulate`.
    """
    card = device_of(device, precision)
    condition = make_condition(task, assistant, **setup)
    if card is None:
        found = run(condition, trials=trials, seed=seed, workers=workers)
        return trial_means(found.outcomes, condition.episodes)
    which = _checked_trials(trials, seed)
    check_for_card(condition)
    from qbumpers.simulation.cuda.engine import run_means

    with _compiling(condition, "on a GPU", why_not_compiled):
        return run_means(condition, which, seed, card)


def run(
    condition: Condition,
    *,
    trials: int | range,
    seed: int = 0,
    workers: int = 1,
    card: Card | None = None,
) -> Simulation:
    """Simulate a condition, on a card if one is given; `simulate` says what the others mean."""
    which = _checked_trials(trials, seed)
    if card is not None:
        return joined(list(run_on_card(condition, [which], seed, card)))
    workers = whole_number(workers, "workers", "from 1 up")
    if workers < 1:
        raise RequestError(f"workers = {workers!r}; at least 1 is needed")
    ends = np.linspace(0, len(which), min(workers, len(which)) + 1).astype(int).tolist()
    ranges = [which[first:last] for first, last in itertools.pairwise(ends)]
    if len(ranges) == 1:
        return _run_block(condition, ranges[0], seed)
    with make_pool({"": condition}, workers) as pool:
        blocks = [pool.submit(_run_block, "", each, seed) for each in ranges]
        waiting = set(blocks)
        while waiting:
            done, waiting = some_finished(waiting)
            for block in done:
                block.result()  # raises at once what went wrong
        return joined([block.result() for block in blocks])


def run_on_card(
    condition: Condition, groups: Iterable[range], seed: int, card: Card
) -> Iterator[Simulation]:
    """Simulate groups of trials on a card, with counts of states for each group.

    Args:
        condition: what to simulate.
        groups: which trials, ranges of step 1.
        seed: the experiment's, for the random streams.
        card: from `device_of`.

    Yields:
        What each group found, in their order.

    Raises:
        RequestError: what a rule or learner raises in a trial, and if one of them, or the task,
            cannot be simulated on a card.
    """
    check_for_card(condition)
    from qbumpers.simulation.cuda.engine import run_groups

    with _compiling(condition, "on a GPU", why_not_compiled):
        yield from run_groups(condition, groups, seed, card)


def check_for_card(condition: Condition) -> None:
    """Check what can be seen of a condition without compiling it.

    Raises:
        RequestError: if it cannot be simulated on a card.
    """
    assistant, learner = condition.assistant, condition.learner_type
    if not condition.task.states:
        raise RequestError(
            f"task {condition.task.name}: on a GPU only tasks with a table are simulated"
        )
    plain = [f"assistant {rule.name}" for rule in assistant.chain if not rule.compiled]
    plain += [] if learner.compiled else [f"learner {learner.name}"]
    if plain and compiles():
        raise RequestError(
            f"{plain[0]}: it runs as plain Python, and on a GPU only compiled code does"
        )


def made_by(task: Task, card: Card | None) -> dict[str, Any]:
    """What simulates a task, as it enters the identity of its results.

    Args:
        task: what is learned.
        card: where; None for the processor.

    Returns:
        `revision` and `precision`; of a card also `gpu`, its own revision and compiler.
    """
    engine = engine_of(task)
    if card is None:
        return {"revision": engine.REVISION, "precision": engine.PRECISION}
    return {
        "revision": engine.REVISION,
        "precision": card.precision,
        "gpu": {"revision": REVISION, "numba-cuda": importlib.metadata.version("numba-cuda")},
    }


def _run_block(condition: Condition, trials: range, seed: int) -> Simulation:
    with _compiling(condition):
        return engine_of(condition.task).run_block(condition, trials, seed)


def _compiling(
    condition: Condition, where: str = "", reason: Callable[[BaseException], str] = shortened
) -> AbstractContextManager[None]:
    parts = [f"assistant {condition.assistant.name}", f"learner {condition.learner_type.name}"]
    return compiling_together(", ".join([*parts, where] if where else parts), reason)


class Engine(Protocol):
    """What simulates trials of one kind of task: `qbumpers.simulation.tabular` or `deep`.

    Attributes:
        REVISION: raised when the numbers that it gives change.
        PRECISION: of those numbers.
    """

    REVISION: int
    PRECISION: str

    def run_block(self, condition: Condition, trials: range, seed: int) -> Simulation:
        """Simulate trials of a condition, one after another on one core.

        Args:
            condition: what to simulate.
            trials: which trials.
            seed: the experiment's, for the random streams.
        """
        ...

    def record(
        self,
        condition: Condition,
        trials: range,
        seed: int,
        script: Script | None,
        interpreted: bool = False,
    ) -> Step:
        """Every step of training of one trial; `qbumpers.simulation.record` says more.

        Args:
            condition: what to simulate.
            trials: a range of one trial.
            seed: the experiment's, for the random streams.
            script: proposals and noise to be played again; None to draw them.
            interpreted: whether to run compiled code as plain Python, to be compared with.
        """
        ...


def engine_of(task: Task) -> Engine:
    """The engine for a task: by whether its states are numbered or observed as vectors."""
    return tabular if task.states else deep


def record(
    condition: Condition, *, trial: int = 0, seed: int = 0, script: Script | None = None
) -> Step:
    """Every step of training of one trial.

    Args:
        condition: what to simulate.
        trial: which trial.
        seed: as for `simulate`.
        script: proposals and noise to be played again, in place of a learner's and fresh noise;
            the trial ends with the script.

    Returns:
        A table of steps: `Step` of arrays [N].

    Raises:
        RequestError: if the trial, the seed or the script is out of range.
    """
    if script is not None:
        _check_script(script, condition.task.actions)
    trials = _checked_trials(range(trial, trial + 1), seed)
    with _compiling(condition):
        return engine_of(condition.task).record(condition, trials, seed, script)


def _checked_trials(trials: int | range, seed: int) -> range:
    if not isinstance(seed, int) or seed < 0:
        raise RequestError(f"seed = {seed!r}; a whole number, not negative, is needed")
    which = range(trials) if isinstance(trials, int) else trials
    if not isinstance(which, range) or len(which) < 1 or min(which) < 0:
        raise RequestError(f"trials = {trials!r}; at least 1, or a range from 0 up, is needed")
    return which


def _check_script(script: Script, actions: int) -> None:
    lengths = {len(part) for part in script}
    if len(lengths) != 1:
        raise RequestError(
            f"script: its parts have lengths {sorted(lengths)}; one length is needed"
        )
    proposed = np.asarray(script.proposed)
    if len(proposed) and not 0 <= proposed.min() <= proposed.max() < actions:
        raise RequestError(f"script: proposed actions must lie in [0, {actions})")
    noise = np.concatenate([script.coin, script.tie])
    if not ((noise >= 0) & (noise < 1)).all():
        raise RequestError("script: coin and tie must lie in [0, 1)")
