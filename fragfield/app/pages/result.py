"""Page 7, the result of a run: the decision, the map, the views, and every table by the catalogue of quantities."""

from __future__ import annotations

import math
from html import escape
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from nicegui import run as threads
from nicegui import ui

import fragfield
from fragfield.app.jobs import start_job
from fragfield.app.markup import Raw, heading, shown_facts
from fragfield.hazard.certainty import metres, whole_metres
from fragfield.hazard.recommended import parts_words
from fragfield.hazard.verdict import criterion_words
from fragfield.numbers import number
from fragfield.quantities import QUANTITIES

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from fragfield.app.page import CasePage

__all__ = ["content"]

_MOST_ROWS = 500


def content(page: CasePage, run: str = "") -> None:
    """Build the page of a run: that of the address, else that of the case."""
    texts, space = page.texts, page.session.space
    names = [one.name for one in space.runs()]
    own = space.run_of(page.document.name) if page.document is not None else ""
    chosen = run or (own if own in names else "")
    with ui.element("div").classes("choices"):
        if names:
            options = names if not chosen or chosen in names else [chosen, *names]
            box = ui.select(options, value=chosen or None, label=texts("result.run")).props("outlined dense")
            box.on_value_change(lambda event: ui.navigate.to(page.address("result", run=event.value)))
    if not chosen:
        ui.label(texts("result.none")).classes("meaning")
        return
    try:
        path = space.inside(chosen)
        found = fragfield.open(path)
        summary = found.summary
    except fragfield.InputError as error:
        ui.label(str(error)).classes("fault")
        return
    parts: dict[str, Callable[[], object]] = {
        "decision": lambda: _decision(page, chosen, path, summary),
        "map": lambda: _map(page, chosen, path),
        "figures": lambda: _figures(page, chosen, path),
        "view": lambda: _view(page, chosen, path),
        "numbers": lambda: _numbers(summary),
        "tables": lambda: _tables(page, found),
        "files": lambda: _files(page, chosen, path),
    }
    with ui.tabs().props("no-caps align=left inline-label outside-arrows mobile-arrows") as tabs:
        for name in parts:
            ui.tab(name, texts(f"result.{name}"))
    with ui.tab_panels(tabs, value="decision", animated=False).style("width:100%").props("keep-alive=false"):
        for name, build in parts.items():
            with ui.tab_panel(name).style("padding:.6rem 0"):
                _when_seen(tabs, name, build)


def _when_seen(tabs: ui.tabs, name: str, build: Callable[[], object]) -> None:
    """Build a part when it is first looked at."""
    place = ui.element("div")

    def show() -> None:
        if tabs.value == name and not place.default_slot.children:
            with place:
                build()

    if name == "decision":
        with place:
            build()
    tabs.on_value_change(show)


def _framed(page: CasePage, run: str, path: Path, name: str) -> None:
    if not (path / name).is_file():
        ui.label(page.texts("result.no_file", name=name)).classes("meaning")
        return
    address = f"/files/{quote(run)}/{name}"
    ui.link(page.texts("result.alone", name=name), address, new_tab=True)
    ui.element("iframe").props(f'src="{address}" title="{name}" loading=lazy')


def _decision(page: CasePage, run: str, path: Path, summary: Mapping[str, Any]) -> None:
    """The recommended distance, the verdicts, what it is not to fall below; then the report itself."""
    texts, hazard = page.texts, summary.get("hazard") or {}
    with ui.element("div").classes("columns"):
        with ui.element("section"):
            heading(texts("result.recommended"))
            if hazard.get("determined"):
                ui.label(f"{whole_metres(hazard['recommended'])} m").classes("number").props("data-box=recommended")
                ui.label(parts_words(hazard)).classes("meaning")
            else:
                ui.label(texts("result.undetermined")).classes("number")
                ui.label(str(hazard.get("reason") or texts("result.not_computed"))).classes("fault")
            for words in (summary.get("minimum") or {}).get("words", ()):
                ui.label(words).classes("note")
        with ui.element("section"):
            heading(texts("result.verdicts"))
            _verdicts(page, summary.get("exposed") or [])
    heading(texts("result.report"))
    _framed(page, run, path, "report.html")


def _verdicts(page: CasePage, exposed: list[Mapping[str, Any]]) -> None:
    texts = page.texts
    rows: list[tuple[str, ...]] = []
    for entry in exposed:
        verdict = entry["verdict"]
        words = escape(texts("verdict." + verdict.replace(" ", "_")))
        mark = Raw(f'<span class="verdict {verdict.replace(" ", "-")}">{words}</span>')
        rows.append((entry["name"], mark, criterion_words(entry), metres(entry["distance"])))
    if not rows:
        ui.label(texts("result.no_places")).classes("meaning")
        return
    heads = [texts(f"result.{name}") for name in ("place", "verdict", "criterion", "distance")]
    shown_facts(rows, heads)


