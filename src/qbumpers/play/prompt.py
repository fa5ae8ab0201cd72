"""Connections that must come to the point, so that idle ones cannot keep others out."""

import asyncio
import contextlib
import logging
import sys
import time
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

REQUEST_WITHIN = 5.0
"""Seconds within which a connection must have asked for something, TLS included."""

LASTS = 60.0
"""Seconds that a connection may last which is no socket; browsers open another one."""

MOST_IDLE = 100
"""Connections at once that are no sockets; if one more comes, the one that has waited longest goes,
first of all one that has not asked for anything."""

_CLOSED_WITHIN = 2.0  # seconds that a page may take to agree to be closed
_FILES = 16384  # that may be open at once, if the system allows as many


class PromptHTTP(H11Protocol):
    """HTTP as uvicorn speaks it, to whoever asks soon."""

    def connection_made(self, transport: Any) -> None:
        """See asyncio."""
        super().connection_made(transport)
        self._began = time.monotonic()  # loops keep a time of their own, not that fine
        self._timers = [
            self.loop.call_later(REQUEST_WITHIN, self._end_if_idle),
            self.loop.call_later(LASTS, transport.abort),
        ]
        others = [each for each in self.connections if isinstance(each, PromptHTTP)]
        staying = [each for each in others if not each.transport.is_closing()]
        if len(staying) > MOST_IDLE:
            min(staying, key=PromptHTTP._worth).transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """See asyncio."""
        self._stop_timers()
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: Any) -> None:
        """See uvicorn."""
        self._stop_timers()
        super().handle_websocket_upgrade(event)

    def send_400_response(self, msg: str) -> None:
        """See uvicorn."""
        if self._has_asked():
            self.cycle.disconnected = True  # or its answer, which is on the way, would fail
        super().send_400_response(msg)

    def _worth(self) -> tuple[bool, float]:
        return self._has_asked(), self._began

    def _has_asked(self) -> bool:
        return self.cycle is not None  # pyright: ignore[reportUnnecessaryComparison]

    def _end_if_idle(self) -> None:
        if not self._has_asked():
            self.transport.abort()

    def _stop_timers(self) -> None:
        for timer in self._timers:
            timer.cancel()


class PromptSocket(WebSocketsSansIOProtocol):
    """A socket as uvicorn has it, that does not wait for pages that take nothing any more."""

    def keepalive_timeout(self) -> None:
        """See uvicorn."""
        super().keepalive_timeout()
        self._end_soon()

    def on_task_complete(self, task: asyncio.Task[None]) -> None:
        """See uvicorn."""
        super().on_task_complete(task)
        self._end_soon()

    def _end_soon(self) -> None:
        self.loop.call_later(_CLOSED_WITHIN, self.transport.abort)


if sys.platform == "win32":
    _Loop = asyncio.SelectorEventLoop
else:
    from uvloop import Loop as _Loop


class PromptLoop(_Loop):
    """A loop whose TLS handshakes must be done as soon as a request must be there."""

    async def create_server(self, *arguments: Any, **named: Any) -> Any:
        """See asyncio."""
        if named.get("ssl") is not None:
            named["ssl_handshake_timeout"] = REQUEST_WITHIN
        return await super().create_server(*arguments, **named)


def allow_connections() -> None:
    """Let this process have as many connections as its limits above allow, several times over."""
    if sys.platform == "win32":
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    allowed = _FILES if hard == resource.RLIM_INFINITY else min(_FILES, hard)
    if soft != resource.RLIM_INFINITY and soft < allowed:
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (allowed, hard))


def plain_log() -> None:
    """Let what uvicorn says of wrong bytes be a line, not a traceback."""
    logger = logging.getLogger("uvicorn.error")
    if _without_traceback not in logger.filters:
        logger.addFilter(_without_traceback)


def _without_traceback(record: logging.LogRecord) -> bool:
    if record.exc_info and isinstance(record.exc_info[1], UnicodeDecodeError):
        record.exc_info = None
    return True
