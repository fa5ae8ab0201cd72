"""Results in a folder: written atomically, never computed twice, read by the analysis."""

import contextlib
import hashlib
import importlib.metadata
import io
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import polars as pl
import tomli_w

import qbumpers
from qbumpers.errors import RequestError
from qbumpers.experiments.cells import Cell, tiles
from qbumpers.experiments.columns import EPISODE_COLUMNS, STATE_COLUMNS, check_columns
from qbumpers.experiments.design import Experiment
from qbumpers.experiments.record import (
    CONDITIONS,
    FILES,
    Record,
    RecordedCondition,
    decoded_record,
    is_kept_file,
    recorded,
)
from qbumpers.experiments.reuse import (
    CellFile,
    again,
    cell_file_name,
    cell_files,
    cells_folder,
    is_cell_file,
    usable_for,
    whole_cells,
)
from qbumpers.experiments.sources import parsed, recorded_experiment
from qbumpers.files import Folder, StoreError, open_folder
from qbumpers.values import NetworkValues, TabularValues, decoded_values

EXPERIMENT, EPISODES, STATES, VALUES = (
    "experiment.toml",
    "episodes.parquet",
    "states.parquet",
    "values.npz",
)
"""Files of an output folder; design and platform, a row per episode, a row per state, Q*."""

_COLUMNS = {EPISODES: EPISODE_COLUMNS, STATES: STATE_COLUMNS}

NEEDED = (EXPERIMENT, CONDITIONS, EPISODES, STATES, VALUES)
"""What the analysis reads."""

FORMAT = 3
"""Of an output folder: what its files are called and hold."""

_READ = (2, FORMAT)  # formats that are read; before 3, folders noted no conditions

# An experiment may be continued with more or fewer of the first three, and be read in another way.
_CHANGING = {"trials", "assistants", "learners", "criterion", "reproduces"}

_COMPRESSION = 1  # of zstd: on these tables the fastest level is also the smallest

_LIBRARIES = ("numpy", "numba", "scipy", "polars")


class Results(NamedTuple):
    """What an output folder holds.

    Attributes:
        experiment: as run.
        episodes: a row per episode.
        states: a row per condition and state; None if observations are vectors.
        values: Q* of the assistants.
        conditions: what is noted of each.
    """

    experiment: Experiment
    episodes: pl.DataFrame
    states: pl.DataFrame | None
    values: TabularValues | NetworkValues
    conditions: Sequence[RecordedCondition]

    @property
    def missing(self) -> dict[str, int]:
        """How many trials each condition lacks, by id; nothing of a finished run."""
        counts = self.episodes.group_by("condition").agg(pl.col("trial").n_unique())
        there = dict(counts.iter_rows())
        lacking = {
            each.condition: self.experiment.trials - there.get(each.condition, 0)
            for each in self.conditions
        }
        return {condition: trials for condition, trials in lacking.items() if trials}


class Survey(NamedTuple):
    """What finished work an output folder holds.

    Attributes:
        cells: whole cells that may be used, by their content.
        damaged: names of files that did not hold what was once written; they are gone.
        changed: why finished trials are simulated again, a sentence each; their cells stay.
    """

    cells: dict[str, list[Cell]]
    damaged: list[str]
    changed: list[str]


