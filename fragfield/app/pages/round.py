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
from fragfield.app.drawing import round_facts, round_svg
from fragfield.app.forms import field_input, form
from fragfield.app.markup import Raw, facts, heading
from fragfield.errors import InputError
from fragfield.numbers import number
from fragfield_base.units import UnitError, read_measure

if TYPE_CHECKING:
    from pathlib import Path

    from fragfield.app.document import CaseDocument
    from fragfield.app.page import CasePage

__all__ = ["BARE", "content", "drawn_round"]

_DRAWINGS = (".dxf", ".svg", ".csv", ".xlsx", ".ods")
_UNITS = ("mm", "cm", "m", "in")
# A cased charge to begin with, where there is none.
BARE = {"unit": "mm", "outer": {"points": [[0, 20], [80, 40], [260, 40]]},
         "cavity": {"points": [[20, 10], [85, 32], [245, 32]]}, "charge": {}}  # fmt: skip
_TOLERANCE = 0.01  # of the drawing's masses, as `round.expected` allows


def content(page: CasePage) -> None:
    """Build the page."""
    texts = page.texts
    rounds = page.case.get(("round",), [])
    if not isinstance(rounds, list) or not rounds:
        ui.label(texts("round.none")).classes("meaning")
        ui.button(texts("round.first"), on_click=lambda: _first(page)).props("no-caps")
        return
    names = {index: str(entry.get("name", index + 1)) if isinstance(entry, dict) else str(index + 1)
             for index, entry in enumerate(rounds)}  # fmt: skip
    chosen = next((index for index in names if page.focus.startswith(f"round[{index + 1}]")), 0)

    @ui.refreshable
    def show(index: int) -> None:
        page.unbind("round[")
        _RoundEditor(page, index).build()

    if len(names) > 1:
        ui.select(
            names, value=chosen, label=texts("page.round"), on_change=lambda event: show.refresh(event.value)
        ).props("outlined dense")
    show(chosen)


