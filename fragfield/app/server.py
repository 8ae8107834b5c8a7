"""The server of the pages: this machine alone, a free port, a token in the address."""

from __future__ import annotations

import secrets
import socket
import threading
import webbrowser
from importlib import resources
from typing import TYPE_CHECKING
from urllib.parse import quote, urlencode

from fragfield.app.security import Guard
from fragfield.app.session import Session
from fragfield.app.workspace import Workspace
from fragfield.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from fastapi import FastAPI

__all__ = ["serve"]


def serve(
    given: Path | None, *, host: str = "127.0.0.1", port: int = 0, browser: bool = True, language: str = ""
) -> None:
    """Show the pages until the command is interrupted.

    Parameters
    ----------
    given : Path, optional
        A case file, a run directory or a folder; left out: the working folder.
    host, port : str, int
        Address to listen at; port 0: a free one. Another host than this machine's is for containers.
    browser : bool
        Open the default browser.
    language : str
        "en" or "de"; empty: as chosen before.

    Raises
    ------
    InputError
        There is no such file, NiceGUI is not installed, or the port is taken.
    """
    space, case, run = Workspace.of(given)
    try:
        import nicegui  # noqa: F401
        import uvicorn
    except ModuleNotFoundError as error:
        raise InputError(
            f"app: needs {error.name}, which is not installed: pip install 'fragfield[app]'"
        ) from None
    listener = _listening(host, port)
    port = listener.getsockname()[1]
    token = secrets.token_urlsafe(24)
    page = "result" if run else ("round" if case else "start")
    query = {key: value for key, value in (("case", case), ("run", run), ("token", token)) if value}
    address = f"http://{'127.0.0.1' if host in ('0.0.0.0', '::') else host}:{port}/{page}?{urlencode(query, quote_via=quote)}"
    app = application(Session(space, language), token=token, port=port, hosts=() if _is_local(host) else ("*",))
    config = uvicorn.Config(app, log_level="error", access_log=False, ws_max_size=1 << 24, lifespan="on")
    print(f"fragfield app: {space.folder}\n{address}\nCtrl-C ends it; runs go on.", flush=True)  # noqa: T201 - the address is the result
    if browser:
        threading.Timer(0.3, webbrowser.open, (address,)).start()
    try:
        uvicorn.Server(config).run(sockets=[listener])
    except KeyboardInterrupt:
        pass  # how it is ended
    finally:
        listener.close()


def application(session: Session, *, token: str, port: int, hosts: tuple[str, ...] = ()) -> FastAPI:
    """The application with its pages, guarded."""
    from fastapi import FastAPI
    from fastapi.staticfiles import StaticFiles
    from nicegui import ui

    from fragfield.app.files import add_files
    from fragfield.app.pages import add_pages

    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    add_files(app, session)
    with resources.as_file(resources.files("fragfield.app") / "static") as static:
        app.mount("/static", StaticFiles(directory=static))
    add_pages(session)
    ui.run_with(
        app, title="fragfield", favicon="🛡", tailwind=False, show_welcome_message=False, reconnect_timeout=10.0,
        language="de" if session.language == "de" else "en-US",
    )  # fmt: skip
    app.add_middleware(Guard, token=token, port=port, hosts=hosts)
    return app


def _is_local(host: str) -> bool:
    return host in ("127.0.0.1", "localhost", "::1")


def _listening(host: str, port: int) -> socket.socket:
    try:
        listener = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
    except (OSError, OverflowError) as error:
        raise InputError(f"app: {host}:{port} cannot be listened at ({getattr(error, 'strerror', None) or error})") from None
    return listener
