"""The page of a comparison: one HTML file that needs nothing else."""

from collections.abc import Sequence

import polars as pl

from qbumpers.analysis.figures.style import NAMES, readable
from qbumpers.analysis.formatting import decimals_of, format_number, format_share
from qbumpers.analysis.page.elements import Column, Table, interval
from qbumpers.analysis.page.layout import Picture, data_url, page_environment
from qbumpers.comparison import sentences
from qbumpers.comparison.results import NARROW, Comparison
from qbumpers.comparison.scores import RUNS, Tables


def page(comparison: Comparison, tables: Tables, pictures: Sequence[Picture]) -> str:
    """The page of a comparison.

    Args:
        comparison: what its folder holds.
        tables: what that shows.
        pictures: every figure.

    Returns:
        HTML.
    """
    environment = page_environment("qbumpers.comparison", "qbumpers.analysis.page")
    files = {
        f"{name}.csv": data_url("text/csv", table.write_csv())
        for name, table in tables._asdict().items()
        if table.width
    }
    return environment.get_template("comparison.html.j2").render(
        comparison=comparison,
        experiment=comparison.cases[0].experiment,
        tables=tables,
        learners=tables.cases["learner"].unique(maintain_order=True).to_list(),
        sentences=sentences,
        names=NAMES,
        pictures=pictures,
        data=data_url,
        files=files,
        runs=RUNS,
        narrow=NARROW,
        aggregates_table=aggregates_table,
        shares_table=shares_table,
        floors_table=floors_table,
        methods_table=methods_table,
        cases_table=cases_table,
    )


def aggregates_table(tables: Tables) -> Table:
    """Methods over their comparable cases, the best first."""
    columns = [
        Column("method", text=True),
        Column("cases"),
        Column("interquartile mean"),
        Column("median", secondary=True),
        Column("mean rank"),
        Column("exceeds the bumpers with probability"),
        Column("lead over the bumpers, all at once"),
    ]
    measures = {"iqm": 2, "median": 2, "rank": 1, "improvement": 2, "lead": 2}
    rows = [
        [
            readable(row["method"]),
            str(row["cases"]),
            *(
                interval(row[f"{name}_mean"], row[f"{name}_low"], row[f"{name}_high"], digits)
                for name, digits in measures.items()
            ),
        ]
        for row in tables.aggregates.sort("iqm_mean", descending=True).iter_rows(named=True)
    ]
    return Table(columns, rows, "aggregates.csv", cards=True)


def shares_table(tables: Tables) -> Table:
    """In how many cases each method reaches a share, and how it then compares."""
    versus = sentences.versus_at_shares(tables)
    return _levels_table(tables.matched, "share", "assisted", versus, "matched.csv")


def floors_table(tables: Tables) -> Table:
    """In how many cases each method performs as well as a floor, and how it then compares."""
    versus = sentences.versus_at_floors(tables)
    return _levels_table(tables.floors, "floor", "unassisted", versus, "floors.csv")


def _levels_table(
    table: pl.DataFrame, level: str, known: str, versus: pl.DataFrame, file: str
) -> Table:
    """A row per method, a column per level: how often it is reached, ahead and behind."""
    counts = table.group_by("method", level, maintain_order=True).agg(
        reached=pl.col(f"{known}_mean").count(), of=pl.len()
    )
    compared = {(row["method"], row[level]): row for row in versus.rows(named=True)}
    levels = table[level].unique(maintain_order=True).to_list()
    columns = [Column("method", text=True), *(Column(format_share(each)) for each in levels)]
    rows = []
    for part in counts.partition_by("method", maintain_order=True):
        name = str(part["method"][0])
        cells = []
        for row in part.rows(named=True):
            signs = compared.get((name, row[level]), {"ahead": 0, "behind": 0})
            shown = f" (+{signs['ahead']} \N{MINUS SIGN}{signs['behind']})"
            clear = signs["ahead"] or signs["behind"]
            cells.append(f"{row['reached']} of {row['of']}{shown if clear else ''}")
        rows.append([readable(name), *cells])
    return Table(columns, rows, file, cards=True)


def methods_table(tables: Tables) -> Table:
    """What changes from setting to setting of each method."""
    counts = dict(
        tables.points.group_by("method", "task", "learner")
        .len()
        .group_by("method")
        .agg(pl.col("len").min().cast(pl.String) + " to " + pl.col("len").max().cast(pl.String))
        .iter_rows()
    )
    columns = [
        Column("method", text=True),
        Column("dial", text=True),
        Column("values", text=True),
        Column("settings"),
    ]
    rows = [
        [
            readable(row["method"]),
            row["dial"],
            row["formula"],
            " to ".join(dict.fromkeys(counts[row["method"]].split(" to "))),
        ]
        for row in tables.methods.iter_rows(named=True)
    ]
    return Table(columns, rows, "methods.csv", cards=True)


def cases_table(tables: Tables) -> Table:
    """The box of each case."""
    columns = [
        Column("task", text=True),
        Column("learner", text=True),
        Column("no assistance, assisted return"),
        Column("maximal assistance, unassisted return"),
        Column("best return"),
        Column("spread of Q*", secondary=True),
        Column("scored", text=True),
    ]
    numbers = ("reference_assisted", "reference_unassisted", "best", "spread")
    rows = [
        [
            row["task"],
            row["learner"],
            *(
                format_number(row[name], decimals_of([0.0, row["spread"], row["best"]]))
                for name in numbers
            ),
            "yes" if row["comparable"] else "no conflict",
        ]
        for row in tables.cases.iter_rows(named=True)
    ]
    return Table(columns, rows, "cases.csv", cards=True)
