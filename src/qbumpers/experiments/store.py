"""What an output folder holds, read back: by the analysis, and by whoever continues its run."""

import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from qbumpers.errors import RequestError
from qbumpers.experiments.cells import Cell, tiles
from qbumpers.experiments.columns import EPISODE_COLUMNS, STATE_COLUMNS, check_columns
from qbumpers.experiments.design import Experiment
from qbumpers.experiments.record import (
    CONDITIONS,
    Record,
    RecordedCondition,
    decoded_record,
    recorded,
)
from qbumpers.experiments.reuse import cell_files, usable_for, whole_cells, whole_content
from qbumpers.experiments.sources import parsed, recorded_experiment
from qbumpers.experiments.tables import EPISODES, STATES, assembled, tables_of
from qbumpers.files import Folder, open_folder
from qbumpers.values import NetworkValues, TabularValues, decoded_values

EXPERIMENT, VALUES = "experiment.toml", "values.npz"
"""Files of an output folder; design and platform, and Q*."""

_COLUMNS = {EPISODES: EPISODE_COLUMNS, STATES: STATE_COLUMNS}

NEEDED = (EXPERIMENT, CONDITIONS, EPISODES, STATES, VALUES)
"""What the analysis reads."""

FORMAT = 3
"""Of an output folder: what its files are called and hold."""

_READ = (2, FORMAT)  # formats that are read; before 3, folders noted no conditions


class Results(NamedTuple):
    """What an output folder holds.

    Attributes:
        experiment: as run.
        episodes: a row per episode.
        states: a row per condition and state; None if observations are vectors.
        values: Q* of the assistants.
        record: what is noted of the task and of each condition.
    """

    experiment: Experiment
    episodes: pl.DataFrame
    states: pl.DataFrame | None
    values: TabularValues | NetworkValues
    record: Record

    @property
    def conditions(self) -> Sequence[RecordedCondition]:
        """What is noted of each condition."""
        return self.record.conditions

    @property
    def missing(self) -> dict[str, int]:
        """How many trials each condition lacks, by id; nothing of a finished run, or of people."""
        if self.experiment.of_participants:
            return {}
        counts = self.episodes.group_by("condition").agg(pl.col("trial").n_unique())
        there = dict(counts.iter_rows())
        lacking = {
            each.condition: self.experiment.trials - there.get(each.condition, 0)
            for each in self.conditions
        }
        return {condition: trials for condition, trials in lacking.items() if trials}


def load(folder: str | Path, *, unfinished: bool = False) -> Results:
    """What an output folder holds, as Polars frames.

    Args:
        folder: output folder of a run, a path or a URL.
        unfinished: whether to load what there is of a run that is not finished; `Results.missing`
            then says what is not there.

    Returns:
        The experiment and its tables.

    Raises:
        RequestError: if the folder is not one of a run, or damaged; if the run is not finished,
            unless that is allowed and some trials are.
    """
    place = open_folder(folder)
    experiment, noted = load_design(folder), decoded_record(place.read(CONDITIONS))
    tables = _whole_tables(place, experiment, noted)
    if tables is None and unfinished and noted is not None:
        tables = _tables_of_cells(place, experiment, noted)
    if tables is None:
        raise RequestError(
            f"results folder {folder}: the run is not finished; run it again to continue"
        )
    record = record_of(noted, experiment, tables[EPISODES])
    values = _values(place, experiment)
    return Results(experiment, tables[EPISODES], tables.get(STATES), values, record)


def _values(folder: Folder, experiment: Experiment) -> TabularValues | NetworkValues:
    content = folder.read(VALUES)
    if content is None:
        raise RequestError(f"results folder {folder}: it holds no {VALUES}")
    values = decoded_values(content, f"{folder}/{VALUES}")
    if experiment.tabular and not isinstance(values, TabularValues):
        raise RequestError(f"values file {folder}/{VALUES}: of task {values.task}, not of this run")
    return values


def _whole_tables(
    folder: Folder, experiment: Experiment, record: Record | None
) -> dict[str, pl.DataFrame] | None:
    """The tables of a finished run; None if they are not there, or those of another part of it."""
    contents = {name: folder.read(name) for name in (EPISODES, STATES)}
    if any(contents[name] is None for name in tables_of(experiment)):
        return None
    try:
        tables = {n: pl.read_parquet(io.BytesIO(c)) for n, c in contents.items() if c is not None}
    except pl.exceptions.PolarsError as error:
        raise RequestError(
            f"results folder {folder}: damaged; run it again to mend it ({error})"
        ) from error
    for name, table in tables.items():
        check_columns(table, _COLUMNS[name], f"{folder}/{name}")
    episodes = tables[EPISODES]
    ids = set(record_of(record, experiment, episodes).by_id())
    if experiment.of_participants:  # who play as much as they like
        return tables
    rows = len(ids) * experiment.trials * (experiment.episodes + experiment.retention)
    whole = episodes.height == rows and set(episodes["condition"].unique()) == ids
    return tables if whole else None


