"""Where records are: in a SQLite file, or in a PostgreSQL database by its URL."""

import contextlib
import functools
from collections.abc import Generator, Mapping, Sequence
from pathlib import Path
from typing import Any

import sqlalchemy as sql
from sqlalchemy import event
from sqlalchemy.exc import ArgumentError, NoSuchModuleError

from qbumpers.errors import RequestError

_SCHEMES = ("postgresql://", "postgres://")
_CONNECTING = 5  # seconds until a database that does not answer counts as absent
_MOST_PAGES = 16_000  # of the log until a commit waits for them: a flusher comes before
_READS = "reads"  # execution option of SQLite connections that write nothing


def is_url(records: str | Path) -> bool:
    """Whether records are said to be in a database, not in a file."""
    return "://" in str(records)


def place_of(records: str | Path) -> str:
    """Where records are, without a password."""
    if not is_url(records):
        return str(records)
    try:
        return sql.make_url(str(records)).render_as_string()
    except (ArgumentError, ValueError):
        return "postgresql://..."


def shown(records: str | Path) -> str:
    """Records as messages name them."""
    return f"records {place_of(records)}" if is_url(records) else f"records file {records}"


def engine_of(records: str | Path, *, new: bool) -> sql.Engine:
    """What leads to records; nothing is read of them yet.

    Args:
        records: path of a SQLite file, or URL of a PostgreSQL database.
        new: whether a file, and the folders above it, are made if there are none.

    Returns:
        An engine whose transactions begin as writers, see `reading`; several processes may write.

    Raises:
        RequestError: if there is no such file, or the URL is not one of PostgreSQL.
    """
    if is_url(records):
        return _postgresql(str(records))
    path = Path(records)
    if new:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch(mode=0o600)  # it holds what tokens are signed with
    elif not path.is_file():
        raise RequestError(f"{shown(records)}: there is none")
    engine = sql.create_engine(f"sqlite:///{path}")
    event.listen(engine, "connect", _prepare)
    event.listen(engine, "begin", _begin)
    return engine


def _postgresql(url: str) -> sql.Engine:
    if not url.startswith(_SCHEMES):
        scheme = url.partition("://")[0]
        raise RequestError(
            f"records of {scheme}://: a file, or postgresql://USER@HOST/DATABASE, is needed"
        )
    try:
        return sql.create_engine(
            sql.make_url(url).set(drivername="postgresql+psycopg"),
            # Each statement sees what was committed before it: writers wait for a lock, then look.
            isolation_level="READ COMMITTED",
            pool_pre_ping=True,  # the database may have been started again
            connect_args={"connect_timeout": _CONNECTING, "application_name": "qbumpers"},
        )
    except (ArgumentError, ValueError) as error:
        raise RequestError(
            f"{shown(url)}: not a URL; postgresql://USER@HOST/DATABASE is needed"
        ) from error
    except (NoSuchModuleError, ImportError) as error:
        raise RequestError(
            f"{shown(url)}: psycopg is missing; pip install 'qbumpers[study]'"
        ) from error


def is_postgresql(bind: sql.Engine | sql.Connection) -> bool:
    """Whether records are in a PostgreSQL database."""
    return bind.dialect.name == "postgresql"


def _prepare(connection: Any, _: Any) -> None:
    connection.isolation_level = None  # SQLAlchemy begins transactions, not Python's module
    for setting in (
        "journal_mode = WAL",
        "synchronous = NORMAL",
        "busy_timeout = 5000",
        f"wal_autocheckpoint = {_MOST_PAGES}",
    ):
        connection.execute(f"PRAGMA {setting}")


def _begin(connection: sql.Connection) -> None:
    reads = connection.get_execution_options().get(_READS, False)
    connection.exec_driver_sql("BEGIN" if reads else "BEGIN IMMEDIATE")


@contextlib.contextmanager
def reading(engine: sql.Engine) -> Generator[sql.Connection]:
    """A connection that sees the records as they are at its first look, and keeps no writer out.

    Args:
        engine: as `open_records` gave it.

    Yields:
        The connection.
    """
    options: dict[str, Any] = (
        {"isolation_level": "REPEATABLE READ"} if is_postgresql(engine) else {_READS: True}
    )
    with engine.connect().execution_options(**options) as connection:
        yield connection


def lock(connection: sql.Connection, name: str) -> None:
    """Wait until no other transaction, of any process, holds or shares a lock; then hold it.

    Args:
        connection: in the transaction that holds it to its end. One of SQLite holds all locks.
        name: of what is locked, any text.
    """
    if is_postgresql(connection):
        connection.execute(_LOCK, {"name": name})


def share_locks(connection: sql.Connection, names: list[str]) -> None:
    """Wait until no other transaction holds any of these locks; then share them, see `lock`."""
    if is_postgresql(connection):
        connection.execute(_SHARE_LOCKS, {"names": names})


_LOCK = sql.text("SELECT pg_advisory_xact_lock(hashtextextended(:name, 0))")
_SHARE_LOCKS = sql.text(
    "SELECT count(pg_advisory_xact_lock_shared(hashtextextended(name, 0))::text) "
    "FROM unnest(cast(:names AS text[])) AS name"
)


class Channel:
    """The connection of one thread that writes, made anew after an error.

    Args:
        engine: as `open_records` gave it.
    """

    def __init__(self, engine: sql.Engine) -> None:
        self._engine = engine
        self._connection: sql.Connection | None = None

    @contextlib.contextmanager
    def transaction(self, *, lasting: bool) -> Generator[sql.Connection, None, None]:
        """A transaction, which is committed at the end.

        Args:
            lasting: whether PostgreSQL must flush what is committed, as it does unless it is set up
                to flush late. For a SQLite file, see `qbumpers.play.flushing`.

        Yields:
            Its connection.
        """
        connection = self._connection = self._connection or self._engine.connect()
        try:
            with connection.begin():
                if lasting and is_postgresql(connection):
                    connection.exec_driver_sql("SET LOCAL synchronous_commit = on")
                yield connection
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Give the connection back; the next transaction has another one."""
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()


def insert(connection: sql.Connection, table: sql.Table, rows: Sequence[Mapping[str, Any]]) -> None:
    """Add rows; columns that a row lacks are null, numbers that count up by themselves are left.

    Args:
        connection: in a transaction.
        table: to which they are added.
        rows: columns by name.
    """
    statement, names, by_place = _insertion(table, connection.dialect)
    if by_place:
        connection.exec_driver_sql(statement, [tuple(map(row.get, names)) for row in rows])
    else:
        connection.exec_driver_sql(statement, [{n: row.get(n) for n in names} for row in rows])


@functools.cache
def _insertion(table: sql.Table, dialect: sql.Dialect) -> tuple[str, tuple[str, ...], bool]:
    """A statement, compiled once, the columns that it takes, and whether it takes them by place."""
    columns = [column.name for column in table.c if column.autoincrement is not True]
    compiled = table.insert().compile(dialect=dialect, column_keys=columns)
    by_place: Sequence[str] | None = compiled.positiontup
    return str(compiled), tuple(by_place or columns), by_place is not None
