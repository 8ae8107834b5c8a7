"""Page 6, the result of a run: the decision, report and map, flight alone again, and the files."""

from __future__ import annotations

from typing import TYPE_CHECKING
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
            choose("Run", options, chosen or None, lambda name: ui.navigate.to(page.address("result", run=name)))
    if not chosen:
        note("This case has not been run yet: page 5 runs it.", "meaning")
        return
    try:
        found = fragfield.open(space.inside(chosen))
        summary = found.summary
    except fragfield.InputError as error:
        note(str(error), "fault")
        return
    if page.document is not None:
        _mark_changes(page, RunDirectory(found.path))
    with box("columns"):
        with box(tag="section"):
            _decision(summary)
        with box(tag="section"):
            heading("Exposed sites")
            _verdicts(summary)
    with box("choices"):
        for file in ("report.html", "map.html"):
            if (found.path / file).is_file():
                ui.link(f"Open {file}", _address(chosen, file), new_tab=True)
    if page.document is not None:
        _again(page, chosen)
    heading("Files")
    _files(chosen, found.path)


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


def _address(run: str, file: str) -> str:
    return f"/files/{quote(run)}/{quote(file)}"


def _decision(summary: Summary) -> None:
    if to_apply := summary.distance_to_apply:
        heading(to_apply.line.partition(": ")[0])
        note(to_apply.distances.replace(" m ", f"{SPACE}m "), "number").props("data-box=to_apply")
        for words in to_apply.words:
            note(words)
    shown = headline(summary.hazard)
    heading(shown.label)
    note(f"{shown.value} {shown.unit}".rstrip(), "number").props("data-box=recommended")
    note(shown.note, "meaning" if shown.unit else "fault")


def _verdicts(summary: Summary) -> None:
    rows = [
        (
            entry.name, Raw(f'<span class="verdict {entry.verdict.replace(" ", "-")}">{entry.verdict}</span>'),
            criterion_words(entry), f"{rounded_metres(entry.distance)} m",
        )
        for entry in summary.exposed or ()
    ]  # fmt: skip
    if rows:
        html(facts(rows, ("Place", "Verdict", "Criterion", "Distance")))
    else:
        note("The case has none.", "meaning")


def _again(page: CasePage, run: str) -> None:
    """Write the report with its number and names, or fly again after a place was moved."""
    case = page.case.name
    heading("Report")
    note(
        "Number and names stand in the report once it is written with them; every printed page holds the number "
        "and the SHA-256 of the run's numbers. Sign the print, or the PDF of it.",
        "meaning",
    )
    form(page, ("document",), only=("number", "revision", "prepared_by", "reviewed_by", "approved_by"))
    fly, report = ([command, case, "--out", run] for command in ("fly", "report"))
    with box("choices"):
        act("Write the report with them", "write-report", lambda: page.compute(f"{case}: report", run, report))
        title = f"{case}: flight and hazard again"
        act("Compute flight and hazard alone again", "fly", lambda: page.compute(title, run, fly, report))
        ui.link("Move places on the map of page 4", page.address("site"))


def _files(run: str, path: Path) -> None:
    with box("list", "ul"):
        for file in sorted(one for one in path.iterdir() if one.is_file() and not one.name.startswith(".")):
            with box(tag="li"):
                ui.link(file.name, f"{_address(run, file.name)}?save=1")
                note(f"{file.stat().st_size / 1e3:,.0f} kB")
    note(f"Folder: {path}")
