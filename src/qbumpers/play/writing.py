"""Writing records: one thread, which commits whatever has come in at once."""

import queue
import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from typing import Any, NamedTuple

import sqlalchemy as sql
from sqlalchemy.exc import OperationalError

from qbumpers.errors import RequestError
from qbumpers.play.flushing import Flusher
from qbumpers.play.stores import Channel, insert, is_postgresql, share_locks
from qbumpers.play.tables import Tenure, latest_tenures

Row = tuple[sql.Table, Mapping[str, Any]]
"""A table, and the columns of a row for it."""

_MOST = 512  # additions per transaction


class TakenOverError(RequestError):
    """Another server has taken a session; nothing more can be added to it from here."""


class UnreachableError(Exception):
    """The database cannot be reached just now; whether it has the addition, it alone can say."""


class _Addition(NamedTuple):
    rows: Sequence[Row]
    tenure: Tenure | None
    lasting: bool
    done: "Future[None]"


class Writer:
    """Adds rows to records; every addition is whole or not there at all.

    Args:
        engine: of the records; other processes may add to them too.
    """

    def __init__(self, engine: sql.Engine) -> None:
        self._engine, self._channel = engine, Channel(engine)
        self._flusher = None if is_postgresql(engine) else Flusher(engine)
        self._waiting: queue.SimpleQueue[_Addition | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._write, name="records", daemon=True)
        self._thread.start()

    def add(
        self, rows: Sequence[Row], tenure: Tenure | None = None, *, lasting: bool = False
    ) -> "Future[None]":
        """Add rows.

        Args:
            rows: those of a table are added in their order.
            tenure: by which they are added to a session that others may take; None for rows of no
                session, or of a new one.
            lasting: whether they must also survive a power cut; without it, they survive the end
                of the server however it comes.

        Returns:
            Done once they are committed; its exception says why they could not be: a
            `TakenOverError` if the session has been taken, an `UnreachableError` if a database
            cannot be reached.
        """
        done: Future[None] = Future()
        done.set_running_or_notify_cancel()  # what was asked for is written, whoever waits
        self._waiting.put(_Addition(rows, tenure, lasting, done))
        return done

    def close(self) -> None:
        """Write what is waiting, and end."""
        self._waiting.put(None)
        self._thread.join()
        self._engine.dispose()

    def _write(self) -> None:
        closing = False
        while not closing:
            group, closing = self._group()
            if group and not self._committed(group, last=len(group) == 1):
                for addition in group:  # one that fails must not take others with it
                    self._committed([addition], last=True)
        self._channel.close()
        if self._flusher is not None:
            self._flusher.close()

    def _group(self) -> tuple[list[_Addition], bool]:
        """What is waiting now, and whether the end has come."""
        group: list[_Addition] = []
        while not group or (len(group) < _MOST and not self._waiting.empty()):
            addition = self._waiting.get()
            if addition is None:
                return group, True
            group.append(addition)
        return group, False

    def _committed(self, group: Sequence[_Addition], last: bool = False) -> bool:
        """Whether whoever waits knows how it went: not if one of several failed."""
        try:
            lasting = any(addition.lasting for addition in group)
            with self._channel.transaction(lasting=lasting) as connection:
                _check_tenures(connection, group)
                for table, rows in _by_table(group).items():
                    insert(connection, table, rows)  # many rows at once take less time
        except Exception as error:  # whatever it is, those who wait must hear of it
            if isinstance(error, OperationalError) and is_postgresql(self._engine):
                reason = str(error.orig).strip().partition("\n")[0]
                _fail(group, UnreachableError(reason))
            elif last:
                _fail(group, error)
            else:
                return False
        else:
            for addition in group:
                if addition.lasting and self._flusher is not None:
                    self._flusher.flush(addition.done)
                else:
                    addition.done.set_result(None)
        return True


def _fail(group: Sequence[_Addition], error: Exception) -> None:
    for addition in group:
        addition.done.set_exception(error)


def _check_tenures(connection: sql.Connection, group: Sequence[_Addition]) -> None:
    """Refuse to add to sessions that have been taken; none can be until the transaction ends."""
    tenures = {addition.tenure for addition in group if addition.tenure is not None}
    if not tenures:
        return
    sessions = sorted({tenure.session for tenure in tenures})
    share_locks(connection, sessions)
    latest = latest_tenures(connection, sessions)
    if any(latest.get(tenure.session) != tenure.number for tenure in tenures):
        raise TakenOverError("this session goes on in another tab or window")


def _by_table(group: Sequence[_Addition]) -> dict[sql.Table, list[Mapping[str, Any]]]:
    found: dict[sql.Table, list[Mapping[str, Any]]] = {}
    for addition in group:
        for table, row in addition.rows:
            found.setdefault(table, []).append(row)
    return found
