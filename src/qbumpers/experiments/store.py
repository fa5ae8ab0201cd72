"""Results in a folder: written atomically, never computed twice, read by the analysis."""

import contextlib
import io
import platform
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import filelock
import polars as pl
import tomli_w

import qbumpers
from qbumpers.errors import RequestError
from qbumpers.experiments.design import Experiment, load_experiment
from qbumpers.files import LEFT_BEHIND, StoreError, write_atomically
from qbumpers.values import TabularValues, load_values

EXPERIMENT, EPISODES, STATES, VALUES = (
    "experiment.toml",
    "episodes.parquet",
    "states.parquet",
    "values.npz",
)
"""Files of an output folder; design and platform, a row an episode, a row a state, Q*."""

_GROWING = {"trials", "assistants"}  # an experiment may be continued with more of these


class Cell(NamedTuple):
    """A block of trials of one condition.

    Attributes:
        condition: its readable id.
        content: digest of everything that decides its numbers.
        first: the first trial.
        trials: how many.
    """

    condition: str
    content: str
    first: int
    trials: int


class Results(NamedTuple):
    """What an output folder holds.

    Attributes:
        experiment: as run.
        episodes: a row an episode.
        states: a row a condition and state.
        values: Q* of the assistants.
    """

    experiment: Experiment
    episodes: pl.DataFrame
    states: pl.DataFrame
    values: TabularValues


class Store:
    """The output folder of one experiment; `open_store` opens it.

    Args:
        folder: of the results.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def finished(self, cell: Cell) -> bool:
        """Whether a cell is there and whole."""
        try:
            for kind in (EPISODES, STATES):
                with self._path(cell, kind).open("rb") as file:
                    pl.read_parquet_schema(file)
        except (OSError, pl.exceptions.PolarsError):
            return False
        return True

    def write(self, cell: Cell, episodes: pl.DataFrame, states: pl.DataFrame) -> None:
        """Keep the results of a cell; the file of episodes, written last, says that it is whole."""
        for kind, frame in ((STATES, states), (EPISODES, episodes)):
            _write_table(self._path(cell, kind), frame)

    def write_values(self, values: TabularValues) -> None:
        """Keep the assistants' Q*."""
        values.save(self.folder / VALUES)

    def assemble(self, cells: list[Cell]) -> None:
        """Write the tables of the whole experiment from its finished cells."""
        for kind in (EPISODES, STATES):
            parts = [
                pl.read_parquet(self._path(cell, kind), glob=False).select(
                    pl.lit(cell.condition).alias("condition"), pl.all()
                )
                for cell in cells
            ]
            table = pl.concat(parts)
            if kind == STATES:
                keys = ["condition", "state", "row", "column"]
                table = table.group_by(keys, maintain_order=True).sum()
            _write_table(self.folder / kind, table)

    def _path(self, cell: Cell, kind: str) -> Path:
        return self.folder / "cells" / cell.content[:16] / f"{cell.first:06d}-{cell.trials}-{kind}"


def _write_table(path: Path, table: pl.DataFrame) -> None:
    # Through memory: Polars' own message about a full disk does not say so.
    buffer = io.BytesIO()
    table.write_parquet(buffer)
    write_atomically(path, lambda temporary: temporary.write_bytes(buffer.getvalue()))


@contextlib.contextmanager
def open_store(folder: str | Path, experiment: Experiment) -> Iterator[Store]:
    """Open an output folder for one run, which alone writes to it.

    Args:
        folder: of the results; made where it is missing.
        experiment: to be run, or continued.

    Yields:
        The store, with what a killed run left half-written cleared away.

    Raises:
        RequestError: where the folder is a file, holds another experiment, or another run is
            writing to it.
        StoreError: where it cannot be written.
    """
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise RequestError(f"output folder {folder}: it is a file")
    _check_same(folder, experiment)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = filelock.FileLock(folder / ".lock").acquire(timeout=0)
    except filelock.Timeout as error:
        raise RequestError(
            f"output folder {folder}: another run is writing to it; wait for it, or choose another "
            "folder"
        ) from error
    except OSError as error:
        raise StoreError(
            f"cannot write {folder / EXPERIMENT}: {error.strerror or error}"
        ) from error
    with lock:
        write_atomically(folder / EXPERIMENT, lambda path: path.write_text(_described(experiment)))
        for left in folder.rglob(LEFT_BEHIND):
            left.unlink(missing_ok=True)
        yield Store(folder)


def load(folder: str | Path) -> Results:
    """What an output folder holds.

    Args:
        folder: of a finished run.

    Returns:
        The experiment and its tables.

    Raises:
        RequestError: where the folder is not one of a finished run.
    """
    folder = Path(folder)
    if not (folder / EXPERIMENT).is_file():
        raise RequestError(f"results folder {folder}: it holds no {EXPERIMENT}")
    experiment = load_experiment(folder / EXPERIMENT)
    if not (folder / EPISODES).is_file():
        raise _unfinished(folder)
    try:
        episodes, states = (pl.read_parquet(folder / f, glob=False) for f in (EPISODES, STATES))
    except (OSError, pl.exceptions.PolarsError) as error:
        raise RequestError(
            f"results folder {folder}: damaged; run it again to mend it ({error})"
        ) from error
    conditions = {named.condition for named in experiment.named_assistants()}
    rows = len(conditions) * experiment.trials * experiment.episodes
    if episodes.height != rows or set(episodes["condition"].unique()) != conditions:
        raise _unfinished(folder)
    return Results(experiment, episodes, states, load_values(folder / VALUES))


def _unfinished(folder: Path) -> RequestError:
    return RequestError(
        f"results folder {folder}: the run is not finished; run it again to continue"
    )


def _described(experiment: Experiment) -> str:
    settings = experiment.model_dump(exclude_none=True)
    run = {
        "version": qbumpers.__version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
    }
    return tomli_w.dumps({**settings, "run": run})


def _check_same(folder: Path, experiment: Experiment) -> None:
    file = folder / EXPERIMENT
    if not file.is_file():
        return
    before = load_experiment(file).model_dump()
    now = experiment.model_dump()
    changed = [f for f in now if f not in _GROWING and now[f] != before[f]]
    if changed:
        details = "; ".join(f"{f} was {before[f]!r}, now {now[f]!r}" for f in changed)
        raise RequestError(
            f"output folder {folder} holds another experiment ({details}); choose another folder"
        )


def run_description(folder: str | Path) -> dict[str, Any]:
    """The `[run]` table of an output folder: version, python, platform."""
    return tomllib.loads((Path(folder) / EXPERIMENT).read_text(encoding="utf-8")).get("run", {})
