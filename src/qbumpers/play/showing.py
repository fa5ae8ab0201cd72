"""Recorded sessions on the page: read from the records, never written."""

import json
import secrets
from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache
from typing import Any

import msgspec
import sqlalchemy as sql
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from qbumpers.errors import RequestError
from qbumpers.play.frames import episodes_of, frames_of
from qbumpers.play.guarding import Guard
from qbumpers.play.replaying import Replayed
from qbumpers.play.server import STATIC
from qbumpers.play.setup import Setup, setup_of
from qbumpers.play.tables import Moment, Recorded, read_moments, read_session
from qbumpers.play.views import task_view


class Showing:
    """Recorded sessions, as a page asks for them.

    Args:
        engine: as `open_records` gave it.
        replayed: the sessions that are shown, held to rule and task already.
    """

    def __init__(self, engine: sql.Engine, replayed: Sequence[Replayed]) -> None:
        self._engine, self._replayed = engine, replayed
        self._setup = lru_cache(4)(_setup_of)
        self._session = lru_cache(4)(self._read)

    def sessions(self) -> list[dict[str, Any]]:
        """What there is to be shown, JSON-like: fields of `Replayed`."""
        return [each._asdict() for each in self._replayed]

    def session(self, number: int) -> dict[str, Any]:
        """How a session's task is shown, and its episodes, JSON-like.

        Args:
            number: of the session among those shown.

        Raises:
            RequestError: if the task cannot be made any more.
        """
        recorded, setup, _ = self._session(number)
        return {"task": task_view(setup), "episodes": episodes_of(recorded)}

    def episode(self, number: int, episode: int) -> list[dict[str, Any]]:
        """The frames of an episode, see `frames_of`.

        Args:
            number: of the session among those shown.
            episode: of the session, from 0.

        Raises:
            RequestError: as `session`.
            IndexError: if there is no such episode.
        """
        recorded, setup, moments = self._session(number)
        return frames_of(setup, recorded, episode, moments)

    def _read(self, number: int) -> tuple[Recorded, Setup, list[Moment]]:
        session = self._replayed[number].session
        recorded = read_session(self._engine, session)
        if recorded is None:
            raise IndexError(session)
        setup = self._setup(json.dumps(recorded.setup))
        return recorded, setup, read_moments(self._engine, session)


def _setup_of(description: str) -> Setup:
    found: Mapping[str, Any] = json.loads(description)
    return setup_of(found)


def make_showing(showing: Showing, hosts: Collection[str], secret: str) -> Any:
    """The server of a replay as an ASGI application.

    Args:
        showing: what is shown.
        hosts: names with ports by which pages may address it.
        secret: that the path of everything recorded begins with: others on this machine, who can
            open its ports, do not know it.
    """

    def page(_: Request) -> FileResponse:
        return FileResponse(STATIC / "replay.html")

    def sessions(_: Request) -> Response:
        return _answer(showing.sessions())

    def session(request: Request) -> Response:
        return _answer(showing.session(request.path_params["number"]))

    def episode(request: Request) -> Response:
        return _answer(showing.episode(**request.path_params))

    def absent(_: Request, __: Exception) -> Response:
        return PlainTextResponse("there is no such session or episode", 404)

    def refused(_: Request, error: Exception) -> Response:
        return PlainTextResponse(str(error), 409)

    recorded = [
        Route("/", page),
        Route("/sessions", sessions),
        Route("/sessions/{number:int}", session),
        Route("/sessions/{number:int}/{episode:int}", episode),
    ]
    routes = [
        Mount(f"/{secret}", routes=recorded),
        Mount("/static", StaticFiles(directory=STATIC)),
    ]
    handlers = {IndexError: absent, RequestError: refused}
    return Guard(Starlette(routes=routes, exception_handlers=handlers), hosts)


def new_secret() -> str:
    """A path that cannot be guessed."""
    return secrets.token_urlsafe(16)


def _answer(content: Any) -> Response:
    return Response(msgspec.json.encode(content), media_type="application/json")
