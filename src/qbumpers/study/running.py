"""Running the server on this machine."""

import contextlib
import socket
import threading
import webbrowser
from collections.abc import Callable
from pathlib import Path

import uvicorn

from qbumpers.errors import RequestError
from qbumpers.study.game import Choice, Game
from qbumpers.study.messages import MOST_BYTES
from qbumpers.study.server import Sessions, make_application
from qbumpers.study.setup import Setup
from qbumpers.study.tables import open_records


def play(
    setup: Setup,
    choice: Choice,
    records: str | Path,
    *,
    port: int,
    browser: bool,
    announce: Callable[[str], None],
) -> None:
    """Serve a task on this machine until Ctrl-C.

    Args:
        setup: what is played.
        choice: who assists unless the participant chooses.
        records: where they are, as `open_records` takes them.
        port: of 127.0.0.1; any that is free if 0.
        browser: whether to open the page in a browser.
        announce: is called with the page's URL before anyone is served.

    Raises:
        RequestError: if the assistant does not suit the task, the port is in use, or the records
            cannot be written.
    """
    Game(setup, 0).begin(choice)
    with contextlib.closing(listening_at(port)) as listening:
        address = f"127.0.0.1:{listening.getsockname()[1]}"
        url = f"http://{address}/"
        sessions = Sessions(setup, choice, open_records(records))
        hosts = [address, address.replace("127.0.0.1", "localhost")]
        announce(url)
        if browser:
            threading.Thread(target=webbrowser.open, args=[url], daemon=True).start()
        uvicorn.Server(configuration(make_application(sessions, hosts))).run([listening])


def configuration(application: object) -> uvicorn.Config:
    """How uvicorn serves an application: one process, small messages, no compression."""
    return uvicorn.Config(
        application,  # pyright: ignore[reportArgumentType]
        ws="websockets-sansio",
        ws_max_size=2 * MOST_BYTES,
        ws_ping_interval=5,
        ws_ping_timeout=10,
        ws_per_message_deflate=False,  # messages are small, and time is short
        timeout_keep_alive=5,
        timeout_graceful_shutdown=2,
        limit_concurrency=500,
        server_header=False,
        access_log=False,
        log_level="warning",
    )


def listening_at(port: int) -> socket.socket:
    """A socket of 127.0.0.1 that listens already.

    Args:
        port: any that is free if 0.

    Raises:
        RequestError: if it is in use, or there is no such port.
    """
    listening = socket.socket()
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind(("127.0.0.1", port))
    except (OSError, OverflowError) as error:
        listening.close()
        raise RequestError(
            f"port = {port}: {getattr(error, 'strerror', None) or error}; give a free one by "
            "--port, or 0 for any"
        ) from error
    listening.listen(128)
    return listening