def _map(page: CasePage, run: str, path: Path) -> None:
    """The map of the run; after a place was moved, flight and hazard alone are computed again."""
    if page.document is not None:
        with ui.element("div").classes("choices"):
            ui.link(page.texts("result.move"), page.address("site"))
            ui.button(page.texts("result.fly_again"), on_click=lambda: _fly_again(page, run)).props(
                "no-caps outline dense data-act=fly"
            )
    _framed(page, run, path, "map.html")


def _fly_again(page: CasePage, run: str) -> None:
    def act() -> None:
        if page.case.is_draft:
            page.case.save()
        commands = [[name, page.case.name, "--out", run] for name in ("fly", "report")]
        title = page.texts("result.fly_title", name=page.case.name)
        start_job(page.session.space, title=title, case=page.case.name, run=run, commands=commands)

    if page.attempt(act):
        ui.navigate.to(page.address("run"))


def _figures(page: CasePage, run: str, path: Path) -> None:
    pictures = sorted((path / "figures").glob("*.svg")) if (path / "figures").is_dir() else []
    if not pictures:
        ui.label(page.texts("result.no_file", name="figures")).classes("meaning")
    with ui.element("div").classes("cards"):
        for picture in pictures:
            with ui.element("figure").classes("card").style("margin:0"):
                address = f"/files/{quote(run)}/figures/{quote(picture.name)}"
                ui.element("img").props(f'src="{address}" alt="{escape(picture.stem)}" loading=lazy').style(
                    "width:100%"
                )
                ui.link(picture.stem.replace("_", " "), address, new_tab=True)


def _view(page: CasePage, run: str, path: Path) -> None:
    there = [name for name in ("view_fragments.html", "view_burst.html") if (path / name).is_file()]
    for name in there[:1]:
        _framed(page, run, path, name)
    for name in there[1:]:
        ui.link(page.texts("result.alone", name=name), f"/files/{quote(run)}/{name}", new_tab=True)
    if not there:
        ui.label(page.texts("result.no_view")).classes("meaning")


def _numbers(summary: Mapping[str, Any]) -> None:
    """Every value of summary.json that the catalogue lists, by stage."""
    rows: list[tuple[str, ...]] = []
    for one in QUANTITIES.values():
        if "[]" not in one.path:
            rows += [(one.stage, row.name, row.value, row.note) for row in one.rows(summary)]
    shown_facts(rows, ["", "", "", ""])


def _tables(page: CasePage, found: Any) -> None:  # noqa: ANN401 - a run
    texts = page.texts
    names = {name: f"{name}: {what}" for name, what in found.tables.items()}
    if not names:
        ui.label(texts("result.not_computed")).classes("meaning")
        return
    place = ui.element("div")

    async def show(name: str) -> None:
        place.clear()
        try:
            table = await threads.io_bound(found.table, name)
        except fragfield.InputError as error:
            with place:
                ui.label(str(error)).classes("fault")
            return
        columns = [table[column] for column in table.columns]
        flat = [(column, values) for column, values in zip(table.columns, columns, strict=True) if values.ndim == 1]
        rows = [tuple(_cell(values[row]) for _, values in flat) for row in range(min(len(table), _MOST_ROWS))]
        with place:
            ui.label(texts("result.rows", shown=len(rows), number=len(table))).classes("note")
            shown_facts(rows, [column for column, _ in flat])

    async def workbook() -> None:
        name = f"{found.path.name}_tables.xlsx"
        file = page.session.space.state(name)
        try:
            await threads.io_bound(found.write_tables, file)
        except fragfield.InputError as error:
            ui.notify(str(error), type="negative")
            return
        ui.download.content(file.read_bytes(), name)
        file.unlink()

    ui.select(names, label=texts("result.table"), on_change=lambda event: show(event.value)).props("outlined dense")
    ui.button(texts("result.workbook"), on_click=workbook).props("outline no-caps")
    place.move(target_index=-1)


def _cell(value: Any) -> str:  # noqa: ANN401 - of a NumPy array
    if isinstance(value, str):
        return str(value)
    plain = value.item()
    if isinstance(plain, float):
        return "–" if math.isnan(plain) else number(plain, 5)
    return plain.decode("utf-8", "replace") if isinstance(plain, bytes) else str(plain)


def _files(page: CasePage, run: str, path: Path) -> None:
    with ui.element("ul").classes("list"):
        for file in sorted(one for one in path.iterdir() if one.is_file() and not one.name.startswith(".")):
            with ui.element("li"):
                ui.link(file.name, f"/files/{quote(run)}/{quote(file.name)}?save=1")
                ui.label(f"{file.stat().st_size / 1e3:,.0f} kB").classes("note")
    ui.label(page.texts("result.folder", path=str(path))).classes("note")
