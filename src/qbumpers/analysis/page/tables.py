"""The tables of the page, as text."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import polars as pl
from markupsafe import Markup

from qbumpers.analysis.comparisons import RETURNS
from qbumpers.analysis.figures.style import NAMES
from qbumpers.analysis.findings import LearnerFindings
from qbumpers.analysis.formatting import NONE, decimals_of, format_number, format_share
from qbumpers.analysis.measures import MEASURES
from qbumpers.analysis.page.elements import Column, Table, breakable, interval, share, unbroken
from qbumpers.analysis.statistics import UNKNOWN


def _of(row: Mapping[str, Any], measure: str, least: int = 1) -> Markup:
    mean, low, high = (row[f"{measure}_{part}"] for part in ("mean", "low", "high"))
    return interval(mean, low, high, least)


def _decimals(table: pl.DataFrame, *measures: str) -> int:
    """Of numbers that are not returns: without any, unless they differ by little."""
    means = [f"{measure}_mean" for measure in measures]
    found = decimals_of(table.select(means).to_numpy().astype(float).ravel().tolist())
    return 0 if found == 1 else found


def pareto_table(about: LearnerFindings) -> Table:
    """The Pareto-optimal conditions, and others that might be; best performance first."""
    columns = [
        Column("condition", text=True),
        Column("assisted return per episode"),
        Column("unassisted return per episode"),
        Column("probability Pareto-optimal"),
    ]
    chosen = about.frontier.filter(pl.col("pareto") | (pl.col("probability") >= 0.05))
    rows = [
        [
            unbroken(row["condition"]) + ("" if row["pareto"] else " (beaten here)"),
            _of(row, "assisted", about.decimals),
            _of(row, "unassisted", about.decimals),
            format_share(row["probability"]),
        ]
        for row in chosen.sort("assisted_mean", descending=True).iter_rows(named=True)
    ]
    return Table(columns, rows, cards=True)


def methods_table(about: LearnerFindings) -> Table:
    """Whole methods: their mean returns, and what their settings cover."""
    digits = _decimals(about.methods, "hypervolume")
    columns = [
        Column("method", text=True),
        Column("settings"),
        Column("mean assisted return per episode"),
        Column("mean unassisted return per episode"),
        Column("covers of all"),
        Column("hypervolume, squared return"),
        Column("covers most"),
    ]
    rows = [
        [
            NAMES.get(row["assistant"], row["assistant"]),
            str(row["conditions"]),
            _of(row, "assisted_macro", about.decimals),
            _of(row, "unassisted_macro", about.decimals),
            format_share(row["share"]),
            _of(row, "hypervolume", digits),
            format_share(row["largest"]),
        ]
        for row in about.methods.iter_rows(named=True)
    ]
    return Table(columns, rows, "methods.csv", cards=True)


def advantage_table(about: LearnerFindings) -> Table:
    """Every two methods by what their settings cover."""
    digits = _decimals(about.advantages, "advantage")
    columns = [
        Column("method", text=True),
        Column("against", text=True),
        Column("covers more by, squared return"),
        Column("share of resamples in which it covers more"),
    ]
    rows = [
        [
            *(NAMES.get(row[who], row[who]) for who in ("assistant", "other")),
            _of(row, "advantage", digits),
            format_share(row["probability"]),
        ]
        for row in about.advantages.iter_rows(named=True)
    ]
    return Table(columns, rows, "advantages.csv", cards=True)


def regret_table(about: LearnerFindings) -> Table:
    """How much less the method loses than the baseline, by what is matched."""
    columns = [
        Column("matched", text=True),
        Column("reduction of regret"),
        Column("baseline's setting", text=True),
        Column("level"),
        Column("baseline"),
        Column("method"),
        Column("best possible"),
        Column("baseline's regret"),
    ]
    rows = [
        [
            matched,
            share(*(regret.reduction if regret.is_known else UNKNOWN)),
            unbroken(regret.baseline_condition),
            format_number(regret.level, about.decimals),
            format_number(regret.baseline, about.decimals),
            interval(*regret.method, about.decimals),
            format_number(regret.best, about.decimals),
            interval(*regret.gap, about.decimals),
        ]
        for matched, regret in about.regrets.items()
    ]
    return Table(columns, rows, "regret.csv", cards=True)


def differences_table(about: LearnerFindings) -> Table:
    """Each condition against no assistance, both returns in one row."""
    columns = [
        Column("condition", text=True),
        *(
            Column(f"{side}: {what}", secondary=what != "difference")
            for side in RETURNS
            for what in ("difference", "p (Holm)", "probability of improvement")
        ),
    ]
    found: dict[str, list[str]] = {}
    for row in about.differences.iter_rows(named=True):
        cells = found.setdefault(row["condition"], [unbroken(row["condition"])])
        numbers = (row["difference_mean"], row["simultaneous_low"], row["simultaneous_high"])
        cells += [
            interval(*numbers, about.decimals),
            _p_value(row["p_adjusted"]),
            format_share(row["improvement_mean"]),
        ]
    return Table(columns, list(found.values()), "differences.csv")


def _p_value(value: float | None) -> str:
    if value is None:
        return NONE
    return "< 0.001" if value < 0.001 else f"{value:.3f}"


_DEPENDENCE = {
    "dependence": "dependence",
    "dependence_last": "dependence at the end",
    "unassisted_last": "unassisted return at the end",
    "retention": "retention",
    "criterion_episodes": "episodes to the criterion",
    "criterion_reached": "reach the criterion",
}


def dependence_table(about: LearnerFindings) -> Table:
    """How much learners depend on each assistant, and what they retain; what is known of it."""
    known = _known(about.summary, _DEPENDENCE)
    columns = [
        Column("condition", text=True),
        *(Column(_DEPENDENCE[name], secondary=place > 1) for place, name in enumerate(known)),
    ]
    rows = [
        [
            unbroken(row["condition"]),
            *(
                format_share(row[f"{name}_mean"])
                if name == "criterion_reached"
                else _of(row, name, 1 if name == "criterion_episodes" else about.decimals)
                for name in known
            ),
        ]
        for row in about.summary.iter_rows(named=True)
    ]
    return Table(columns, rows)


def learners_table(learners: Sequence[LearnerFindings], measure: str) -> Table:
    """One measure of every condition, a column per learner."""
    columns = [Column("condition", text=True), *(Column(about.label) for about in learners)]
    digits = max(about.decimals for about in learners)
    found: dict[str, dict[str, Markup]] = {}
    for about in learners:
        for row in about.summary.iter_rows(named=True):
            shared = str(row["condition"]).partition("@")[0]
            found.setdefault(shared, {})[about.learner] = _of(row, measure, digits)
    rows = [
        [unbroken(condition), *(cells.get(about.learner, NONE) for about in learners)]
        for condition, cells in found.items()
    ]
    return Table(columns, rows, cards=True)


def missing_table(missing: Mapping[str, int], trials: int) -> Table:
    """The conditions that lack trials, if the run is not finished."""
    columns = [Column("condition", text=True), Column("trials there"), Column("of")]
    rows = [
        [breakable(condition), str(trials - number), str(trials)]
        for condition, number in missing.items()
    ]
    return Table(columns, rows, folded="What is missing, by condition")


def conditions_table(about: LearnerFindings) -> Table:
    """Every condition, under its id; a heading says which learner."""
    events = _known(about.summary, ("unassisted_success", "unassisted_crash"))
    columns = [
        Column("condition", text=True),
        Column("assisted return per episode"),
        Column("unassisted return per episode"),
        Column("overrides per episode", secondary=True),
        Column("overridden steps", secondary=True),
        *(Column(name.replace("_", " "), secondary=True) for name in events),
    ]
    rows = [
        [
            breakable(row["condition"].partition("@")[0]),
            _of(row, "assisted", about.decimals),
            _of(row, "unassisted", about.decimals),
            format_number(row["overrides_mean"], 2),
            format_share(row["override_rate_mean"]),
            *(format_share(row[f"{name}_mean"]) for name in events),
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


def versions_table(run: Mapping[str, Any]) -> Table:
    """The versions and the platform that made the results."""
    names = {"version": "qbumpers", "python": "Python"}
    rows = [[names.get(name, name), str(value)] for name, value in run.items()]
    return Table([Column("", text=True), Column("version", text=True)], rows)
