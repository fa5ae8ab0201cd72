"""Write the page on Lunar Lander from kept results: `python docs/make_lunar_lander.py`.

With `--keep`, `--runs` and `--quality` it first keeps those of finished runs, which
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
from qbumpers.analysis.claims import Claim, judged
from qbumpers.analysis.keeping import (
    RUNS,
    Kept,
    keep,
    keep_runs,
    read_kept,
    read_trials,
    write_numbers,
)
from writing import DOCS, measure, template

from qbumpers import make_task
from qbumpers.analysis.figures.curves import block_size, courses_figure, curves_figure
from qbumpers.analysis.figures.quality import quality_figure
from qbumpers.analysis.figures.runs import run_means, runs_figure
from qbumpers.analysis.figures.sensitivity import sensitivities, sensitivity_figure
from qbumpers.analysis.figures.style import NAMES, looks
from qbumpers.analysis.figures.tradeoffs import tradeoffs, tradeoffs_figure
from qbumpers.analysis.findings import find_tables
from qbumpers.analysis.page.headlines import told
from qbumpers.experts.quality import check_values, summarise
from qbumpers.values import NetworkValues, load_values

_COLOURS = 48  # bands that overlap make many, and large files

QUALITY = "quality.csv"
"""What Q values of several files claim, and what is achieved: a row a claim."""

READING = "reading.txt"
"""What people make of kept results, in words; goes when others are kept."""

ABOUT = "about.toml"
DEFAULT = "default"
"""What a person adds to kept results: hours, machine, a note; and what their run is called."""


class Runs(NamedTuple):
    """Runs that differ from the default in one thing each.

    Attributes:
        means: a row a run and condition.
        cells: its rows by run and condition.
        claims: the paper's claims by run, judged from its trials.
    """

    means: pl.DataFrame
    cells: dict[tuple[str, str], dict[str, Any]]
    claims: dict[str, list[Claim]]


def make(data: Path, folder: Path) -> None:
    """Write `lunar-lander.md` and its images into `folder`, from what was kept in `data`."""
    images = folder / "images"
    images.mkdir(parents=True, exist_ok=True)
    kept = read_kept(data)
    findings = find_tables(kept.trials, kept.experiment)
    draw(kept, findings.summary, images)
    runs = compared_runs(kept, data / RUNS)
    if runs is not None:
        keep_picture(runs_figure(runs.means, looks(NAMES)), images, "lunar-lander-runs", _COLOURS)
    claims = kept_claims(data / QUALITY)
    if claims:
        figure = quality_figure(list(claims.items())[:2])
        keep_picture(figure, images, "lunar-lander-quality", _COLOURS)
    text = template("lunar-lander.md.j2").render(
        experiment=kept.experiment,
        run=kept.run,
        about=about(data / ABOUT),
        block=block_size(kept.experiment.episodes),
        findings=findings,
        runs=runs,
        reading=reading(data / READING),
        quality={name: summarise(rows) for name, rows in claims.items()},
        told=told,
        measure=measure,
    )
    (folder / "lunar-lander.md").write_text(text, encoding="utf-8")


def draw(kept: Kept, summary: pl.DataFrame, images: Path) -> None:
    """Every figure of the main run."""
    drawn = looks(NAMES)
    helped = kept.overrides.filter(pl.col("override_rate_mean").max().over("condition") > 0)
    for name, figure in {
        "figure4": tradeoffs_figure(tradeoffs(summary), drawn),
        "learning": curves_figure(kept.curves, drawn),
        "success": curves_figure(kept.curves, drawn, "success"),
        "overrides": courses_figure(helped, drawn),
        "settings": sensitivity_figure(sensitivities(summary, ["alpha"]), drawn),
    }.items():
        keep_picture(figure, images, f"lunar-lander-{name}", _COLOURS)


def compared_runs(kept: Kept, path: Path) -> Runs | None:
    """The kept runs beside the conditions of the main run that they have too; None without any."""
    if not path.is_file():
        return None
    trials = read_trials(path)
    conditions = trials["condition"].unique(maintain_order=True).to_list()
    own = kept.trials.filter(pl.col("condition").is_in(conditions))
    own = own.select(pl.lit(DEFAULT).alias("run"), pl.all())
    together = pl.concat([own, trials.filter(pl.col("run") != DEFAULT)])
    claims = {
        str(part["run"][0]): judged(
            "lunar-lander", part.drop("run"), np.random.default_rng(kept.experiment.seed)
        )
        for part in together.partition_by("run", maintain_order=True)
    }
    means = run_means(together)
    cells = {(row["run"], row["condition"]): row for row in means.iter_rows(named=True)}
    return Runs(means, cells, claims)


def keep_quality(files: dict[str, str], into: Path) -> None:
    """Check the Q values in files, and keep what they claim off the expert's path and at the start.

    Args:
        files: by name.
        into: folder for the table.
    """
    task, parts = make_task("lunar-lander"), []
    for name, path in files.items():
        values = load_values(path)
        assert isinstance(values, NetworkValues)
        claims = check_values(task, values, discount=values.discount)
        told = claims.filter((pl.col("policy") != "greedy") | (pl.col("time") == 0))
        parts.append(told.select(pl.lit(name).alias("values"), pl.all()))
    write_numbers(into / QUALITY, pl.concat(parts))


def kept_claims(path: Path) -> dict[str, pl.DataFrame]:
    """What `keep_quality` kept, by name; nothing where there is none."""
    if not path.is_file():
        return {}
    table = pl.read_csv(path, infer_schema_length=None)
    parts = table.partition_by("values", maintain_order=True)
    return {part["values"][0]: part.drop("values") for part in parts}


def reading(path: Path) -> str:
    """What people made of the results; empty where they did not say."""
    return path.read_text(encoding="utf-8").strip() if path.is_file() else ""


def about(path: Path) -> dict[str, Any]:
    """What a person noted of the run; nothing where there is no note."""
    return tomllib.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def by_name(pairs: list[str]) -> dict[str, str]:
    """Paths by name, from `NAME=PATH`."""
    return dict(pair.rsplit("=", 1) for pair in pairs)


def main() -> None:
    """Keep what is to be kept, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=DOCS, help="for the page")
    parser.add_argument("--data", type=Path, default=DOCS / "data" / "lunar-lander")
    parser.add_argument("--keep", type=Path, help="folder of the finished run, to be kept first")
    parser.add_argument("--hours", type=float, help="that the run took, to be told")
    parser.add_argument("--machine", help="that it ran on, to be told, such as 'two cores'")
    parser.add_argument("--note", help="a sentence on the run, to be told")
    parser.add_argument("--runs", nargs="+", metavar="NAME=FOLDER", help="runs to be kept beside")
    parser.add_argument(
        "--quality", nargs="+", metavar="NAME=FILE", help="Q values to be checked; two are drawn"
    )
    asked = parser.parse_args()
    noted = {"hours": asked.hours, "machine": asked.machine, "note": asked.note}
    noted = {name: value for name, value in noted.items() if value is not None}
    if asked.keep:
        keep(asked.keep, asked.data)
        (asked.data / READING).unlink(missing_ok=True)
    if asked.keep or noted:
        (asked.data / ABOUT).write_text(tomli_w.dumps(noted), encoding="utf-8")
    if asked.runs:
        keep_runs(by_name(asked.runs), asked.data)
    if asked.quality:
        keep_quality(by_name(asked.quality), asked.data)
    make(asked.data, asked.folder)


if __name__ == "__main__":
    main()
