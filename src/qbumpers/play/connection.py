"""One page at the other end of a socket."""

import asyncio
import time
from collections.abc import Callable
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from qbumpers.errors import RequestError
from qbumpers.play.messages import decoded, encoded

TAKEN_OVER, TOO_MUCH, WRONG, UNKNOWN_SESSION, NOT_KEPT, FAILED = range(4001, 4007)
"""Codes with which a socket is closed: another page took over; too many or too long messages; no
proper greeting; a session that cannot be gone on with; what happened could not be written; the task
or the assistant failed."""

AGAIN = 1013
"""Of WebSockets: the page may come back in a moment."""

MESSAGES_PER_SECOND = 100.0
"""That a page may send for long; keys repeat about 30 times per second."""

_AT_ONCE = 200.0
_PATIENCE = 5.0  # seconds that a message may take to leave


class GoneError(Exception):
    """The page is no longer there."""


class Connection:
    """A page, and how much it has sent lately.

    Args:
        socket: accepted.
        decode: reads a message, see `qbumpers.play.messages.decoded_by`.
        per_second: messages that the page may send for long.
    """

    def __init__(
        self,
        socket: WebSocket,
        decode: Callable[[str | bytes], Any] = decoded,
        per_second: float = MESSAGES_PER_SECOND,
    ) -> None:
        self._socket, self._decode, self._per_second = socket, decode, per_second
        self._allowance, self._counted = _AT_ONCE, time.monotonic()

    async def send(self, kind: str, **fields: Any) -> None:
        """Send a message, see `qbumpers.play.messages.encoded`.

        Raises:
            GoneError: if the page has gone or takes nothing.
        """
        try:
            async with asyncio.timeout(_PATIENCE):
                await self._socket.send_text(encoded(kind, **fields))
        except (WebSocketDisconnect, RuntimeError, OSError, TimeoutError) as error:
            raise GoneError from error

    async def receive(self) -> Any:
        """The next message.

        Raises:
            GoneError: if the page has gone.
            RequestError: if the message is wrong; the next one may be right.
        """
        found = await self._socket.receive()
        if found["type"] != "websocket.receive":
            raise GoneError
        self._count()
        text = found.get("text")
        if text is None:
            raise RequestError("message: bytes; a JSON text is needed")
        return self._decode(text)

    async def close(self, code: int, reason: str) -> None:
        """Say why, and close; a page that has gone is no matter."""
        if self._socket.client_state is not WebSocketState.CONNECTED:
            return
        try:
            await self.send("closing", code=code, reason=reason)
            async with asyncio.timeout(_PATIENCE):
                await self._socket.close(code)
        except (GoneError, RuntimeError, TimeoutError):
            return

    def _count(self) -> None:
        """TooMuchError if messages come faster than they may."""
        now = time.monotonic()
        more = (now - self._counted) * self._per_second
        self._allowance = min(_AT_ONCE, self._allowance + more) - 1
        self._counted = now
        if self._allowance < 0:
            raise TooMuchError(
                f"more than {self._per_second:.0f} messages per second; the page may send fewer"
            )


class TooMuchError(RequestError):
    """A page sends more than it may."""
