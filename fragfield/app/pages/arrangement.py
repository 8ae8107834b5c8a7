"""Page 3, the arrangement: how many rounds, how they stand, who is initiated, and what is computed of it."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

from nicegui import run, ui

from fragfield.app.forms import entries_form, form
from fragfield.app.page import PAGES, box, facts, fold, heading, html, note
from fragfield.app.pages.run import checked, kilograms
from fragfield.numbers import number
from fragfield.report.figures.arrangement import plan_svg
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
    texts = page.texts
    with box("columns"):
        with box(tag="section"):
            heading(texts("arrangement.title"))
            _stack(page)
            for index, entry in enumerate(page.case.get(("round",), [])):
                name = entry.get("name", index + 1) if isinstance(entry, dict) else index + 1
                heading(f"{texts('arrangement.attitude')}: {name}", 3)
                own = [key.removeprefix("round.") for key in PAGES["arrangement"] if key.startswith("round.")]
                form(page, ("round", index), only=[key for key in own if not key.startswith("i")])
                with fold(texts("arrangement.initiation"), opened=page.focus.startswith(f"round[{index + 1}].i")):
                    form(page, ("round", index), only=[key for key in own if key.startswith("i")])
            heading(texts("arrangement.planes"))
            entries_form(page, ("plane",))
        with box(tag="section"):
            pictures = {name: html(kind="picture") for name in ("plan", "elevation")}
            note(texts("arrangement.legend"))
            arranged = html()

    async def judged() -> None:
        case, found = page.case.resolved(), await run.io_bound(checked, page)
        for vertical, (name, picture) in enumerate(pictures.items(), start=1):
            title = texts(f"arrangement.{name}")
            drawn = await run.io_bound(plan_svg, case, vertical, title) if case is not None and case.round else ""
            picture.set_content(f"<h3>{escape(title)}</h3>{drawn}" if drawn else "")
        arranged.set_content(_facts(page, found))

    page.follow(judged)


def _stack(page: CasePage) -> None:
    now = page.case.get(("stack", "arrangement"), "single")

    def choose(kind: str) -> None:
        gap = page.case.get(("stack", "gap"), "21.7 mm")
        table = {"arrangement": kind, "gap": gap, **_STACKS[kind]} if kind != "single" else None
        if page.change(("stack",), table):
            ui.navigate.reload()

    options = {name: page.texts(f"arrangement.{name}") for name in _STACKS}
    ui.toggle(options, value=now if now in options else None, on_change=lambda event: choose(event.value))
    if now != "single":
        form(page, ("stack",), without=("arrangement",))


def _facts(page: CasePage, found: CheckedBurst | str | None) -> str:
    texts = page.texts
    if found is None or isinstance(found, str):
        return f'<p class="fault">{escape(found or texts("arrangement.cannot"))}</p>'
    from burst_fenicsx.symmetry import symmetry_words

    arranged = found.arrangement
    rows = [(texts("run.geometry"), f"{found.geometry.choice} ({found.geometry.reason})")]
    if gap := arranged.min_clearance:
        (first, second), distance = gap.rounds, number(1e3 * gap.clearance, 4)
        between = texts("arrangement.between", distance=distance, first=first, second=second)
        rows.append((texts("arrangement.clear"), between))
    if contents := found.contents:
        rows.append((texts("run.neq"), f"{kilograms(contents.explosive)} (TNT {kilograms(contents.tnt)})"))
    rows += [(texts("arrangement.computed"), words) for words in symmetry_words(to_json(found.symmetry))]
    rows.append((texts("arrangement.attitude"), arranged.attitude.words))
    listed = [_round_row(page, entry) for entry in arranged.rounds[:_MOST_LISTED]]
    return f"{facts(rows)}<h3>{escape(texts('arrangement.rounds'))}</h3>{facts(listed)}"


def _round_row(page: CasePage, entry: PlacedRound) -> tuple[str, str, str]:
    place, delays, texts = ", ".join(number(1e3 * one, 4) for one in entry.position), entry.delays, page.texts
    shock = texts("arrangement.by_shock")
    return (
        entry.name,
        f"({place}) mm",
        texts("arrangement.initiated_at", time=number(1e6 * delays[0], 3)) if delays else shock,
    )
