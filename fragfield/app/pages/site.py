"""Page 4, the site: a map on which people, roads, buildings and barricades are dragged; rules by mass."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from nicegui import run, ui

from fragfield.app.forms import entries_form, field_input, form
from fragfield.app.markup import facts, heading
from fragfield.app.pages.run import checked
from fragfield.app.site_plan import exported, imported, move, plan_of, site_in
from fragfield.errors import InputError
from fragfield.hazard.certainty import metres
from fragfield_base.writing import write_bytes

if TYPE_CHECKING:
    from nicegui.events import GenericEventArguments, UploadEventArguments

    from fragfield.app.page import CasePage

__all__ = ["content"]

_NEW: dict[str, tuple[str, dict[str, Any]]] = {
    "person": ("exposed", {"position": ["60 m", "60 m"]}),
    "road": ("exposed", {"kind": "road", "points": [["-150 m", "-120 m"], ["150 m", "-120 m"]], "width": "6 m"}),
    "area": (
        "exposed",
        {"kind": "area", "points": [["80 m", "-60 m"], ["140 m", "-60 m"], ["140 m", "0 m"], ["80 m", "0 m"]]},
    ),
    "building": (
        "exposed",
        {"kind": "building", "position": ["-100 m", "60 m"], "length": "12 m", "width": "8 m", "height": "4 m"},
    ),
    "wall": ("obstacle", {"kind": "wall", "start": ["-10 m", "20 m"], "end": ["10 m", "20 m"], "height": "3 m"}),
    "barricade": (
        "obstacle",
        {"kind": "barricade", "start": ["-15 m", "-20 m"], "end": ["15 m", "-20 m"], "height": "4 m"},
    ),
    "obstacle_building": (
        "obstacle",
        {"kind": "building", "centre": ["-60 m", "-20 m"], "length": "14 m", "width": "10 m", "height": "5 m"},
    ),
}
"""What is added to the map, by the name of its button: table and first values."""
_MAPS = (".geojson", ".json", ".kml", ".kmz")
_PICTURES = (".png", ".jpg", ".jpeg")


def content(page: CasePage) -> None:
    """Build the page."""
    texts = page.texts
    site = _Site(page)
    with ui.element("div").classes("columns wide-left"):
        with ui.element("section"):
            heading(texts("site.title"))
            ui.html('<div id="site-map"></div>', sanitize=False)
            ui.label(texts("site.drag")).classes("note")
            with ui.element("div").classes("choices").props(f'role=group aria-label="{texts("site.add")}"'):
                for name in _NEW:
                    ui.button(texts(f"site.{name}"), icon="add", on_click=lambda _, name=name: site.add(name)).props(
                        f"dense outline no-caps data-add={name}"
                    )
            _exchange(page, site)
            heading(texts("site.rules"))
            site.rules = ui.html("", sanitize=False)
        with ui.element("section"):
            heading(texts("site.exposed"))
            site.lists()
            heading(texts("site.earth"))
            form(page, ("site",))
            heading(texts("site.ground"))
            _ground(page)
            _background(page, site)
    ui.on("moved", site.moved)
    page.follow(site.judged)


class _Site:
    """The map and its lists."""

    def __init__(self, page: CasePage) -> None:
        self.page = page
        self.circles: list[dict[str, Any]] = []
        self.rules: ui.html

    @ui.refreshable_method
    def lists(self) -> None:
        """Forms of the exposed sites and of the obstacles."""
        entries_form(self.page, ("exposed",), changed=self.draw)
        heading(self.page.texts("site.obstacles"))
        entries_form(self.page, ("obstacle",), changed=self.draw)

    def draw(self) -> None:
        """Draw the draft as it stands."""
        import json

        data = json.dumps(plan_of(self.page.case, self.circles, self._background())).replace("</", "<\\/")
        ui.run_javascript(f"fragfieldMap({data})")

    async def judged(self) -> None:
        """Rules by mass as circles, and the whole map, after a change."""
        found = await run.io_bound(checked, self.page)
        rules = [
            one for one in (found or {}).get("rules", []) if one["distance"] is not None and one["use"] == "siting"
        ]
        self.circles = [
            {"name": f"{one['name']}, {metres(one['distance'])}", "radius": one["distance"], "kind": one["hazard"]}
            for one in rules
        ]
        self.rules.set_content(_rules_table(self.page, (found or {}).get("rules", [])))
        self.draw()

    def moved(self, event: GenericEventArguments) -> None:
        """A mark was dragged, or moved by keys."""
        path, x, y = event.args
        clean = tuple(step if isinstance(step, int) else str(step) for step in path)
        if clean[:1] in (("exposed",), ("obstacle",)):
            self.page.attempt(lambda: move(self.page.case, clean, float(x), float(y)))
        self.lists.refresh()
        self.draw()

    def add(self, name: str) -> None:
        """Put something new on the map."""
        table, values = _NEW[name]
        entries = self.page.case.get((table,), [])
        number = len(entries) if isinstance(entries, list) else 0
        if self.page.change((table, number), {"name": f"{name.removeprefix('obstacle_')} {number + 1}", **values}):
            self.lists.refresh()
            self.draw()

    def _background(self) -> dict[str, Any] | None:
        kept = self.page.session.space.settings().get("background", {}).get(self.page.case.name)
        if not kept or not (self.page.session.space.folder / kept["file"]).is_file():
            return None
        return {"address": f"/files/{quote(kept['file'])}", "width": kept["width"]}


def _rules_table(page: CasePage, rules: list[dict[str, Any]]) -> str:
    rows = [
        (one["name"], f"{one['hazard']}, {one['use']}", metres(one["distance"]) if one["distance"] else one["reason"])
        for one in rules
    ]
    return facts(rows, [page.texts(f"site.{name}") for name in ("rule", "hazard", "distance")])


def _ground(page: CasePage) -> None:
    maps = [one.name for ending in ("asc", "tif", "tiff") for one in page.case.path.parent.glob(f"*.{ending}")]
    if maps:
        field_input(page, ("flight", "ground", "map"), choices=sorted(maps))
    else:
        form(page, ("flight", "ground"), only=("map",))
    form(page, ("flight", "ground"), without=("map",))
    extent = ui.label("").classes("note")

    def judged() -> None:
        from fragfield.case.conversion.surroundings import ground_of

        case = page.case.resolved()
        ground = ground_of(case) if case is not None else 0.0
        if isinstance(ground, float):
            extent.set_text("")
            return
        (west, south), (east, north) = ground.corner, ground.end
        values = {"west": west, "east": east, "south": south, "north": north, "low": ground.heights.min(),
                  "high": ground.heights.max()}  # fmt: skip
        extent.set_text(page.texts("site.terrain", **{name: f"{value:.0f}" for name, value in values.items()}))

    page.follow(judged)


def _exchange(page: CasePage, site: _Site) -> None:
    """GeoJSON out, GeoJSON and KML in."""
    texts = page.texts
    if site_in(page.case) is None:
        ui.label(f"{texts('site.no_north')} {texts('site.needs_site')}").classes("note")
        return

    def export() -> None:
        page.attempt(
            lambda: ui.download.content(exported(page.case), f"{page.case.path.stem}.geojson", "application/geo+json")
        )

    async def take(event: UploadEventArguments) -> None:
        data = await event.file.read()

        def act() -> None:
            ending = next((one for one in _MAPS if event.file.name.lower().endswith(one)), ".geojson")
            kept = write_bytes(page.session.space.state(f"imported{ending}"), data, InputError)
            tables, notes = imported(page.case, kept)
            for name, entries in tables.items():
                begin = len(page.case.get((name,), []))
                for number, entry in enumerate(entries):
                    page.case.set((name, begin + number), entry)
            number = sum(map(len, tables.values()))
            ui.notify("\n".join([texts("site.imported", number=number), *notes]), type="positive", multi_line=True)

        if page.attempt(act):
            site.lists.refresh()
            site.draw()

    with ui.element("div").classes("choices"):
        ui.button(texts("site.export"), on_click=export).props("dense outline no-caps data-act=export")
        ui.upload(label=texts("site.import"), on_upload=take, auto_upload=True, max_file_size=1 << 22).props(
            'flat bordered accept=".geojson,.json,.kml,.kmz"'
        )


def _background(page: CasePage, site: _Site) -> None:
    """A picture of the folder below the map, its middle at the origin."""
    texts, space = page.texts, page.session.space
    pictures = sorted(one.name for one in space.folder.iterdir() if one.suffix.lower() in _PICTURES and one.is_file())
    if not pictures:
        return
    kept = space.settings().get("background", {})
    chosen = {"file": "", "width": 500.0, **kept.get(page.case.name, {})}

    def keep(**change: object) -> None:
        chosen.update(change)
        now = {**space.settings().get("background", {}), page.case.name: chosen}
        if not chosen["file"]:
            now.pop(page.case.name)
        page.attempt(lambda: space.keep(background=now))
        site.draw()

    with ui.element("div").classes("form"):
        options = {"": texts("site.background_none"), **{name: name for name in pictures}}
        box = ui.select(options, value=chosen["file"], label=texts("site.background")).props("outlined dense")
        box.on_value_change(lambda event: keep(file=event.value))
        width = ui.number(texts("site.background_width"), value=chosen["width"], min=1.0, max=1e5)
        width.props("outlined dense").on_value_change(lambda event: keep(width=float(event.value or 500.0)))
