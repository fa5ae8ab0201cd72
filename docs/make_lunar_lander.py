"""Write the page on Lunar Lander from archived results: `python docs/make_lunar_lander.py`.

With `--keep`, `--runs` and `--quality` it first archives those of finished runs, which
`run_lunar_lander.py` makes.
"""

import argparse
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import polars as pl
import tomli_w
from make_pictures import keep as keep_picture
from writing import DOCS, measure, template

from qbumpers import make_task
from qbumpers.analysis.archive import (
    RUNS,
    Archive,
    archive_run,
    archive_trials,
    load_archive,
    read_trials,
    write_rounded,
)
from qbumpers.analysis.figures.curves import block_size, courses_figure, curves_figure
from qbumpers.analysis.figures.quality import quality_figure
from qbumpers.analysis.figures.runs import run_means, runs_figure
from qbumpers.analysis.figures.sensitivity import sensitivities, sensitivity_figure
from qbumpers.analysis.figures.style import NAMES, looks
from qbumpers.analysis.figures.tradeoffs import tradeoffs, tradeoffs_figure
from qbumpers.analysis.findings import find_tables
from qbumpers.experts.quality import check_values, summarise
from qbumpers.reproduction.claims import Claim, claim_sentence
from qbumpers.reproduction.lunar_lander.claims import (
    decisive_conditions,
    experiment_claims,
    judge_claims,
)
from qbumpers.values import NetworkValues, load_values

_COLOURS = 48  # bands that overlap make many, and large files

QUALITY = "quality.csv"
"""What Q values of several files predict, and what is achieved: a row per prediction."""

READING = "reading.txt"
"""What authors make of archived results, in words; removed when others are archived."""

ABOUT = "about.toml"
DEFAULT = "default"
"""What an author notes on archived results: hours, machine, a note; and the name of their run."""


class Runs(NamedTuple):
    """Runs that differ from the default in one thing each.

    Attributes:
        means: a row per run and condition.
        rows: of that table, by run and condition.
        claims: the paper's claims by run, judged from its trials.
    """

    means: pl.DataFrame
    rows: dict[tuple[str, str], dict[str, Any]]
    claims: dict[str, list[Claim]]


def make(data: Path, folder: Path) -> None:
    """Write `lunar-lander.md` and its images into `folder`, from what was archived in `data`."""
    images = folder / "images"
    images.mkdir(parents=True, exist_ok=True)
    archive = load_archive(data)
    findings = find_tables(archive.trials, archive.experiment, archive.conditions)
    draw(archive, findings.summary, images)
    runs = compared_runs(archive, data / RUNS)
    if runs is not None:
        keep_picture(runs_figure(runs.means, looks(NAMES)), images, "lunar-lander-runs", _COLOURS)
    checks = read_checks(data / QUALITY)
    if checks:
        figure = quality_figure(list(checks.items())[:2])
        keep_picture(figure, images, "lunar-lander-quality", _COLOURS)
    text = template("lunar-lander.md.j2").render(
        experiment=archive.experiment,
        run=archive.run,
        about=about(data / ABOUT),
        block=block_size(archive.experiment.episodes),
        findings=findings,
        claims=experiment_claims(archive.trials, archive.experiment),
        runs=runs,
        reading=reading(data / READING),
        quality={name: summarise(rows) for name, rows in checks.items()},
        claim_sentence=claim_sentence,
        measure=measure,
    )
    (folder / "lunar-lander.md").write_text(text, encoding="utf-8")


def draw(archive: Archive, summary: pl.DataFrame, images: Path) -> None:
    """Every figure of the main run."""
    drawn = looks(NAMES)
    overriding = archive.overrides.filter(pl.col("override_rate_mean").max().over("condition") > 0)
    for name, figure in {
        "figure4": tradeoffs_figure(tradeoffs(summary), drawn),
        "learning": curves_figure(archive.curves, drawn),
        "success": curves_figure(archive.curves, drawn, "success"),
        "overrides": courses_figure(overriding, drawn),
        "settings": sensitivity_figure(sensitivities(summary, ["alpha"]), drawn),
    }.items():
        keep_picture(figure, images, f"lunar-lander-{name}", _COLOURS)


