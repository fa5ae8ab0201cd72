"""The page of a report: one HTML file that needs nothing else."""

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import jinja2
import polars as pl
from markupsafe import Markup

from qbumpers.analysis.figures.style import NAMES
from qbumpers.analysis.findings import Findings
from qbumpers.analysis.formatting import format_number
from qbumpers.analysis.page import points
from qbumpers.analysis.page import tables as page_tables
from qbumpers.experiments.store import EXPERIMENT, Results, run_description


class Picture(NamedTuple):
    """A drawn figure.

    Attributes:
        kind: what it is, for example "frontier".
        label: what distinguishes its learner from others.
        name: the name of its files, without ending.
        caption: what can be seen.
        image: content of the PNG.
        numbers: what it is drawn from, as CSV.
    """

    kind: str
    label: str
    name: str
    caption: str
    image: bytes
    numbers: str


def page(
    folder: Path,
    results: Results,
    findings: Findings,
    pictures: Sequence[Picture],
    tables: Mapping[str, pl.DataFrame],
) -> str:
    """The page of a report.

    Args:
        folder: output folder of the run.
        results: what that folder holds.
        findings: what its tables say.
        pictures: every figure.
        tables: CSV files, offered for download.

    Returns:
        HTML.
    """
    settings = (folder / EXPERIMENT).read_text(encoding="utf-8")
    files = {
        name: data_url("text/csv", table.write_csv().encode()) for name, table in tables.items()
    }
    return _template().render(
        experiment=results.experiment,
        findings=findings,
        make=page_tables,
        names=NAMES,
        kinds={picture.kind for picture in pictures},
        pictures=pictures,
        data=data_url,
        files={**files, EXPERIMENT: data_url("application/toml", settings.encode())},
        settings=settings,
        run=run_description(folder),
        command=findings.additions.command or f"qbumpers run {EXPERIMENT}",
    )


def _template() -> jinja2.Template:
    environment = page_environment("qbumpers.analysis.page")
    environment.globals |= {
        "panels": points.panels,
        "width": points.WIDTH,
        "height": points.HEIGHT,
        "left": points.LEFT,
        "below": points.BELOW,
    }
    return environment.get_template("report.html.j2")


def page_environment(*packages: str) -> jinja2.Environment:
    """Templates of pages.

    Args:
        *packages: whose folders `templates` are looked in, one after the other.
    """
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(package) for package in packages]),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {"number": format_number}
    return environment


def data_url(kind: str, content: bytes | str) -> Markup:
    """Content as a data URL."""
    content = content.encode() if isinstance(content, str) else content
    return Markup(f"data:{kind};base64,{base64.b64encode(content).decode()}")
