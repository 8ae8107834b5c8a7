"""Page 8, confidence and report: uncertain inputs, error of the cells, evidence, comparison, document and signature."""

from __future__ import annotations

import datetime as dt
import hashlib
import json
from html import escape
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from nicegui import run as threads
from nicegui import ui

import fragfield
from fragfield.app.forms import form
from fragfield.app.jobs import start_job
from fragfield.app.markup import heading, shown_facts
from fragfield.errors import InputError, message_of
from fragfield.files.run_directory import RunDirectory
from fragfield.hazard.certainty import metres
from fragfield.numbers import number
from fragfield.quantities import QUANTITIES
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from fragfield.app.page import CasePage

__all__ = ["content", "is_signed", "sign"]

_SAMPLES = 60
_SIGNATURE = "signature.json"
_COMPARED = ("distances", "places", "casing", "by_zone")
"""Tables of a comparison that fit a page; `fragfield compare` writes all."""


def content(page: CasePage) -> None:
    """Build the page."""
    texts, space = page.texts, page.session.space
    run = space.run_of(page.case.name)
    path = space.folder / run
    summary = _summary(path)
    with ui.element("div").classes("columns"):
        with ui.element("section"):
            heading(texts("confidence.uncertain"))
            _uncertain(page, run, path)
            heading(texts("confidence.cells"))
            _cells(summary)
            heading(texts("confidence.bearing"))
            evidence = ui.element("div")
        with ui.element("section"):
            heading(texts("confidence.document"))
            form(page, ("document",))
            _signature(page, run, path)
            heading(texts("confidence.compare"))
            _compare(page)

    async def reasons() -> None:
        found = await threads.io_bound(_reasons, path) if summary else ([], [])
        with evidence:
            for mark, words in [("✓", one) for one in found[0]] + [("✗", one) for one in found[1]]:
                ui.label(f"{mark} {words}").classes("meaning")
            if not summary:
                ui.label(texts("result.none")).classes("meaning")

    ui.timer(0.1, reasons, once=True)


def _summary(path: Path) -> dict[str, Any]:
    try:
        return RunDirectory(path).summary()
    except (fragfield.InputError, OSError):
        return {}


def _reasons(path: Path) -> tuple[list[str], list[str]]:
    """Reasons for and against, as on the report's first page."""
    from fragfield.report.findings.findings import findings
    from fragfield.report.findings.reasons import reasons_against, reasons_for
    from fragfield.report.reading.run_files import read_run

    try:
        run = read_run(path)
        return reasons_for(run), reasons_against(run, findings(run))
    except (fragfield.InputError, OSError) as error:
        return [], [message_of(error)]


def _uncertain(page: CasePage, run: str, path: Path) -> None:
    texts = page.texts
    form(page, ("uncertainty",))
    chosen = {"samples": int(page.case.get(("uncertainty", "samples"), _SAMPLES) or _SAMPLES)}
    folder = path.with_name(f"{path.name}_uncertainty")

    def start() -> None:
        def act() -> None:
            if not (path / "summary.json").is_file():
                raise InputError(texts("confidence.no_run"))
            target = f"{run}_uncertainty"
            command = ["uncertainty", run, "--samples", str(chosen["samples"]), "--out", target]
            command += ["--resume"] if folder.is_dir() else []
            title = texts("confidence.title", name=page.case.name, samples=chosen["samples"])
            start_job(page.session.space, title=title, case=page.case.name, run=run, commands=[command])

        if page.attempt(act):
            ui.navigate.to(page.address("run"))

    with ui.element("div").classes("choices"):
        box = ui.number(texts("confidence.samples"), value=chosen["samples"], min=8, max=100000, precision=0)
        box.props("outlined dense")
        box.on_value_change(lambda event: chosen.update(samples=int(event.value or _SAMPLES)))
        ui.button(texts("confidence.start"), on_click=start).props("no-caps outline data-act=sample")
    progress, outcome = ui.label("").classes("note"), ui.html("", sanitize=False)

    def look() -> None:
        done = folder / "samples.jsonl"
        if done.is_file():
            with done.open("rb") as lines:
                progress.set_text(texts("confidence.progress", done=sum(1 for _ in lines), samples=chosen["samples"]))
        found = folder / "uncertainty.json"
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


