"""Results on their way into a folder: written atomically, never computed twice."""

import contextlib
import importlib.metadata
import io
import platform
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import polars as pl
import tomli_w

import qbumpers
from qbumpers.errors import RequestError
from qbumpers.experiments.cells import Cell
from qbumpers.experiments.design import Experiment
from qbumpers.experiments.record import (
    CONDITIONS,
    FILES,
    Record,
    decoded_record,
    is_kept_file,
)
from qbumpers.experiments.reuse import (
    CellFile,
    again,
    cell_file_name,
    cell_files,
    cells_folder,
    digest_of,
    is_cell_file,
    usable_for,
    whole_cells,
    whole_content,
)
from qbumpers.experiments.store import EXPERIMENT, FORMAT, NEEDED, VALUES, read_design
from qbumpers.experiments.tables import assembled, encoded, tables_of
from qbumpers.files import Folder, StoreError, open_folder
from qbumpers.values import NetworkValues, TabularValues, decoded_values

# An experiment may be continued with more or fewer of the first three, and be read in another way.
_CHANGING = {"trials", "assistants", "learners", "criterion", "reproduces", "imports"}

_LIBRARIES = ("numpy", "numba", "scipy", "polars")


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
            whole = [file for file in usable if whole_content(self._folder, file) is not None]
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

    def write(self, cell: Cell, files: Mapping[str, bytes]) -> None:
        """Keep the tables of a cell, encoded, by kind; it is whole when all are there."""
        for kind, content in files.items():
            name = cell_file_name(cell, kind, self._identities[cell.content], digest_of(content))
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
        if f"-{digest_of(content)}." not in name:
            raise StoreError(f"{name} was changed while the run went on; run it again to mend it")
        return pl.read_parquet(io.BytesIO(content))


@contextlib.contextmanager
def open_store(folder: str | Path, experiment: Experiment, record: Record) -> Iterator[Store]:
    """Open an output folder for one run, which alone writes to it.

    Args:
        folder: where the results go, a path or a URL; made if it is missing.
        experiment: to be run, or continued.
        record: what is noted of its conditions, as they are now.

    Yields:
        The store, with what a killed run left half-written cleared away.

    Raises:
        RequestError: if the folder is a file, holds another experiment, or another run is
            writing to it.
        StoreError: if it cannot be written.
    """
    place = open_folder(folder)
    with place.locked():
        found, before = read_design(place), decoded_record(place.read(CONDITIONS))
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
        place.write(EXPERIMENT, described(experiment).encode())
        yield Store(place, tables_of(experiment), record, before)


def _clear_left(folder: Folder, records: Sequence[Record]) -> None:
    """Clear away what killed runs left half-written of their own files, and of no others."""
    folder.clear_left("", NEEDED.__contains__)
    folder.clear_left(FILES, is_kept_file)
    for place in {cells_folder(each.content) for record in records for each in record.conditions}:
        folder.clear_left(place, is_cell_file)


def described(experiment: Experiment, **more: Any) -> str:
    """An experiment as its output folder notes it, with what is noted of the run.

    Args:
        experiment: as run.
        **more: what else is noted of the run.
    """
    settings = experiment.model_dump(exclude_none=True)
    run = {
        "format": FORMAT,
        "version": qbumpers.__version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
        **{name: importlib.metadata.version(name) for name in _LIBRARIES},
        **more,
    }
    return tomli_w.dumps({**settings, "run": run})


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
