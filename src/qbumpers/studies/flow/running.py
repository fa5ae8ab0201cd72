"""Serving a study on this machine, and its records in its folder."""

import contextlib
import sqlite3
import threading
import webbrowser
from collections.abc import Callable, Mapping
from pathlib import Path

import sqlalchemy as sql
import uvicorn

from qbumpers.errors import RequestError
from qbumpers.studies.design.freezing import check_frozen, content_of, hash_of
from qbumpers.studies.design.models import Study
from qbumpers.studies.flow.researcher import researcher_routes
from qbumpers.studies.flow.server import PAGE, StudyHost
from qbumpers.studies.flow.tables import open_study
from qbumpers.study.running import configuration, listening_at
from qbumpers.study.server import make_application
from qbumpers.study.setup import Setup


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
        file: of the study.
        study: in it.
        setups: what is played in each block, by its id.
        folder: of the records.
        mode: "pilot", "live" or "simulated".

    Raises:
        RequestError: if it is to be live and is not as it was frozen, or the records are of
            something else.
    """
    live = mode == "live"
    digest = check_frozen(file, study, setups) if live else hash_of(content_of(study, setups))
    return open_study(records_of(folder, mode), study.name, mode, digest)


def serve(
    host: StudyHost,
    setups: Mapping[str, Setup],
    *,
    port: int,
    browser: bool,
    announce: Callable[[str, str], None],
) -> None:
    """Serve a study on this machine until Ctrl-C.

    Args:
        host: of the study.
        setups: what is played in each block, by its id.
        port: of 127.0.0.1; any that is free if 0.
        browser: whether to open the page in a browser.
        announce: is called with the page's URL, and the researcher's, before anyone is served.

    Raises:
        RequestError: if the port is in use.
    """
    with contextlib.closing(listening_at(port)) as listening:
        address = f"127.0.0.1:{listening.getsockname()[1]}"
        url = f"http://{address}/"
        hosts = [address, address.replace("127.0.0.1", "localhost")]
        announce(url, f"{url}researcher")
        if browser:
            threading.Thread(target=webbrowser.open, args=[url], daemon=True).start()
        routes = [*host.routes(), *researcher_routes(host, setups)]
        application = make_application(host, hosts, PAGE, routes)
        uvicorn.Server(configuration(application)).run([listening])


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