def _tables_of_cells(
    folder: Folder, experiment: Experiment, record: Record
) -> dict[str, pl.DataFrame] | None:
    """Tables of what is finished of a run; None if nothing is."""
    files = {each.content: cell_files(folder, each.content) for each in record.conditions}
    kinds = sorted({file.kind for found in files.values() for file in found}, reverse=True)
    tables: dict[tuple[Cell, str], pl.DataFrame] = {}
    parts = []
    for each in record.conditions:
        usable = [f for f in files[each.content] if usable_for(each.identity, f.identity, record)]
        whole = [(file, content) for file in usable if (content := whole_content(folder, file))]
        tables |= {(f.cell, f.kind): pl.read_parquet(io.BytesIO(c)) for f, c in whole}
        cells = whole_cells([file for file, _ in whole], kinds)
        size = max((cell.trials for cell in cells), default=1)
        chosen = tiles(each.content, experiment.trials, size, cells)
        parts += [(each, cell) for cell in chosen if cell in cells]
    if not parts:
        return None
    return {
        kind: assembled(parts, kind, lambda cell, kind=kind: tables[cell, kind]) for kind in kinds
    }


def files_to_read(folder: str | Path) -> Iterator[str]:
    """Names of the files that a report needs, those of cells too if the run is not finished."""
    yield from NEEDED
    place = open_folder(folder)
    record = decoded_record(place.read(CONDITIONS))
    if record is not None and _whole_tables(place, load_design(folder), record) is None:
        for each in record.conditions:
            yield from (file.name for file in cell_files(place, each.content))


def record_of(record: Record | None, experiment: Experiment, table: pl.DataFrame) -> Record:
    """What is noted of a run; its conditions are found out if it is nothing, as of old folders.

    Args:
        record: what the folder notes; None if that is nothing.
        experiment: as run.
        table: with columns condition, assistant, alpha and learner.
    """
    if record is not None:
        return record
    try:
        return Record([recorded(named) for named in experiment.conditions()])
    except RequestError:  # what they name is not there any more
        columns = ("condition", "assistant", "alpha", "learner")
        rows = table.select(columns).unique(maintain_order=True).iter_rows(named=True)
        return Record(
            [
                RecordedCondition(
                    **row, options={} if row["alpha"] is None else {"alpha": row["alpha"]}
                )
                for row in rows
            ]
        )


def load_design(folder: str | Path) -> Experiment:
    """The experiment of an output folder, as run.

    Raises:
        RequestError: where there is none, or it is damaged or of a version that is not read here.
    """
    experiment = read_design(open_folder(folder))
    if experiment is None:
        raise RequestError(f"results folder {folder}: it holds no {EXPERIMENT}")
    return experiment


def read_design(folder: Folder) -> Experiment | None:
    """The experiment of an output folder; None if there is none."""
    content = folder.read(EXPERIMENT)
    if content is None:
        return None
    where = f"experiment file {folder}/{EXPERIMENT}"
    settings = parsed(content, where)
    if not isinstance(settings.get("run"), dict):
        raise RequestError(f"{where}: it has no table [run]; is it the one that a run wrote?")
    found = settings["run"].get("format", 1)
    if found not in _READ:
        age = "a newer" if isinstance(found, int) and found > FORMAT else "an older"
        raise RequestError(
            f"output folder {folder}: written by {age} version of qbumpers (format {found!r}, "
            f"needed {FORMAT}); choose another folder"
        )
    del settings["run"]
    return recorded_experiment(settings, where)


def kept_files(folder: str | Path, each: RecordedCondition) -> dict[str, np.ndarray]:
    """What was in the files that a condition named when it was run.

    Args:
        folder: output folder of a run, a path or a URL.
        each: the condition, as the folder notes it.

    Returns:
        Float64 [N, K] by the name that the experiment has for a file; nothing from old folders.
    """
    place = open_folder(folder)
    contents = {name: place.read(kept) for name, kept in each.files.items()}
    return {name: np.load(io.BytesIO(found)) for name, found in contents.items() if found}


def run_description(folder: str | Path) -> dict[str, Any]:
    """The `[run]` table of an output folder: its format, and the versions and platform that ran."""
    content = open_folder(folder).read(EXPERIMENT) or b""
    return parsed(content, f"experiment file {folder}/{EXPERIMENT}").get("run", {})
