"""Page 3, the arrangement: how many rounds, how they stand, who is initiated, and what is computed of it."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

from nicegui import run, ui

from fragfield.app.forms import entries_form, form
from fragfield.app.page import PAGES, box, facts, fold, heading, html, note
from fragfield.app.pages.run import checked, kilograms
from fragfield.numbers import number
from fragfield.report.figures.rounds import plan_svg
from fragfield.results.part import to_json

if TYPE_CHECKING:
    from fragfield.app.page import CasePage
    from fragfield.results.check import CheckedBurst, PlacedRound


_MOST_LISTED = 40
_STACKS: dict[str, dict[str, Any]] = {
    "single": {}, "row": {"count": 2}, "triangle": {"count": 2}, "pallet": {"counts": [2, 2, 1]},
}  # fmt: skip
"""Arrangements, and the counts with which each begins."""


def content(page: CasePage) -> None:
    """Build the page."""
    with box("columns"):
        with box(tag="section"):
            heading("How the rounds stand")
            _stack(page)
            for index, entry in enumerate(page.case.get(("round",), [])):
                name = entry.get("name", index + 1) if isinstance(entry, dict) else index + 1
                heading(f"Attitude and position: {name}", 3)
                own = [key.removeprefix("round.") for key in PAGES["arrangement"] if key.startswith("round.")]
                form(page, ("round", index), only=[key for key in own if not key.startswith("i")])
                with fold("Who is initiated, and when", opened=page.focus.startswith(f"round[{index + 1}].i")):
                    form(page, ("round", index), only=[key for key in own if key.startswith("i")])
            heading("Ground, decks and planes of symmetry")
            entries_form(page, ("plane",))
        with box(tag="section"):
            pictures = {title: html(kind="picture") for title in ("Plan, from above", "Elevation, seen along +y")}
            note(
                "hatched: a round, its computed part in full lines; dashed: an image behind a plane of symmetry; ● "
                "initiated by its own points"
            )
            arranged = html()

    async def judged() -> None:
        case, found = page.case.resolved(), await run.io_bound(checked, page)
        for vertical, (title, picture) in enumerate(pictures.items(), start=1):
            drawn = await run.io_bound(plan_svg, case, vertical, title) if case is not None and case.round else ""
            picture.set_content(f"<h3>{escape(title)}</h3>{drawn}" if drawn else "")
        arranged.set_content(_facts(found))

    page.follow(judged)


def _stack(page: CasePage) -> None:
    now = page.case.get(("stack", "arrangement"), "single")

    def choose(kind: str) -> None:
        gap = page.case.get(("stack", "gap"), "21.7 mm")
        table = {"arrangement": kind, "gap": gap, **_STACKS[kind]} if kind != "single" else None
        if page.change(("stack",), table):
            ui.navigate.reload()

    options = {name: name.capitalize() for name in _STACKS}
    ui.toggle(options, value=now if now in options else None, on_change=lambda event: choose(event.value))
    if now != "single":
        form(page, ("stack",), without=("arrangement",))


def _facts(found: CheckedBurst | str | None) -> str:
    if found is None or isinstance(found, str):
        return f'<p class="fault">{escape(found or "Mend the errors to see the arrangement.")}</p>'
    from burst_fenicsx.symmetry import symmetry_words

    arranged = found.arrangement
    rows = [("Burst", f"{found.geometry.choice} ({found.geometry.reason})")]
    if gap := arranged.min_clearance:
        between = f"{number(1e3 * gap.clearance, 4)} mm, {' to '.join(gap.rounds)}"
        rows.append(("Smallest clear distance", between))
    if contents := found.contents:
        rows.append(("Net explosive quantity", f"{kilograms(contents.explosive)} (TNT {kilograms(contents.tnt)})"))
    rows += [("Computed", words) for words in symmetry_words(to_json(found.symmetry))]
    rows.append(("Attitude and position", arranged.attitude.words))
    listed = [_round_row(entry) for entry in arranged.rounds[:_MOST_LISTED]]
    return f"{facts(rows)}<h3>Rounds</h3>{facts(listed)}"


def _round_row(entry: PlacedRound) -> tuple[str, str, str]:
    place, delays = ", ".join(number(1e3 * one, 4) for one in entry.position), entry.delays
    initiated = f"at {number(1e6 * delays[0], 3)} µs" if delays else "by shock alone"
    return entry.name, f"({place}) mm", initiated
