"""The server: its page, its socket, and the sessions that are being played."""

import asyncio
import contextlib
import logging
import secrets
import time
from abc import ABC, abstractmethod
from collections.abc import AsyncGenerator, Collection, Generator, Sequence
from pathlib import Path
from typing import Any

import sqlalchemy as sql
from itsdangerous import BadSignature, URLSafeSerializer
from sqlalchemy.exc import OperationalError
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse
from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket

import qbumpers
from qbumpers.errors import RequestError
from qbumpers.play.connection import (
    AGAIN,
    TOO_MUCH,
    UNKNOWN_SESSION,
    WRONG,
    Connection,
    GoneError,
    TooMuchError,
)
from qbumpers.play.game import Choice, Game, resumed
from qbumpers.play.guarding import Guard
from qbumpers.play.messages import Hello
from qbumpers.play.offers import offers
from qbumpers.play.player import Player
from qbumpers.play.setup import Setup
from qbumpers.play.tables import (
    SESSIONS,
    TENURES,
    Tenure,
    drives,
    read_session,
    secret_of,
    take_session,
)
from qbumpers.play.views import task_view
from qbumpers.play.writing import UnreachableError, Writer

STATIC = Path(__file__).with_name("static")
"""The folder of the page."""

MOST_CONNECTIONS = 200
"""Pages at once."""

MOST_SILENT = 100
"""Sockets at once that have not greeted; if one more comes, the one that waited longest goes."""

GREETING = 5.0
"""Seconds within which a page must greet."""

_LOGGER = logging.getLogger("qbumpers.play")


class UnknownSessionError(RequestError):
    """A token of no session that can go on here."""


class Entrance(ABC):
    """Whose pages a server serves: those of play, or of a study. It counts its pages."""

    def __init__(self) -> None:
        self._open = 0
        self._silent: list[asyncio.Timeout] = []

    def connection(self, socket: WebSocket) -> Any:
        """A page at the other end of a socket."""
        return Connection(socket)

    async def greeted(self, connection: Connection) -> Hello:
        """What a page says first.

        Raises:
            RequestError: if it is no greeting.
            TimeoutError: if it does not come soon, or others wait that came later.
            GoneError: if the page has gone.
        """
        async with asyncio.timeout(GREETING) as limit:
            self._silent.append(limit)
            if len(self._silent) > MOST_SILENT:
                self._silent.pop(0).reschedule(0.0)
            try:
                hello = await connection.receive()
            finally:
                with contextlib.suppress(ValueError):  # if it had to go, it is out already
                    self._silent.remove(limit)
        if not isinstance(hello, Hello):
            raise RequestError("the first message of a page is hello")
        return hello

    @contextlib.contextmanager
    def page(self) -> Generator[None, None, None]:
        """One more page.

        Raises:
            TooMuchError: if there are too many.
        """
        if self._open >= MOST_CONNECTIONS:
            raise TooMuchError("too many pages are open")
        self._open += 1
        try:
            yield
        finally:
            self._open -= 1

    @abstractmethod
    async def join(self, connection: Any, hello: Any, /) -> Any:
        """Whose page it is that has greeted; something that handles messages."""

    @abstractmethod
    async def welcome(self, player: Any, connection: Any, hello: Any, /) -> None:
        """Show a page where they are."""

    @abstractmethod
    async def leave(self, player: Any, connection: Any, /) -> None:
        """A page has gone."""

    @abstractmethod
    def close(self) -> None:
        """Write what is waiting."""


