"""A simulated learner at the real WebSocket: what the page does in a browser, without one."""

import asyncio
import json
import secrets
import time
from collections.abc import Mapping
from typing import Any, NamedTuple

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Origin

from qbumpers.errors import RequestError
from qbumpers.study.bots.person import Person


class Taken(NamedTuple):
    """How somebody took part.

    Attributes:
        outcome: of the last page; "dropped out" for who left.
        token: by which they could come back.
        reloads: of the page.
        code: on the last page; empty if there was none.
    """

    outcome: str
    token: str
    reloads: int
    code: str


class _ReloadError(Exception):
    """The page is loaded again."""


class BotPage:
    """The page of a simulated learner.

    Args:
        address: of the server, "host:port".
        person: who takes part.
        arrival: what the link says of them.
    """

    def __init__(self, address: str, person: Person, arrival: Mapping[str, str]) -> None:
        self._address, self._person, self._arrival = address, person, dict(arrival)
        self._token = ""
        self._page: dict[str, Any] = {}
        self._rate = 0.0
        self._sequence = 0
        self._begun = -1
        self._began = time.monotonic()

    async def take_part(self) -> Taken:
        """Go through the study until it ends, or they leave."""
        reloads = 0
        while True:
            try:
                async with connect(
                    f"ws://{self._address}/socket",
                    origin=Origin(f"http://{self._address}"),
                    compression=None,
                    ping_interval=None,
                ) as socket:
                    return await self._visit(socket, reloads)
            except _ReloadError:
                reloads += 1
            except ConnectionClosed as error:
                raise RequestError(f"participant: the server closed the page: {error}") from error

    async def _visit(self, socket: ClientConnection, reloads: int) -> Taken:
        """Everything from one load of the page to the next."""
        await self._send(
            socket, type="hello", token=self._token, page=secrets.token_hex(4),
            arrival=self._arrival, width=1280, height=800, refresh=60,
        )  # fmt: skip
        self._begun = -1
        async for text in socket:
            message = json.loads(text)
            if await self._is_last(socket, message):
                outcome = "dropped out" if self._page["kind"] != "end" else self._page["id"]
                return Taken(outcome, self._token, reloads, self._page.get("code", ""))
            if self._person.chance.random() < self._person.habits.reloads:
                raise _ReloadError
        raise RequestError(f"participant: the server closed the page: {socket.close_reason}")

    async def _is_last(self, socket: ClientConnection, message: dict[str, Any]) -> bool:
        """Do what a person does at a message; whether they are done."""
        person, kind = self._person, message["type"]
        if person.habits.pause and kind == "page":
            await asyncio.sleep(person.habits.pause)
        if kind == "welcome":
            self._token = message["token"]
        elif kind == "page":
            self._page, self._begun = message["page"], -1
            leaves = self._page["number"] == person.habits.drops_at
            if self._page["kind"] == "end" or leaves:
                return True
            await self._turn_page(socket)
        elif kind == "board":
            self._rate = message["task"]["rate"]
        elif kind == "state":
            await self._play(socket, message)
        elif kind == "paused":
            await self._send(socket, type="continue")
        elif kind == "ask":
            await self._send(
                socket, type="attribute", number=message["number"], answer=person.attribution(),
                shown=self._now(), at=self._now(),
            )  # fmt: skip
        elif kind == "problem":
            raise RequestError(f"participant: {message['message']}")
        return False

    async def _turn_page(self, socket: ClientConnection) -> None:
        page = self._page
        if page["kind"] == "sitting":
            raise _ReloadError  # they come back
        if page["kind"] == "block" and not page["over"]:
            await self._begin(socket, page["played"])
        else:
            await self._answer(socket)

    async def _answer(self, socket: ClientConnection) -> None:
        content = self._person.answer(self._page)
        shown, number = self._now(), self._page["number"]
        await self._send(
            socket, type="answer", number=number, content=content, shown=shown, at=self._now()
        )

    async def _begin(self, socket: ClientConnection, episode: int) -> None:
        """Begin an episode, once; one that goes on already is not begun again by the server."""
        if self._begun != episode:
            self._begun = episode
            await self._send(socket, type="begin", episode=episode, assistant="none")

    async def _play(self, socket: ClientConnection, state: Mapping[str, Any]) -> None:
        action = self._person.play(self._page["id"], state)
        if action is None:
            if state["over"]:
                await self._answer(socket)
            else:
                await self._begin(socket, state["episode"]["episode"] + 1)
            return
        pressed = {"device": "keyboard", "pressed": self._now(), "shown": self._now()}
        if self._rate:
            self._sequence += 1
            await self._send(socket, type="hold", sequence=self._sequence, action=action, **pressed)
        else:
            await self._send(socket, type="act", number=state["number"], action=action, **pressed)

    async def _send(self, socket: ClientConnection, **message: Any) -> None:
        await socket.send(json.dumps(message))

    def _now(self) -> float:
        return 1000 * (time.monotonic() - self._began)
