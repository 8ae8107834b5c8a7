"""Page 8, confidence and report: uncertain inputs, error of the cells, evidence, comparison, document and signature."""

from __future__ import annotations

import json
from functools import partial
from html import escape
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from nicegui import run as threads
from nicegui import ui

import fragfield
from fragfield.app.forms import form
from fragfield.app.page import act, box, choose, heading, html, note, shown_facts
from fragfield.app.pages.result import cell_words
from fragfield.errors import message_of
from fragfield.files.run_directory import RunDirectory
from fragfield.files.stamped import SIGNATURE, read_signature, sign
from fragfield.hazard.certainty import metres
from fragfield.numbers import number
from fragfield.quantities import QUANTITIES

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from fragfield.app.page import CasePage


_SAMPLES = 60
_COMPARED = ("distances", "places", "casing", "by_zone")
"""Tables of a comparison that fit a page; `fragfield compare` writes all."""


def content(page: CasePage) -> None:
    """Build the page."""
    texts, space = page.texts, page.session.space
    run = space.run_of(page.case.name)
    path = space.folder / run
    summary = _summary(path)
    with box("columns"):
        with box(tag="section"):
            heading(texts("confidence.uncertain"))
            _uncertain(page, run, path)
            heading(texts("confidence.cells"))
            _cells(summary)
            heading(texts("confidence.bearing"))
            evidence = box()
        with box(tag="section"):
            heading(texts("confidence.document"))
            form(page, ("document",))
            _signature(page, run, path)
            heading(texts("confidence.compare"))
            _compare(page)

    async def reasons() -> None:
        found = await threads.io_bound(_reasons, path) if summary else []
        with evidence:
            for words in found or [texts("result.none")]:
                note(words, "meaning")

    ui.timer(0.1, reasons, once=True)


def _summary(path: Path) -> dict[str, Any]:
    try:
        return RunDirectory(path).summary()
    except (fragfield.InputError, OSError):
        return {}


def _reasons(path: Path) -> list[str]:
    """Reasons for and against, as on the report's first page."""
    from fragfield.report.findings.findings import findings
    from fragfield.report.findings.reasons import reasons_against, reasons_for
    from fragfield.report.reading.run_files import read_run

    try:
        run = read_run(path)
        against = [f"✗ {words}" for words in reasons_against(run, findings(run))]
        return [f"✓ {words}" for words in reasons_for(run)] + against
    except (fragfield.InputError, OSError) as error:
        return [message_of(error)]


def _uncertain(page: CasePage, run: str, path: Path) -> None:
    texts = page.texts
    form(page, ("uncertainty",))
    chosen = {"samples": int(page.case.get(("uncertainty", "samples"), _SAMPLES) or _SAMPLES)}
    folder = path.with_name(f"{path.name}_uncertainty")

    def start() -> None:
        if not (path / "summary.json").is_file():
            ui.notify(texts("confidence.no_run"), type="warning")
            return
        title = texts("confidence.title", name=page.case.name, samples=chosen["samples"])
        command = ["uncertainty", run, "--samples", str(chosen["samples"]), "--out", f"{run}_uncertainty"]
        command += ["--resume"] if folder.is_dir() else []
        page.queue(title, f"{run}_uncertainty", command, result=run)

    with box("choices"):
        samples = ui.number(texts("confidence.samples"), value=chosen["samples"], min=8, max=100000, precision=0)
        samples.on_value_change(lambda event: chosen.update(samples=int(event.value or _SAMPLES)))
        act(texts("confidence.start"), "sample", start, "outline")
    progress, outcome = note(""), html()

    def look() -> None:
        done, found = folder / "samples.jsonl", folder / "uncertainty.json"
        if done.is_file():
            with done.open("rb") as lines:
                progress.set_text(texts("confidence.progress", done=sum(1 for _ in lines), samples=chosen["samples"]))
        if found.is_file():
            try:
                outcome.set_content(_spread(page, json.loads(found.read_text(encoding="utf-8"))))
            except (OSError, ValueError):
                outcome.set_content("")

    ui.timer(2.0, look)
    look()


