"""Running the server."""

import asyncio
import contextlib
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import Any

import uvicorn

from qbumpers.play.addresses import Address, listening_at
from qbumpers.play.game import Choice, Game
from qbumpers.play.messages import MOST_BYTES
from qbumpers.play.prompt import PromptHTTP, PromptLoop, PromptSocket, allow_connections, plain_log
from qbumpers.play.server import Sessions, make_application
from qbumpers.play.setup import Setup
from qbumpers.play.showing import Showing, make_showing, new_secret
from qbumpers.play.tables import open_records

_SWITCHES = 0.001
"""Seconds after which a thread that waits gets its turn: steps wait for the thread of the records
and it for them, and Python's 5 ms would be a quarter of a step at 50 Hz."""


def play(
    setup: Setup,
    choice: Choice,
    records: str | Path,
    *,
    address: Address,
    browser: bool,
    announce: Callable[[str], None],
) -> None:
    """Serve a task until Ctrl-C.

    Args:
        setup: what is played.
        choice: who assists unless the participant chooses.
        records: where they are, as `open_records` takes them.
        address: where to listen, see `Address.check`.
        browser: whether to open the page in a browser.
        announce: is called with the page's URL before anyone is served.

    Raises:
        RequestError: if the address is refused or in use, the assistant does not suit the task, or
            the records cannot be written.
    """
    address.check()
    Game(setup, 0).begin(choice)

    def make(hosts: list[str]) -> Any:
        sessions = Sessions(setup, choice, open_records(records))
        return make_application(sessions, hosts, address.scheme)

    serve(make, address, browser=browser, announce=announce)


def show(showing: Showing, *, port: int, browser: bool, announce: Callable[[str], None]) -> None:
    """Show recorded sessions on this machine until Ctrl-C.

    Args:
        showing: the sessions.
        port: of this machine; any that is free if 0.
        browser: whether to open the page in a browser.
        announce: is called with the page's URL before it is served.

    Raises:
        RequestError: if the port is in use.
    """
    secret = new_secret()

    def make(hosts: list[str]) -> Any:
        return make_showing(showing, hosts, secret)

    serve(make, Address(port=port), browser=browser, announce=announce, path=f"{secret}/")


def serve(
    make: Callable[[list[str]], Any],
    address: Address,
    *,
    browser: bool,
    announce: Callable[[str], None],
    path: str = "",
) -> None:
    """Serve an application until Ctrl-C.

    Args:
        make: is called with the names by which pages may address it once it listens there.
        address: where to listen, checked.
        browser: whether to open the page in a browser.
        announce: is called with the page's URL before anyone is served.
        path: where the page is, below the host.

    Raises:
        RequestError: if the address is in use, or what `make` raises.
    """
    with contextlib.closing(listening_at(address.port, address.host)) as listening:
        hosts = address.hosts(listening.getsockname()[1])
        application = make(hosts)
        url = f"{address.scheme}://{hosts[0]}/{path}"
        announce(url)
        if browser:
            threading.Thread(target=webbrowser.open, args=[url], daemon=True).start()
        serve_until_stopped(application, listening, address)


def serve_until_stopped(
    application: object, listening: socket.socket, address: Address | None = None
) -> None:
    """Serve an application in this process, which does nothing else.

    Args:
        application: an ASGI application.
        listening: socket that listens already.
        address: with its certificate, if it has one.
    """
    sys.setswitchinterval(_SWITCHES)
    allow_connections()
    server = uvicorn.Server(configuration(application, address))
    with asyncio.Runner(loop_factory=PromptLoop) as runner:
        runner.run(server.serve([listening]))


def configuration(application: object, address: Address | None = None) -> uvicorn.Config:
    """How uvicorn serves an application: one process, small messages, no compression.

    Args:
        application: to be served.
        address: with its certificate, if it has one.
    """
    address = address or Address()
    config = uvicorn.Config(
        application,  # pyright: ignore[reportArgumentType]
        http=PromptHTTP,
        ws=PromptSocket,
        ws_max_size=2 * MOST_BYTES,
        ws_ping_interval=5,
        ws_ping_timeout=10,
        ws_per_message_deflate=False,  # messages are small, and time is short
        timeout_keep_alive=5,
        backlog=128,  # also how many are taken at once before others have their turn
        timeout_graceful_shutdown=2,
        proxy_headers=False,  # nothing hangs on what anyone can write into a header
        server_header=False,
        access_log=False,
        log_level="warning",
        ssl_certfile=address.certificate,
        ssl_keyfile=address.key,
    )
    plain_log()
    return config
