"""The tables of results: those of cells, and those of a whole run that are made of them."""

import io
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import polars as pl

from qbumpers.experiments.cells import Cell
from qbumpers.experiments.design import Experiment
from qbumpers.experiments.record import RecordedCondition

EPISODES, STATES = "episodes.parquet", "states.parquet"
"""Kinds of tables: a row per episode; a row per state."""

_COMPRESSION = 1  # of zstd: on these tables the fastest level is also the smallest


def tables_of(experiment: Experiment) -> tuple[str, ...]:
    """What a finished cell of an experiment holds, in the order of writing."""
    return (STATES, EPISODES) if experiment.tabular else (EPISODES,)


def encoded(table: pl.DataFrame) -> bytes:
    """A table as the bytes of a Parquet file."""
    buffer = io.BytesIO()
    table.write_parquet(buffer, compression_level=_COMPRESSION)
    return buffer.getvalue()


def assembled(
    parts: Sequence[tuple[RecordedCondition, Cell]],
    kind: str,
    read: Callable[[Cell], pl.DataFrame],
) -> pl.DataFrame:
    """One table of many cells.

    Args:
        parts: cells with the conditions that they are of; at least one.
        kind: of table.
        read: reads the table of a cell.

    Returns:
        `episodes.parquet` or `states.parquet`.
    """

    def labelled(part: tuple[RecordedCondition, Cell]) -> pl.DataFrame:
        return read(part[1]).select(*_labels(part[0], kind), pl.all())

    with ThreadPoolExecutor() as pool:
        table = pl.concat(pool.map(labelled, parts))
    if kind == STATES:
        keys = ["condition", "state", "row", "column"]
        return table.group_by(keys, maintain_order=True).sum()
    return table


def _labels(each: RecordedCondition, kind: str) -> list[pl.Expr]:
    """Columns that say whose rows these are."""
    labels = [pl.lit(each.condition).alias("condition")]
    if kind == EPISODES:
        labels += [
            pl.lit(each.assistant).alias("assistant"),
            pl.lit(each.alpha, pl.Float64).alias("alpha"),
            pl.lit(each.learner).alias("learner"),
        ]
    return labels
