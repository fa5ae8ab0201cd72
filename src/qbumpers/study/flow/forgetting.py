"""Deleting what is known of a participant, so that nothing of it stays in the file."""

import datetime

import sqlalchemy as sql

from qbumpers.play.tables import EPISODES, NOTES, SESSIONS, STEPS, TENURES
from qbumpers.study.flow.tables import IDENTITIES, LOG, PARTICIPANTS, TOMBSTONES

_PLAYED = (SESSIONS, TENURES, EPISODES, STEPS, NOTES)


def delete_participant(engine: sql.Engine, participant: str, reason: str) -> bool:
    """Delete everything of a participant, and leave a dated tombstone that does not say whose.

    Args:
        engine: as `open_records` gave it.
        participant: identifier.
        reason: for the tombstone, for instance "withdrawn".

    Returns:
        Whether there was such a participant.
    """
    with engine.begin() as connection:
        if engine.dialect.name == "sqlite":
            connection.exec_driver_sql("PRAGMA secure_delete = ON")
        found = 0
        for table in (PARTICIPANTS, LOG, IDENTITIES):
            gone = connection.execute(table.delete().where(table.c.participant == participant))
            found += gone.rowcount if table is PARTICIPANTS else 0
        for table in _PLAYED:
            mine = table.c.session.startswith(f"{participant}.", autoescape=True)
            connection.execute(table.delete().where(mine))
        if found:
            today = datetime.datetime.now(datetime.UTC).date().isoformat()
            connection.execute(TOMBSTONES.insert(), {"date": today, "reason": reason})
    _forget_log(engine)
    return bool(found)


def delete_identities(engine: sql.Engine) -> int:
    """Delete who participants are to the recruitment; what they did stays.

    Returns:
        How many there were.
    """
    with engine.begin() as connection:
        if engine.dialect.name == "sqlite":
            connection.exec_driver_sql("PRAGMA secure_delete = ON")
        found = connection.execute(IDENTITIES.delete()).rowcount
    _forget_log(engine)
    return found


def _forget_log(engine: sql.Engine) -> None:
    """SQLite's write-ahead log still has what was deleted, until it is written over."""
    if engine.dialect.name == "sqlite":
        with engine.connect() as connection:
            connection.commit()
            raw = connection.connection.dbapi_connection
            assert raw is not None
            raw.execute("PRAGMA wal_checkpoint(TRUNCATE)")
