"""The server of the pages: this machine alone, a free port, a token in the address, and small requests."""

from __future__ import annotations

import hmac
import logging
import secrets
import socket
import threading
import webbrowser
from contextlib import suppress
from importlib import import_module, resources
from typing import TYPE_CHECKING
from urllib.parse import quote, urlencode, urlsplit

from starlette.datastructures import MutableHeaders
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import HTTPConnection
from starlette.responses import FileResponse, PlainTextResponse, RedirectResponse

from fragfield.app.document import Session
from fragfield.app.workspace import Workspace
from fragfield.errors import InputError, message_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from fastapi import FastAPI
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

    from fragfield.app.document import Session


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
    taken = 0

    async def limited() -> Message:
        nonlocal taken
        message = await receive()
        taken += len(message.get("body") or b"")
        return {"type": "http.disconnect"} if taken > MOST_UPLOADED else message

    return limited


def _closed(send: Send) -> Send:
    async def closed(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in _HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return closed


_SHUT_OFF = (
    "sandbox allow-scripts allow-popups allow-downloads allow-modals; default-src 'none'; img-src 'self' data: blob:; "
    "style-src 'unsafe-inline'; script-src 'unsafe-inline' 'unsafe-eval' blob:; font-src data:; worker-src blob:; "
    "connect-src data: blob:"
)
"""A page that a run wrote may show itself, but ask for nothing and reach no other page."""
_OPEN = (".html", ".svg", ".png", ".jpg", ".jpeg", ".pdf", ".json", ".csv", ".txt", ".log", ".toml", ".geojson", ".kml",
         ".xlsx", ".h5", ".xdmf")  # fmt: skip


def add_files(app: FastAPI, session: Session) -> None:
    """Let `/files/NAME` give a file of the workspace."""

    def give(request: Request) -> Response:
        name = str(request.path_params["name"])
        try:
            path = session.space.inside(name)
        except InputError as error:
            return PlainTextResponse(str(error), status_code=404)
        if not path.is_file() or path.suffix.lower() not in _OPEN:
            return PlainTextResponse(f"{name[:200]}: no such file", status_code=404)
        headers = {"content-security-policy": _SHUT_OFF, "cache-control": "no-cache"}
        if request.query_params.get("save"):
            return FileResponse(path, headers=headers, filename=path.name)
        return FileResponse(path, headers=headers)

    app.add_route("/files/{name:path}", give)


_ANY = ("0.0.0.0", "::")
_BROWSER, _WARM_UP = 0.3, 2.0  # s after the start
_NEEDED_SOON = (
    "fragfield.checking.check", "burst_fenicsx.symmetry", "burst_fenicsx.meshing", "fragfield.interface.results",
)  # fmt: skip


def serve(
    given: Path | None, *, announce: Callable[[str], object], host: str = "127.0.0.1", port: int = 0,
    browser: bool = True,
) -> None:  # fmt: skip
    """Show the pages until the command is interrupted.

    `given`: a case file, a run directory or a folder; left out, the working folder. `announce` is given the address
    before the server starts. Port 0 is a free one; another host than this machine's is for containers.

    Raises InputError: there is no such file, NiceGUI is not installed, or the port is taken.
    """
    space, case, run = Workspace.of(given)
    try:
        import nicegui  # noqa: F401
        import uvicorn
    except ModuleNotFoundError as error:
        raise InputError(f"app: needs {error.name}, which is not installed: pip install 'fragfield[app]'") from None
    listener = _listening(host, port)
    port = listener.getsockname()[1]
    token = secrets.token_urlsafe(24)
    page = "result" if run else ("round" if case else "start")
    query = {key: value for key, value in (("case", case), ("run", run), ("token", token)) if value}
    shown = "127.0.0.1" if host in _ANY else f"[{host}]" if ":" in host else host
    address = f"http://{shown}:{port}/{page}?{urlencode(query, quote_via=quote)}"
    session = Session(space)
    app = application(session, token=token, port=port, hosts=() if host in _LOCAL or host == "::1" else ("*",))
    config = uvicorn.Config(app, log_level="error", access_log=False, ws_max_size=1 << 24, lifespan="on")
    announce(f"fragfield app: {space.folder}\n{address}\nCtrl-C ends it, and stops a run as Cancel does.")
    later = [threading.Timer(_WARM_UP, lambda: [import_module(name) for name in _NEEDED_SOON])]
    if browser:
        later.append(threading.Timer(_BROWSER, webbrowser.open, (address,)))
    for timer in later:
        timer.daemon = True
        timer.start()
    try:
        with suppress(KeyboardInterrupt):  # how it is ended
            uvicorn.Server(config).run(sockets=[listener])
    finally:
        listener.close()
        if session.job is not None:
            session.job.end()


def application(session: Session, *, token: str, port: int, hosts: tuple[str, ...] = ()) -> FastAPI:
    """The application with its pages, guarded."""
    from fastapi import FastAPI
    from fastapi.staticfiles import StaticFiles
    from nicegui import ui

    from fragfield.app.page import add_pages

    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    add_files(app, session)
    with resources.as_file(resources.files("fragfield.app") / "static") as static:
        app.mount("/static", StaticFiles(directory=static))
    add_pages(session)
    ui.run_with(
        app, title="fragfield", favicon="🛡", tailwind=False, show_welcome_message=False, reconnect_timeout=10.0,
        language="en-US",
    )  # fmt: skip
    _keep_faults(session)
    app.add_middleware(guarded, token=token, port=port, hosts=hosts)
    return app


def _keep_faults(session: Session) -> None:
    """Write tracebacks of faults of the program into a log, and say on the page where they are."""
    from nicegui import app as pages
    from nicegui import ui

    log = session.space.state("app.log")
    handler = logging.FileHandler(log, encoding="utf-8", errors="backslashreplace", delay=True)
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    for name in ("nicegui", "uvicorn.error", "asyncio"):
        logger = logging.getLogger(name)
        logger.addHandler(handler)
        logger.propagate = False

    def words(error: Exception) -> str:
        return f"{message_of(error)}; please report it with {log}"

    def on_page(error: Exception) -> None:
        with ui.element("div").classes("content"):
            ui.label(words(error)).classes("fault")
            ui.link("fragfield", "/start")

    def in_event(error: Exception) -> None:
        with suppress(RuntimeError):  # without a page
            ui.notify(words(error), type="negative", multi_line=True, timeout=0, close_button="×")

    pages.on_page_exception(on_page)
    pages.on_exception(in_event)


def _listening(host: str, port: int) -> socket.socket:
    try:
        listener = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen(128)  # a browser that is quicker than the server waits
    except (OSError, OverflowError) as error:
        raise InputError(
            f"app: {host}:{port} cannot be listened at ({getattr(error, 'strerror', None) or error})"
        ) from None
    return listener
