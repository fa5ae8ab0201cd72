"""What protects a participant's page: which pages may speak to the server, and headers."""

from collections.abc import Collection
from typing import Any

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

POLICY = "; ".join([
    "default-src 'none'",
    "script-src 'self'",
    "style-src 'self'",
    "img-src 'self'",
    "connect-src 'self'",
    "base-uri 'none'",
    "form-action 'none'",
    "frame-ancestors 'none'",
])  # fmt: skip
"""Nothing in line, nothing from elsewhere, and no page around it."""

HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=(), gamepad=(self)",
    # Alone in its process, a page has a finer clock.
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Embedder-Policy": "require-corp",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-cache",
}
"""Of every answer."""


class Guard:
    """An application behind a check of who asks, and with headers on what it answers.

    A page of another site cannot open a socket, since browsers say which site a page is of; nor can
    one whose name was made to lead here, since names are checked.

    Args:
        application: to be guarded.
        hosts: names with ports by which it may be addressed.
        scheme: "http" or "https", of the pages.
    """

    def __init__(self, application: ASGIApp, hosts: Collection[str], scheme: str = "http") -> None:
        self._application, self._hosts = application, frozenset(hosts)
        self._scheme = scheme

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """See ASGI."""
        if scope["type"] == "lifespan":
            await self._application(scope, receive, send)
            return
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        if scope["type"] == "websocket":
            if host in self._hosts and headers.get("origin") == f"{self._scheme}://{host}":
                await self._application(scope, receive, send)
            else:
                await send({"type": "websocket.close", "code": 1008})  # answers 403
            return

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HEADERS)
            await send(message)

        known = host in self._hosts
        application: Any = self._application if known else _wrong_host(host)
        await application(scope, receive, send_guarded)


def _wrong_host(host: str) -> PlainTextResponse:
    return PlainTextResponse(f"host {host[:100]!r}: this server has another name", 421)