def _spread(page: CasePage, found: Mapping[str, Any]) -> str:
    """Distance over the inputs, and the share of each input as bars."""
    distance = found.get("distance") or {}
    spread = distance.get("spread") or {}
    if not spread:
        return f'<p class="fault">{escape(str((found.get("states") or {}).get("reason", "")))}</p>'
    low, median, high = (metres(spread[key]) for key in ("low", "median", "high"))
    words = page.texts("confidence.distance", low=low, median=median, high=high)
    bars = []
    for row in sorted(distance.get("indices") or [], key=lambda one: -(one.get("total") or 0.0))[:12]:
        share = min(max(100.0 * float(row.get("total") or 0.0), 0.0), 100.0)
        name = str(row.get("label") or row.get("name") or row.get("key") or "")
        shown = escape(page.texts("confidence.share", share=f"{share:.0f}"))
        bar = f'<div class="bar"><div style="width:{share:.1f}%"></div></div>'
        bars.append(f'<div class="stage"><span>{escape(name)}</span>{bar}<span class="detail">{shown}</span></div>')
    title = escape(page.texts("confidence.tornado"))
    return f"<p>{escape(words)}</p>" + (
        f'<h3>{title}</h3><div class="stages tornado">{"".join(bars)}</div>' if bars else ""
    )


def _cells(summary: Mapping[str, Any]) -> None:
    quantities = (summary.get("convergence") or {}).get("quantities") or {}
    labels = {one.name or one.path.rpartition(".")[2]: one for one in QUANTITIES.values()}
    rows = []
    for name, entry in quantities.items():
        known = labels.get(name)
        value, error = (
            known.row(one).value if known is not None and one is not None else number(one)
            for one in (entry["values"][0], entry["uncertainty"])
        )
        rows.append((known.label if known else name, value, f"±\u00a0{error}", entry["kind"]))
    shown_facts(rows)


def _signature(page: CasePage, run: str, path: Path) -> None:
    """Write the report again, sign it, or withdraw the signature; a signed run is locked."""
    texts, signature = page.texts, read_signature(path)
    if signature is None:
        note(texts("confidence.unsigned"))
    else:
        digest = (signature.sha256 or {}).get("report.html", "")
        note(texts("confidence.signed", when=signature.when, who=signature.who, hash=digest)).props("data-box=signed")
        if changed := signature.changed(path):
            note(texts("confidence.broken", names=", ".join(changed)), "fault")

    def again(do: Any) -> None:  # noqa: ANN401 - an act
        if page.attempt(do):
            ui.navigate.reload()

    def lock() -> None:
        sign(path, str(page.case.get(("document", "prepared_by"), "")))

    with box("choices"):
        if signature is None:
            command = ["report", page.case.name, "--out", run]
            act(texts("confidence.write"), "report", lambda: page.queue(texts("confidence.write"), run, command))
            act(texts("confidence.sign"), "sign", lambda: again(lock), "dense")
        else:
            act(texts("confidence.withdraw"), "withdraw", lambda: again((path / SIGNATURE).unlink))
        if (path / "report.html").is_file():
            ui.link(texts("result.alone", name="report.html"), f"/files/{quote(run)}/report.html", new_tab=True)
    note(texts("confidence.pdf"))


def _compare(page: CasePage) -> None:
    """Two runs: first the inputs that differ, then one divided by the other."""
    texts, space = page.texts, page.session.space
    names = [one.name for one in space.runs()]
    chosen: dict[str, str] = {}

    async def take(key: str, value: str) -> None:
        chosen[key] = value
        if len(chosen) < 2:
            return
        runs = (space.inside(chosen[name]) for name in ("first", "second"))
        done = await page.ask(place, fragfield.compare_runs, *runs)
        if done is None:
            return
        with place:
            heading(texts("confidence.differ"), 3)
            for line in done.found["differences"][:40] or [texts("confidence.same")]:
                note(str(line), "meaning")
            for name in (one for one in _COMPARED if one in done.tables):
                table = done.table(name)
                columns = table.columns[:7]
                rows = [tuple(cell_words(table[column][row]) for column in columns) for row in range(len(table))]
                heading(name, 3)
                shown_facts(rows, columns)

    with box("form"):
        for key in ("first", "second"):
            choose(texts(f"confidence.{key}"), names, None, partial(take, key))
    place = box()
