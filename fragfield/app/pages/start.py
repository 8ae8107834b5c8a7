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


_TEMPLATES = {
    "single": "One round (M107, TNT)", "workshop": "A row of four at a workshop and a road",
    "drawing": "A round of my own drawing",
}  # fmt: skip
_UPLOADS = (".toml", ".csv", ".tsv", ".txt", ".xlsx", ".asc", ".tif", ".tiff", ".png", ".jpg", ".geojson",
            ".kml", ".kmz", ".dxf", ".msh")  # fmt: skip


def content(page: CasePage) -> None:
    """Build the page."""
    space = page.session.space
    heading("Hazard distances of fragments", 1)
    note(f"For explosives safety only. Working folder: {space.folder}", "meaning")
    with box("columns"):
        with box(tag="section"):
            _new(page)
            heading("Bring a file into the folder")
            note(
                f"A case, a drawing, a map of heights, a table of a test: up to {MOST_UPLOADED >> 20} MiB. Nothing "
                "leaves this machine.",
                "meaning",
            )
            upload(page, "Choose a file", _UPLOADS, lambda name, data: keep_file(page, name, data, _UPLOADS))
        with box(tag="section"):
            cases, runs = space.cases(), space.runs()
            heading("Cases")
            _listed(cases, "case", "/round")
            heading("Runs")
            _listed(runs, "run", "/result")


def _listed(found: list[Listed], key: str, place: str) -> None:
    with box("list", "ul"):
        for one in found:
            with box(tag="li"):
                ui.link(one.name, f"{place}?{urlencode({key: one.name})}")
                when = dt.datetime.fromtimestamp(one.changed, dt.UTC).astimezone()
                done = f"done up to: {one.state}" if one.state else ""
                note(" · ".join(part for part in (f"{when:%Y-%m-%d %H:%M}", done) if part))
        if not found:
            note("none yet")


def _new(page: CasePage) -> None:
    chosen = {"template": "single", "name": ""}
    heading("New case")

    def write() -> None:
        name = make_case(page, chosen["template"], chosen["name"])
        page_name = "site" if chosen["template"] == "workshop" else "round"
        ui.navigate.to(f"/{page_name}?{urlencode({'case': name})}")

    def make() -> None:
        page.attempt(write)

    ui.radio(_TEMPLATES, value="single", on_change=lambda event: chosen.update(template=event.value)).props("dense")
    name = ui.input("Name of the file", on_change=lambda event: chosen.update(name=event.value or ""))
    name.props("data-key=new-name").on("keydown.enter", make)
    ui.button("Make the case", on_click=make).props("id=make")


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