class Store:
    """The output folder of one experiment; `open_store` opens it.

    The file of a cell's table is named by the cell, by the identity of what made it, and by a
    digest of its bytes, so that damage shows wherever it is.

    Args:
        folder: where the results are, locked against other writers.
        tables: what a finished cell holds, see `tables_of`.
        record: of the conditions that are run.
        before: what the folder noted until now; None if that is nothing.
    """

    def __init__(
        self, folder: Folder, tables: Sequence[str], record: Record, before: Record | None
    ) -> None:
        self._folder, self._tables = folder, tables
        self._record, self._before = record, before
        self._identities = {each.content: each.identity for each in record.conditions}
        self._files: dict[tuple[Cell, str], str] = {}

    def survey(self, trials: int) -> Survey:
        """Look for finished cells, check them, and clear damaged files away.

        Args:
            trials: that are wanted of each condition.

        Returns:
            What there is.
        """
        cells, stale, damaged = {}, {}, []
        for content, wanted in self._identities.items():
            files = cell_files(self._folder, content)
            usable = [f for f in files if usable_for(wanted, f.identity, self._record)]
            whole = [file for file in usable if self._is_whole(file)]
            damaged += [file.name for file in usable if file not in whole]
            self._files |= {(file.cell, file.kind): file.name for file in whole}
            cells[content] = whole_cells(whole, self._tables)
            stale[content] = [file for file in files if file not in usable]

        def stale_of(content: str) -> list[CellFile]:
            return stale[content] if content in stale else cell_files(self._folder, content)

        for name in damaged:
            self._folder.remove(name)
        changed = again(self._record, self._before, cells, stale_of, trials)
        return Survey(cells, damaged, changed)

    def _is_whole(self, file: CellFile) -> bool:
        return _content(self._folder, file) is not None

    def write(self, cell: Cell, files: Mapping[str, bytes]) -> None:
        """Keep the tables of a cell, encoded, by kind; it is whole when all are there."""
        for kind, content in files.items():
            name = cell_file_name(cell, kind, self._identities[cell.content], _digest(content))
            self._folder.write(name, content)
            self._files[cell, kind] = name

    def write_inputs(
        self, values: TabularValues | NetworkValues, files: Mapping[str, np.ndarray]
    ) -> None:
        """Keep the assistants' Q*, and what is in files that conditions name, by `file_name`."""
        self._folder.write(VALUES, values.encoded())
        for name, numbers in files.items():
            buffer = io.BytesIO()
            np.save(buffer, numbers)
            self._folder.write(name, buffer.getvalue())

    def assemble(self, cells: Mapping[str, Sequence[Cell]]) -> None:
        """Write the tables of the whole experiment from its finished cells.

        Args:
            cells: of each content, in the order of their trials.

        Raises:
            StoreError: if a cell cannot be read, or a table cannot be written.
        """
        for kind in self._tables:
            table = assembled(
                [(each, cell) for each in self._record.conditions for cell in cells[each.content]],
                kind,
                lambda cell, kind=kind: self.read(cell, kind),
            )
            self._folder.write(kind, encoded(table))

    def read(self, cell: Cell, kind: str) -> pl.DataFrame:
        """A table of a cell that was written or surveyed; StoreError if it is damaged."""
        name = self._files[cell, kind]
        content = self._folder.read(name) or b""
        if f"-{_digest(content)}." not in name:
            raise StoreError(f"{name} was changed while the run went on; run it again to mend it")
        return pl.read_parquet(io.BytesIO(content))


def tables_of(experiment: Experiment) -> tuple[str, ...]:
    """What a finished cell of an experiment holds, in the order of writing."""
    return (STATES, EPISODES) if experiment.tabular else (EPISODES,)


def encoded(table: pl.DataFrame) -> bytes:
    """A table as the bytes of a Parquet file."""
    buffer = io.BytesIO()
    table.write_parquet(buffer, compression_level=_COMPRESSION)
    return buffer.getvalue()


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def _clear_left(folder: Folder, records: Sequence[Record]) -> None:
    """Clear away what killed runs left half-written of their own files, and of no others."""
    own = {EXPERIMENT, CONDITIONS, EPISODES, STATES, VALUES}
    folder.clear_left("", own.__contains__)
    folder.clear_left(FILES, is_kept_file)
    for place in {cells_folder(each.content) for record in records for each in record.conditions}:
        folder.clear_left(place, is_cell_file)


