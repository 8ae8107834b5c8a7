"""Page 2, the round: its contour, fill and casing; the drawing follows what is typed."""

from __future__ import annotations

import tomllib
from html import escape
from typing import TYPE_CHECKING, Any

from nicegui import ui

import fragfield
from burst_fenicsx.errors import InputError as BurstInputError
from burst_fenicsx.geometry import load_profile, profile_from_table
from burst_fenicsx.geometry.files import PROFILES, profile_names
from burst_fenicsx.materials.library import burst_explosive_names, casing_names, load_casing, load_explosive
from burst_fenicsx.problem import Round
from fragfield.app.contour import ContourTable, from_case, to_case
from fragfield.app.forms import field_input, files_in, form, keep_file, upload
from fragfield.app.page import act, box, choose, facts, fold, heading, html, note
from fragfield.case.conversion.rounds import masses_of
from fragfield.errors import InputError
from fragfield.numbers import number
from fragfield.report.figures.rounds import centre_of_mass, round_svg

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from fragfield.app.document import CaseDocument
    from fragfield.app.page import CasePage


_DRAWINGS = (".dxf", ".csv", ".xlsx")
_UNITS = ("mm", "cm", "m", "in")
# A cased charge to begin with, where there is none.
BARE = {"unit": "mm", "outer": {"points": [[0, 20], [80, 40], [260, 40]]},
         "cavity": {"points": [[20, 10], [85, 32], [245, 32]]}, "charge": {}}  # fmt: skip
OWN_ROUND = {"name": "round", "profile": BARE, "explosive": "tnt", "casing": "steel_paper", "attitude": "upright",
             "position": ["0 m", "0 m", "1 m"]}  # fmt: skip


def content(page: CasePage) -> None:
    """Build the page."""
    rounds = page.case.get(("round",), [])

    def first() -> None:
        if page.change(("round", 0), OWN_ROUND):
            ui.navigate.reload()

    if not isinstance(rounds, list) or not rounds:
        note("The case has no round.", "meaning")
        act("Add a round", "first-round", first, look="")
        return
    names = {index: str(entry.get("name", index + 1)) if isinstance(entry, dict) else str(index + 1)
             for index, entry in enumerate(rounds)}  # fmt: skip
    chosen = next((index for index in names if page.focus.startswith(f"round[{index + 1}]")), 0)

    @ui.refreshable
    def show(index: int) -> None:
        page.unbind("round[")
        _RoundEditor(page, index, lambda: show.refresh(index)).build()

    if len(names) > 1:
        choose("Round", names, chosen, show.refresh)
    show(chosen)


def drawn_round(case: CaseDocument, index: int) -> Round:
    """A round of the draft for its drawing; raises InputError where its contour or its materials are at fault."""
    entry = case.get(("round", index), {})
    profile, folder = entry.get("profile"), case.path.parent
    where = f"round[{index + 1}].profile"
    try:
        shape = (
            profile_from_table(profile, where) if isinstance(profile, dict) else load_profile(_located(profile, folder))
        )
        return Round(
            str(entry.get("name", "")), load_explosive(_located(entry.get("explosive"), folder)),
            load_casing(_located(entry.get("casing"), folder)), profile=shape,
        )  # fmt: skip
    except BurstInputError as error:
        raise InputError(str(error)) from None


def _located(name: object, folder: Path) -> str:
    """A built-in name as it is, a file's name relative to the case's folder."""
    if not isinstance(name, str):
        raise InputError(f"found {type(name).__name__}; allowed for a drawing: a name or a file")
    return str(folder / name) if name.partition("#")[0].endswith(".toml") else name


