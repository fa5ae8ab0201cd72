"""The tables of a study beside those of play: its log, identities, and what was deleted."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import sqlalchemy as sql

from qbumpers.errors import RequestError
from qbumpers.play.tables import STEPS, open_records

_metadata = sql.MetaData()

STUDY = sql.Table(
    "study",
    _metadata,
    sql.Column("name", sql.String, nullable=False),
    sql.Column("mode", sql.String, nullable=False),
    sql.Column("digest", sql.String, nullable=False),
)
"""One row: whose records these are, "pilot" or "live", and the digest of the study as it began."""

PARTICIPANTS = sql.Table(
    "participants",
    _metadata,
    sql.Column("participant", sql.String, primary_key=True),
    sql.Column("came", sql.Float, nullable=False),
)
"""One row per participant: when they came, in seconds since 1970."""

LOG = sql.Table(
    "log",
    _metadata,
    sql.Column("entry", sql.Integer, primary_key=True, autoincrement=True),
    sql.Column("participant", sql.String, nullable=False, index=True),
    sql.Column("time", sql.Float, nullable=False),
    sql.Column("kind", sql.String, nullable=False),
    sql.Column("content", sql.String, nullable=False),
)
"""What happened to participants outside of episodes; rows are added, never changed."""

IDENTITIES = sql.Table(
    "identities",
    _metadata,
    sql.Column("participant", sql.String, primary_key=True),
    sql.Column("identity", sql.String, nullable=False, unique=True),
    sql.Column("study_id", sql.String, nullable=False),
    sql.Column("session_id", sql.String, nullable=False),
)
"""Who participants are to the recruitment: PROLIFIC_PID, or the code of a class list."""

TOMBSTONES = sql.Table(
    "tombstones",
    _metadata,
    sql.Column("entry", sql.Integer, primary_key=True, autoincrement=True),
    sql.Column("date", sql.String, nullable=False),
    sql.Column("reason", sql.String, nullable=False),
)
"""That somebody's data were deleted: the date and why, not whose."""

EXPORTS = sql.Table(
    "exports",
    _metadata,
    sql.Column("folder", sql.String, primary_key=True),
)
"""Folders to which the records were exported, so that deleting reaches them."""


class Event(NamedTuple):
    """A row of the log.

    Attributes:
        time: in seconds since 1970.
        kind: "arrived", "left", "assigned", "answered", "attributed", "restarted" or "ended".
        content: JSON-like.
    """

    time: float
    kind: str
    content: Mapping[str, Any]


def log_row(participant: str, event: Event) -> dict[str, Any]:
    """A row of the log as the table has it."""
    content = json.dumps(event.content, sort_keys=True)
    return {"participant": participant, **event._asdict(), "content": content}


def open_study(path: str | Path, name: str, mode: str, digest: str) -> sql.Engine:
    """The records of a study, made if there are none.

    Args:
        path: of the file.
        name: of the study.
        mode: "pilot" or "live".
        digest: of the study.

    Returns:
        The engine, see `qbumpers.play.tables.open_records`.

    Raises:
        RequestError: if the file holds records of something else, or live ones of another digest.
    """
    engine = open_records(path)
    with engine.begin() as connection:
        _metadata.create_all(connection)
        found = connection.execute(sql.select(STUDY)).mappings().first()
        if found is None:
            row = {"name": name, "mode": mode, "digest": digest}
            connection.execute(STUDY.insert(), row)
            return engine
    if (found["name"], found["mode"]) != (name, mode):
        raise RequestError(
            f"records file {path}: it is of study {found['name']!r}, {found['mode']}; needed "
            f"{name!r}, {mode}"
        )
    if mode == "live" and found["digest"] != digest:
        raise RequestError(
            f"records file {path}: the study was another when its live records began; a study that "
            "is live cannot be changed: give it another name"
        )
    return engine


def read_records(path: str | Path) -> sql.Engine:
    """The records of a study that is there.

    Raises:
        RequestError: if there are none, or they are no study's.
    """
    if not Path(path).is_file():
        raise RequestError(f"records file {path}: there is none; serve or simulate the study first")
    engine = open_records(path)
    if not sql.inspect(engine).has_table(STUDY.name):
        raise RequestError(f"records file {path}: it is of play, not of a study")
    return engine


def participants_in(engine: sql.Engine) -> dict[str, float]:
    """When each participant came, in seconds since 1970, the earliest first."""
    with engine.connect() as connection:
        rows = connection.execute(sql.select(PARTICIPANTS).order_by(PARTICIPANTS.c.came))
        return {row.participant: row.came for row in rows}


def events_of(
    engine: sql.Engine, participants: Iterable[str] | None = None
) -> dict[str, list[Event]]:
    """What happened to participants, in order.

    Args:
        engine: as `open_records` gave it.
        participants: whom; everybody if None.
    """
    query = sql.select(LOG).order_by(LOG.c.entry)
    if participants is not None:
        query = query.where(LOG.c.participant.in_(list(participants)))
    found: dict[str, list[Event]] = {}
    with engine.connect() as connection:
        for row in connection.execute(query).mappings():
            event = Event(row["time"], row["kind"], json.loads(row["content"]))
            found.setdefault(row["participant"], []).append(event)
    return found


def last_step_of(engine: sql.Engine, participant: str) -> float:
    """When a participant last acted in an episode, in seconds since 1970; 0 if they never did."""
    mine = STEPS.c.session.startswith(f"{participant}.", autoescape=True)
    with engine.connect() as connection:
        return (
            connection.execute(sql.select(sql.func.max(STEPS.c.applied)).where(mine)).scalar()
            or 0.0
        )


def session_name(participant: str, block: str, attempt: int) -> str:
    """Identifier of the session in which a participant plays a block.

    Args:
        participant: identifier.
        block: id of the block.
        attempt: how often the sitting was begun before.
    """
    return f"{participant}.{block}.{attempt}"


def identity_of(engine: sql.Engine, identity: str) -> str | None:
    """The participant of an identity; None if there is none."""
    with engine.connect() as connection:
        query = sql.select(IDENTITIES.c.participant).where(IDENTITIES.c.identity == identity)
        return connection.execute(query).scalar()


OF_PARTICIPANT = (PARTICIPANTS, LOG, IDENTITIES)
"""Tables with a column `participant`; those of play have sessions, see `session_name`."""
