"""Page 6, the result of a run: the decision with the report, the map, and the files."""

from __future__ import annotations

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
    space = page.session.space
    names = [one.name for one in space.runs()]
    own = space.run_of(page.document.name) if page.document is not None else ""
    chosen = run or (own if own in names else "")
    if names:
        options = names if not chosen or chosen in names else [chosen, *names]
        with box("choices"):
            choose(
                "Run", options, chosen or None,
                lambda name: ui.navigate.to(page.address("result", run=name)),
            )  # fmt: skip
    if not chosen:
        note("This case has not been run yet: page 5 runs it.", "meaning")
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
            ui.tab(build.__name__, build.__name__.capitalize())
    with ui.tab_panels(tabs, value="decision", animated=False).style("width:100%").props("keep-alive=false"):
        for build in parts:
            with ui.tab_panel(build.__name__).style("padding:.6rem 0"):
                _when_seen(tabs, build)


def _mark_changes(page: CasePage, run: RunDirectory) -> None:
    """Say in which keys the case on the pages is another than that of the run, as long as it is."""
    place = box("news").props("role=status data-box=changed")
    place.set_visibility(False)

    def changes() -> list[str]:
        case = page.case.resolved()
        return ["the case has faults now"] if case is None else differences(run.stored_case(), case, words=_SIDES)

    async def judged() -> None:
        lines = await threads.io_bound(changes)
        place.clear()
        place.set_visibility(bool(lines))
        with place, box():
            note("This is the result of another state of the case, which has been changed since:", "warning")
            for line in lines[:_MOST_CHANGES]:
                ui.label(line)
            if len(lines) > _MOST_CHANGES:
                note(f"and {len(lines) - _MOST_CHANGES} more keys")
            ui.link("Compute it again", page.address("run"))

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
        self.page, self.name, self.run = page, name, found
        self.path: Path = found.path
        self.summary: Summary = found.summary

    def _address(self, file: str) -> str:
        return f"/files/{quote(self.name)}/{quote(file)}"

    def _framed(self, file: str) -> None:
        if not (self.path / file).is_file():
            note(f"The run has no {file} (yet).", "meaning")
            return
        ui.link(f"Open {file} alone", self._address(file), new_tab=True)
        ui.element("iframe").props(f'src="{self._address(file)}" title="{file}" loading=lazy')

    def decision(self) -> None:
        """The recommended distance, the verdicts, what it is not to fall below; then the report itself."""
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
                heading("Exposed sites")
                self._verdicts()
        heading("Report")
        if self.page.document is not None:
            self._document(self.page)
        self._framed("report.html")

    def _document(self, page: CasePage) -> None:
        """Number and names of the report, written into it; its pages hold them, with the digest of the numbers."""
        case = page.case.name
        note(
            "Number and names stand in the report once it is written with them; every printed page holds the number "
            "and the SHA-256 of the run's numbers. Sign the print, or the PDF of it.",
            "meaning",
        )
        form(page, ("document",), only=("number", "revision", "prepared_by", "reviewed_by", "approved_by"))
        title = f"{case}: report"
        command = ["report", case, "--out", self.name]
        with box("choices"):
            act("Write the report with them", "write-report", lambda: page.compute(title, self.name, command))

    def _verdicts(self) -> None:
        rows = []
        for entry in self.summary.exposed or ():
            verdict = entry.verdict
            mark = Raw(f'<span class="verdict {verdict.replace(" ", "-")}">{verdict}</span>')
            rows.append((entry.name, mark, criterion_words(entry), f"{rounded_metres(entry.distance)} m"))
        if not rows:
            note("The case has none.", "meaning")
            return
        html(facts(rows, ("Place", "Verdict", "Criterion", "Distance")))

    def map(self) -> None:
        """The map of the run; after a place was moved, flight and hazard alone are computed again."""
        page = self.page
        if page.document is not None:
            case = page.document.name
            commands = [[command, case, "--out", self.name] for command in ("fly", "report")]
            title = f"{case}: flight and hazard again"
            with box("choices"):
                ui.link("Move places on the map of page 4", page.address("site"))
                act("Compute flight and hazard alone again", "fly", lambda: page.compute(title, self.name, *commands))
        self._framed("map.html")

    def files(self) -> None:
        with box("list", "ul"):
            for file in sorted(one for one in self.path.iterdir() if one.is_file() and not one.name.startswith(".")):
                with box(tag="li"):
                    ui.link(file.name, f"{self._address(file.name)}?save=1")
                    note(f"{file.stat().st_size / 1e3:,.0f} kB")
        note(f"Folder: {self.path}")
