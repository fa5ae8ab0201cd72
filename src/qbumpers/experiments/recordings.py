"""Recorded steps as a Minari dataset, for offline reinforcement learning and imitation."""

import itertools
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from qbumpers.decisions import Step
from qbumpers.errors import RequestError, counted, unknown_name
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.store import kept_files, load
from qbumpers.imports import import_modules
from qbumpers.registration import files_from
from qbumpers.simulation import record
from qbumpers.tasks import Task
from qbumpers.tasks.dynamics import LIMIT, TERMINATED, TRUNCATED

INFOS = ("proposed", "undone", "credited", "overridden", "probability", "coin", "tie", "values",
         "projected_return")  # fmt: skip
"""What the `infos` of each step hold beside `trial` and `episode`; see `qbumpers.Step`."""

_VERSIONED = re.compile(r"-v\d+$")


def export_recording(
    folder: str | Path, condition: str, dataset: str, *, trials: int | range = 1
) -> int:
    """Play trials of a finished run again and keep every training step as a Minari dataset.

    Observations are numbers of states [N + 1], or vectors [N + 1, D]; actions are the executed ones
    [N]. Both are numbered as the environment that the task was made from numbers them. `infos` has
    the same keys in every episode, `INFOS` with `trial` and `episode`, as arrays [N + 1]: one entry
    for the reset, where numbers are -1 or NaN, and one per step. After a step that was undone, the
    observation is the one before it. Episodes in which the assistant is gone are there too, with
    probability 0.

    Q* and the files that options name are those that the folder keeps, and what is played is
    compared with the run.

    The dataset says how Gymnasium makes the environment, if it can, for Minari's
    `recover_environment`.

    Args:
        folder: output folder of the run.
        condition: a readable id in its `episodes.parquet`.
        dataset: name of the dataset to be made where Minari keeps its own, for instance
            "cliff/bumpers-v0".
        trials: how many of the run's trials, or which.

    Returns:
        How many episodes were written.

    Raises:
        RequestError: if the folder is not one of a finished run, the condition or a trial is not
            in it, what is played is not what was run, the dataset is there already or badly named,
            or Minari is not installed.
    """
    if not _VERSIONED.search(dataset):
        raise RequestError(
            f"dataset = {dataset!r}; a name with a version, such as 'cliff/bumpers-v0', is needed"
        )
    results = load(folder)
    if results.experiment.imports:  # so that what they register is known when it is read
        import_modules(results.experiment.imports, f"imports of {folder}")
        results = load(folder)
    noted = {each.condition: each for each in results.conditions}
    if condition not in noted:
        raise unknown_name("condition", condition, noted)
    which = _checked(trials, results.experiment.trials)
    files = [kept_files(folder, each) for each in (*results.conditions, noted[condition])]
    with files_from({name: numbers for found in files for name, numbers in found.items()}):
        plan = make_plan(results.experiment, results.values)
    contents = {named.condition: content for named, content in plan.named}
    chosen, seed = plan.conditions[contents[condition]], plan.experiment.seed
    episodes = [
        episode
        for trial in which
        for episode in _episodes(
            trial, as_environment_counts(record(chosen, trial=trial, seed=seed), chosen.task)
        )
    ]
    _check_same(results.episodes.filter(condition=condition), episodes)
    _write(dataset, condition, chosen.task, episodes)
    return len(episodes)


def _check_same(run: pl.DataFrame, episodes: Sequence[Mapping[str, Any]]) -> None:
    """Refuse episodes that are not those of the run: its code or its task changed since."""
    columns = ("trial", "episode", "assisted_return", "assisted_length", "overrides")
    rows = {row[:2]: row[2:] for row in run.select(columns).iter_rows()}
    for each in episodes:
        infos = each["infos"]
        place = (int(infos["trial"][0]), int(infos["episode"][0]))
        total, then = float(np.sum(each["rewards"])), rows[place]
        now = (len(each["actions"]), int(infos["overridden"].sum()))
        if now != then[1:] or not np.isclose(total, then[0], rtol=1e-9, atol=1e-9):
            raise RequestError(
                f"trial {place[0]} is not what was run: in episode {place[1]} the return is "
                f"{total:g} and was {then[0]:g}, with {counted(now[1], 'override')} in "
                f"{counted(now[0], 'step')} and {then[2]} in {then[1]}; the code, the task or a "
                "library changed since"
            )


def as_environment_counts(steps: Step, task: Task) -> Step:
    """Steps with states and actions counted from the starts of a task's spaces.

    Args:
        steps: a table, counted from 0.
        task: that they are of.
    """
    action = int(task.action_space.start)
    state = int(getattr(task.observation_space, "start", 0))  # vectors have none
    return steps._replace(
        state=steps.state + state,
        next_state=steps.next_state + state,
        proposed=steps.proposed + action,
        executed=steps.executed + action,
        credited=np.where(steps.credited < 0, -1, steps.credited + action),
    )


def _checked(trials: int | range, run: int) -> range:
    which = range(trials) if isinstance(trials, int) else trials
    if not which or min(which) < 0 or max(which) >= run:
        raise RequestError(
            f"trials = {trials!r}; at least 1, of those that were run, 0 to {run - 1}, are needed"
        )
    return which


def _write(dataset: str, condition: str, task: Task, episodes: Sequence[Mapping[str, Any]]) -> None:
    try:
        import minari
        from minari.data_collector import EpisodeBuffer
    except ImportError as error:
        raise RequestError("Minari is not installed: pip install 'qbumpers[minari]'") from error
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # it asks for an author and a link
        try:
            minari.create_dataset_from_buffers(
                dataset,
                [EpisodeBuffer(id=number, **episode) for number, episode in enumerate(episodes)],
                env=task.environment_spec,
                observation_space=task.observation_space,
                action_space=task.action_space,
                algorithm_name=condition,
                description=f"Simulated learners at {task.name}, assisted by {condition}.",
            )
        except ValueError as error:
            raise RequestError(f"dataset = {dataset!r}: {error}") from error


def _episodes(trial: int, steps: Step) -> Iterator[dict[str, Any]]:
    """The fields of Minari's buffers, an episode each."""
    ends = [*(np.flatnonzero(np.diff(steps.episode)) + 1), len(steps.episode)]
    for first, end in itertools.pairwise([0, *ends]):
        part = Step(*(array[first:end] for array in steps))
        terminated = (part.events & TERMINATED) > 0
        truncated = (part.events & (TRUNCATED | LIMIT)) > 0
        last = part.state if part.undone[-1] else part.next_state
        infos = {name: _after_reset(getattr(part, name)) for name in INFOS}
        numbers = {"trial": trial, "episode": int(part.episode[0])}
        yield {
            "observations": np.concatenate([part.state, last[-1:]]),
            "actions": part.executed,
            "rewards": part.reward,
            "terminations": terminated,
            "truncations": truncated,
            "infos": infos | {k: np.full(end - first + 1, v) for k, v in numbers.items()},
        }


def _after_reset(values: np.ndarray) -> np.ndarray:
    """An array of steps with an entry for the reset before them."""
    missing = {"f": np.nan, "i": -1, "b": False}[values.dtype.kind]
    return np.concatenate([np.full_like(values[:1], missing), values])
