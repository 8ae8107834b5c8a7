"""Page 1, the start: recent cases and runs, a new case from a template, and files to be brought in."""

from __future__ import annotations

import datetime as dt
from typing import TYPE_CHECKING
from urllib.parse import urlencode

from nicegui import ui

from fragfield.app.forms import keep_file, upload
from fragfield.app.page import box, heading, note
from fragfield.app.server import MOST_UPLOADED
from fragfield.app.workspace import safe_name

if TYPE_CHECKING:
    from fragfield.app.page import CasePage
    from fragfield.app.workspace import Listed


_TEMPLATES = {"single": "round", "workshop": "site", "drawing": "round"}
"""The page that a case made from each is opened on."""
_UPLOADS = (".toml", ".csv", ".tsv", ".txt", ".xlsx", ".ods", ".asc", ".tif", ".tiff", ".png", ".jpg", ".geojson",
            ".kml", ".kmz", ".dxf", ".msh")  # fmt: skip


def content(page: CasePage) -> None:
    """Build the page."""
    texts, space = page.texts, page.session.space
    heading(texts("start.title"), 1)
    note(texts("start.purpose", folder=str(space.folder)), "meaning")
    with box("columns"):
        with box(tag="section"):
            _new(page)
            heading(texts("start.upload"))
            note(texts("start.upload_what", most=MOST_UPLOADED >> 20), "meaning")
            upload(page, texts("start.choose"), _UPLOADS, lambda name, data: keep_file(page, name, data, _UPLOADS))
        with box(tag="section"):
            cases, runs = space.cases(), space.runs()
            heading(texts("start.cases"))
            _listed(page, cases, "case", "/round")
            heading(texts("start.runs"))
            _listed(page, runs, "run", "/result")


def _listed(page: CasePage, found: list[Listed], key: str, place: str) -> None:
    with box("list", "ul"):
        for one in found:
            with box(tag="li"):
                ui.link(one.name, f"{place}?{urlencode({key: one.name})}")
                when = dt.datetime.fromtimestamp(one.changed, dt.UTC).astimezone()
                done = page.texts("start.done", stage=one.state) if one.state else ""
                note(" · ".join(part for part in (f"{when:%Y-%m-%d %H:%M}", done) if part))
        if not found:
            note(page.texts("start.none"))


def _new(page: CasePage) -> None:
    texts, chosen = page.texts, {"template": "single", "name": ""}
    heading(texts("start.new"))

    def write() -> None:
        name = make_case(page, chosen["template"], chosen["name"])
        ui.navigate.to(f"/{_TEMPLATES[chosen['template']]}?{urlencode({'case': name})}")

    def make() -> None:
        page.attempt(write)

    options = {name: texts(f"template.{name}") for name in _TEMPLATES}
    ui.radio(options, value="single", on_change=lambda event: chosen.update(template=event.value)).props("dense")
    name = ui.input(texts("start.name"), on_change=lambda event: chosen.update(name=event.value or ""))
    name.props("data-key=new-name").on("keydown.enter", make)
    ui.button(texts("start.make"), on_click=make).props("id=make")


def make_case(page: CasePage, template: str, name: str) -> str:
    """Write a new case from a template; its name. Raises InputError where the name is taken or odd."""
    from fragfield.case.new_case import write_new_case

    path = page.session.space.inside(safe_name(name, ".toml"))
    write_new_case(path, "m107", "tnt", stack="row" if template == "workshop" else None)
    case = page.session.open(page.session.space.name_of(path))
    if template == "drawing":
        from fragfield.app.pages.round import OWN_ROUND

        case.set(("round", 0), OWN_ROUND)
        case.set(("title",), path.stem)
    if template == "workshop":
        case.set(("stack", "count"), 4)
        case.set(("obstacle", 0), {"name": "workshop", "kind": "building", "position": ["-60 m", "-15 m"],
                                   "length": "14 m", "width": "10 m", "height": "5 m"})  # fmt: skip
        case.set(("exposed", 0), {"name": "workshop", "kind": "building", "obstacle": "workshop", "max_hits": 1.0})
        case.set(("exposed", 1), {"name": "road", "kind": "road", "width": "7 m",
                                  "points": [["-200 m", "-180 m"], ["200 m", "-180 m"]]})  # fmt: skip
    case.save()
    return case.name