def _first(page: CasePage) -> None:
    table = {"name": "round", "profile": dict(BARE), "explosive": "tnt", "casing": "steel_paper", "attitude": "upright",
             "position": ["0 m", "0 m", "1 m"]}  # fmt: skip
    if page.change(("round", 0), table):
        ui.navigate.reload()


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
    """The editor of one round."""

    def __init__(self, page: CasePage, index: int) -> None:
        self.page, self.index, self.path = page, index, ("round", index)
        profile = page.case.get((*self.path, "profile"))
        self.table: ContourTable | None = from_case(profile) if isinstance(profile, dict) else None

    def build(self) -> None:
        """Table on the left, drawing on the right; on a telephone the drawing first."""
        texts = self.page.texts
        with ui.element("div").classes("columns drawing-first"):
            with ui.element("section"):
                self._shape()
                self._from_file()
                heading(texts("round.materials"))
                self._materials()
                heading(texts("round.expected"))
                ui.label(texts("round.expected_why")).classes("meaning")
                with ui.element("div").classes("form"):
                    for key in ("casing", "charge"):
                        field_input(self.page, (*self.path, "expected", key), changed=self.draw)
                self._official()
            with ui.element("section").classes("beside"):
                self.picture = ui.html("", sanitize=False).classes("picture")
                self.facts = ui.html("", sanitize=False)
        self.draw()

    def _shape(self) -> None:
        texts, page = self.page.texts, self.page
        heading(texts("round.contour"))
        field_input(page, (*self.path, "name"))
        kinds = {"own": texts("round.own"), "ready": texts("round.ready")}
        value = "own" if self.table is not None else "ready"
        ui.toggle(kinds, value=value, on_change=lambda event: self._switch(event.value)).props("no-caps dense")
        if self.table is None:
            field_input(page, (*self.path, "profile"), choices=profile_names(), changed=self.draw)
            return
        with ui.element("div").classes("choices"):
            ui.toggle({False: texts("round.radii"), True: texts("round.diameters")}, value=self.table.diameters,
                      on_change=lambda event: self._count(diameters=event.value)).props("no-caps dense")  # fmt: skip
            ui.toggle({False: texts("round.from_nose"), True: texts("round.from_base")}, value=self.table.from_base,
                      on_change=lambda event: self._count(from_base=event.value)).props("no-caps dense")  # fmt: skip
            ui.select(list(_UNITS), value=self.table.unit, label=texts("round.unit"), on_change=self._unit).props(
                "dense outlined"
            )
        self._tables()

    @ui.refreshable_method
    def _tables(self) -> None:
        texts, table = self.page.texts, self.table
        assert table is not None
        across = texts("round.diameter" if table.diameters else "round.radius")
        heads = (
            f"{texts('round.station')} ({table.unit})",
            f"{across} ({table.unit})",
            f"{texts('round.arc')} ({table.unit})",
        )
        for name in ("outer", "cavity"):
            heading(texts(f"round.{name}"), 3)
            with ui.element("div").classes("contour").props(f'role=table aria-label="{texts(f"round.{name}")}"') as box:
                for head in heads:
                    ui.label(head).classes("head-cell")
                ui.label("")
                for row, cells in enumerate(getattr(table, name)):
                    for column, cell in enumerate(cells):
                        self._cell(name, row, column, cell, heads[column])
                    with ui.button(icon="close", on_click=lambda _, at=(name, row): self._remove(*at)) as away:
                        away.props(f'flat dense round size=sm tabindex=-1 aria-label="{texts("form.remove")}"')
            self.page.bind((*self.path, "profile", name), box)
            ui.button(texts("round.add_point"), icon="add", on_click=lambda _, name=name: self._add(name)).props(
                "dense flat no-caps"
            )
        heading(texts("round.charge"), 3)
        with ui.element("div").classes("form"):
            self._single("front", f"{texts('round.front')} ({table.unit})")
            fills = {"": texts("round.full"), "inert": texts("round.inert"), "void": texts("round.void")}
            fill = ui.select(fills, value=table.fill, label=texts("round.fill"))
            fill.props("outlined dense").on_value_change(lambda event: self._put("fill", event.value))
            self._single("mass", f"{texts('round.fuze_mass')} (kg)")

    def _cell(self, name: str, row: int, column: int, value: str, head: str) -> None:
        if column == 2 and row == 0:
            ui.label("")
            return
        box = ui.input(value=value, on_change=lambda event: self._type(name, row, column, event.value))
        box.props(f'outlined dense inputmode=decimal data-cell="{name}-{row}-{column}" aria-label="{head}, {row + 1}"')
        box.on("keydown.enter", lambda _: self._add(name, row + 1))

    def _single(self, name: str, label: str) -> None:
        assert self.table is not None
        box = ui.input(label, value=getattr(self.table, name), on_change=lambda event: self._put(name, event.value))
        box.props(f"outlined dense stack-label inputmode=decimal data-cell={name}")
        place = ("charge", "front") if name == "front" else ("fuze", "mass")
        self.page.bind((*self.path, "profile", *place[:1]), box)

    def _type(self, name: str, row: int, column: int, text: str | None) -> None:
        getattr(self.table, name)[row][column] = text or ""
        self._keep()

    def _put(self, name: str, text: str | None) -> None:
        setattr(self.table, name, text or "")
        self._keep()

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

    def _count(self, *, diameters: bool | None = None, from_base: bool | None = None) -> None:
        table = self.table
        assert table is not None
        self.table = from_case(
            to_case(table, {}), diameters=table.diameters if diameters is None else diameters,
            from_base=table.from_base if from_base is None else from_base,
        )  # fmt: skip
        self._tables.refresh()

    def _unit(self, event: Any) -> None:  # noqa: ANN401 - of NiceGUI
        assert self.table is not None
        self.table.unit = event.value
        self._keep()
        self._tables.refresh()

    def _keep(self) -> None:
        """Put the table into the case, and draw it."""
        assert self.table is not None
        place = (*self.path, "profile")
        before = self.page.case.get(place)
        self.page.change(place, to_case(self.table, before if isinstance(before, dict) else {}))
        self.draw()

    def _switch(self, kind: str) -> None:
        """To an own contour, beginning with that of the ready profile, or to a ready profile."""
        place = (*self.path, "profile")
        if kind == "ready":
            self.page.change(place, profile_names()[0])
        else:
            name = self.page.case.get(place)
            file = PROFILES / f"{name}.toml"
            tables = tomllib.loads(file.read_text(encoding="utf-8")) if file.is_file() else dict(BARE)
            tables.pop("notes", None)
            self.page.change(place, {**tables, "title": f"after {name}"} if "title" in tables else tables)
        ui.navigate.reload()

    def _from_file(self) -> None:
        """The contour of a drawing or of a table of diameters in the folder, as `fragfield convert` reads it."""
        texts, page = self.page.texts, self.page
        folder = page.case.path.parent
        files = sorted(one.name for one in folder.iterdir() if one.suffix.lower() in _DRAWINGS and one.is_file())
        if not files:
            return
        chosen = {"file": files[0], "settings": ""}

        def take() -> None:
            def act() -> None:
                settings = [one.strip() for one in chosen["settings"].split(",") if one.strip()]
                found = fragfield.convert(folder / chosen["file"], set=settings)
                page.case.set((*self.path, "profile"), found.tables)
                ui.notify("\n".join(found.notes), type="positive", multi_line=True)

            if page.attempt(act):
                ui.navigate.reload()

        with ui.expansion(texts("round.from_file")).classes("folded"):
            with ui.element("div").classes("form"):
                box = ui.select(files, value=files[0], label=texts("data.file")).props("outlined dense")
                box.on_value_change(lambda event: chosen.update(file=event.value))
                words = ui.input(texts("round.file_settings"), placeholder="unit=1 mm").props(
                    "outlined dense stack-label"
                )
                words.on_value_change(lambda event: chosen.update(settings=event.value or ""))
            ui.button(texts("round.take_file"), on_click=take).props("no-caps outline dense data-act=take-file")

    def _materials(self) -> None:
        with ui.element("div").classes("form"):
            for key, names in (("explosive", burst_explosive_names()), ("casing", casing_names())):
                place = (*self.path, key)
                if isinstance(self.page.case.get(place), dict):
                    form(self.page, place)
                else:
                    field_input(self.page, place, choices=names, changed=self.draw)
        self.sources = ui.label("").classes("meaning")

    def _official(self) -> None:
        with ui.expansion(self.page.texts("round.official"), value=self.page.focus.startswith("official")).classes(
            "folded"
        ):
            form(self.page, ("official",))
        with ui.expansion(self.page.texts("round.more")).classes("folded"):
            form(self.page, self.path, only=("mesh",))

    def draw(self) -> None:
        """Draw the round as it stands in the draft, or say why it cannot be drawn."""
        texts = self.page.texts
        try:
            item = drawn_round(self.page.case, self.index)
        except InputError as error:
            self.picture.classes("stale")
            self.facts.set_content(f'<p class="fault" role="alert">{escape(str(error))}</p>')
            return
        numbers = round_facts(item)
        self.picture.classes(remove="stale")
        self.picture.set_content(round_svg(item, texts("round.drawing")))
        self.facts.set_content(_facts_table(self.page, numbers, self._expected()))
        words = (
            f"{name}: {source}"
            for name, source in ((item.explosive.name, item.explosive.source), (item.casing.name, item.casing.source))
            if source
        )
        self.sources.set_text(" ".join(words))

    def _expected(self) -> dict[str, float]:
        given = self.page.case.get((*self.path, "expected"), {})
        found: dict[str, float] = {}
        for key, text in given.items() if isinstance(given, dict) else ():
            try:
                measure = read_measure(str(text))
            except UnitError:
                continue
            if measure.is_of("kg") and measure.value > 0.0:
                found[key] = measure.value
        return found


