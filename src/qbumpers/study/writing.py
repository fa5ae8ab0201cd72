"""Writing records: one thread, which commits whatever has come in at once."""

import queue
import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from typing import Any, NamedTuple

import sqlalchemy as sql

Row = tuple[sql.Table, Mapping[str, Any]]
"""A table, and the columns of a row for it."""

_MOST = 512  # additions per transaction


class _Addition(NamedTuple):
    rows: Sequence[Row]
    lasting: bool
    done: "Future[None]"


class Writer:
    """Adds rows to a records file; every addition is whole or not there at all.

    Args:
        engine: of the file; no one else may write to it.
    """

    def __init__(self, engine: sql.Engine) -> None:
        self._engine = engine
        self._waiting: queue.SimpleQueue[_Addition | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._write, name="records", daemon=True)
        self._thread.start()

    def add(self, rows: Sequence[Row], *, lasting: bool = False) -> "Future[None]":
        """Add rows.

        Args:
            rows: those of a table are added in their order.
            lasting: whether they must also survive a power cut; without it, they survive the end
                of the server however it comes.

        Returns:
            Done once they are committed; its exception says why they could not be.
        """
        done: Future[None] = Future()
        done.set_running_or_notify_cancel()  # what was asked for is written, whoever waits
        self._waiting.put(_Addition(rows, lasting, done))
        return done

    def close(self) -> None:
        """Write what is waiting, and end."""
        self._waiting.put(None)
        self._thread.join()
        self._engine.dispose()

    def _write(self) -> None:
        with self._engine.connect() as connection:
            closing = False
            while not closing:
                group, closing = self._group()
                if group and not self._committed(connection, group):
                    for addition in group:  # one that fails must not take others with it
                        self._committed(connection, [addition], last=True)

    def _group(self) -> tuple[list[_Addition], bool]:
        """What is waiting now, and whether the end has come."""
        group: list[_Addition] = []
        while not group or (len(group) < _MOST and not self._waiting.empty()):
            addition = self._waiting.get()
            if addition is None:
                return group, True
            group.append(addition)
        return group, False

    def _committed(
        self, connection: sql.Connection, group: Sequence[_Addition], last: bool = False
    ) -> bool:
        """Whether a group could be committed; if not, whoever waits learns why if it was `last`."""
        lasting = any(addition.lasting for addition in group)
        try:
            _set_synchronous(connection, "FULL" if lasting else "NORMAL")
            with connection.begin():
                for table, rows in _by_table(group).items():
                    connection.execute(table.insert(), rows)  # many rows at once take less time
        except Exception as error:  # whatever it is, those who wait must hear of it
            if last:
                group[0].done.set_exception(error)
            return False
        for addition in group:
            addition.done.set_result(None)
        return True


def _by_table(group: Sequence[_Addition]) -> dict[sql.Table, list[Mapping[str, Any]]]:
    found: dict[sql.Table, list[Mapping[str, Any]]] = {}
    for addition in group:
        for table, row in addition.rows:
            found.setdefault(table, []).append(row)
    return found


def _set_synchronous(connection: sql.Connection, how: str) -> None:
    raw: Any = connection.connection.dbapi_connection
    raw.execute(f"PRAGMA synchronous = {how}")
