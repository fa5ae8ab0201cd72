"""Write the page that helps to choose an assistant, and its figures, from kept tables.

`python docs/make_comparison.py` writes the page from `docs/data/comparison`;
`python docs/make_comparison.py keep RESULTS` first keeps the tables of a comparison there.
"""

import json
import re
import sys
from pathlib import Path

import polars as pl
from make_pictures import keep
from writing import DOCS, template

from qbumpers.analysis.figures.style import NAMES
from qbumpers.comparison import sentences
from qbumpers.comparison.figures import drawings
from qbumpers.comparison.page import floors_table, shares_table
from qbumpers.comparison.report import read_tables
from qbumpers.comparison.results import NARROW
from qbumpers.comparison.running import COMPARISON

DATA = DOCS / "data" / "comparison"
_DIGITS, _COLOURS = 4, 60
_NOTED = "comparison.json"


def keep_tables(results: Path) -> None:
    """Keep the tables of a comparison, rounded, and the command that repeats it."""
    DATA.mkdir(parents=True, exist_ok=True)
    for name, table in read_tables(results)._asdict().items():
        rounded = table.with_columns(pl.selectors.float().round_sig_figs(_DIGITS))
        (DATA / f"{name}.csv").write_bytes(rounded.write_csv().encode())
    noted = json.loads((results / COMPARISON).read_text("utf-8"))
    kept = {field: noted[field] for field in ("version", "command")}
    (DATA / _NOTED).write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


def make(folder: Path) -> None:
    """Write `choosing.md` and its images into `folder`."""
    tables = read_tables(DATA)
    images = folder / "images"
    images.mkdir(parents=True, exist_ok=True)
    shown = [
        (drawing, "comparison-" + re.sub(r"[^\w-]", "-", drawing.name))
        for drawing in drawings(tables)
    ]
    for drawing, name in shown:
        keep(drawing.draw(), images, name, _COLOURS)
    page = template("choosing.md.j2")
    text = page.render(
        noted=json.loads((DATA / _NOTED).read_text("utf-8")),
        tables=tables,
        sentences=sentences,
        names=NAMES,
        narrow=NARROW,
        at_shares=shares_table(tables),
        at_floors=floors_table(tables),
        figures=[(drawing.kind, drawing.label, name) for drawing, name in shown],
    )
    (folder / "choosing.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1:2] == ["keep"]:
        keep_tables(Path(sys.argv[2]))
        make(DOCS)
    else:
        make(Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS)