class Sessions(Entrance):
    """The sessions that are being played, and those of the record.

    Args:
        setup: what is played.
        choice: who assists unless the participant chooses.
        engine: as `open_records` gave it.
        second: how long a second of the countdown takes.
    """

    def __init__(
        self, setup: Setup, choice: Choice, engine: sql.Engine, second: float = 1.0
    ) -> None:
        super().__init__()
        self._setup, self._engine, self._second = setup, engine, second
        self._writer = Writer(engine)
        self._signer = URLSafeSerializer(secret_of(engine), salt="session")
        self._players: dict[str, Player] = {}
        self._finding = asyncio.Lock()
        self._facts: dict[str, Any] = {
            "task": task_view(setup),
            "offers": offers(setup),
            "choice": {
                "assistant": choice.name,
                "options": dict(choice.options),
                "assisted": choice.assisted,
            },
        }

    async def join(self, connection: Connection, hello: Hello) -> Player:
        """The session of a page that has greeted; it is that page's from now on.

        Raises:
            UnknownSessionError: if there is no such session, or it cannot go on.
        """
        async with self._finding:
            player = await self._player(hello.token)
            await player.take_over(connection)
            return player

    async def welcome(self, player: Player, connection: Connection, hello: Hello) -> None:
        """Show a page where its session is."""
        token = self._signer.dumps(player.tenure.session)
        await player.welcome(connection, hello, {**self._facts, "token": token})

    async def leave(self, player: Player, connection: Connection) -> None:
        """A page has gone; a session without one is forgotten, since the record has it all."""
        session, gone = player.tenure.session, False
        with contextlib.suppress(GoneError):
            gone = await player.leave(connection)
        if (gone or player.lost) and self._players.get(session) is player:
            del self._players[session]

    def close(self) -> None:
        """Write what is waiting."""
        self._writer.close()

    async def _player(self, token: str) -> Player:
        if not token:
            return await self._new()
        try:
            session = str(self._signer.loads(token))
        except BadSignature:
            raise UnknownSessionError("this server knows no such session") from None
        playing = self._players.get(session)
        if playing is not None and await self._goes_on(playing):
            return playing
        return self._add(*await asyncio.to_thread(self._taken, session))

    async def _goes_on(self, player: Player) -> bool:
        """Whether a session is as its record says: not if another server took it."""
        if player.lost:
            return False
        return await asyncio.to_thread(drives, self._engine, player.tenure)

    async def _new(self) -> Player:
        session, seed = secrets.token_urlsafe(16), secrets.randbits(63)
        row = {
            "session": session,
            "began": time.time(),
            "seed": str(seed),
            "setup": self._setup.described(),
            "version": qbumpers.__version__,
        }
        tenure = Tenure(session, 0)
        rows = [(SESSIONS, row), (TENURES, tenure.row())]
        await asyncio.wrap_future(self._writer.add(rows))
        return self._add(tenure, Game(self._setup, seed))

    def _taken(self, session: str) -> tuple[Tenure, Game]:
        """A session of the record, taken from whoever drove it."""
        tenure = take_session(self._engine, session)
        recorded = read_session(self._engine, session)
        if tenure is None or recorded is None:
            raise UnknownSessionError("this server knows no such session")
        difference = self._setup.difference(recorded.setup)
        if difference:
            raise UnknownSessionError(f"the session before cannot go on: {difference}")
        try:
            return tenure, resumed(self._setup, recorded.seed, recorded.played)
        except RequestError as error:
            raise UnknownSessionError(f"the session before cannot go on: {error}") from error

    def _add(self, tenure: Tenure, game: Game) -> Player:
        player = Player(tenure, game, self._writer, self._second)
        self._players[tenure.session] = player
        return player


async def _converse(sessions: Entrance, connection: Connection) -> None:
    """Everything that a page says, until it goes."""
    try:
        hello = await sessions.greeted(connection)
        with sessions.page():
            await _play(sessions, connection, hello)
    except GoneError:
        pass
    except TimeoutError:
        await connection.close(WRONG, f"no hello within {GREETING:.0f} seconds")
    except UnknownSessionError as error:
        await connection.close(UNKNOWN_SESSION, str(error))
    except TooMuchError as error:
        await connection.close(TOO_MUCH, str(error))
    except RequestError as error:
        await connection.close(WRONG, str(error))
    except (UnreachableError, OperationalError):
        await connection.close(AGAIN, "the records cannot be reached just now")
    except Exception:
        _LOGGER.exception("a session failed")
        await connection.close(1011, "the server failed; what happened before is kept")


async def _play(sessions: Entrance, connection: Connection, hello: Hello) -> None:
    """What a page says once it has greeted."""
    player = await sessions.join(connection, hello)
    try:
        await sessions.welcome(player, connection, hello)
        while True:
            try:
                await player.handle(await connection.receive())
            except TooMuchError:
                raise
            except RequestError as error:
                await connection.send("problem", message=str(error))
    finally:
        await sessions.leave(player, connection)


def make_application(
    sessions: Entrance,
    hosts: Collection[str],
    scheme: str = "http",
    file: str = "index.html",
    routes: Sequence[BaseRoute] = (),
) -> Any:
    """The server as an ASGI application.

    Args:
        sessions: that are played on it; closed when it ends.
        hosts: names with ports by which pages may address it.
        scheme: "http" or "https", of the pages.
        file: name of its page in `STATIC`.
        routes: further ones.
    """

    async def page(_: Request) -> FileResponse:
        return FileResponse(STATIC / file)

    async def socket(websocket: WebSocket) -> None:
        await websocket.accept()
        await _converse(sessions, sessions.connection(websocket))

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncGenerator[None, None]:
        yield
        await asyncio.to_thread(sessions.close)

    everywhere = [
        Route("/", page),
        WebSocketRoute("/socket", socket),
        Mount("/static", StaticFiles(directory=STATIC)),
    ]
    application = Starlette(routes=[*everywhere, *routes], lifespan=lifespan)
    return Guard(application, hosts, scheme)
