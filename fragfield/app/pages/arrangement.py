"""Page 3, the arrangement: how many rounds, how they stand, who is initiated, and what is computed of it."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

from nicegui import run, ui

from fragfield.app.forms import entries_form, form
from fragfield.app.markup import facts, heading
from fragfield.app.pages.run import checked
from fragfield.app.plan import plan_svg
from fragfield.numbers import number

if TYPE_CHECKING:
    from fragfield.app.page import CasePage

__all__ = ["content"]

_STACKS = ("single", "row", "triangle", "pallet")
_MOST_LISTED = 40
_COUNTS: dict[str, dict[str, Any]] = {"row": {"count": 2}, "triangle": {"count": 2}, "pallet": {"counts": [2, 2, 1]}}
"""With which an arrangement begins."""


def content(page: CasePage) -> None:
    """Build the page."""
    texts = page.texts
    with ui.element("div").classes("columns"):
        with ui.element("section"):
            heading(texts("arrangement.title"))
            _stack(page)
            for index, entry in enumerate(page.case.get(("round",), [])):
                name = entry.get("name", index + 1) if isinstance(entry, dict) else index + 1
                heading(f"{texts('arrangement.attitude')}: {name}", 3)
                form(page, ("round", index), only=("attitude", "azimuth", "base", "position", "axis"))
                with ui.expansion(
                    texts("arrangement.initiation"), value=page.focus.startswith(f"round[{index + 1}].i")
                ).classes("folded"):
                    form(page, ("round", index), only=("ignition", "initiation"))
            heading(texts("arrangement.planes"))
            entries_form(page, ("plane",))
        with ui.element("section"):
            pictures = [ui.html("", sanitize=False).classes("picture") for _ in range(2)]
            ui.label(texts("arrangement.legend")).classes("note")
            found_facts = ui.html("", sanitize=False)

    async def judged() -> None:
        case = page.case.resolved()
        found = await run.io_bound(checked, page)
        for picture, vertical, name in zip(pictures, (1, 2), ("plan", "elevation"), strict=True):
            title = texts(f"arrangement.{name}")
            drawn = await run.io_bound(plan_svg, case, vertical, title) if case is not None and case.round else ""
            picture.set_content(f"<h3>{escape(title)}</h3>{drawn}" if drawn else "")
        found_facts.set_content(_facts(page, found))

    page.follow(judged)


def _stack(page: CasePage) -> None:
    """Single, or an arrangement of copies."""
    texts = page.texts
    now = page.case.get(("stack", "arrangement"), "single")

    def choose(kind: str) -> None:
        counts = _COUNTS.get(kind, {})
        gap = page.case.get(("stack", "gap"), "21.7 mm")
        table = {"arrangement": kind, "gap": gap, **counts} if kind != "single" else None
        if page.change(("stack",), table):
            ui.navigate.reload()

    options = {name: texts(f"arrangement.{name}") for name in _STACKS}
    ui.toggle(options, value=now if now in options else None, on_change=lambda event: choose(event.value)).props(
        "no-caps dense"
    )
    if now != "single":
        form(page, ("stack",), without=("arrangement",))


def _facts(page: CasePage, found: dict[str, Any] | None) -> str:
    """Clear gap, net explosive quantity, what is computed and what is image, and each round's place and time."""
    texts = page.texts
    if found is None or "refused" in found:
        words = texts("arrangement.cannot") if found is None else found["refused"]
        return f'<p class="fault">{escape(words)}</p>'
    arranged = found["arrangement"]
    rows = [(texts("run.geometry"), f"{found['geometry']['choice']} ({found['geometry']['reason']})")]
    if gap := arranged["min_clearance"]:
        distance = number(1e3 * gap["clearance"], 4)
        first, second = gap["rounds"]
        rows.append(
            (texts("arrangement.clear"), texts("arrangement.between", distance=distance, first=first, second=second))
        )
    if contents := found.get("contents"):
        rows.append((texts("run.neq"), f"{number(contents['explosive'], 3)} kg (TNT {number(contents['tnt'], 3)} kg)"))
    from burst_fenicsx.symmetry import symmetry_words

    rows += [(texts("arrangement.computed"), words) for words in symmetry_words(found["symmetry"])]
    rows.append((texts("arrangement.attitude"), arranged["attitude"]["words"]))
    listed = [_round_row(page, entry) for entry in arranged["rounds"][:_MOST_LISTED]]
    return f"{facts(rows)}<h3>{escape(texts('arrangement.rounds'))}</h3>{facts(listed)}"


def _round_row(page: CasePage, entry: dict[str, Any]) -> tuple[str, str, str]:
    texts = page.texts
    place = ", ".join(number(1e3 * value, 4) for value in entry["position"])
    delays = entry["delays"]
    time = (
        texts("arrangement.initiated_at", time=number(1e6 * delays[0], 3)) if delays else texts("arrangement.by_shock")
    )
    return entry["name"], f"({place}) mm", time
