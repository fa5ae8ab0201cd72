"""Tables, figures and one self-contained page, from the files of a finished run alone."""

import base64
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
import numpy as np
import polars as pl

from qbumpers.analysis.figures.curves import curves_figure, representative
from qbumpers.analysis.figures.frontier import frontier_figure
from qbumpers.analysis.figures.heatmaps import heatmap_figure
from qbumpers.analysis.figures.style import NAMES, readable, save
from qbumpers.analysis.figures.thresholds import overrides_figure, shares_figure, values_figure
from qbumpers.analysis.frontier import Regret, matched_regret
from qbumpers.analysis.measures import summary, trial_means, trial_samples
from qbumpers.analysis.published import Comparison, compare, published_numbers
from qbumpers.analysis.section_4_1 import (
    ThresholdStory,
    suboptimal_moves,
    threshold_story,
)
from qbumpers.experiments.store import Results, load, run_description
from qbumpers.files import write_atomically

REPORT, SUMMARY, REGRET, PUBLISHED = (
    "report.html",
    "summary.csv",
    "regret.csv",
    "published.csv",
)


_SHOWN_THRESHOLDS = (0.5, 0.499, 0.0195, 0.018)  # before and after each change of behaviour


class Findings(NamedTuple):
    """What the tables of a report say.

    Attributes:
        summary: a row a condition.
        regrets: by what is matched, "performance" and "learning"; empty without two swept methods.
        methods: the method and the baseline of the regrets.
        comparisons: with printed numbers, empty where the experiment reproduces none.
    """

    summary: pl.DataFrame
    regrets: dict[str, Regret]
    methods: tuple[str, str] | None
    comparisons: list[Comparison]


def write_report(
    folder: str | Path, advance: Callable[[str], None] = lambda part: None
) -> Findings:
    """Analyse a finished run: write tables, figures and `report.html` into its folder.

    Args:
        folder: of the run.
        advance: called with the name of each part before it is made.

    Returns:
        What the tables say.

    Raises:
        RequestError: where the folder is not one of a finished run.
        StoreError: where a file cannot be written.
    """
    folder = Path(folder)
    results = load(folder)
    advance("tables")
    findings = find(results)
    _write_tables(folder, findings)
    story = _story(results, findings)
    pictures = {}
    for name, draw in _drawings(results, findings, story).items():
        advance(f"figure {name}")
        pictures[name] = save(draw(), folder / "figures", name)
    advance(REPORT)
    page = _page(folder, results, findings, story, pictures)
    write_atomically(folder / REPORT, lambda path: path.write_text(page, encoding="utf-8"))
    return findings


def find(results: Results) -> Findings:
    """Every table of a report, from the results of a run."""
    options = {n: a.options._asdict() for n, a in results.experiment.named_assistants()}
    trials = trial_means(results.episodes)
    table = summary(results.episodes, trials, options)
    methods, regrets = _regrets(table, trials, results.experiment.seed)
    comparisons: list[Comparison] = []
    if results.experiment.reproduces:
        comparisons = compare(published_numbers(results.experiment.reproduces), table, regrets)
    return Findings(table, regrets, methods, comparisons)


def _regrets(
    table: pl.DataFrame, trials: pl.DataFrame, seed: int
) -> tuple[tuple[str, str] | None, dict[str, Regret]]:
    """The last swept method of an experiment against the one before it."""
    overriding = table.filter(pl.col("overrides_mean") > 0)
    groups = overriding.partition_by("assistant", as_dict=True, maintain_order=True)
    swept = [str(key[0]) for key, rows in groups.items() if rows.height > 1]
    if len(swept) < 2:
        return None, {}
    baseline, method = swept[-2:]
    samples = trial_samples(trials, "assisted", "unassisted")
    ours, theirs = (
        {name: samples[name] for name in groups[(chosen,)]["condition"]}
        for chosen in (method, baseline)
    )
    means = {name: values.mean(axis=0) for name, values in samples.items()}
    regrets = {}
    for axis, matched in enumerate(("performance", "learning")):
        best = max(means, key=lambda name: means[name][1 - axis])
        generator = np.random.default_rng([seed, axis])
        regrets[matched] = matched_regret(ours, theirs, samples[best], axis, generator)
    return (method, baseline), regrets


def _drawings(
    results: Results, findings: Findings, story: ThresholdStory | None
) -> dict[str, Callable[[], Any]]:
    table = findings.summary
    chosen = representative(table)
    printed = published_numbers(results.experiment.reproduces or "")["number"]
    episodes = results.experiment.trials * results.experiment.episodes
    drawings: dict[str, Callable[[], Any]] = {
        "frontier": lambda: frontier_figure(table, printed),
        "learning-curves": lambda: curves_figure(results.episodes, chosen),
    }
    if results.states["row"].null_count() == 0:
        drawings["heatmaps"] = lambda: heatmap_figure(results.states, chosen, episodes)
    if story is not None:
        q_values = results.values.table
        drawings["q-values"] = lambda: values_figure(q_values)
        drawings["threshold-maps"] = lambda: overrides_figure(q_values, _SHOWN_THRESHOLDS)
        drawings["threshold-shares"] = lambda: shares_figure(suboptimal_moves(q_values))
    return drawings


def _story(results: Results, findings: Findings) -> ThresholdStory | None:
    thresholding = findings.summary.filter(pl.col("assistant") == "local-q-thresholding")
    if results.experiment.task.name != "cliff-walking" or not thresholding.height:
        return None
    return threshold_story(results.values.table, thresholding["alpha"].to_list())


def _write_tables(folder: Path, findings: Findings) -> None:
    tables = {SUMMARY: findings.summary}
    if findings.regrets:
        tables[REGRET] = pl.DataFrame([_flat(m, r) for m, r in findings.regrets.items()])
    if findings.comparisons:
        tables[PUBLISHED] = pl.DataFrame([_compared(c) for c in findings.comparisons])
    for name, table in tables.items():
        write_atomically(folder / name, table.write_csv)


def _flat(matched: str, regret: Regret) -> dict[str, Any]:
    return {
        "matched": matched,
        "baseline_condition": regret.baseline_condition,
        "level": regret.level,
        "baseline": regret.baseline,
        "best": regret.best,
        **{f"method_{part}": number for part, number in regret.method._asdict().items()},
        **{f"reduction_{part}": number for part, number in regret.reduction._asdict().items()},
    }


def _compared(row: Comparison) -> dict[str, Any]:
    return {
        "what": row.what,
        "published": row.published,
        **{f"measured_{part}": number for part, number in row.measured._asdict().items()},
        "agrees": row.agrees,
        "note": row.note,
    }


def _page(
    folder: Path,
    results: Results,
    findings: Findings,
    story: ThresholdStory | None,
    pictures: Mapping[str, Path],
) -> str:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("qbumpers.analysis"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {"number": _number, "readable": readable, "per_cent": _per_cent}
    return environment.get_template("report.html.j2").render(
        experiment=results.experiment,
        run=run_description(folder),
        settings=(folder / "experiment.toml").read_text(encoding="utf-8"),
        findings=findings,
        names=NAMES,
        story=story,
        pictures={name: _embedded(path) for name, path in pictures.items()},
    )


def _embedded(path: Path) -> str:
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode()


def _number(value: float | None, digits: int = 1) -> str:
    if value is None or not np.isfinite(value):
        return "–"
    return f"{value:,.{digits}f}".replace("-", "\N{MINUS SIGN}")


def _per_cent(value: float | None) -> str:
    return "–" if value is None or not np.isfinite(value) else f"{100 * value:.0f}%"