def assembled(
    parts: Sequence[tuple[RecordedCondition, Cell]],
    kind: str,
    read: Callable[[Cell], pl.DataFrame],
) -> pl.DataFrame:
    """One table of many cells.

    Args:
        parts: cells with the conditions that they are of; at least one.
        kind: of table.
        read: reads the table of a cell.

    Returns:
        `episodes.parquet` or `states.parquet`.
    """

    def labelled(part: tuple[RecordedCondition, Cell]) -> pl.DataFrame:
        return read(part[1]).select(*_labels(part[0], kind), pl.all())

    with ThreadPoolExecutor() as pool:
        table = pl.concat(pool.map(labelled, parts))
    if kind == STATES:
        keys = ["condition", "state", "row", "column"]
        return table.group_by(keys, maintain_order=True).sum()
    return table


def _labels(each: RecordedCondition, kind: str) -> list[pl.Expr]:
    """Columns that say whose rows these are."""
    labels = [pl.lit(each.condition).alias("condition")]
    if kind == EPISODES:
        labels += [
            pl.lit(each.assistant).alias("assistant"),
            pl.lit(each.alpha, pl.Float64).alias("alpha"),
            pl.lit(each.learner).alias("learner"),
        ]
    return labels


@contextlib.contextmanager
def open_store(folder: str | Path, experiment: Experiment, record: Record) -> Iterator[Store]:
    """Open an output folder for one run, which alone writes to it.

    Args:
        folder: where the results go, a path or a URL; made if it is missing.
        experiment: to be run, or continued.
        record: of its conditions.

    Yields:
        The store, with what a killed run left half-written cleared away.

    Raises:
        RequestError: if the folder is a file, holds another experiment, or another run is
            writing to it.
        StoreError: if it cannot be written.
    """
    place = open_folder(folder)
    with place.locked():
        found, before = _read_design(place), decoded_record(place.read(CONDITIONS))
        if found is not None:
            _check_same(place, found, experiment)
            _check_inputs(place, before, experiment, record)
            if _renamed(found, before, experiment, record):
                for table in tables_of(experiment):  # or a stopped run would pass them off
                    place.remove(table)
        if before is not None:
            record = record._replace(identities={**before.identities, **record.identities})
        _clear_left(place, [record, *([before] if before else [])])
        place.write(CONDITIONS, record.encoded())
        place.write(EXPERIMENT, _described(experiment).encode())
        yield Store(place, tables_of(experiment), record, before)


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
    experiment = load_design(folder)
    tables = _whole_tables(place, experiment)
    if tables is None:
        record = decoded_record(place.read(CONDITIONS))
        tables = _tables_of_cells(place, experiment, record) if unfinished and record else None
    if tables is None:
        raise RequestError(
            f"results folder {folder}: the run is not finished; run it again to continue"
        )
    conditions = conditions_of(folder, experiment, tables[EPISODES])
    values = _values(place, experiment)
    return Results(experiment, tables[EPISODES], tables.get(STATES), values, conditions)


def _values(folder: Folder, experiment: Experiment) -> TabularValues | NetworkValues:
    content = folder.read(VALUES)
    if content is None:
        raise RequestError(f"results folder {folder}: it holds no {VALUES}")
    values = decoded_values(content, f"{folder}/{VALUES}")
    if experiment.tabular and not isinstance(values, TabularValues):
        raise RequestError(f"values file {folder}/{VALUES}: of task {values.task}, not of this run")
    return values


def _whole_tables(folder: Folder, experiment: Experiment) -> dict[str, pl.DataFrame] | None:
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
    ids = {each.condition for each in conditions_of(str(folder), experiment, episodes)}
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
        whole = [(file, content) for file in usable if (content := _content(folder, file))]
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


def _content(folder: Folder, file: CellFile) -> bytes | None:
    """What a cell's file holds; None if it is damaged."""
    content = folder.read(file.name) or b""
    return content if _digest(content) == file.digest else None


def files_to_read(folder: str | Path) -> Iterator[str]:
    """Names of the files that a report needs, those of cells too if the run is not finished."""
    yield from NEEDED
    place = open_folder(folder)
    record = decoded_record(place.read(CONDITIONS))
    if record is not None and _whole_tables(place, load_design(folder)) is None:
        for each in record.conditions:
            yield from (file.name for file in cell_files(place, each.content))


