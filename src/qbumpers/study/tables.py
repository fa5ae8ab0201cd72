"""The tables of a records file, and reading them. Rows are added, never changed."""

import json
import secrets
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import sqlalchemy as sql
from sqlalchemy import event
from sqlalchemy.exc import DatabaseError

from qbumpers.decisions import Step
from qbumpers.errors import RequestError
from qbumpers.study.game import Choice, Played

SCHEMA = 1
"""Version of the tables, raised when they change."""

_metadata = sql.MetaData()

ABOUT = sql.Table(
    "about",
    _metadata,
    sql.Column("schema", sql.Integer, nullable=False),
    sql.Column("secret", sql.String, nullable=False),
)
"""One row: the version of the tables, and what session tokens are signed with."""

SESSIONS = sql.Table(
    "sessions",
    _metadata,
    sql.Column("session", sql.String, primary_key=True),
    sql.Column("began", sql.Float, nullable=False),
    sql.Column("seed", sql.String, nullable=False),
    sql.Column("setup", sql.String, nullable=False),
    sql.Column("version", sql.String, nullable=False),
)
"""One row per participant: when they came (seconds since 1970), the seed, the setup as JSON, and
the version of the package."""

EPISODES = sql.Table(
    "episodes",
    _metadata,
    sql.Column("session", sql.String, primary_key=True),
    sql.Column("episode", sql.Integer, primary_key=True),
    sql.Column("began", sql.Float, nullable=False),
    sql.Column("assistant", sql.String, nullable=False),
    sql.Column("options", sql.String, nullable=False),
    sql.Column("assisted", sql.Boolean, nullable=False),
)
"""One row per episode, written when it begins."""

TIMES = ("shown", "pressed", "received", "applied")
"""When the state was shown and the key pressed, milliseconds of the page's clock; when the server
received the message and applied the action, seconds since 1970. None if there was none."""

STEPS = sql.Table(
    "steps",
    _metadata,
    sql.Column("session", sql.String, primary_key=True),
    sql.Column("number", sql.Integer, primary_key=True),
    sql.Column("of_session", sql.Integer, nullable=False),
    *(sql.Column(field, sql.String, nullable=False) for field in ("state", "values", "next_state")),
    *(
        sql.Column(field, sql.Integer, nullable=False)
        for field in ("episode", "proposed", "executed", "credited", "events")
    ),
    *(sql.Column(field, sql.Boolean, nullable=False) for field in ("undone", "overridden")),
    *(
        sql.Column(field, sql.Float, nullable=False)
        for field in ("probability", "coin", "tie", "projected_return", "reward")
    ),
    sql.Column("device", sql.String, nullable=False),
    *(sql.Column(field, sql.Float) for field in TIMES),
)
"""One row per step: the fields of `qbumpers.Step`, states and values as JSON; the participant's
`episode`, and `of_session`, the same counted by the assistant's session; the device and the times.
"""

NOTES = sql.Table(
    "notes",
    _metadata,
    sql.Column("note", sql.Integer, primary_key=True, autoincrement=True),
    sql.Column("session", sql.String, nullable=False),
    sql.Column("time", sql.Float, nullable=False),
    sql.Column("kind", sql.String, nullable=False),
    sql.Column("content", sql.String, nullable=False),
)
"""What else happened: pages that joined (with refresh rate and size) and left, focus, pauses."""


