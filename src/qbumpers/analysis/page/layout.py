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
from qbumpers.analysis.numerals import written
from qbumpers.analysis.page import tables as page_tables
from qbumpers.analysis.page.evidence import claim_table
from qbumpers.analysis.section_4_1 import ThresholdStory
from qbumpers.experiments.design import Experiment, reproductions
from qbumpers.experiments.sources import profiles, reproduction
from qbumpers.experiments.store import EXPERIMENT, Results, run_description


class Picture(NamedTuple):
    """A drawn figure.

    Attributes:
        kind: what it is, for instance "frontier".
        label: what tells its learner from others.
        name: of its files, without ending.
        caption: what can be seen.
        image: content of the PNG.
        numbers: behind it, as CSV.
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
    story: ThresholdStory | None,
    pictures: Sequence[Picture],
    tables: Mapping[str, pl.DataFrame],
) -> str:
    """The page of a report.

    Args:
        folder: of the run.
        results: of the run.
        findings: what its tables say.
        story: the numbers of Section 4.1, where the run tells that story.
        pictures: every figure.
        tables: CSV files, offered for download.

    Returns:
        HTML.
    """
    settings = (folder / EXPERIMENT).read_text(encoding="utf-8")
    files = {name: _data("text/csv", table.write_csv().encode()) for name, table in tables.items()}
    return _template().render(
        experiment=results.experiment,
        findings=findings,
        story=story,
        make=page_tables,
        claim_table=claim_table,
        names=NAMES,
        kinds={picture.kind for picture in pictures},
        pictures=pictures,
        data=_data,
        files={**files, EXPERIMENT: _data("application/toml", settings.encode())},
        settings=settings,
        run=run_description(folder),
        command=command(results.experiment),
    )


def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("qbumpers.analysis.page"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {"number": written}
    return environment.get_template("report.html.j2")


def command(experiment: Experiment) -> str:
    """What to type to repeat an experiment."""
    known = [(name, profile) for name in reproductions() for profile in profiles(name)]
    for name, profile in known:
        repeated = reproduction(name, profile, trials=experiment.trials, seed=experiment.seed)
        if repeated == experiment:
            size = f"--trials {experiment.trials} --seed {experiment.seed}"
            return f"qbumpers reproduce {name} --profile {profile} {size}"
    return f"qbumpers run {EXPERIMENT}"


def _data(kind: str, content: bytes | str) -> Markup:
    """Content as an address that holds it."""
    content = content.encode() if isinstance(content, str) else content
    return Markup(f"data:{kind};base64,{base64.b64encode(content).decode()}")
