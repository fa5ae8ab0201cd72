"""The tables of records, and reading them. Rows are added, never changed."""

import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import sqlalchemy as sql
from sqlalchemy.exc import DatabaseError

from qbumpers.decisions import Step
from qbumpers.errors import RequestError
from qbumpers.play.game import Choice, Played
from qbumpers.play.stores import engine_of, lock, reading, shown
from qbumpers.play.upgrades import bring_up_to_date

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

TENURES = sql.Table(
    "tenures",
    _metadata,
    sql.Column("session", sql.String, primary_key=True),
    sql.Column("tenure", sql.Integer, primary_key=True),
    sql.Column("began", sql.Float, nullable=False),
)
"""One row per time that a server took a session: only the last one may add to the session."""

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


def open_records(records: str | Path, *, new: bool = True) -> sql.Engine:
    """Records, with their tables, which are brought up to date if they are older.

    Args:
        records: path of a SQLite file, or URL of a PostgreSQL database.
        new: whether a file, and the folders above it, are made if there are none.

    Returns:
        An engine whose transactions begin as writers; `reading` gives one that only reads.

    Raises:
        RequestError: if there are no such records, or they are something else, cannot be reached or
            are of a newer version.
    """
    engine = engine_of(records, new=new)
    try:
        bring_up_to_date(engine, _metadata, shown(records))
    except DatabaseError as error:
        engine.dispose()
        reason = str(error.orig).strip().partition("\n")[0]
        raise RequestError(f"{shown(records)}: {reason}") from error
    except RequestError:
        engine.dispose()
        raise
    return engine


def secret_of(engine: sql.Engine) -> str:
    """What session tokens of records are signed with."""
    with reading(engine) as connection:
        return connection.execute(sql.select(ABOUT.c.secret)).scalar_one()


class Tenure(NamedTuple):
    """A server's right to add to a session, until another one takes it.

    Attributes:
        session: identifier.
        number: counted from 0.
    """

    session: str
    number: int

    def row(self) -> dict[str, Any]:
        """The columns of its row, as of now."""
        return {"session": self.session, "tenure": self.number, "began": time.time()}


def take_session(engine: sql.Engine, session: str) -> Tenure | None:
    """Take a session from whichever server drives it; what that one added before is committed.

    Args:
        engine: as `open_records` gave it.
        session: identifier.

    Returns:
        The right to add to it; None if there is no such session.
    """
    with engine.begin() as connection:
        lock(connection, session)
        last = latest_tenures(connection, [session]).get(session)
        if last is None:
            return None
        tenure = Tenure(session, last + 1)
        connection.execute(TENURES.insert(), tenure.row())
    return tenure


def drives(engine: sql.Engine, tenure: Tenure) -> bool:
    """Whether nobody has taken a session since."""
    with reading(engine) as connection:
        return latest_tenures(connection, [tenure.session]).get(tenure.session) == tenure.number


def latest_tenures(connection: sql.Connection, sessions: Sequence[str]) -> dict[str, int]:
    """The number of each session's last tenure; sessions that are not there are left out."""
    found = connection.execute(_LATEST, {"sessions": sessions})
    return {row.session: row.tenure for row in found}


_LATEST = (
    sql.select(TENURES.c.session, sql.func.max(TENURES.c.tenure).label("tenure"))
    .where(TENURES.c.session.in_(sql.bindparam("sessions", expanding=True)))
    .group_by(TENURES.c.session)
)


def step_row(session: str, number: int, episode: int, step: Step) -> dict[str, Any]:
    """The columns of a step that say what was decided and done.

    Args:
        session: identifier, as signed in the participant's token.
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
        seed: from which the session's noise and chance come.
        setup: description of what was played, see `Setup.description`.
        played: every episode.
    """

    session: str
    seed: int
    setup: dict[str, Any]
    played: list[Played]

    @property
    def steps(self) -> list[Step]:
        """All steps, in their order."""
        return [step for played in self.played for step in played.steps]


def sessions_in(engine: sql.Engine) -> list[str]:
    """Identifiers of every session, the earliest first."""
    with reading(engine) as connection:
        order = sql.select(SESSIONS.c.session).order_by(SESSIONS.c.began)
        return list(connection.execute(order).scalars())


def read_session(engine: sql.Engine, session: str) -> Recorded | None:
    """What is recorded of a participant.

    Args:
        engine: as `open_records` gave it.
        session: identifier.

    Returns:
        The record; None if there is none.
    """
    with reading(engine) as connection:
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
        engine: as `open_records` gave it.
        session: identifier.
    """
    columns = [STEPS.c[field] for field in Moment._fields]
    found = sql.select(*columns).where(STEPS.c.session == session).order_by(STEPS.c.number)
    with reading(engine) as connection:
        return [Moment(*row) for row in connection.execute(found)]


def read_notes(engine: sql.Engine, session: str) -> list[dict[str, Any]]:
    """What else happened in a session: `session`, `time`, `kind`, and `content` as JSON."""
    columns = (NOTES.c.session, NOTES.c.time, NOTES.c.kind, NOTES.c.content)
    with reading(engine) as connection:
        order = sql.select(*columns).where(NOTES.c.session == session).order_by(NOTES.c.note)
        return [dict(row) for row in connection.execute(order).mappings()]