def _facts_table(page: CasePage, found: dict[str, float], expected: dict[str, float]) -> str:
    texts = page.texts
    rows = [(texts(f"fact.{key}"), f"{number(found[key], 4)} kg", _difference(texts, found[key], expected.get(key)))
            for key in ("casing", "charge", "fuze", "whole")]  # fmt: skip
    rows += [
        (texts("fact.ratio"), number(found["ratio"], 4), ""),
        (texts("fact.fuze_density"), f"{number(found['fuze_density'], 4)} kg/m³" if found["fuze_density"] else "–", ""),
        (texts("fact.centre"), f"{number(1e3 * found['centre'], 4)} mm", texts("fact.from_nose")),
        (texts("fact.size"), f"{number(1e3 * found['length'], 4)} × ⌀ {number(1e3 * found['diameter'], 4)} mm", ""),
    ]
    return facts(rows)


def _difference(texts: Any, mass: float, wanted: float | None) -> str:  # noqa: ANN401 - texts
    if wanted is None:
        return ""
    off = mass / wanted - 1.0
    kind = "good" if abs(off) <= _TOLERANCE else "bad"
    sign = "✓" if kind == "good" else "✗"
    return Raw(f'<span class="{kind}">{sign} {off:+.2%} {escape(texts("fact.of_drawing"))}</span>'.replace("-", "−"))
