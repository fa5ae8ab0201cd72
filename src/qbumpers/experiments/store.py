"""Results in a folder: written atomically, never computed twice, read by the analysis."""

import contextlib
import hashlib
import json
import os
import platform
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import polars as pl
import tomli_w

import qbumpers
from qbumpers.errors import RequestError
from qbumpers.experiments.design import Experiment, load_experiment
from qbumpers.values import TabularValues, load_values

EXPERIMENT, EPISODES, STATES, VALUES = (
    "experiment.toml",
    "episodes.parquet",
    "states.parquet",
    "values.npz",
)
"""Files of an output folder; design and platform, a row an episode, a row a state, Q*."""

_GROWING = {"trials", "assistants"}  # an experiment may be continued with more of these


class StoreError(OSError):
    """Results could not be written or read; what was finished before stays."""


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


def write_atomically(path: Path, write: Callable[[Path], Any]) -> None:
    """Write a file so that it appears whole or not at all.

    Args:
        path: of the file.
        write: writes it at the path that it is given.

    Raises:
        StoreError: where it cannot be written, for instance on a full disk.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(temporary)
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        temporary.replace(path)
    except (OSError, pl.exceptions.ComputeError) as error:
        raise StoreError(
            f"cannot write {path}: {getattr(error, 'strerror', None) or error}"
        ) from error
    finally:
        with contextlib.suppress(OSError):  # an unwritable folder: nothing was left there
            temporary.unlink(missing_ok=True)


def digest(content: Any) -> str:
    """A SHA-256 of JSON-like data, in hexadecimal."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


class Store:
    """The output folder of one experiment.

    Args:
        folder: of the results; made where it is missing.
        experiment: to be run, or continued.

    Raises:
        RequestError: where the folder holds another experiment, or is no folder.
        StoreError: where it cannot be written.
    """

    def __init__(self, folder: str | Path, experiment: Experiment) -> None:
        self.folder = Path(folder)
        if self.folder.exists() and not self.folder.is_dir():
            raise RequestError(f"output folder {folder}: it is a file")
        _check_same(self.folder, experiment)
        write_atomically(
            self.folder / EXPERIMENT, lambda path: path.write_text(_described(experiment))
        )

    def finished(self, cell: Cell) -> bool:
        """Whether a cell is there and whole."""
        try:
            for kind in (EPISODES, STATES):
                pl.read_parquet_schema(self._path(cell, kind))
        except (OSError, pl.exceptions.PolarsError):
            return False
        return True

    def write(self, cell: Cell, episodes: pl.DataFrame, states: pl.DataFrame) -> None:
        """Keep the results of a cell; the file of episodes, written last, says that it is whole."""
        for kind, frame in ((STATES, states), (EPISODES, episodes)):
            write_atomically(self._path(cell, kind), frame.write_parquet)

    def write_values(self, values: TabularValues) -> None:
        """Keep the assistants' Q*."""
        write_atomically(self.folder / VALUES, values.save)

    def assemble(self, cells: list[Cell]) -> None:
        """Write the tables of the whole experiment from its finished cells."""
        for kind in (EPISODES, STATES):
            parts = [
                pl.read_parquet(self._path(cell, kind)).select(
                    pl.lit(cell.condition).alias("condition"), pl.all()
                )
                for cell in cells
            ]
            table = pl.concat(parts)
            if kind == STATES:
                keys = ["condition", "state", "row", "column"]
                table = table.group_by(keys, maintain_order=True).sum()
            write_atomically(self.folder / kind, table.write_parquet)

    def _path(self, cell: Cell, kind: str) -> Path:
        return self.folder / "cells" / cell.content[:16] / f"{cell.first:06d}-{cell.trials}-{kind}"


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
    if not (folder / EPISODES).is_file():
        raise RequestError(
            f"results folder {folder}: the run is not finished; run it again to continue"
        )
    try:
        episodes, states = pl.read_parquet(folder / EPISODES), pl.read_parquet(folder / STATES)
    except (OSError, pl.exceptions.PolarsError) as error:
        raise RequestError(
            f"results folder {folder}: damaged; run it again to mend it ({error})"
        ) from error
    return Results(
        load_experiment(folder / EXPERIMENT), episodes, states, load_values(folder / VALUES)
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
