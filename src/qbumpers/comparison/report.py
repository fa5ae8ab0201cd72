"""Tables, figures and the page of a comparison, from the files of its runs alone."""

from collections.abc import Callable
from pathlib import Path

import polars as pl

from qbumpers.analysis.page.layout import Picture
from qbumpers.analysis.report import FIGURES, picture
from qbumpers.comparison.figures import drawings
from qbumpers.comparison.page import page
from qbumpers.comparison.results import load_comparison
from qbumpers.comparison.scores import Tables, find_tables
from qbumpers.errors import RequestError
from qbumpers.files import write_atomically

PAGE = "comparison.html"

_NUMBERS = ("_mean", "_low", "_high", "best", "spread", "_assisted", "_unassisted", "share")


def write_comparison(
    folder: str | Path, advance: Callable[[str], None] = lambda part: None
) -> Tables:
    """Write tables, figures and `comparison.html` of a finished comparison into its folder.

    Args:
        folder: output folder of `run_cases`.
        advance: called with the name of each part before it is made.

    Returns:
        The tables.

    Raises:
        RequestError: if the folder is not one of a finished comparison.
        StoreError: if a file cannot be written.
    """
    place = Path(folder)
    advance("tables")
    comparison = load_comparison(place)
    tables = find_tables(comparison)
    for name, table in tables._asdict().items():
        if table.width:  # of scores there may be none
            _write(place / f"{name}.csv", table.write_csv())
    pictures: list[Picture] = []
    for drawing in drawings(tables):
        advance(f"figure {drawing.name}")
        pictures.append(picture(place / FIGURES, drawing))
    advance(PAGE)
    _write(place / PAGE, page(comparison, tables, pictures))
    return tables


def read_tables(folder: str | Path) -> Tables:
    """The tables that `write_comparison` wrote.

    Args:
        folder: where the CSV files are.

    Raises:
        RequestError: if one is missing.
    """
    return Tables(**{name: _read(Path(folder) / f"{name}.csv") for name in Tables._fields})


def _read(path: Path) -> pl.DataFrame:
    if not path.is_file():
        raise RequestError(f"tables of a comparison {path}: there is no such file")
    table = pl.read_csv(path, infer_schema_length=None)
    numbers = [name for name in table.columns if name.endswith(_NUMBERS)]
    return table.with_columns(pl.col(numbers).cast(pl.Float64))


def _write(path: Path, text: str) -> None:
    write_atomically(path, lambda temporary: temporary.write_bytes(text.encode()))