def conditions_of(
    folder: str | Path, experiment: Experiment, table: pl.DataFrame
) -> Sequence[RecordedCondition]:
    """What a folder notes of its conditions; an old one does not, then it is found out.

    Args:
        folder: of the results.
        experiment: as run.
        table: with columns condition, assistant, alpha and learner.
    """
    record = decoded_record(open_folder(folder).read(CONDITIONS))
    if record is not None:
        return record.conditions
    try:
        return [recorded(named) for named in experiment.conditions()]
    except RequestError:  # what they name is not there any more
        columns = ("condition", "assistant", "alpha", "learner")
        return [
            RecordedCondition(
                **row, options={} if row["alpha"] is None else {"alpha": row["alpha"]}
            )
            for row in table.select(columns).unique(maintain_order=True).iter_rows(named=True)
        ]


def _described(experiment: Experiment) -> str:
    settings = experiment.model_dump(exclude_none=True)
    run = {
        "format": FORMAT,
        "version": qbumpers.__version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
        **{name: importlib.metadata.version(name) for name in _LIBRARIES},
    }
    return tomli_w.dumps({**settings, "run": run})


def load_design(folder: str | Path) -> Experiment:
    """The experiment of an output folder, as run.

    Raises:
        RequestError: where there is none, or it is damaged or of a version that is not read here.
    """
    experiment = _read_design(open_folder(folder))
    if experiment is None:
        raise RequestError(f"results folder {folder}: it holds no {EXPERIMENT}")
    return experiment


def _read_design(folder: Folder) -> Experiment | None:
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


def _check_same(folder: Folder, found: Experiment, experiment: Experiment) -> None:
    before, now = found.model_dump(), experiment.model_dump()
    changed = [f for f in now if f not in _CHANGING and now[f] != before[f]]
    if changed:
        details = "; ".join(f"{f} was {before[f]!r}, now {now[f]!r}" for f in changed)
        raise RequestError(
            f"output folder {folder} holds another experiment ({details}); choose another folder"
        )


def _check_inputs(
    folder: Folder, before: Record | None, experiment: Experiment, record: Record
) -> None:
    """Refuse Q* or a task that are others by now under the name that they had."""
    changed = []
    if before is not None and before.task not in ("", record.task):
        changed.append(f"task {experiment.task.name!r} does not behave as it did")
    with contextlib.suppress(RequestError):  # what is damaged is written anew
        kept = decoded_values(folder.read(VALUES) or b"", VALUES)
        if kept.digest() != record.values:
            changed.append(f"values = {experiment.values!r} are not those in its {VALUES}")
    if changed:
        raise RequestError(
            f"output folder {folder} holds another experiment ({'; '.join(changed)}); choose "
            "another folder"
        )


def kept_files(folder: str | Path, each: RecordedCondition) -> dict[str, np.ndarray]:
    """What was in the files that a condition named when it was run.

    Args:
        folder: of the results.
        each: the condition.

    Returns:
        Float64 [N, K] by the name that the experiment has for a file; nothing from old folders.
    """
    place = open_folder(folder)
    contents = {name: place.read(kept) for name, kept in each.files.items()}
    return {name: np.load(io.BytesIO(found)) for name, found in contents.items() if found}


def _renamed(
    found: Experiment, before: Record | None, experiment: Experiment, record: Record
) -> bool:
    """Whether an id may mean another condition than it did, or one that other code made."""
    if before is None:
        own = any(not record.allows_unmarked(each.identity) for each in record.conditions)
        return own or any(
            getattr(found, field) != getattr(experiment, field)
            for field in ("assistants", "learners")
        )
    then = before.by_id()
    return any(
        each.condition in then
        and (then[each.condition].content, then[each.condition].identity)
        != (each.content, each.identity)
        for each in record.conditions
    )


def run_description(folder: str | Path) -> dict[str, Any]:
    """The `[run]` table of an output folder: its format, and the versions and platform that ran."""
    content = open_folder(folder).read(EXPERIMENT) or b""
    return parsed(content, f"experiment file {folder}/{EXPERIMENT}").get("run", {})
