"""Files of runs for the pages: reports, maps and pictures, each shut off from the application's own pages."""

from __future__ import annotations

from typing import TYPE_CHECKING

from starlette.responses import FileResponse, PlainTextResponse

from fragfield.errors import InputError

if TYPE_CHECKING:
    from fastapi import FastAPI
    from starlette.requests import Request
    from starlette.responses import Response

    from fragfield.app.session import Session

__all__ = ["add_files"]

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
