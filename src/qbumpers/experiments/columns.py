"""The columns of a run's tables, and whether a file has them."""

from collections.abc import Mapping

import polars as pl

from qbumpers.errors import RequestError

_TEXTS, _FLAGS, _WHOLE, _REAL = ("texts", "true or false", "whole numbers", "numbers")

EPISODE_COLUMNS: Mapping[str, str] = {
    "condition": _TEXTS, "assistant": _TEXTS, "alpha": _REAL, "learner": _TEXTS, "trial": _WHOLE,
    "episode": _WHOLE, "retention": _FLAGS, "assisted_return": _REAL, "unassisted_return": _REAL,
    "assisted_length": _WHOLE, "unassisted_length": _WHOLE, "overrides": _WHOLE,
    "assisted_success": _FLAGS, "unassisted_success": _FLAGS, "assisted_crash": _FLAGS,
    "unassisted_crash": _FLAGS,
}  # fmt: skip
"""What the columns of a row per episode hold."""

STATE_COLUMNS: Mapping[str, str] = {
    "condition": _TEXTS, "state": _WHOLE, "row": _WHOLE, "column": _WHOLE, "assisted": _WHOLE,
    "overridden": _WHOLE, "unassisted": _WHOLE,
}  # fmt: skip
"""What the columns of a row per state hold."""

_MAY_LACK = {
    "alpha", "row", "column", "assisted_success", "unassisted_success", "assisted_crash",
    "unassisted_crash",
}  # fmt: skip


def check_columns(table: pl.DataFrame, columns: Mapping[str, str], where: str) -> None:
    """Check that a table from a file is what it was when it was written.

    Args:
        table: with any further columns.
        columns: what it must have, `EPISODE_COLUMNS` or `STATE_COLUMNS`.
        where: for messages, the path of the file.

    Raises:
        RequestError: if a column is missing, holds something else, or lacks values.
    """
    for name, kind in columns.items():
        if name not in table.columns:
            raise RequestError(f"{where}: it has no column {name!r}, but {table.columns}")
        column = table[name]
        if not _holds(column.dtype, kind):
            raise RequestError(f"{where}: column {name!r} holds {column.dtype}, not {kind}")
        if name not in _MAY_LACK and column.has_nulls():
            raise RequestError(f"{where}: column {name!r} lacks values")
        if column.dtype.is_float() and not column.drop_nulls().is_finite().all():
            raise RequestError(f"{where}: column {name!r} has numbers that are not finite")


def _holds(found: pl.DataType, kind: str) -> bool:
    suits = {
        _TEXTS: found == pl.String,
        _FLAGS: found == pl.Boolean,
        _WHOLE: found.is_integer(),
        _REAL: found.is_numeric(),
    }
    return suits[kind] or found == pl.Null