class _RoundEditor:
    def __init__(self, page: CasePage, index: int, again: Callable[[], object]) -> None:
        self.again = again
        self.page, self.index, self.path = page, index, ("round", index)
        self.place = (*self.path, "profile")
        profile = page.case.get(self.place)
        self.own = isinstance(profile, dict)
        self.table = from_case(profile) if self.own else ContourTable()

    def build(self) -> None:
        """Table on the left, drawing on the right; on a telephone the drawing first."""
        page = self.page
        with box("columns drawing-first"):
            with box(tag="section"):
                self._shape()
                self._from_file()
                heading("Fill and casing")
                self._materials()
                heading("Masses on the drawing")
                note(
                    "Contours and materials must give them within 1 %: this finds diameters given for radii, and "
                    "wrong units.",
                    "meaning",
                )
                with box("form"):
                    for key in ("casing", "charge"):
                        field_input(page, (*self.path, "expected", key))
                with fold("Official distances of this round", opened=page.focus.startswith("official")):
                    form(page, ("official",))
                with fold("Mesh of its own"):
                    form(page, self.path, only=("mesh",))
            with box("beside", "section"):
                self.picture, self.facts = html(kind="picture"), html()
        self.draw()

    def _shape(self) -> None:
        page, table = self.page, self.table
        heading("Contour")
        field_input(page, (*self.path, "name"))
        kinds = {True: "Own drawing", False: "Ready profile"}
        ui.toggle(kinds, value=self.own, on_change=lambda event: self._switch(own=event.value))
        if not self.own:
            field_input(page, self.place, choices=profile_names(), changed=self.draw)
            return
        with box("choices"):
            for name, options in (
                ("diameters", {False: "Radii", True: "Diameters"}),
                ("from_base", {False: "Stations from nose", True: "Stations from base"}),
            ):
                ui.toggle(
                    options, value=getattr(table, name),
                    on_change=lambda event, name=name: self._count(**{name: event.value}),
                )  # fmt: skip
            choose("Unit", list(_UNITS), table.unit, lambda unit: self._put("unit", unit, again=True))
        self._tables()

    @ui.refreshable_method
    def _tables(self) -> None:
        table = self.table
        across = "Diameter" if table.diameters else "Radius"
        heads = [f"{one} ({table.unit})" for one in ("Station", across, "Arc radius")]
        with box("contours") as contours:
            for name, title in (("outer", "Outside of the casing"), ("cavity", "Cavity")):
                heading(title, 3)
                with box("contour").props(f'role=table aria-label="{title}"'):
                    for head in (*heads, ""):
                        note(head, "head-cell")
                    for row, cells in enumerate(getattr(table, name)):
                        for column, cell in enumerate(cells):
                            self._cell(name, row, column, cell, heads[column])
                        with ui.button(icon="close", on_click=lambda _, at=(name, row): self._remove(*at)) as away:
                            away.props("flat dense round size=sm tabindex=-1 aria-label=Remove")
                ui.button("Add a point", icon="add", on_click=lambda _, name=name: self._add(name)).props("dense flat")
        self.page.bind(self.place, contours)
        heading("Charge and fuze", 3)
        with box("form"):
            self._single("front", f"Front of the charge ({table.unit})", "charge")
            fills = {"": "nothing: the cavity is full", "inert": "inert fuze", "void": "void"}
            choose("Before the charge", fills, table.fill, lambda fill: self._put("fill", fill))
            self._single("mass", "Mass of the fuze (kg)", "fuze")

    def _cell(self, name: str, row: int, column: int, value: str, head: str) -> None:
        if column == 2 and row == 0:
            ui.label("")
            return

        def take(event: Any) -> None:  # noqa: ANN401 - of NiceGUI
            getattr(self.table, name)[row][column] = event.value or ""
            self._keep()

        cell = ui.input(value=value, on_change=take).on("keydown.enter", lambda _: self._add(name, row + 1))
        cell.props(f'inputmode=decimal data-cell="{name}-{row}-{column}" aria-label="{head}, {row + 1}"')

    def _single(self, name: str, label: str, key: str) -> None:
        element = ui.input(label, value=getattr(self.table, name), on_change=lambda event: self._put(name, event.value))
        self.page.bind((*self.place, key), element.props(f"inputmode=decimal data-cell={name}"))

    def _put(self, name: str, text: str | None, *, again: bool = False) -> None:
        setattr(self.table, name, text or "")
        self._keep()
        if again:
            self._tables.refresh()

    def _add(self, name: str, row: int | None = None) -> None:
        rows = getattr(self.table, name)
        at = len(rows) if row is None else row
        rows.insert(at, ["", "", ""])
        self._tables.refresh()
        ui.run_javascript(f"setTimeout(() => fragfield.cell('{name}-{at}-0'), 60)")

    def _remove(self, name: str, row: int) -> None:
        del getattr(self.table, name)[row]
        self._keep()
        self._tables.refresh()

    def _count(self, **change: bool) -> None:
        how = {"diameters": self.table.diameters, "from_base": self.table.from_base, **change}
        self.table = from_case(to_case(self.table, {}), **how)
        self._tables.refresh()

    def _keep(self) -> None:
        before = self.page.case.get(self.place)
        self.page.change(self.place, to_case(self.table, before if isinstance(before, dict) else {}))
        self.draw()

    def _switch(self, *, own: bool) -> None:
        """To an own contour, beginning with that of the ready profile, or to a ready profile."""
        name = self.page.case.get(self.place)
        tables: Any = profile_names()[0]
        if own:
            file = PROFILES / f"{name}.toml"
            tables = tomllib.loads(file.read_text(encoding="utf-8")) if file.is_file() else dict(BARE)
            tables.pop("notes", None)
            tables |= {"title": f"after {name}"} if "title" in tables else {}
        self.page.change(self.place, tables)
        self.again()

    def _from_file(self) -> None:
        """The contour of a drawing or of a table of diameters, as `fragfield convert` reads it."""
        page = self.page
        files = files_in(page.folder, _DRAWINGS)
        chosen = {"file": files[0] if files else "", "settings": ""}

        def take() -> None:
            settings = [one.strip() for one in chosen["settings"].split(",") if one.strip()]
            found = fragfield.convert(page.folder / chosen["file"], set=settings)
            page.case.set(self.place, found.tables)
            ui.notify("\n".join(found.notes), type="positive", multi_line=True, timeout=0, close_button="×")

        def act_on_file() -> None:
            if page.attempt(take):
                self.again()

        opened = bool(files) and page.case.get(self.place) == BARE
        with fold("From a file: drawing (DXF) or table of diameters", opened=opened):
            if files:
                with box("form"):
                    choose("File", files, files[0], lambda name: chosen.update(file=name))
                    ui.input(
                        "How it is read, as KEY=VALUE, with commas between", placeholder="unit=1 mm",
                        on_change=lambda event: chosen.update(settings=event.value or ""),
                    )  # fmt: skip
                act("Take its contour", "take-file", act_on_file)
            upload(page, "Choose a file", _DRAWINGS, lambda name, data: keep_file(page, name, data, _DRAWINGS))

    def _materials(self) -> None:
        with box("form"):
            for key, names in (("explosive", burst_explosive_names()), ("casing", casing_names())):
                place = (*self.path, key)
                if isinstance(self.page.case.get(place), dict):
                    form(self.page, place)
                else:
                    field_input(self.page, place, choices=names, changed=self.draw)
        self.sources = note("", "meaning")

    def draw(self) -> None:
        """Draw the round as it stands in the draft, or say why it cannot be drawn."""
        try:
            item = drawn_round(self.page.case, self.index)
        except InputError as error:
            self.picture.classes("stale")
            self.facts.set_content(f'<p class="fault" role="alert">{escape(str(error))}</p>')
            return
        self.picture.classes(remove="stale")
        centre = centre_of_mass(item)
        self.picture.set_content(round_svg(item, centre))
        self.facts.set_content(_facts_table(item, centre))
        used = (item.explosive, item.casing)
        self.sources.set_text(" ".join(f"{one.name}: {one.source}" for one in used if one.source))


def _facts_table(item: Round, centre: float) -> str:
    found, profile = masses_of(item), item.profile
    assert profile is not None
    masses = {"Casing": found.casing, "Charge": found.charge, "Fuze": found.fuze, "Whole round": found.whole}
    return facts([
        *((name, f"{number(mass, 4)} kg") for name, mass in masses.items()),
        ("Charge / casing (C/M)", number(found.ratio, 4)),
        ("Fuze density", f"{number(profile.fuze_density, 4)} kg/m³" if profile.fuze_density else "–"),
        ("Centre of mass", f"{number(1e3 * centre, 4)} mm from the nose"),
        ("Length and diameter", f"{number(1e3 * profile.length, 4)} × ⌀ {number(2e3 * profile.max_radius, 4)} mm"),
    ])  # fmt: skip
