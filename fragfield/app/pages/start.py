"""Page 1, the start: recent cases and runs, a new case from a template, and files to be brought in."""

from __future__ import annotations

import datetime as dt
from typing import TYPE_CHECKING
from urllib.parse import urlencode

from nicegui import ui

from fragfield.app.markup import heading
from fragfield.app.security import MOST_UPLOADED
from fragfield.app.workspace import safe_name
from fragfield.errors import InputError
from fragfield_base.writing import write_bytes

if TYPE_CHECKING:
    from nicegui.events import UploadEventArguments

    from fragfield.app.page import CasePage
    from fragfield.app.workspace import Listed

__all__ = ["content", "make_case"]

_TEMPLATES = ("single", "workshop", "arena", "drawing")
_NEXT = {"workshop": "site", "arena": "data"}
"""The page that a new case is opened on; the others on that of the round."""
_UPLOADS = (
    ".toml",
    ".csv",
    ".tsv",
    ".txt",
    ".xlsx",
    ".ods",
    ".asc",
    ".tif",
    ".tiff",
    ".png",
    ".jpg",
    ".geojson",
    ".kml",
    ".kmz",
    ".dxf",
    ".svg",
    ".msh",
)


def content(page: CasePage) -> None:
    """Build the page."""
    texts, space = page.texts, page.session.space
    heading(texts("start.title"), 1)
    ui.label(texts("start.purpose", folder=str(space.folder))).classes("meaning")
    with ui.element("div").classes("columns"):
        with ui.element("section"):
            _new(page)
            _upload(page)
        with ui.element("section"):
            cases, runs = space.cases(), space.runs()
            heading(texts("start.cases"))
            _listed(page, cases, "case", "/round")
            heading(texts("start.runs"))
            _listed(page, runs, "run", "/result")


def _listed(page: CasePage, found: list[Listed], key: str, place: str) -> None:
    with ui.element("ul").classes("list"):
        for one in found:
            with ui.element("li"):
                ui.link(one.name, f"{place}?{urlencode({key: one.name})}")
                when = dt.datetime.fromtimestamp(one.changed, dt.UTC).astimezone()
                done = page.texts("start.done", stage=one.state) if one.state else ""
                ui.label(" · ".join(part for part in (f"{when:%Y-%m-%d %H:%M}", done) if part)).classes("note")
        if not found:
            ui.label(page.texts("start.none")).classes("note")


def _new(page: CasePage) -> None:
    texts = page.texts
    heading(texts("start.new"))
    chosen = {"template": "single", "name": ""}

    def make() -> None:
        def write() -> None:
            name = make_case(page, chosen["template"], chosen["name"])
            place = _NEXT.get(chosen["template"], "round")
            ui.navigate.to(f"/{place}?{urlencode({'case': name})}")

        page.attempt(write)

    options = {name: texts(f"template.{name}") for name in _TEMPLATES}
    ui.radio(options, value="single", on_change=lambda event: chosen.update(template=event.value)).props("dense")
    box = ui.input(texts("start.name"), on_change=lambda event: chosen.update(name=event.value or ""))
    box.props("outlined dense stack-label data-key=new-name").on("keydown.enter", make)
    ui.button(texts("start.make"), on_click=make).props("no-caps id=make")


def make_case(page: CasePage, template: str, name: str) -> str:
    """Write a new case from a template; its name. Raises InputError where the name is taken or odd."""
    from fragfield.case.new_case import write_new_case

    path = page.session.space.inside(safe_name(name, ".toml"))
    write_new_case(path, "m107", "tnt", stack="row" if template == "workshop" else None)
    case = page.session.open(page.session.space.name_of(path))
    if template == "drawing":
        from fragfield.app.pages.round import BARE

        case.set(("round", 0), {"name": "round", "profile": BARE, "explosive": "tnt", "casing": "steel_paper",
                                "attitude": "upright", "position": ["0 m", "0 m", "1 m"]})  # fmt: skip
        case.set(("title",), path.stem)
    if template == "workshop":
        case.set(("stack", "count"), 4)
        case.set(("obstacle", 0), {"name": "workshop", "kind": "building", "centre": ["-60 m", "-15 m"],
                                   "length": "14 m", "width": "10 m", "height": "5 m"})  # fmt: skip
        case.set(("exposed", 0), {"name": "workshop", "kind": "building", "obstacle": "workshop", "max_hits": 1.0})
        case.set(("exposed", 1), {"name": "road", "kind": "road", "width": "7 m",
                                  "points": [["-200 m", "-180 m"], ["200 m", "-180 m"]]})  # fmt: skip
    case.save()
    return case.name


def _upload(page: CasePage) -> None:
    texts = page.texts
    heading(texts("start.upload"))
    ui.label(texts("start.upload_what", most=MOST_UPLOADED >> 20)).classes("meaning")

    async def take(event: UploadEventArguments) -> None:
        data = await event.file.read()
        if page.attempt(lambda: _kept(page, event.file.name, data)):
            ui.navigate.reload()

    ui.upload(
        label=texts("start.choose"), on_upload=take, auto_upload=True, max_file_size=MOST_UPLOADED - (1 << 16),
        on_rejected=lambda: ui.notify(texts("start.too_large", most=MOST_UPLOADED >> 20), type="negative"),
    ).props(f'flat bordered accept="{",".join(_UPLOADS)}"')  # fmt: skip


def _kept(page: CasePage, name: str, data: bytes) -> None:
    ending = next((one for one in _UPLOADS if name.lower().endswith(one)), "")
    if not ending:
        raise InputError(f"{name[:80]}: found a file of this ending; allowed: {', '.join(_UPLOADS)}")
    path = page.session.space.inside(safe_name(name[: -len(ending)], ending))
    if path.exists():
        raise InputError(f"{path.name}: is there already; rename the file first")
    write_bytes(path, data, InputError)
