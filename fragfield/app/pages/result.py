"""Page 6, the result of a run: the decision with the report, the map, and the files."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from nicegui import run as threads
from nicegui import ui

import fragfield
from fragfield.app.forms import form
from fragfield.app.page import Raw, act, box, choose, facts, heading, html, note
from fragfield.case import differences
from fragfield.files.run_directory import RunDirectory
from fragfield.hazard.verdict import criterion_words
from fragfield.numbers import SPACE
from fragfield.results.words import headline, rounded_metres

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from fragfield.app.page import CasePage
    from fragfield.results.summary import Summary


_MOST_CHANGES = 6
_SIDES = ("in the run", "now")


def content(page: CasePage, run: str = "") -> None:
    """Build the page of a run: that of the address, else that of the case."""
    texts, space = page.texts, page.session.space
    names = [one.name for one in space.runs()]
    own = space.run_of(page.document.name) if page.document is not None else ""
    chosen = run or (own if own in names else "")
    if names:
        options = names if not chosen or chosen in names else [chosen, *names]
        with box("choices"):
            choose(
                texts("result.run"), options, chosen or None,
                lambda name: ui.navigate.to(page.address("result", run=name)),
            )  # fmt: skip
    if not chosen:
        note(texts("result.none"), "meaning")
        return
    try:
        found = fragfield.open(space.inside(chosen))
        part = _Parts(page, chosen, found)
    except fragfield.InputError as error:
        note(str(error), "fault")
        return
    if page.document is not None:
        _mark_changes(page, RunDirectory(found.path))
    parts = (part.decision, part.map, part.files)
    with ui.tabs().props("no-caps align=left inline-label outside-arrows mobile-arrows") as tabs:
        for build in parts:
            ui.tab(build.__name__, texts(f"result.{build.__name__}"))
    with ui.tab_panels(tabs, value="decision", animated=False).style("width:100%").props("keep-alive=false"):
        for build in parts:
            with ui.tab_panel(build.__name__).style("padding:.6rem 0"):
                _when_seen(tabs, build)


def _mark_changes(page: CasePage, run: RunDirectory) -> None:
    """Say in which keys the case on the pages is another than that of the run, as long as it is."""
    texts, place = page.texts, box("news").props("role=status data-box=changed")
    place.set_visibility(False)

    def changes() -> list[str]:
        case = page.case.resolved()
        return [texts("result.has_faults")] if case is None else differences(run.stored_case(), case, words=_SIDES)

    async def judged() -> None:
        lines = await threads.io_bound(changes)
        place.clear()
        place.set_visibility(bool(lines))
        with place, box():
            note(texts("result.changed"), "warning")
            for line in lines[:_MOST_CHANGES]:
                ui.label(line)
            if len(lines) > _MOST_CHANGES:
                note(texts("result.more_changes", number=len(lines) - _MOST_CHANGES))
            ui.link(texts("result.compute_again"), page.address("run"))

    page.follow(judged)


def _when_seen(tabs: ui.tabs, build: Callable[[], None]) -> None:
    place = box().style("width:100%")

    def show() -> None:
        if (tabs.value or "decision") == build.__name__ and not place.default_slot.children:
            with place:
                build()

    show()
    tabs.on_value_change(show)


class _Parts:
    def __init__(self, page: CasePage, name: str, found: Any) -> None:  # noqa: ANN401 - a run
        self.page, self.texts, self.name, self.run = page, page.texts, name, found
        self.path: Path = found.path
        self.summary: Summary = found.summary

    def _address(self, file: str) -> str:
        return f"/files/{quote(self.name)}/{quote(file)}"

    def _framed(self, file: str) -> None:
        if not (self.path / file).is_file():
            note(self.texts("result.no_file", name=file), "meaning")
            return
        ui.link(self.texts("result.alone", name=file), self._address(file), new_tab=True)
        ui.element("iframe").props(f'src="{self._address(file)}" title="{file}" loading=lazy')

    def decision(self) -> None:
        """The recommended distance, the verdicts, what it is not to fall below; then the report itself."""
        texts = self.texts
        with box("columns"):
            with box(tag="section"):
                if to_apply := self.summary.distance_to_apply:
                    heading(to_apply.line.partition(": ")[0])
                    note(to_apply.distances.replace(" m ", f"{SPACE}m "), "number").props("data-box=to_apply")
                    for words in to_apply.words:
                        note(words)
                shown = headline(self.summary.hazard)
                heading(shown.label)
                note(f"{shown.value} {shown.unit}".rstrip(), "number").props("data-box=recommended")
                note(shown.note, "meaning" if shown.unit else "fault")
            with box(tag="section"):
                heading(texts("result.verdicts"))
                self._verdicts()
        heading(texts("result.report"))
        if self.page.document is not None:
            self._document(self.page)
        self._framed("report.html")

    def _document(self, page: CasePage) -> None:
        """Number and names of the report, written into it; its pages hold them, with the digest of the numbers."""
        texts, case = self.texts, page.case.name
        note(texts("result.sign_how"), "meaning")
        form(page, ("document",), only=("number", "revision", "prepared_by", "reviewed_by", "approved_by"))
        title = texts("result.report_title", name=case)
        command = ["report", case, "--out", self.name]
        with box("choices"):
            act(texts("result.write_report"), "write-report", lambda: page.compute(title, self.name, command))

    def _verdicts(self) -> None:
        texts, rows = self.texts, []
        for entry in self.summary.exposed or ():
            verdict = entry.verdict
            words = escape(texts("verdict." + verdict.replace(" ", "_")))
            mark = Raw(f'<span class="verdict {verdict.replace(" ", "-")}">{words}</span>')
            rows.append((entry.name, mark, criterion_words(entry), f"{rounded_metres(entry.distance)} m"))
        if not rows:
            note(texts("result.no_places"), "meaning")
            return
        html(facts(rows, [texts(f"result.{name}") for name in ("place", "verdict", "criterion", "distance")]))

    def map(self) -> None:
        """The map of the run; after a place was moved, flight and hazard alone are computed again."""
        page, texts = self.page, self.texts
        if page.document is not None:
            case = page.document.name
            commands = [[command, case, "--out", self.name] for command in ("fly", "report")]
            title = texts("result.fly_title", name=case)
            with box("choices"):
                ui.link(texts("result.move"), page.address("site"))
                act(texts("result.fly_again"), "fly", lambda: page.compute(title, self.name, *commands))
        self._framed("map.html")

    def files(self) -> None:
        """Every file of the run."""
        with box("list", "ul"):
            for file in sorted(one for one in self.path.iterdir() if one.is_file() and not one.name.startswith(".")):
                with box(tag="li"):
                    ui.link(file.name, f"{self._address(file.name)}?save=1")
                    note(f"{file.stat().st_size / 1e3:,.0f} kB")
        note(self.texts("result.folder", path=str(self.path)))
