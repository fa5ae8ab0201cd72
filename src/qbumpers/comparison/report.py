"""Tables, figures and the page of a comparison, from the files of its runs alone."""

from collections.abc import Callable
from pathlib import Path

from qbumpers.analysis.page.layout import Picture
from qbumpers.analysis.report import FIGURES, picture
from qbumpers.comparison.figures import drawings
from qbumpers.comparison.page import page
from qbumpers.comparison.results import load_comparison
from qbumpers.comparison.scores import Tables, find_tables
from qbumpers.files import write_atomically

PAGE = "comparison.html"


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
        if table.width:
            _write(place / f"{name}.csv", table.write_csv())
    pictures: list[Picture] = []
    for drawing in drawings(tables):
        advance(f"figure {drawing.name}")
        pictures.append(picture(place / FIGURES, drawing))
    advance(PAGE)
    _write(place / PAGE, page(comparison, tables, pictures))
    return tables


def _write(path: Path, text: str) -> None:
    write_atomically(path, lambda temporary: temporary.write_bytes(text.encode()))
