"""Who may ask: only pages that were opened with the token, from the address that was given, with small requests."""

from __future__ import annotations

import hmac
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, urlencode, urlsplit

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send


MOST_UPLOADED = 64 << 20
"""Bytes that a request may have: maps of heights and tables of tests are smaller."""
_LOCAL = ("127.0.0.1", "localhost", "[::1]")
_POLICY = (
    "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; frame-ancestors 'self'; "
    "script-src 'self' 'unsafe-inline' 'unsafe-eval'; connect-src 'self'; font-src 'self' data:; form-action 'self'; "
    "base-uri 'self'; object-src 'none'"
)
"""No page may ask another machine for anything."""


class Guard:
    """Refuses requests without the token, of a foreign origin, for another host, or that are too large.

    Parameters
    ----------
    app : ASGIApp
        What is guarded.
    token : str
        Stands in the address once; a cookie of this port keeps it.
    port : int
        Of the server.
    hosts : tuple of str
        Names besides the local ones under which the server may be asked for; "*": any, as in a container.
    """

    def __init__(self, app: ASGIApp, *, token: str, port: int, hosts: tuple[str, ...] = ()) -> None:
        self._app, self._token, self._cookie = app, token, f"fragfield-{port}"
        self._hosts = (*_LOCAL, *hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or pass it on."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        query = dict(parse_qsl(scope.get("query_string", b"").decode("latin-1"), keep_blank_values=True))
        if (refusal := self._refusal(headers, query)) is not None:
            await _refuse(scope, receive, send, 403, refusal)
        elif scope["type"] == "http" and "token" in query:
            await self._welcome(scope, send, {key: value for key, value in query.items() if key != "token"})
        elif scope["type"] == "http" and _length(headers) > MOST_UPLOADED:
            await _refuse(scope, receive, send, 413, f"found more than {MOST_UPLOADED >> 20} MiB in one request")
        else:
            await self._app(scope, _limited(receive), _closed(send))

    def _refusal(self, headers: dict[str, str], query: dict[str, str]) -> str | None:
        host = headers.get("host", "")
        if "*" not in self._hosts and host.rsplit(":", 1)[0] not in self._hosts:
            return f"found the host {host}; this page answers to {self._hosts[0]} alone"
        origin = headers.get("origin")
        if origin is not None and urlsplit(origin).netloc != host:
            return f"found the origin {origin}; only its own pages may ask this server"
        given = query.get("token") or self._kept(headers.get("cookie", ""))
        if not hmac.compare_digest(given.encode(), self._token.encode()):
            return "the token in the address is missing or wrong; open the address that fragfield app printed"
        return None

    def _kept(self, cookies: str) -> str:
        try:
            found = SimpleCookie(cookies).get(self._cookie)
        except CookieError:
            return ""
        return found.value if found is not None else ""

    async def _welcome(self, scope: Scope, send: Send, query: dict[str, str]) -> None:
        """Keep the token in a cookie, and out of the address from now on."""
        place = scope["path"] + (f"?{urlencode(query)}" if query else "")
        # Strict would keep it from the page that follows here on a click in a chat or a terminal in a browser.
        cookie = f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Lax"
        headers = [(b"location", place.encode("latin-1", "replace")), (b"set-cookie", cookie.encode("latin-1"))]
        await send({"type": "http.response.start", "status": 303, "headers": headers})
        await send({"type": "http.response.body", "body": b""})


def _length(headers: dict[str, str]) -> int:
    text = headers.get("content-length", "0")
    return int(text) if text.isdigit() and len(text) < 19 else (0 if not text else MOST_UPLOADED + 1)


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
            own = {name.lower() for name, _ in message["headers"]}
            more = ((b"content-security-policy", _POLICY.encode()), (b"x-content-type-options", b"nosniff"),
                    (b"referrer-policy", b"no-referrer"),
                    (b"cross-origin-resource-policy", b"same-origin"))  # fmt: skip
            message["headers"] = [*message["headers"], *(one for one in more if one[0] not in own)]
        await send(message)

    return closed


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int, words: str) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008})
        return
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"x-content-type-options", b"nosniff"),
               (b"connection", b"close")]  # fmt: skip
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": f"fragfield app: {words}\n".encode()})
