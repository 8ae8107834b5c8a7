"""Who may ask: only pages that were opened with the token, from the address that was given, with small requests."""

from __future__ import annotations

import hmac
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from starlette.datastructures import MutableHeaders
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse, RedirectResponse

if TYPE_CHECKING:
    from collections.abc import Sequence

    from starlette.types import ASGIApp, Message, Receive, Scope, Send


MOST_UPLOADED = 64 << 20
"""Bytes that a request may have: maps of heights and tables of tests are smaller."""
_LOCAL = ("127.0.0.1", "localhost", "[::1]")
_HEADERS = {
    "content-security-policy": (
        "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; frame-ancestors 'self'; "
        "script-src 'self' 'unsafe-inline' 'unsafe-eval'; connect-src 'self'; font-src 'self' data:; form-action "
        "'self'; base-uri 'self'; object-src 'none'"
    ),
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
}
"""No page may ask another machine for anything, and none of another machine may hold one of these."""


def guarded(app: ASGIApp, *, token: str, port: int, hosts: Sequence[str] = ()) -> ASGIApp:
    """An application that answers to the local names and `hosts` alone ("*": any, as in a container), with the token.

    `token` stands in the address once; a cookie of this `port` keeps it.
    """
    guard = _Guard(app, token, f"fragfield-{port}")
    return TrustedHostMiddleware(guard, allowed_hosts=[*_LOCAL, *hosts], www_redirect=False)


class _Guard:
    """Refuses requests without the token, of a foreign origin, or that are too large."""

    def __init__(self, app: ASGIApp, token: str, cookie: str) -> None:
        self._app, self._token, self._cookie = app, token, cookie

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        asked = HTTPConnection(scope)
        if refusal := self._refusal(asked):
            words = PlainTextResponse(f"fragfield app: {refusal[1]}\n", refusal[0], {"connection": "close"})
            await words(scope, receive, send)
        elif scope["type"] == "http" and "token" in asked.query_params:
            place = asked.url.remove_query_params("token")
            welcome = RedirectResponse(f"{place.path}?{place.query}" if place.query else place.path, 303)
            # Strict would keep it from the page that follows here on a click in a chat or a terminal in a browser.
            welcome.set_cookie(self._cookie, self._token, httponly=True, samesite="lax")
            await welcome(scope, receive, send)
        else:
            await self._app(scope, _limited(receive), _closed(send))

    def _refusal(self, asked: HTTPConnection) -> tuple[int, str] | None:
        """Status and words, or None for a request that may pass."""
        origin, length = asked.headers.get("origin"), asked.headers.get("content-length", "0")
        if origin is not None and urlsplit(origin).netloc != asked.headers.get("host"):
            return 403, f"found the origin {origin}; only its own pages may ask this server"
        given = asked.query_params.get("token") or asked.cookies.get(self._cookie, "")
        if not hmac.compare_digest(given.encode(), self._token.encode()):
            return 403, "the token in the address is missing or wrong; open the address that fragfield app printed"
        if len(length) > 18 or not length.isdigit() or int(length) > MOST_UPLOADED:
            return 413, f"found more than {MOST_UPLOADED >> 20} MiB in one request"
        return None


def _limited(receive: Receive) -> Receive:
    """What a request sends, ended where it is longer than allowed though it did not say so."""
    taken = 0

    async def limited() -> Message:
        nonlocal taken
        message = await receive()
        taken += len(message.get("body") or b"")
        return {"type": "http.disconnect"} if taken > MOST_UPLOADED else message

    return limited


def _closed(send: Send) -> Send:
    """What is answered, with headers that keep other machines and other pages out."""

    async def closed(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in _HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return closed
