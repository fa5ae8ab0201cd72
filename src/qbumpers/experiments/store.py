"""Results in a folder: written atomically, never computed twice, read by the analysis."""

import contextlib
import hashlib
import importlib.metadata
import io
import platform
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import polars as pl
import tomli_w

import qbumpers
from qbumpers.assistants import Assistant
from qbumpers.errors import RequestError
from qbumpers.experiments.cells import Cell
from qbumpers.experiments.design import Experiment, NamedCondition
from qbumpers.experiments.sources import make_experiment, parsed
from qbumpers.files import Folder, StoreError, open_folder
from qbumpers.values import NetworkValues, TabularValues, decoded_values

EXPERIMENT, EPISODES, STATES, VALUES = (
    "experiment.toml",
    "episodes.parquet",
    "states.parquet",
    "values.npz",
)
"""Files of an output folder; design and platform, a row per episode, a row per state, Q*."""

NEEDED = (EXPERIMENT, EPISODES, STATES, VALUES)
"""What the analysis reads."""

FORMAT = 2
"""Of an output folder: what its files are called and hold."""

_FILE = re.compile(
    r"(?P<first>\d+)-(?P<trials>\d+)-(?P<kind>\w+)-(?P<digest>[0-9a-f]{16})\.parquet"
)

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
    """

    experiment: Experiment
    episodes: pl.DataFrame
    states: pl.DataFrame | None
    values: TabularValues | NetworkValues


class Survey(NamedTuple):
    """What finished work an output folder holds.

    Attributes:
        cells: whole cells, by their content.
        damaged: names of files that did not hold what was once written; they are gone.
    """

    cells: dict[str, list[Cell]]
    damaged: list[str]


class Store:
    """The output folder of one experiment; `open_store` opens it.

    The file of a cell's table is named by the cell and by a digest of its bytes, so that damage
    shows wherever it is.

    Args:
        folder: where the results are, locked against other writers.
        tables: what a finished cell holds, see `tables_of`.
    """

    def __init__(self, folder: Folder, tables: Sequence[str]) -> None:
        self._folder, self._tables = folder, tables
        self._files: dict[tuple[Cell, str], str] = {}

    def survey(self, contents: Iterable[str]) -> Survey:
        """Look for finished cells, check them, and clear damaged files away.

        Args:
            contents: digests of the conditions that are wanted.

        Returns:
            What there is.
        """
        cells, damaged = {}, []
        for content in contents:
            kinds: dict[Cell, set[str]] = {}
            for file in self._folder.names(_place(content)):
                name = _FILE.fullmatch(file.rpartition("/")[2])
                if name is None:
                    continue
                if _digest(self._folder.read(file) or b"") != name["digest"]:
                    damaged.append(file)
                    self._folder.remove(file)
                    continue
                cell = Cell(content, int(name["first"]), int(name["trials"]))
                kind = f"{name['kind']}.parquet"
                self._files[cell, kind] = file
                kinds.setdefault(cell, set()).add(kind)
            cells[content] = [cell for cell, found in kinds.items() if found == set(self._tables)]
        return Survey(cells, damaged)

    def write(self, cell: Cell, files: Mapping[str, bytes]) -> None:
        """Keep the tables of a cell, encoded, by kind; it is whole when all are there."""
        for kind, content in files.items():
            stem = f"{cell.first:06d}-{cell.trials}-{kind.removesuffix('.parquet')}"
            name = f"{_place(cell.content)}/{stem}-{_digest(content)}.parquet"
            self._folder.write(name, content)
            self._files[cell, kind] = name

    def write_values(self, values: TabularValues | NetworkValues) -> None:
        """Keep the assistants' Q*."""
        self._folder.write(VALUES, values.encoded())

    def assemble(self, parts: Iterable[tuple[NamedCondition, Sequence[Cell]]]) -> None:
        """Write the tables of the whole experiment from its finished cells.

        Args:
            parts: the cells of each condition, in the order of their trials.

        Raises:
            StoreError: if a cell cannot be read, or a table cannot be written.
        """
        cells = [(named, cell) for named, chosen in parts for cell in chosen]
        for kind in self._tables:
            with ThreadPoolExecutor() as pool:
                table = pl.concat(
                    pool.map(lambda part, kind=kind: self._labelled(part[0], part[1], kind), cells)
                )
            if kind == STATES:
                keys = ["condition", "state", "row", "column"]
                table = table.group_by(keys, maintain_order=True).sum()
            self._folder.write(kind, encoded(table))

    def _labelled(self, named: NamedCondition, cell: Cell, kind: str) -> pl.DataFrame:
        return self.read(cell, kind).select(*_labels(named, kind), pl.all())

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


def _place(content: str) -> str:
    return f"cells/{content[:16]}"


