"""Making what a SQLite file has committed survive a power cut, beside the thread that commits.

A disk takes milliseconds for it; who commits steps must not wait for the ends of other episodes.
"""

import contextlib
import os
import queue
import threading
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import sqlalchemy as sql

_LOG = 4 * 2**20
"""Bytes of the write-ahead log after which it is put into the file."""


class Flusher:
    """A thread that flushes the write-ahead log when it is asked to, and puts it into the file.

    Args:
        engine: of a SQLite file.
    """

    def __init__(self, engine: sql.Engine) -> None:
        self._engine = engine
        self._log = Path(f"{engine.url.database}-wal")
        self._waiting: queue.SimpleQueue[Future[None] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._flush, name="flusher", daemon=True)
        self._thread.start()

    def flush(self, done: "Future[None]") -> None:
        """Flush what has been committed.

        Args:
            done: is done once that survives a power cut; its exception says why it does not.
        """
        self._waiting.put(done)

    def close(self) -> None:
        """Flush what is waiting, and end."""
        self._waiting.put(None)
        self._thread.join()

    def _flush(self) -> None:
        closing = False
        while not closing:
            group, closing = self._group()
            try:
                self._synchronise()
            except OSError as error:
                for done in group:
                    done.set_exception(error)
            else:
                for done in group:
                    done.set_result(None)
            self._put_into_file()

    def _group(self) -> "tuple[list[Future[None]], bool]":
        """Whoever is waiting now, and whether the end has come."""
        group: list[Future[None]] = []
        while not group or not self._waiting.empty():
            done = self._waiting.get()
            if done is None:
                return group, True
            group.append(done)
        return group, False

    def _synchronise(self) -> None:
        # Without a log, everything is in the file, which was flushed when it was put there.
        with contextlib.suppress(FileNotFoundError):
            descriptor = os.open(self._log, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)

    def _put_into_file(self) -> None:
        """Put a long log into the file; nobody who writes or reads waits for it."""
        with contextlib.suppress(OSError):
            if self._log.stat().st_size > _LOG:
                raw: Any = self._engine.raw_connection()
                with contextlib.closing(raw):
                    raw.execute("PRAGMA wal_checkpoint(PASSIVE)")
