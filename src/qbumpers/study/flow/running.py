"""Serving a study, and its records in its folder."""

import contextlib
import sqlite3
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import sqlalchemy as sql

from qbumpers.errors import RequestError
from qbumpers.play.addresses import Address
from qbumpers.play.running import serve
from qbumpers.play.server import make_application
from qbumpers.play.setup import Setup
from qbumpers.study.design.freezing import check_frozen, content_of, hash_of
from qbumpers.study.design.models import Study
from qbumpers.study.flow.researcher import researcher_routes
from qbumpers.study.flow.server import PAGE, StudyHost
from qbumpers.study.flow.tables import open_study


def records_of(folder: str | Path, mode: str) -> Path:
    """The records file of a study in its folder.

    Args:
        folder: of the study.
        mode: "pilot", "live" or "simulated".
    """
    return Path(folder) / f"{mode}.sqlite"


def opened(
    file: Path, study: Study, setups: Mapping[str, Setup], folder: Path, mode: str
) -> sql.Engine:
    """The records of a study, to be added to.

    Args:
        file: path of the study file.
        study: in it.
        setups: what is played in each block, by its id.
        folder: in which the records are.
        mode: "pilot", "live" or "simulated".

    Raises:
        RequestError: if it is to be live and is not as it was frozen, or the records are of
            something else.
    """
    live = mode == "live"
    digest = check_frozen(file, study, setups) if live else hash_of(content_of(study, setups))
    return open_study(records_of(folder, mode), study.name, mode, digest)


def serve_study(
    host: StudyHost,
    setups: Mapping[str, Setup],
    address: Address,
    *,
    browser: bool,
    announce: Callable[[str], None],
) -> None:
    """Serve a study until Ctrl-C.

    Args:
        host: serves the study.
        setups: what is played in each block, by its id.
        address: where to listen, checked.
        browser: whether to open the page in a browser.
        announce: is called with the page's URL before anyone is served; the researcher's page is
            `researcher` under it.

    Raises:
        RequestError: if the address is in use.
    """

    def make(hosts: list[str]) -> Any:
        routes = [*host.routes(), *researcher_routes(host, setups)]
        return make_application(host, hosts, address.scheme, PAGE, routes)

    serve(make, address, browser=browser, announce=announce)


def back_up(records: Path, copy: Path) -> None:
    """Copy records while they may be written to, whole and as of one moment.

    Args:
        records: the file.
        copy: path of the copy, which is not there yet.

    Raises:
        RequestError: if there are no records, or something is at the copy's path.
    """
    _check_free(records, copy, "backup")
    with (
        contextlib.closing(sqlite3.connect(records)) as source,
        contextlib.closing(sqlite3.connect(copy)) as target,
    ):
        source.backup(target)


def restore(copy: Path, records: Path) -> None:
    """Put a backup into the place of records that are lost.

    Args:
        copy: the backup.
        records: the file that it is to become, which is not there any more.

    Raises:
        RequestError: if the backup is damaged or none, or the records are still there.
    """
    _check_free(copy, records, "restore")
    try:
        with contextlib.closing(sqlite3.connect(copy)) as source:
            [(verdict,)] = source.execute("PRAGMA integrity_check").fetchall()[:1]
    except sqlite3.DatabaseError as error:
        raise RequestError(f"backup {copy}: {error}") from error
    if verdict != "ok":
        raise RequestError(f"backup {copy}: damaged: {verdict}")
    records.parent.mkdir(parents=True, exist_ok=True)
    back_up(copy, records)


def _check_free(source: Path, target: Path, what: str) -> None:
    if not source.is_file():
        raise RequestError(f"{what}: {source}: there is no such file")
    if target.exists():
        raise RequestError(f"{what}: {target}: something is there already; move it away first")
    target.parent.mkdir(parents=True, exist_ok=True)
