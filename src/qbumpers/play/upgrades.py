"""Versions of the tables: records of an older one are brought up to date, a step per version."""

import secrets

import sqlalchemy as sql

from qbumpers.errors import RequestError
from qbumpers.play.stores import lock

SCHEMA = 2
"""Version of the tables, raised when they change."""

UPGRADES = {
    1: (
        # Who drives a session, so that several servers may share the records.
        "CREATE TABLE tenures (session VARCHAR NOT NULL, tenure INTEGER NOT NULL, "
        "began FLOAT NOT NULL, PRIMARY KEY (session, tenure))",
        "INSERT INTO tenures (session, tenure, began) SELECT session, 0, began FROM sessions",
    ),
}
"""What leads from a version to the next. Never changed: it is about tables as they were."""


def bring_up_to_date(engine: sql.Engine, tables: sql.MetaData, where: str) -> None:
    """Make the tables of records if there are none, or bring older ones up to date, all or nothing.

    Args:
        engine: as `open_records` gave it.
        tables: of the present version, with `about`, the one that says the version.
        where: for messages, what the records are.

    Raises:
        RequestError: if they are of a newer version, or of something else.
    """
    about = tables.tables["about"]
    with engine.begin() as connection:
        lock(connection, "tables")  # two servers may begin at once
        if not sql.inspect(connection).has_table(about.name):
            _check_free(connection, tables, where)
            tables.create_all(connection)
            row = {"schema": SCHEMA, "secret": secrets.token_hex(32)}
            connection.execute(about.insert(), row)
            return
        found = connection.execute(sql.select(about.c.schema)).scalar_one()
        if found > SCHEMA:
            raise RequestError(
                f"{where}: its tables are of version {found}, newer than {SCHEMA}, the newest that "
                "this version of qbumpers knows; use the version that wrote it"
            )
        for version in range(found, SCHEMA):
            for statement in UPGRADES[version]:
                connection.exec_driver_sql(statement)
        if found < SCHEMA:
            connection.execute(about.update().values(schema=SCHEMA))


def _check_free(connection: sql.Connection, tables: sql.MetaData, where: str) -> None:
    taken = sorted(set(sql.inspect(connection).get_table_names()) & set(tables.tables))
    if taken:
        raise RequestError(
            f"{where}: it has a table {taken[0]} that is not qbumpers'; name another"
        )