def _labels(named: NamedCondition, kind: str) -> list[pl.Expr]:
    """Columns that say whose rows these are."""
    labels = [pl.lit(named.condition).alias("condition")]
    if kind == EPISODES:
        alpha = _alpha_of(named.assistant)
        labels += [
            pl.lit(named.assistant.name).alias("assistant"),
            pl.lit(alpha, pl.Float64).alias("alpha"),
            pl.lit(named.learner_id).alias("learner"),
        ]
    return labels


def _alpha_of(assistant: Assistant | None) -> float | None:
    """The option alpha of an assistant or of one that it is over."""
    while assistant is not None:
        options = assistant.options._asdict()
        if "alpha" in options:
            return options["alpha"]
        assistant = assistant.of
    return None


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


@contextlib.contextmanager
def open_store(folder: str | Path, experiment: Experiment) -> Iterator[Store]:
    """Open an output folder for one run, which alone writes to it.

    Args:
        folder: where the results go, a path or a URL; made if it is missing.
        experiment: to be run, or continued.

    Yields:
        The store, with what a killed run left half-written cleared away.

    Raises:
        RequestError: if the folder is a file, holds another experiment, or another run is
            writing to it.
        StoreError: if it cannot be written.
    """
    place = open_folder(folder)
    with place.locked():
        found = _read_design(place)
        if found is not None:
            _check_same(place, found, experiment)
            if _renamed(found, experiment):  # or a stopped run would pass old rows off as its own
                for table in tables_of(experiment):
                    place.remove(table)
        place.write(EXPERIMENT, _described(experiment).encode())
        yield Store(place, tables_of(experiment))


def load(folder: str | Path) -> Results:
    """What an output folder holds, as Polars frames.

    Args:
        folder: output folder of a finished run, a path or a URL.

    Returns:
        The experiment and its tables.

    Raises:
        RequestError: if the folder is not one of a finished run, or damaged.
    """
    place = open_folder(folder)
    experiment = _read_design(place)
    if experiment is None:
        raise RequestError(f"results folder {folder}: it holds no {EXPERIMENT}")
    contents = {name: place.read(name) for name in tables_of(experiment)}
    if None in contents.values():
        raise _unfinished(place)
    try:
        tables = {n: pl.read_parquet(io.BytesIO(content or b"")) for n, content in contents.items()}
    except pl.exceptions.PolarsError as error:
        raise RequestError(
            f"results folder {folder}: damaged; run it again to mend it ({error})"
        ) from error
    episodes = tables[EPISODES]
    conditions = {named.condition for named in experiment.conditions()}
    rows = len(conditions) * experiment.trials * (experiment.episodes + experiment.retention)
    if episodes.height != rows or set(episodes["condition"].unique()) != conditions:
        raise _unfinished(place)
    values = decoded_values(place.read(VALUES) or b"", f"{folder}/{VALUES}")
    return Results(experiment, episodes, tables.get(STATES), values)


def _unfinished(folder: Folder) -> RequestError:
    return RequestError(
        f"results folder {folder}: the run is not finished; run it again to continue"
    )


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


def _read_design(folder: Folder) -> Experiment | None:
    """The experiment of an output folder; None if there is none."""
    content = folder.read(EXPERIMENT)
    if content is None:
        return None
    settings = parsed(content, f"experiment file {folder}/{EXPERIMENT}")
    found = settings.get("run", {}).get("format", 1)
    if found != FORMAT:
        age = "a newer" if isinstance(found, int) and found > FORMAT else "an older"
        raise RequestError(
            f"output folder {folder}: written by {age} version of qbumpers (format {found!r}, "
            f"needed {FORMAT}); choose another folder"
        )
    del settings["run"]
    return make_experiment(settings, f"experiment file {folder}/{EXPERIMENT}", large=True)


def _check_same(folder: Folder, found: Experiment, experiment: Experiment) -> None:
    before, now = found.model_dump(), experiment.model_dump()
    changed = [f for f in now if f not in _CHANGING and now[f] != before[f]]
    if changed:
        details = "; ".join(f"{f} was {before[f]!r}, now {now[f]!r}" for f in changed)
        raise RequestError(
            f"output folder {folder} holds another experiment ({details}); choose another folder"
        )


def _renamed(found: Experiment, experiment: Experiment) -> bool:
    """Whether an id means another condition than it did."""
    before = {named.condition: named for named in found.conditions()}
    return any(before.get(named.condition, named) != named for named in experiment.conditions())


def run_description(folder: str | Path) -> dict[str, Any]:
    """The `[run]` table of an output folder: its format, and the versions and platform that ran."""
    content = open_folder(folder).read(EXPERIMENT) or b""
    return parsed(content, f"experiment file {folder}/{EXPERIMENT}").get("run", {})