def compared_runs(archive: Archive, path: Path) -> Runs | None:
    """The archived runs beside the same conditions of the main run; None if there are none."""
    if not path.is_file():
        return None
    trials = read_trials(path)
    conditions = trials["condition"].unique(maintain_order=True).to_list()
    own = archive.trials.filter(pl.col("condition").is_in(conditions))
    own = own.select(pl.lit(DEFAULT).alias("run"), pl.all())
    together = pl.concat([own, trials.filter(pl.col("run") != DEFAULT)])
    claims = {
        str(part["run"][0]): judge_claims(
            part.drop("run"), np.random.default_rng(archive.experiment.seed)
        )
        for part in together.partition_by("run", maintain_order=True)
    }
    means = run_means(together)
    rows = {(row["run"], row["condition"]): row for row in means.iter_rows(named=True)}
    return Runs(means, rows, claims)


def archive_checks(files: dict[str, str], into: Path) -> None:
    """Check the Q values in files, off the expert's path and at the start, and archive that.

    Args:
        files: by name.
        into: folder for the table.
    """
    task, parts = make_task("lunar-lander"), []
    for name, path in files.items():
        values = load_values(path)
        assert isinstance(values, NetworkValues)
        checks = check_values(task, values, discount=values.discount)
        shown = checks.filter((pl.col("policy") != "greedy") | (pl.col("time") == 0))
        parts.append(shown.select(pl.lit(name).alias("values"), pl.all()))
    write_rounded(into / QUALITY, pl.concat(parts))


def read_checks(path: Path) -> dict[str, pl.DataFrame]:
    """What `archive_checks` wrote, by name; empty if there is none."""
    if not path.is_file():
        return {}
    table = pl.read_csv(path, infer_schema_length=None)
    parts = table.partition_by("values", maintain_order=True)
    return {part["values"][0]: part.drop("values") for part in parts}


def reading(path: Path) -> str:
    """What the authors make of the results; empty if they do not say."""
    return path.read_text(encoding="utf-8").strip() if path.is_file() else ""


def about(path: Path) -> dict[str, Any]:
    """What an author noted on the run; empty if there is no note."""
    return tomllib.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def by_name(pairs: list[str]) -> dict[str, str]:
    """Paths by name, from `NAME=PATH`."""
    return dict(pair.rsplit("=", 1) for pair in pairs)


def main() -> None:
    """Archive what is to be archived, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=DOCS, help="for the page")
    parser.add_argument("--data", type=Path, default=DOCS / "data" / "lunar-lander")
    parser.add_argument(
        "--keep", type=Path, help="folder of the finished run, to be archived first"
    )
    parser.add_argument("--hours", type=float, help="that the run took, for the page")
    parser.add_argument("--machine", help="that it ran on, for the page, such as 'two cores'")
    parser.add_argument("--note", help="a sentence on the run, for the page")
    parser.add_argument(
        "--runs", nargs="+", metavar="NAME=FOLDER", help="runs to be archived beside"
    )
    parser.add_argument(
        "--quality", nargs="+", metavar="NAME=FILE", help="Q values to be checked; two are drawn"
    )
    asked = parser.parse_args()
    noted = {"hours": asked.hours, "machine": asked.machine, "note": asked.note}
    noted = {name: value for name, value in noted.items() if value is not None}
    if asked.keep:
        archive_run(asked.keep, asked.data, decisive_conditions)
        (asked.data / READING).unlink(missing_ok=True)
    if asked.keep or noted:
        (asked.data / ABOUT).write_text(tomli_w.dumps(noted), encoding="utf-8")
    if asked.runs:
        archive_trials(by_name(asked.runs), asked.data)
    if asked.quality:
        archive_checks(by_name(asked.quality), asked.data)
    make(asked.data, asked.folder)


if __name__ == "__main__":
    main()
