"""What a comparison shows, in sentences that its tables decide.

"Clearly" means that an interval that holds for all methods at once lies on one side of 0.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import polars as pl

from qbumpers.analysis.figures.style import NAMES, readable
from qbumpers.analysis.formatting import format_number, format_share
from qbumpers.comparison.methods import BASELINE
from qbumpers.comparison.scores import Tables
from qbumpers.errors import counted

Row = Mapping[str, Any]

_BEING = {"ahead": ("is ahead", "are ahead"), "behind": ("is behind", "are behind")}
_TEACHING = {
    "ahead": ("teaches clearly more", "teach clearly more"),
    "behind": ("teaches clearly less", "teach clearly less"),
}
"""Of one method and of several."""


def overall(tables: Tables) -> list[str]:
    """What came out over all comparable cases, and which cases are not.

    Args:
        tables: from `find_tables`.
    """
    return [*_scored(tables), *_without_conflict(tables), *_beyond_the_best(tables)]


def _scored(tables: Tables) -> list[str]:
    if not tables.aggregates.height:
        return []
    every = max(tables.aggregates["cases"].to_list())
    order = tables.aggregates.filter(cases=every).sort("iqm_mean", descending=True)
    best = order.row(0, named=True)
    said = [
        f"Of the methods that are scored in each of {counted(every, 'comparable case')}, "
        f"{_name(best)} covers most: {_number(best, 'iqm')} of the box, by the interquartile mean."
    ]
    bumpers = tables.aggregates.filter(method=BASELINE)
    if bumpers.height and best["method"] != BASELINE:
        said.append(f"{_name(bumpers.row(0, named=True))} covers {_number(bumpers, 'iqm')}.")
    for side, word in ((_more(tables.aggregates, "lead"), "more"),
                       (_less(tables.aggregates, "lead"), "less")):  # fmt: skip
        if side.height:
            names = _listed([f"{_name(r)} ({_number(r, 'lead')})" for r in side.rows(named=True)])
            said.append(f"Clearly {word} than {NAMES[BASELINE]} over the same cases: {names}.")
    return said


def _without_conflict(tables: Tables) -> list[str]:
    rows = tables.cases.filter(~pl.col("comparable")).rows(named=True)
    if not rows:
        return []
    return [
        "Performance and learning hardly conflict in "
        + _listed([_case(row) for row in rows])
        + ": a side of the box, from no assistance or from maximal assistance to the best return, "
        "is narrower than a tenth of the spread of Q* or than chance. No method is scored there."
    ]


def _beyond_the_best(tables: Tables) -> list[str]:
    """Methods that return more than any policy, which are not scored where they do."""
    cases = tables.cases.filter("comparable").select("task", "learner", "best")
    rows = (
        tables.points.join(cases, on=["task", "learner"], maintain_order="left")
        .filter(pl.col("assisted_low") > pl.col("best") + 1e-9)
        .sort("assisted_mean", descending=True)
        .unique(["method", "task", "learner"], keep="first", maintain_order=True)
    )
    return [
        f"{readable(method)} is not scored in {_listed([_case(row) for row in part])}: it returns "
        f"more than any policy there, up to {format_number(part[0]['assisted_mean'], 2)} against "
        f"{format_number(part[0]['best'], 2)}, as steps that are taken back pay, too."
        for method in rows["method"].unique(maintain_order=True)
        for part in [rows.filter(method=method).rows(named=True)]
    ]


def by_method(tables: Tables) -> dict[str, str]:
    """Where each method covers more, or less, than the bumpers.

    Args:
        tables: from `find_tables`.

    Returns:
        A sentence by name of a method, without the bumpers; none if no case is comparable.
    """
    found = {}
    for name in tables.methods["method"]:
        rows = tables.scores.filter(method=name) if tables.scores.height else tables.scores
        if name == BASELINE or not rows.height or rows["advantage_mean"].null_count():
            continue
        sides = {"more": _more(rows, "advantage"), "less": _less(rows, "advantage")}
        parts = [
            f"clearly {word} in {len(side)} of them ({_most(tables, side)})"
            for word, side in sides.items()
            if side.height
        ]
        clear = " and ".join(parts) or "neither clearly more nor clearly less in any of them"
        found[name] = (
            f"In {counted(rows.height, 'comparable case')}, {readable(name)} covers {clear}."
        )
    return found


def _most(tables: Tables, side: pl.DataFrame) -> str:
    """The case of the largest difference, with its numbers."""
    row = side.sort(pl.col("advantage_mean").abs(), descending=True).row(0, named=True)
    theirs = tables.scores.filter(task=row["task"], learner=row["learner"], method=BASELINE)
    return (
        f"{'' if side.height == 1 else 'most in '}{_case(row)}: "
        f"{format_number(row['hypervolume_mean'], 2)} against "
        f"{format_number(theirs['hypervolume_mean'][0], 2)}, by {_number(row, 'advantage')}"
    )


def by_learner(tables: Tables) -> dict[str, str]:
    """Which methods cover most with each learner.

    Args:
        tables: from `find_tables`.

    Returns:
        A sentence by learner.
    """
    found = {}
    for part in tables.scores.partition_by("learner") if tables.scores.height else []:
        cases = part.select("task").n_unique()
        means = (
            part.group_by("method", maintain_order=True)
            .agg(pl.col("hypervolume_mean").mean(), pl.len())
            .filter(pl.col("len") == cases)
            .sort("hypervolume_mean", descending=True)
        )
        best = [
            f"{_name(row)} ({format_number(row['hypervolume_mean'], 2)}{_ahead_in(part, row)})"
            for row in means.head(3).rows(named=True)
        ]
        certain = part.filter(pl.col("largest") >= 0.95).rows(named=True)
        said = f"On average over {counted(cases, 'task')}, these cover most: {_listed(best)}."
        if certain:
            winners = [f"{_name(row)} in {row['task']}" for row in certain]
            said += f" The largest in at least 95% of resamples: {_listed(winners)}."
        found[str(part["learner"][0])] = said
    return found


def _ahead_in(part: pl.DataFrame, row: Row) -> str:
    """In how many tasks a method covers clearly more than the bumpers; empty for these."""
    own = part.filter(method=row["method"])
    if row["method"] == BASELINE or own["advantage_mean"].null_count():
        return ""
    number = len(_more(own, "advantage")) or "none"
    return f", clearly more than {NAMES[BASELINE]} in {number} of them"


def at_shares(tables: Tables) -> list[str]:
    """Which methods are ahead of the bumpers, or behind, at equal shares of overridden steps.

    Args:
        tables: from `find_tables`.

    Returns:
        A sentence for each share at which one is in most cases.
    """
    return [
        f"At {format_share(share)} of overridden steps, {said} in most of the cases in which both "
        "reach it."
        for share, said in _usual(versus_at_shares(tables), "share", _BEING)
    ]


def at_floors(tables: Tables) -> list[str]:
    """Which methods teach more than the bumpers, or less, at equal performance.

    Args:
        tables: from `find_tables`.

    Returns:
        A sentence for each floor at which one does in most cases.
    """
    return [
        f"If assisted return must be {format_share(floor)} of the way from no assistance to the "
        f"best, {said} in most of the cases in which both perform as well."
        for floor, said in _usual(versus_at_floors(tables), "floor", _TEACHING)
    ]


def _usual(
    counts: pl.DataFrame, level: str, words: Mapping[str, tuple[str, str]]
) -> Iterator[tuple[float, str]]:
    """What holds in most cases, by level, with how many they are."""
    for part in counts.partition_by(level, maintain_order=True) if counts.height else []:
        parts = []
        for column, verbs in words.items():
            rows = part.filter(2 * pl.col(column) > pl.col("cases")).sort(column, descending=True)
            names = [f"{_name(r)} ({r[column]} of {r['cases']})" for r in rows.rows(named=True)]
            if names:
                parts.append(f"{_listed(names)} {verbs[len(names) > 1]}")
        if parts:
            yield part[level][0], "; ".join(parts)


def versus_at_shares(tables: Tables) -> pl.DataFrame:
    """How often a method is ahead of the bumpers, or behind, at an equal share.

    Args:
        tables: from `find_tables`.

    Returns:
        A row per share and method but the bumpers: share, method, cases (that both reach), ahead
        (clearly better in one return and clearly worse in none) and behind (the reverse).
    """
    return _versus(tables.matched, "share", ("assisted_lead", "unassisted_lead"))


def versus_at_floors(tables: Tables) -> pl.DataFrame:
    """How often a method teaches clearly more than the bumpers, or less, at equal performance.

    Args:
        tables: from `find_tables`.

    Returns:
        A row per floor and method but the bumpers: floor, method, cases (in which both perform as
        well), ahead and behind.
    """
    return _versus(tables.floors, "floor", ("unassisted_lead",))


def _versus(table: pl.DataFrame, level: str, leads: Sequence[str]) -> pl.DataFrame:
    if not table.height:
        return table
    up = pl.any_horizontal(pl.col(f"{lead}_low") > 0 for lead in leads)
    down = pl.any_horizontal(pl.col(f"{lead}_high") < 0 for lead in leads)
    return (
        table.filter(pl.col("method") != BASELINE)
        .group_by(level, "method", maintain_order=True)
        .agg(
            cases=pl.col(f"{leads[0]}_mean").count(),
            ahead=(up & ~down).sum(),
            behind=(down & ~up).sum(),
        )
        .sort(level, maintain_order=True)
    )


def reach(tables: Tables) -> list[str]:
    """Which methods cannot reach a share of overridden steps.

    Args:
        tables: from `find_tables`.

    Returns:
        A sentence per method that misses one in some case.
    """
    said = []
    for part in tables.matched.partition_by("method", maintain_order=True):
        counts = part.group_by("share", maintain_order=True).agg(
            missed=pl.col("assisted_mean").null_count(), cases=pl.len()
        )
        missed = [
            f"{format_share(row['share'])} in {row['missed']}"
            for row in counts.filter(pl.col("missed") > 0).rows(named=True)
        ]
        if missed:
            cases = counts["cases"][0]
            name = readable(part["method"][0])
            said.append(f"{name} does not reach {_listed(missed)} of {counted(cases, 'case')}.")
    return said


def left_out(tables: Tables) -> list[str]:
    """Which tasks cannot carry a method, and why."""
    return [
        f"{readable(method)} is left out of {_listed(part['task'].to_list())}: {reason}."
        for (method, reason), part in tables.left_out.group_by(
            "method", "reason", maintain_order=True
        )
    ]


def _more(rows: pl.DataFrame, name: str) -> pl.DataFrame:
    return rows.filter(pl.col(f"{name}_low") > 0).sort(f"{name}_mean", descending=True)


def _less(rows: pl.DataFrame, name: str) -> pl.DataFrame:
    return rows.filter(pl.col(f"{name}_high") < 0).sort(f"{name}_mean")


def _name(row: Row) -> str:
    return readable(row["method"])


def _case(row: Row) -> str:
    return f"{row['task']} with {row['learner']}"


def _number(row: Row | pl.DataFrame, name: str) -> str:
    """A number with its interval, of a row or of a table of one row."""
    values = row.row(0, named=True) if isinstance(row, pl.DataFrame) else row
    numbers = [values[f"{name}_{end}"] for end in ("mean", "low", "high")]
    hidden = any(number and not round(number, 2) for number in numbers)
    mean, low, high = (format_number(number, 3 if hidden else 2) for number in numbers)
    return mean if values[f"{name}_low"] is None else f"{mean} [{low}, {high}]"


def _listed(parts: Sequence[str]) -> str:
    if len(parts) < 2:
        return "".join(parts)
    return f"{', '.join(parts[:-1])} and {parts[-1]}"
