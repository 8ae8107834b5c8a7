"""Page 4, the site: a map on which people, roads, buildings and barricades are dragged; rules by mass."""

from __future__ import annotations

import json
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from nicegui import run, ui

from fragfield.app.forms import entries_form, field_input, files_in, form, upload
from fragfield.app.page import box, facts, heading, html, note
from fragfield.app.pages.run import checked
from fragfield.app.site_plan import imported, move, plan_of, shapes_of, site_in
from fragfield.errors import InputError
from fragfield.results.words import metres
from fragfield_base import errors
from fragfield_base.writing import write_bytes

if TYPE_CHECKING:
    from nicegui.events import GenericEventArguments

    from fragfield.app.page import CasePage


_NEW: dict[str, tuple[str, dict[str, Any]]] = {
    "person": ("exposed", {"position": ["60 m", "60 m"]}),
    "road": ("exposed", {"kind": "road", "points": [["-150 m", "-120 m"], ["150 m", "-120 m"]], "width": "6 m"}),
    "area": ("exposed", {
        "kind": "area", "points": [["80 m", "-60 m"], ["140 m", "-60 m"], ["140 m", "0 m"], ["80 m", "0 m"]]}),
    "building": ("exposed", {
        "kind": "building", "position": ["-100 m", "60 m"], "length": "12 m", "width": "8 m", "height": "4 m"}),
    "wall": ("obstacle", {"kind": "wall", "start": ["-10 m", "20 m"], "end": ["10 m", "20 m"], "height": "3 m"}),
    "barricade": ("obstacle", {
        "kind": "barricade", "start": ["-15 m", "-20 m"], "end": ["15 m", "-20 m"], "height": "4 m"}),
    "obstacle_building": ("obstacle", {
        "kind": "building", "position": ["-60 m", "-20 m"], "length": "14 m", "width": "10 m", "height": "5 m"}),
}  # fmt: skip
"""What is added to the map, by the name of its button: table and first values."""
_MAPS = (".geojson", ".json", ".kml", ".kmz")
_GRIDS = (".asc", ".tif", ".tiff")


def content(page: CasePage) -> None:
    """Build the page."""
    site = _Site(page)
    with box("columns wide-left"):
        with box(tag="section"):
            heading("Map of the site")
            html('<div id="site-map"></div>')
            note(
                "Drag a mark to move it; the arrow keys move the mark in focus by a metre, with Shift by ten. Wheel "
                "and buttons zoom."
            )
            with box("choices").props('role=group aria-label="Add to the map"'):
                for name in _NEW:
                    words = "Building that shields" if name == "obstacle_building" else name.capitalize()
                    ui.button(words, icon="add", on_click=lambda _, name=name: site.add(name)).props(
                        f"dense outline data-add={name}"
                    )
            _exchange(page, site)
            heading("Rules and blast by mass, before any run")
            site.rules = html()
        with box(tag="section"):
            heading("Exposed sites")
            site.lists()
            heading("Where on Earth")
            form(page, ("site",))
            heading("Ground and terrain")
            _ground(page)
    ui.on("moved", site.moved)
    page.follow(site.judged)


class _Site:
    def __init__(self, page: CasePage) -> None:
        self.page = page
        self.circles: list[dict[str, Any]] = []
        self.shapes: list[dict[str, Any]] = []
        self.rules: ui.html

    @ui.refreshable_method
    def lists(self) -> None:
        entries_form(self.page, ("exposed",), changed=self.draw)
        heading("Barricades, walls and buildings")
        entries_form(self.page, ("obstacle",), changed=self.draw)

    def draw(self) -> None:
        plan = plan_of(self.page.case, self.shapes, self.circles)
        ui.run_javascript(f"fragfieldMap({json.dumps(plan)})".replace("</", "<\\/"))

    async def judged(self) -> None:
        """Rules by mass as circles, and the whole map, after a change."""
        if (case := self.page.case.resolved()) is not None:
            with suppress(errors.InputError):  # which check says below
                self.shapes = await run.io_bound(shapes_of, case)
        found = await run.io_bound(checked, self.page)
        rules = () if found is None or isinstance(found, str) else found.rules
        self.circles = [
            {"name": f"{one.name}, {metres(one.distance)}", "short": metres(one.distance), "radius": one.distance,
             "kind": one.hazard}
            for one in rules if one.distance is not None and one.use == "siting"
        ]  # fmt: skip
        rows = [
            (one.name, f"{one.hazard}, {one.use}", metres(one.distance) if one.distance else one.reason)
            for one in rules
        ]
        self.rules.set_content(facts(rows, ("Rule", "Against", "Distance")))
        self.draw()

    def again(self) -> None:
        self.lists.refresh()
        self.draw()

    def moved(self, event: GenericEventArguments) -> None:
        path, x, y = event.args
        clean = tuple(step if isinstance(step, int) else str(step) for step in path)
        if clean[:1] in (("exposed",), ("obstacle",)):
            self.page.attempt(lambda: move(self.page.case, clean, float(x), float(y)))
        self.again()

    def add(self, name: str) -> None:
        table, values = _NEW[name]
        entries = self.page.case.get((table,), [])
        number = len(entries) if isinstance(entries, list) else 0
        if self.page.change((table, number), {"name": f"{name.removeprefix('obstacle_')} {number + 1}", **values}):
            self.again()


def _ground(page: CasePage) -> None:
    if maps := files_in(page.folder, _GRIDS):
        field_input(page, ("flight", "ground", "map"), choices=maps)
    else:
        form(page, ("flight", "ground"), only=("map",))
    form(page, ("flight", "ground"), without=("map",))
    extent = note("")

    def judged() -> None:
        from fragfield.case.conversion.surroundings import ground_of

        case = page.case.resolved()
        ground = ground_of(case) if case is not None else 0.0
        if isinstance(ground, float):
            extent.set_text("")
            return
        (west, south), (east, north) = ground.corner, ground.end
        low, high = ground.heights.min(), ground.heights.max()
        extent.set_text(
            f"Map of heights: x {west:.0f} to {east:.0f} m, y {south:.0f} to {north:.0f} m, heights {low:.0f} to "
            f"{high:.0f} m"
        )

    page.follow(judged)


def _exchange(page: CasePage, site: _Site) -> None:
    if site_in(page.case) is None:
        note("Without a place on Earth the map has no north: x is drawn to the right. Import needs one.")
        return

    def take(name: str, data: bytes) -> None:
        ending = next((one for one in _MAPS if name.lower().endswith(one)), _MAPS[0])
        tables, notes = imported(
            page.case, write_bytes(page.session.space.state(f"imported{ending}"), data, InputError)
        )  # fmt: skip
        for table, entries in tables.items():
            begin = len(page.case.get((table,), []))
            for number, entry in enumerate(entries):
                page.case.set((table, begin + number), entry)
        words = f"{sum(map(len, tables.values()))} places were added"
        ui.notify("\n".join([words, *notes]), type="positive", multi_line=True)
        site.again()

    with box("choices"):
        upload(page, "Import GeoJSON or KML", _MAPS, take)