def sign(path: Path, who: str) -> dict[str, str]:
    """Lock the report of a run with its hash; raises InputError where there is no report or no name."""
    report = path / "report.html"
    if not report.is_file():
        raise InputError(f"{path.name}: has no report.html to sign")
    if not who.strip():
        raise InputError("document.prepared_by: missing; the name of who signs")
    when = dt.datetime.now(dt.UTC).strftime("%Y-%m-%d %H:%M UTC")
    found = {"who": who, "when": when, "sha256": hashlib.sha256(report.read_bytes()).hexdigest(),
             "case_sha256": hashlib.sha256((path / "case.toml").read_bytes()).hexdigest()}  # fmt: skip
    write_text(path.with_name(f"{path.name}.{_SIGNATURE}"), json.dumps(found, indent=1) + "\n", InputError)
    return found


def is_signed(path: Path) -> tuple[dict[str, str], bool] | None:
    """The signature of a run's report and whether it still holds; None where there is none."""
    try:
        found = json.loads(path.with_name(f"{path.name}.{_SIGNATURE}").read_text(encoding="utf-8"))
        return found, hashlib.sha256((path / "report.html").read_bytes()).hexdigest() == found["sha256"]
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _signature(page: CasePage, run: str, path: Path) -> None:
    texts = page.texts
    signed = is_signed(path)
    if signed is None:
        ui.label(texts("confidence.unsigned")).classes("note")
    else:
        entry, holds = signed
        ui.label(texts("confidence.signed", when=entry["when"], who=entry["who"], hash=entry["sha256"])).classes(
            "note"
        ).props("data-box=signed")
        if not holds:
            ui.label(texts("confidence.broken")).classes("fault")

    def write_again() -> None:
        def act() -> None:
            if page.case.is_draft:
                page.case.save()
            commands = [["report", page.case.name, "--out", run]]
            start_job(
                page.session.space, title=texts("confidence.write"), case=page.case.name, run=run, commands=commands
            )

        if page.attempt(act):
            ui.navigate.to(page.address("run"))

    def lock() -> None:
        if page.attempt(lambda: sign(path, str(page.case.get(("document", "prepared_by"), "")))):
            ui.navigate.reload()

    with ui.element("div").classes("choices"):
        ui.button(texts("confidence.write"), on_click=write_again).props("no-caps outline dense data-act=report")
        ui.button(texts("confidence.sign"), on_click=lock).props("no-caps dense data-act=sign")
        if (path / "report.html").is_file():
            ui.link(texts("result.alone", name="report.html"), f"/files/{quote(run)}/report.html", new_tab=True)
    ui.label(texts("confidence.pdf")).classes("note")


def _compare(page: CasePage) -> None:
    """Two runs: first the inputs that differ, then one divided by the other."""
    texts, space = page.texts, page.session.space
    names = [one.name for one in space.runs()]
    chosen: dict[str, str] = {}
    place = ui.element("div")

    async def show() -> None:
        if len(chosen) < 2:
            return
        place.clear()
        try:
            done = await threads.io_bound(
                fragfield.compare_runs, *(space.inside(chosen[key]) for key in ("first", "second"))
            )
        except (fragfield.InputError, OSError) as error:
            with place:
                ui.label(message_of(error)).classes("fault")
            return
        with place:
            heading(texts("confidence.differ"), 3)
            for line in done.found["differences"][:40] or [texts("confidence.same")]:
                ui.label(str(line)).classes("meaning")
            for name in (one for one in _COMPARED if one in done.tables):
                table = done.table(name)
                columns = table.columns[:7]
                rows = [tuple(_cell(table[column][row]) for column in columns) for row in range(len(table))]
                heading(name, 3)
                shown_facts(rows, columns)

    def choose(key: str, value: str) -> Any:  # noqa: ANN401 - a coroutine
        chosen[key] = value
        return show()

    with ui.element("div").classes("form"):
        for key in ("first", "second"):
            ui.select(
                names, label=texts(f"confidence.{key}"), on_change=lambda event, key=key: choose(key, event.value)
            ).props("outlined dense")
    place.move(target_index=-1)


def _cell(value: Any) -> str:  # noqa: ANN401 - of a NumPy array
    plain = value.item() if hasattr(value, "item") else value
    return number(plain, 4) if isinstance(plain, float) else str(plain)
