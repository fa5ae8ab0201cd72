"""Tables, figures and one self-contained page, from the files of a finished run alone."""

import contextlib
import gc
import io
from collections.abc import Callable, Collection, Iterable, Iterator
from pathlib import Path
from typing import Any

import polars as pl

from qbumpers.analysis.additions import Additions
from qbumpers.analysis.figures.style import save
from qbumpers.analysis.findings import Findings, LearnerFindings, find_tables
from qbumpers.analysis.frontier import Regret
from qbumpers.analysis.measures import trial_measures
from qbumpers.analysis.page.cautions import cautions
from qbumpers.analysis.page.doubts import doubts
from qbumpers.analysis.page.drawings import drawings
from qbumpers.analysis.page.elements import Drawing
from qbumpers.analysis.page.headlines import headlines
from qbumpers.analysis.page.layout import Picture, page
from qbumpers.analysis.page.suggestions import suggestions
from qbumpers.experiments.store import Results, load
from qbumpers.files import clear_left, write_atomically

REPORT, SUMMARY, TRIALS = "report.html", "summary.csv", "trials.parquet"
"""The page; a row per condition; a row per trial."""

METHODS, ADVANTAGES, DIFFERENCES, REGRET = (
    "methods.csv",
    "advantages.csv",
    "differences.csv",
    "regret.csv",
)
"""Written if there is something to compare."""

FIGURES = "figures"
_OPTIONAL = (METHODS, ADVANTAGES, DIFFERENCES, REGRET)
_FIGURE_FILES = (".png", ".svg", ".csv")


Add = Callable[[Results, Findings], Additions]
"""What is added to a report, from the results of a run and their tables."""


def nothing(results: Results, findings: Findings) -> Additions:
    """No additions."""
    return Additions()


def write_report(
    folder: str | Path,
    advance: Callable[[str], None] = lambda part: None,
    add: Add = nothing,
) -> Findings:
    """Analyse a run: write tables, figures and `report.html` into its folder.

    Of a run that is not finished, the report says what is missing. What an earlier analysis left
    there, and this one does not write, is removed.

    Args:
        folder: output folder of the run, a path or a URL.
        advance: called with the name of each part before it is made.
        add: finds what is to be added; the reports of published experiments have
            `qbumpers.reproduction.report.additions`.

    Returns:
        What the tables say.

    Raises:
        RequestError: if the folder is not one of a run of which some trials are finished.
        StoreError: if a file cannot be written.
    """
    folder = Path(folder)
    results = load(folder, unfinished=True)
    advance("tables")
    findings = find(results, add)
    tables = _tables(findings)
    for name, table in tables.items():
        _write(folder / name, table.write_csv().encode())
    _write(folder / TRIALS, _parquet(findings.trials))
    pictures = []
    for drawing in drawings(results, findings):
        advance(f"figure {drawing.name}")
        pictures.append(picture(folder / FIGURES, drawing))
    advance(REPORT)
    text = page(folder, results, findings, pictures, tables)
    _write(folder / REPORT, text.encode())
    _clear(folder, {*tables})
    _clear_figures(folder / FIGURES, {each.name for each in pictures})
    return findings


def find(results: Results, add: Add = nothing) -> Findings:
    """Every table of a report and what they say in sentences.

    Args:
        results: what the run's output folder holds.
        add: finds what is to be added.
    """
    trials = trial_measures(results.episodes, results.experiment.criterion)
    found = find_tables(trials, results.experiment, results.conditions)
    found = found._replace(missing=results.missing)
    found = found._replace(additions=add(results, found))
    return found._replace(
        headlines=headlines(found),
        cautions=[*doubts(found, results), *cautions(found, results.experiment)],
        suggestions=suggestions(found),
    )


def _tables(findings: Findings) -> dict[str, pl.DataFrame]:
    """Tables for reading, by the name of their file."""
    everyone = findings.learners
    tables = {
        SUMMARY: findings.summary,
        METHODS: _together((about, about.methods) for about in everyone),
        ADVANTAGES: _together((about, about.advantages) for about in everyone),
        DIFFERENCES: _together((about, about.differences) for about in everyone),
        REGRET: pl.DataFrame(
            [_flat(about, m, r) for about in everyone for m, r in about.regrets.items()]
        ).fill_nan(None),
        **findings.additions.tables,
    }
    return {name: table for name, table in tables.items() if table.height}


def _together(tables: Iterable[tuple[LearnerFindings, pl.DataFrame]]) -> pl.DataFrame:
    """Tables of several learners in one; those that have nothing to compare are left out."""
    parts = [
        table.select(pl.lit(about.learner).alias("learner"), pl.all())
        for about, table in tables
        if table.height
    ]
    return pl.concat(parts) if parts else pl.DataFrame()


def _flat(about: LearnerFindings, matched: str, regret: Regret) -> dict[str, Any]:
    return {
        "learner": about.learner,
        "matched": matched,
        "baseline_condition": regret.baseline_condition,
        "best_condition": regret.best_condition,
        "level": regret.level,
        "baseline": regret.baseline,
        "best": regret.best,
        **{f"method_{part}": number for part, number in regret.method._asdict().items()},
        **{
            f"reduction_{part}": number if regret.is_known else float("nan")
            for part, number in regret.reduction._asdict().items()
        },
        **{f"gap_{part}": number for part, number in regret.gap._asdict().items()},
    }


def picture(folder: Path, drawing: Drawing) -> Picture:
    """Draw a figure and write it as PNG and SVG, with the numbers behind it as CSV.

    Args:
        folder: where the files go.
        drawing: what is drawn.

    Returns:
        The figure, for a page.

    Raises:
        StoreError: if a file cannot be written.
    """
    numbers = drawing.numbers.with_columns(pl.selectors.float().round_sig_figs(8)).write_csv()
    _write(folder / f"{drawing.name}.csv", numbers.encode())
    with _without_collection():
        image = save(drawing.draw(), folder, drawing.name).read_bytes()
    return Picture(drawing.kind, drawing.label, drawing.name, drawing.caption, image, numbers)


@contextlib.contextmanager
def _without_collection() -> Iterator[None]:
    """Without garbage collection: a figure makes so many objects that it takes a tenth longer."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def _parquet(table: pl.DataFrame) -> bytes:
    # Through memory: Polars' own message about a full disk does not say so.
    buffer = io.BytesIO()
    table.write_parquet(buffer)
    return buffer.getvalue()


def _write(path: Path, content: bytes) -> None:
    write_atomically(path, lambda temporary: temporary.write_bytes(content))


def _clear(folder: Path, tables: set[str]) -> None:
    """Remove what an earlier analysis wrote, and this one did not, or was killed while it wrote."""
    for name in _OPTIONAL:
        if name not in tables:
            (folder / name).unlink(missing_ok=True)
    clear_left(folder, {REPORT, SUMMARY, TRIALS, *_OPTIONAL}.__contains__)


def _clear_figures(folder: Path, kept: Collection[str]) -> None:
    """Remove figures that an earlier analysis drew, and files of them that are half-written.

    A figure of a report is three files; others that somebody put there are left alone.

    Args:
        folder: where the reports of a run draw their figures.
        kept: names of the figures that stay, without ending.
    """
    for path in folder.glob("*.svg"):
        files = [path.with_name(path.stem + ending) for ending in _FIGURE_FILES]
        if path.stem not in kept and all(file.is_file() for file in files):
            for file in files:
                file.unlink(missing_ok=True)
    clear_left(folder, lambda name: name.endswith(_FIGURE_FILES))
