"""A finished run archived as a few small files, fit for a repository, and read again."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import polars as pl

from qbumpers.analysis.figures.curves import learning_curves, override_courses
from qbumpers.analysis.measures import MEASURES, trial_measures
from qbumpers.errors import RequestError
from qbumpers.experiments.design import Experiment
from qbumpers.experiments.record import CONDITIONS, RecordedCondition, decoded_record
from qbumpers.experiments.store import (
    EXPERIMENT,
    load,
    load_design,
    record_of,
    run_description,
)
from qbumpers.files import open_folder, write_atomically

TRIALS, CURVES, OVERRIDES, RUNS = "trials.csv", "curves.csv", "overrides.csv", "runs.csv"
"""A row per trial; learning curves and override rates by block of episodes; trials of runs."""

_DIGITS = 7  # more would only be noise
_NUMBERS = {"alpha": pl.Float64, **dict.fromkeys(MEASURES, pl.Float64)}


class Archive(NamedTuple):
    """What was archived of a run.

    Attributes:
        experiment: as run.
        run: versions and platform that ran it.
        trials: a row per trial, as from `trial_measures`.
        curves: learning curves, returns and success rates, as from `learning_curves`.
        overrides: as from `override_courses`.
        conditions: what is noted of each.
    """

    experiment: Experiment
    run: dict[str, Any]
    trials: pl.DataFrame
    curves: pl.DataFrame
    overrides: pl.DataFrame
    conditions: Sequence[RecordedCondition]


Choose = Callable[[pl.DataFrame], Sequence[str]]
"""Chooses conditions, from a table of trials."""


def archive_run(folder: str | Path, into: str | Path, choose: Choose) -> None:
    """Archive the trials of a run, and the curves of a few conditions, as CSV.

    Args:
        folder: output folder of a finished run.
        into: folder for the files; made if it is missing.
        choose: the conditions whose curves are archived, from the table of trials.

    Raises:
        RequestError: if the folder is not one of a finished run.
        StoreError: if a file cannot be written.
    """
    results = load(folder)
    trials = trial_measures(results.episodes, results.experiment.criterion)
    chosen = choose(trials)
    keys = ["condition", "episode", "retention"]
    curves = learning_curves(results.episodes, chosen)
    if results.episodes["unassisted_success"].null_count() == 0:
        more = learning_curves(results.episodes, chosen, "success")
        curves = curves.join(more, on=keys, maintain_order="left")
    overrides = override_courses(results.episodes, chosen)
    write_rounded(Path(into) / TRIALS, trials)
    write_rounded(Path(into) / CURVES, curves)
    write_rounded(Path(into) / OVERRIDES, overrides)
    settings = (Path(folder) / EXPERIMENT).read_bytes()
    noted = results.record.encoded()
    for name, content in ((EXPERIMENT, settings), (CONDITIONS, noted)):
        write_atomically(Path(into) / name, lambda path, content=content: path.write_bytes(content))


def load_archive(folder: str | Path) -> Archive:
    """What `archive_run` wrote.

    Args:
        folder: where `archive_run` put its files.

    Raises:
        RequestError: if a file is missing.
    """
    place = Path(folder)
    experiment, trials = load_design(place), read_trials(place / TRIALS)
    record = decoded_record(open_folder(place).read(CONDITIONS))
    return Archive(
        experiment=experiment,
        run=run_description(place),
        trials=trials,
        curves=_read(place / CURVES),
        overrides=_read(place / OVERRIDES),
        conditions=record_of(record, experiment, trials).conditions,
    )


def archive_trials(folders: Mapping[str, str | Path], into: str | Path) -> None:
    """Archive the trials of several runs in one table, `RUNS`, with the name of each run.

    Args:
        folders: output folders of finished runs, by the name that each run gets in the table.
        into: folder for the file; made if it is missing.

    Raises:
        RequestError: if a folder is not one of a finished run.
        StoreError: if the file cannot be written.
    """
    write_rounded(Path(into) / RUNS, trials_of_runs(folders))


def trials_of_runs(folders: Mapping[str, str | Path]) -> pl.DataFrame:
    """The trials of several runs in one table.

    Args:
        folders: output folders of finished runs, by the name that each run gets in the table.

    Returns:
        A row per run and trial: run, and the columns of `trial_measures`.

    Raises:
        RequestError: if a folder is not one of a finished run.
    """
    parts = []
    for name, folder in folders.items():
        results = load(folder)
        trials = trial_measures(results.episodes, results.experiment.criterion)
        parts.append(trials.select(pl.lit(name).alias("run"), pl.all()))
    return pl.concat(parts)


def read_trials(path: str | Path) -> pl.DataFrame:
    """A table of trials that was archived as CSV; RequestError if there is none."""
    return _read(Path(path)).with_columns(
        pl.col(name).cast(kind) for name, kind in _NUMBERS.items()
    )


def write_rounded(path: Path, table: pl.DataFrame) -> None:
    """Write a table as CSV, its numbers rounded to seven digits."""
    content = table.with_columns(pl.selectors.float().round_sig_figs(_DIGITS)).write_csv()
    write_atomically(path, lambda temporary: temporary.write_bytes(content.encode()))


def _read(path: Path) -> pl.DataFrame:
    if not path.is_file():
        raise RequestError(f"archived results {path}: there is no such file")
    return pl.read_csv(path, infer_schema_length=None)
