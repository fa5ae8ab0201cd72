"""Finished cells in a folder: which of them may be used again, and why others are not.

A cell's files lie in a folder that its content names, and their names hold the identity of what
made them. Cells of another identity stay where they are: they are used again if the code becomes
again what it was.
"""

import hashlib
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import NamedTuple

from qbumpers.experiments.cells import Cell
from qbumpers.experiments.identity import differences
from qbumpers.experiments.record import Record, RecordedCondition
from qbumpers.files import Folder

_NAME = re.compile(
    r"(?P<first>\d+)-(?P<trials>\d+)-(?P<kind>[a-z]+)"
    r"(?:-(?P<identity>[0-9a-f]{16}))?-(?P<digest>[0-9a-f]{16})\.parquet"
)


class CellFile(NamedTuple):
    """A table of a cell, as it is named.

    Attributes:
        name: in the output folder.
        cell: whose table it is.
        kind: of table, for example "episodes.parquet".
        identity: of what made it; empty if that was not noted.
        digest: of the bytes that it should hold.
    """

    name: str
    cell: Cell
    kind: str
    identity: str
    digest: str


def cells_folder(content: str) -> str:
    """The folder of the cells of a content, in the output folder."""
    return f"cells/{content[:16]}"


def cell_file_name(cell: Cell, kind: str, identity: str, digest: str) -> str:
    """How a table of a cell is named in the output folder."""
    stem = f"{cell.first:06d}-{cell.trials}-{kind.removesuffix('.parquet')}"
    return f"{cells_folder(cell.content)}/{stem}-{identity}-{digest}.parquet"


def is_cell_file(name: str) -> bool:
    """Whether a file among the cells is named as a table of one is."""
    return _NAME.fullmatch(name) is not None


def cell_files(folder: Folder, content: str) -> list[CellFile]:
    """The tables of all cells of a content; other files there are left out."""
    found = []
    for name in folder.names(cells_folder(content)):
        parts = _NAME.fullmatch(name.rpartition("/")[2])
        if parts is not None:
            cell = Cell(content, int(parts["first"]), int(parts["trials"]))
            kind = f"{parts['kind']}.parquet"
            found.append(CellFile(name, cell, kind, parts["identity"] or "", parts["digest"]))
    return found


def usable_for(wanted: str, identity: str, record: Record) -> bool:
    """Whether a cell may be used by a condition.

    Args:
        wanted: identity of the condition.
        identity: of what made the cell; empty if that was not noted.
        record: of the conditions.
    """
    return record.allows_unmarked(wanted) if not identity else identity == wanted


def digest_of(content: bytes) -> str:
    """The digest of a table's bytes, of which its name tells."""
    return hashlib.sha256(content).hexdigest()[:16]


def whole_content(folder: Folder, file: CellFile) -> bytes | None:
    """What the file of a cell holds; None if it is damaged."""
    content = folder.read(file.name) or b""
    return content if digest_of(content) == file.digest else None


def whole_cells(files: Iterable[CellFile], tables: Collection[str]) -> list[Cell]:
    """Cells of which there are all tables."""
    kinds: dict[Cell, set[str]] = {}
    for file in files:
        kinds.setdefault(file.cell, set()).add(file.kind)
    return [cell for cell, found in kinds.items() if found == set(tables)]


def again(
    record: Record,
    before: Record | None,
    cells: Mapping[str, Sequence[Cell]],
    stale: Callable[[str], Sequence[CellFile]],
    trials: int,
) -> list[str]:
    """Why finished trials are simulated again.

    Args:
        record: of the conditions.
        before: what the folder noted until now; None if that is nothing.
        cells: that are used, by their content.
        stale: finds the files of cells that are not, by their content.
        trials: that are wanted of each condition.

    Returns:
        A sentence for each reason.
    """
    then = before.by_id() if before else {}
    found: dict[str, dict[str, int]] = {}
    for each in record.conditions:
        known = then.get(each.condition)
        renewed = [] if known is None else _renewed(known, each)
        files = stale(known.content if known and renewed else each.content)
        there = _numbers(f.cell for f in files) - _numbers(cells[each.content])
        number = sum(trial < trials for trial in there)
        if number:
            reason = " and ".join(renewed) or _reason(each, known, files, record)
            found.setdefault(reason, {})[each.condition] = number
    return [
        f"{_named(list(numbers))}: {reason}; {_counted(sum(numbers.values()))} simulated again"
        for reason, numbers in found.items()
    ]


def _renewed(then: RecordedCondition, now: RecordedCondition) -> list[str]:
    """What is said of files that hold something else than they did."""
    return [
        f"the file {name} changed since they were simulated"
        for name, kept in now.files.items()
        if then.content != now.content and then.files.get(name, kept) != kept
    ]


def _reason(
    each: RecordedCondition,
    then: RecordedCondition | None,
    files: Sequence[CellFile],
    record: Record,
) -> str:
    identities = [file.identity for file in files]
    latest = then.identity if then and then.identity in identities else identities[-1]
    return differences(record.identities.get(latest), record.identities[each.identity])


def _numbers(cells: Iterable[Cell]) -> set[int]:
    return {number for cell in cells for number in range(cell.first, cell.end)}


def _named(conditions: Sequence[str]) -> str:
    more = len(conditions) - 1
    return conditions[0] + (f" and {more} more condition{'s' * (more > 1)}" if more else "")


def _counted(trials: int) -> str:
    return "1 trial is" if trials == 1 else f"{trials} trials are"
