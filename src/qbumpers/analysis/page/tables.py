"""The tables of the page, as text."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import polars as pl
from markupsafe import Markup

from qbumpers.analysis.figures.style import NAMES
from qbumpers.analysis.findings import LearnerFindings
from qbumpers.analysis.measures import MEASURES
from qbumpers.analysis.numerals import NONE, per_cent, written
from qbumpers.analysis.page.cells import Column, Table, breakable, interval, named, share
from qbumpers.analysis.published import Comparison
from qbumpers.analysis.section_4_1 import ThresholdStory


def _of(row: Mapping[str, Any], measure: str, least: int = 1) -> Markup:
    mean, low, high = (row[f"{measure}_{part}"] for part in ("mean", "low", "high"))
    return interval(mean, low, high, least)


def pareto_table(about: LearnerFindings) -> Table:
    """The Pareto-optimal conditions, and others that might be; best performance first."""
    columns = [
        Column("condition", text=True),
        Column("return with the assistant"),
        Column("return without it"),
        Column("probability Pareto-optimal"),
    ]
    chosen = about.frontier.filter(pl.col("pareto") | (pl.col("probability") >= 0.05))
    rows = [
        [
            named(row["condition"]) + ("" if row["pareto"] else " (beaten here)"),
            _of(row, "assisted"),
            _of(row, "unassisted"),
            per_cent(row["probability"]),
        ]
        for row in chosen.sort("assisted_mean", descending=True).iter_rows(named=True)
    ]
    return Table(columns, rows, cards=True)


def methods_table(about: LearnerFindings) -> Table:
    """Whole methods."""
    columns = [
        Column("method", text=True),
        Column("settings"),
        Column("mean return with it"),
        Column("mean return without it"),
        Column("covers of all"),
        Column("hypervolume"),
        Column("covers most"),
    ]
    rows = [
        [
            NAMES.get(row["assistant"], row["assistant"]),
            str(row["conditions"]),
            _of(row, "assisted_macro"),
            _of(row, "unassisted_macro"),
            per_cent(row["share"]),
            _of(row, "hypervolume", 0),
            per_cent(row["largest"]),
        ]
        for row in about.methods.iter_rows(named=True)
    ]
    return Table(columns, rows, "methods.csv", cards=True)


def advantage_table(about: LearnerFindings) -> Table:
    """Every two methods against each other."""
    columns = [
        Column("method", text=True),
        Column("against", text=True),
        Column("covers more by"),
        Column("share of resamples in which it covers more"),
    ]
    rows = [
        [
            *(NAMES.get(row[who], row[who]) for who in ("assistant", "other")),
            _of(row, "advantage", 0),
            per_cent(row["probability"]),
        ]
        for row in about.advantages.iter_rows(named=True)
    ]
    return Table(columns, rows, "advantages.csv", cards=True)


def regret_table(about: LearnerFindings) -> Table:
    """The method against the baseline."""
    columns = [
        Column("matched", text=True),
        Column("reduction of regret"),
        Column("baseline's setting", text=True),
        Column("level"),
        Column("baseline"),
        Column("method"),
        Column("best possible"),
    ]
    rows = [
        [
            matched,
            share(*regret.reduction),
            named(regret.baseline_condition),
            written(regret.level),
            written(regret.baseline),
            interval(*regret.method),
            written(regret.best),
        ]
        for matched, regret in about.regrets.items()
    ]
    return Table(columns, rows, "regret.csv", cards=True)


def published_table(comparisons: Sequence[Comparison]) -> Table:
    """Printed numbers beside measured ones."""
    columns = [
        Column("number", text=True),
        Column("paper"),
        Column("measured, with 95% interval"),
        Column("agrees", text=True),
        Column("", text=True, secondary=True),
    ]
    verdicts = {
        None: NONE,
        True: Markup('<span class="yes">yes</span>'),
        False: Markup('<span class="no">no</span>'),
    }
    rows = [
        [
            row.what,
            row.printed,
            interval(*row.measured, 2 if "regret" in row.what else 1),
            verdicts[row.agrees],
            row.note,
        ]
        for row in comparisons
    ]
    return Table(columns, rows, "published.csv", cards=True)


def differences_table(about: LearnerFindings) -> Table:
    """Each condition against no assistance, both returns in one row."""
    columns = [
        Column("condition", text=True),
        *(
            Column(f"{what} {side}", secondary=what != "difference")
            for side in ("with it", "without it")
            for what in ("difference", "p (Holm)", "probability of improvement")
        ),
    ]
    found: dict[str, list[str]] = {}
    for row in about.differences.iter_rows(named=True):
        cells = found.setdefault(row["condition"], [named(row["condition"])])
        numbers = (row["difference_mean"], row["simultaneous_low"], row["simultaneous_high"])
        cells += [
            interval(*numbers),
            _p_value(row["p_adjusted"]),
            per_cent(row["improvement_mean"]),
        ]
    return Table(columns, list(found.values()), "differences.csv")


def _p_value(value: float | None) -> str:
    if value is None:
        return NONE
    return "< 0.001" if value < 0.001 else f"{value:.3f}"


_DEPENDENCE = {
    "dependence": "dependence",
    "dependence_last": "dependence at the end",
    "unassisted_last": "return without it at the end",
    "retention": "retention",
    "criterion_episodes": "episodes to the criterion",
    "criterion_reached": "reach it",
}


def dependence_table(about: LearnerFindings) -> Table:
    """How much learners depend on each assistant, and what they keep; what is known of it."""
    known = _known(about.summary, _DEPENDENCE)
    columns = [
        Column("condition", text=True),
        *(Column(_DEPENDENCE[name], secondary=place > 1) for place, name in enumerate(known)),
    ]
    rows = [
        [
            named(row["condition"]),
            *(
                per_cent(row[f"{name}_mean"]) if name == "criterion_reached" else _of(row, name)
                for name in known
            ),
        ]
        for row in about.summary.iter_rows(named=True)
    ]
    return Table(columns, rows)


def learners_table(learners: Sequence[LearnerFindings], measure: str) -> Table:
    """One measure of every condition, a column a learner."""
    columns = [Column("condition", text=True), *(Column(about.label) for about in learners)]
    everyone = zip(*(about.summary.iter_rows(named=True) for about in learners), strict=True)
    rows = [[named(row[0]["condition"]), *(_of(one, measure) for one in row)] for row in everyone]
    return Table(columns, rows, cards=True)


def conditions_table(about: LearnerFindings) -> Table:
    """Every condition, under its id."""
    events = _known(about.summary, ("unassisted_success", "unassisted_crash"))
    columns = [
        Column("condition", text=True),
        Column("return with the assistant"),
        Column("return without it"),
        Column("overrides an episode", secondary=True),
        Column("overridden steps", secondary=True),
        *(Column(f"{name.partition('_')[2]} without it", secondary=True) for name in events),
    ]
    rows = [
        [
            breakable(row["condition"]),
            _of(row, "assisted"),
            _of(row, "unassisted"),
            written(row["overrides_mean"], 2),
            per_cent(row["override_rate_mean"]),
            *(per_cent(row[f"{name}_mean"]) for name in events),
        ]
        for row in about.summary.iter_rows(named=True)
    ]
    return Table(columns, rows, "summary.csv")


def _known(summary: pl.DataFrame, measures: Iterable[str]) -> list[str]:
    return [name for name in measures if f"{name}_mean" in summary.columns]


def measures_table(summary: pl.DataFrame) -> Table:
    """What the measures are that this experiment knows."""
    columns = [Column("measure", text=True), Column("what it is", text=True)]
    return Table(columns, [[name, MEASURES[name]] for name in _known(summary, MEASURES)])


def thresholds_table(story: ThresholdStory) -> Table:
    """The moves that Section 4.1 discusses."""
    columns = [
        Column("cell", text=True),
        Column("move", text=True),
        Column("Q*"),
        Column("best Q* there"),
        Column("overridden where α is below"),
    ]
    rows = [
        [
            f"({row},\N{NO-BREAK SPACE}{column})",
            action,
            written(value, 0),
            written(best, 0),
            written(critical, 4),
        ]
        for row, column, action, value, best, critical in story.examples
    ]
    return Table(columns, rows)


def versions_table(run: Mapping[str, Any]) -> Table:
    """What made the results."""
    names = {"version": "qbumpers", "python": "Python"}
    rows = [[names.get(name, name), str(value)] for name, value in run.items()]
    return Table([Column("", text=True), Column("version", text=True)], rows)