def open_records(path: str | Path) -> sql.Engine:
    """A records file, made with its tables if there is none.

    Args:
        path: of the file; folders above it are made.

    Returns:
        An engine whose transactions begin at once as writers, with a write-ahead log.

    Raises:
        RequestError: if it is no records file, or of another version of the tables.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.touch(mode=0o600)  # it holds what tokens are signed with
    engine = sql.create_engine(f"sqlite:///{path}")
    event.listen(engine, "connect", _prepare)
    event.listen(engine, "begin", _begin)
    try:
        with engine.begin() as connection:
            _metadata.create_all(connection)
            _check_version(connection, path)
    except DatabaseError as error:
        raise RequestError(f"records file {path}: {error.orig}") from error
    return engine


def _prepare(connection: Any, _: Any) -> None:
    connection.isolation_level = None  # SQLAlchemy begins transactions, not Python's module
    for setting in ("journal_mode = WAL", "synchronous = NORMAL", "busy_timeout = 5000"):
        connection.execute(f"PRAGMA {setting}")


def _begin(connection: sql.Connection) -> None:
    connection.exec_driver_sql("BEGIN IMMEDIATE")


def _check_version(connection: sql.Connection, path: Path) -> None:
    found = connection.execute(sql.select(ABOUT.c.schema)).scalar()
    if found is None:
        connection.execute(ABOUT.insert(), {"schema": SCHEMA, "secret": secrets.token_hex(32)})
    elif found != SCHEMA:
        raise RequestError(
            f"records file {path}: its tables are of version {found}, these of {SCHEMA}; use the "
            "version of qbumpers that wrote it"
        )


def secret_of(engine: sql.Engine) -> str:
    """What session tokens of a records file are signed with."""
    with engine.connect() as connection:
        return connection.execute(sql.select(ABOUT.c.secret)).scalar_one()


def step_row(session: str, number: int, episode: int, step: Step) -> dict[str, Any]:
    """The columns of a step that say what was decided and done.

    Args:
        session: of the participant.
        number: of the step in the session, from 0.
        episode: of the participant, from 0.
        step: the record.
    """
    fields = step._asdict()
    plain = {field: _plain(value) for field, value in fields.items()}
    for field in ("state", "values", "next_state"):
        plain[field] = json.dumps(plain[field])
    return {
        **plain,
        "session": session,
        "number": number,
        "episode": episode,
        "of_session": int(step.episode),
    }


def _plain(value: Any) -> Any:
    """A number or an array as JSON has it; float32 exactly."""
    as_list: Any = getattr(value, "tolist", None)
    return value if as_list is None else as_list()


def step_of_row(row: Mapping[Any, Any]) -> Step:
    """The record of a step as it was, from its row."""
    state, values, following = (json.loads(row[f]) for f in ("state", "values", "next_state"))
    fields = {field: row[field] for field in Step._fields}
    return Step(**{
        **fields,
        "episode": row["of_session"],
        "state": _state(state),
        "values": np.array(values, np.float64),
        "next_state": _state(following),
    })  # fmt: skip


def _state(found: Any) -> Any:
    return np.array(found, np.float32) if isinstance(found, list) else found


class Recorded(NamedTuple):
    """What is recorded of a participant.

    Attributes:
        session: identifier.
        seed: of the session.
        setup: description of what was played, see `Setup.description`.
        played: every episode.
    """

    session: str
    seed: int
    setup: dict[str, Any]
    played: list[Played]


def sessions_in(engine: sql.Engine) -> list[str]:
    """Identifiers of every session, the earliest first."""
    with engine.connect() as connection:
        order = sql.select(SESSIONS.c.session).order_by(SESSIONS.c.began)
        return list(connection.execute(order).scalars())


def read_session(engine: sql.Engine, session: str) -> Recorded | None:
    """What is recorded of a participant.

    Args:
        engine: of the records.
        session: identifier.

    Returns:
        The record; None if there is none.
    """
    with engine.connect() as connection:
        of = {table: table.c.session == session for table in (SESSIONS, EPISODES, STEPS)}
        found = connection.execute(sql.select(SESSIONS).where(of[SESSIONS])).mappings().first()
        if found is None:
            return None
        episodes = connection.execute(
            sql.select(EPISODES).where(of[EPISODES]).order_by(EPISODES.c.episode)
        ).mappings()
        played = [
            Played(
                Choice(row["assistant"], json.loads(row["options"]), row["assisted"]), list[Step]()
            )
            for row in episodes
        ]
        steps = sql.select(STEPS).where(of[STEPS]).order_by(STEPS.c.number)
        for row in connection.execute(steps).mappings():
            played[int(row["episode"])].steps.append(step_of_row(row))
    return Recorded(session, int(found["seed"]), json.loads(found["setup"]), played)


class Moment(NamedTuple):
    """How a step came about.

    Attributes:
        device: that the participant used.
        shown: see `TIMES`.
        pressed: likewise.
        received: likewise.
        applied: likewise.
    """

    device: str
    shown: float | None
    pressed: float | None
    received: float | None
    applied: float | None


def read_moments(engine: sql.Engine, session: str) -> list[Moment]:
    """How every step of a session came about, in their order.

    Args:
        engine: of the records.
        session: identifier.
    """
    columns = [STEPS.c[field] for field in Moment._fields]
    found = sql.select(*columns).where(STEPS.c.session == session).order_by(STEPS.c.number)
    with engine.connect() as connection:
        return [Moment(*row) for row in connection.execute(found)]
