"""Page 6, check and run: findings by severity, presets, what it will cost, and the queue of runs."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from nicegui import run as threads
from nicegui import ui

import fragfield
from fragfield.app.forms import entries_form, form
from fragfield.app.jobs import cancel, forget, jobs_of, start_job
from fragfield.app.markup import facts, heading
from fragfield.app.page import page_of
from fragfield.case.changes import load_case
from fragfield.errors import InputError
from fragfield.files.run_directory import STAGES, RunDirectory
from fragfield.numbers import number
from fragfield.terminal.progress import duration

if TYPE_CHECKING:
    from fragfield.app.jobs import Job
    from fragfield.app.page import CasePage

__all__ = ["checked", "content", "preset_values"]

PRESETS = {"quick": (13, "off", 8), "standard": (26, "standard", None), "final": (39, "final", 100)}
"""Cells across the largest diameter, grid convergence and fewest realisations (None: the default) of each preset."""
_KEY = re.compile(r"^([a-z_]+(\[\d+\])?(\.[a-z_]+(\[\d+\])?)*)( =|:| \()")
_FOLDED = ("burst", "break_up", "flight", "hazard")
_LOOK = 1.0  # s between looks at the queue


def content(page: CasePage) -> None:
    """Build the page."""
    texts = page.texts
    with ui.element("div").classes("columns"):
        with ui.element("section"):
            heading(texts("run.settings"))
            _presets(page)
            _tables(page)
        with ui.element("section"):
            heading(texts("run.findings"))
            findings = ui.element("div").props("role=status")
            heading(texts("run.cost"))
            cost = ui.html("", sanitize=False)
            starter = _Starter(page)
            heading(texts("run.queue"))
            queue = _Queue(page)

    async def judged() -> None:
        found = await threads.io_bound(checked, page)
        starter.allow(found is not None)
        _show_findings(page, findings, found)
        cost.set_content(_cost(page, found) if found is not None else f'<p class="meaning">{texts("run.no_cost")}</p>')

    page.follow(judged)
    ui.timer(_LOOK, queue.look)


def checked(page: CasePage) -> dict[str, Any] | None:
    """What `fragfield check` finds of the draft; None where it has faults, which the page shows already."""
    case = page.case.resolved()
    if case is None:
        return None
    from fragfield.checking.check import check_report

    try:
        return check_report(case)
    except fragfield.InputError as error:
        return {"refused": str(error), "warnings": []}


def _show_findings(page: CasePage, box: Any, found: dict[str, Any] | None) -> None:  # noqa: ANN401 - an element
    texts = page.texts
    rows = [("error", fault.key, fault.message) for fault in page.case.faults()]
    if found is not None:
        rows += [("error", "", found["refused"])] if "refused" in found else []
        rows += [("warning", _key_of(words), words) for words in found["warnings"]]
    box.clear()
    box.props("data-box=findings")  # known from now on
    with box:
        for severity, key, words in rows[:60]:
            with ui.element("div").classes("finding"):
                ui.label(texts(f"run.{severity}")).classes(f"severity {severity}")
                with ui.element("div"):
                    if key:
                        ui.link(key, page.address(page_of(key), key=key))
                    ui.label(words)
        if not rows:
            ui.label(texts("run.nothing")).classes("good")


def _key_of(warning: str) -> str:
    found = _KEY.match(warning)
    return found[1] if found is not None else ""


def _cost(page: CasePage, found: dict[str, Any]) -> str:
    """What is computed, and how long it may take: the estimate, and what the last run of this name took."""
    texts = page.texts
    if "refused" in found:
        return ""
    expected, mesh = found["expected"], found["mesh"]
    rows = [
        (texts("run.geometry"), f"{found['geometry']['choice']} ({found['geometry']['reason']})"),
        (texts("run.cells"), number(mesh["cells"])),
        (texts("run.memory"), f"{expected['memory_bytes'] / 1e9:.2g} GB"),
        (texts("run.burst_time"), texts("run.burst_time_is", time=duration(max(expected["core_seconds"], 1.0)))),
        (texts("run.also"), texts("run.also_is")),
    ]
    last = _last_time(page)
    if last:
        rows.append((texts("run.last"), last))
    if contents := found.get("contents"):
        rows.append((texts("run.neq"), f"{number(contents['explosive'], 3)} kg"))
    return facts(rows)


def _last_time(page: CasePage) -> str:
    try:
        summary = RunDirectory(page.session.space.inside(page.session.space.run_of(page.case.name))).summary()
    except InputError:
        return ""
    times = [part.get("wall_seconds") for name in ("burst", "flight") if isinstance(part := summary.get(name), dict)]
    known = [float(time) for time in times if time is not None]
    return duration(sum(known)) if known else ""


def preset_values(name: str, diameter: float) -> dict[tuple[str, str], object]:
    """Values that a preset sets in the case, for the largest diameter (m) of its rounds; None: the default."""
    cells, convergence, realisations = PRESETS[name]
    return {
        ("burst", "cell_size"): f"{1e3 * diameter / cells:.2g} mm",
        ("burst", "convergence"): None if convergence == "standard" else convergence,
        ("break_up", "realisations"): realisations,
    }


def _presets(page: CasePage) -> None:
    texts = page.texts
    ui.label(texts("run.presets_why")).classes("meaning")

    def choose(name: str) -> None:
        case = page.case.resolved()
        diameter = max((_diameter(entry.profile) for entry in case.round), default=0.0) if case is not None else 0.0
        if not diameter:
            ui.notify(texts("run.no_preset"), type="warning")
            return
        kept = [page.change(path, value) for path, value in preset_values(name, diameter).items()]
        if all(kept):
            ui.navigate.reload()

    with ui.element("div").classes("choices"):
        for name in PRESETS:
            ui.button(texts(f"run.{name}"), on_click=lambda _, name=name: choose(name)).props(
                f"no-caps outline data-preset={name}"
            )


def _diameter(profile: Any) -> float:  # noqa: ANN401 - tables of a contour, or none
    from burst_fenicsx.geometry import profile_from_table

    return 2.0 * profile_from_table(profile, "round").max_radius if isinstance(profile, dict) else 0.0


def _tables(page: CasePage) -> None:
    form(page, (), only=("title", "seed"))
    if page.case.get(("burst",)) is not None:
        form(page, ("burst",), only=("cell_size", "convergence", "geometry", "end_time"))
    for name in _FOLDED:
        opened = page.focus.startswith(name)
        with ui.expansion(page.texts.label(name), value=opened).classes("folded") as fold:
            place = ui.element("div")

        def build(fold: Any = fold, place: Any = place, name: str = name) -> None:  # noqa: ANN401 - elements
            if fold.value and not place.default_slot.children:
                with place:
                    form(page, (name,), without=("ground",) if name == "flight" else ())

        fold.on_value_change(lambda _, build=build: build())
        build()
    with ui.expansion(page.texts.label("witness"), value=page.focus.startswith("witness")).classes("folded"):
        entries_form(page, ("witness",))
    with ui.expansion(page.texts("run.text"), value=False).classes("folded"):
        _source(page)


def _source(page: CasePage) -> None:
    """The case file itself, to be read and changed as text."""
    ui.label(page.texts("run.text_why")).classes("meaning")
    box = ui.textarea(value=page.case.text).props("outlined autogrow spellcheck=false").classes("source")

    def take() -> None:
        if page.attempt(lambda: page.case.replace(box.value or "")):
            ui.navigate.reload()

    ui.button(page.texts("run.take_text"), on_click=take).props("no-caps outline dense")


class _Starter:
    """Buttons that start a run."""

    def __init__(self, page: CasePage) -> None:
        self.page, texts = page, page.texts
        self.run = page.session.space.run_of(page.case.name)
        with ui.element("div").classes("choices"):
            self.start = ui.button(texts("run.start"), on_click=lambda: self.go([])).props("no-caps data-act=start")
            self.resume = ui.button(texts("run.resume"), on_click=lambda: self.go(["--resume"])).props(
                "no-caps outline data-act=resume"
            )
            self.again = ui.button(texts("run.again"), on_click=lambda: self.go(["--overwrite"])).props(
                "no-caps outline data-act=again"
            )
        self.note = ui.label(texts("run.writes", run=self.run)).classes("note")
        self._buttons()

    def _buttons(self) -> None:
        there = RunDirectory(self.page.session.space.folder / self.run).exists
        self.start.set_visibility(not there)
        self.resume.set_visibility(there)
        self.again.set_visibility(there)

    def allow(self, allowed: bool) -> None:
        """Let a case without faults be run."""
        for button in (self.start, self.resume, self.again):
            button.set_enabled(allowed)
        self._buttons()

    def go(self, options: list[str]) -> None:
        """Save the case and queue its run."""
        page = self.page

        def act() -> None:
            if page.case.is_draft:
                page.case.save()
            load_case(page.case.path)
            title = str(page.case.get(("title",)) or page.case.name)
            command = ["run", page.case.name, "--out", self.run, *options]
            start_job(page.session.space, title=title, case=page.case.name, run=self.run, commands=[command])

        if page.attempt(act):
            self.start.set_enabled(False)
            ui.notify(page.texts("run.queued"), type="positive")


class _Queue:
    """The jobs of the folder, the newest first, looked at while the page is open."""

    def __init__(self, page: CasePage) -> None:
        self.page = page
        self.box = ui.element("div").props("data-box=queue")
        self.shown: list[object] | None = None
        self.look()

    def look(self) -> None:
        """Read the jobs again, and show them where something has changed."""
        jobs = jobs_of(self.page.session.space)[:10]
        now = [(job.file.name, job.state, job.progress()) for job in jobs]
        if now == self.shown:
            return
        self.shown = list(now)
        self.box.clear()
        with self.box:
            for job in jobs:
                self._job(job)
            if not jobs:
                ui.label(self.page.texts("run.no_jobs")).classes("note")

    def _forget(self, job: Job) -> None:
        forget(job)
        self.look()

    def _job(self, job: Job) -> None:
        texts = self.page.texts
        with ui.element("div").classes(f"job {job.state}").props(f"data-state={job.state}"):
            with ui.element("div").classes("choices"):
                ui.label(job.title).style("font-weight:600")
                ui.label(texts(f"job.{job.state}")).classes("state")
                if job.state in ("queued", "running"):
                    ui.button(texts("run.cancel"), on_click=lambda: cancel(job)).props(
                        "dense outline no-caps data-act=cancel"
                    )
                if job.state == "done":
                    ui.link(texts("run.to_result"), self.page.address("result", run=job.run))
                if not job.is_live:
                    ui.button(texts("form.remove"), on_click=lambda: self._forget(job)).props("dense flat no-caps")
            if job.is_live:
                _stages(job)
            elif job.state == "failed":
                ui.label(texts("job.code", code="–" if job.code is None else job.code)).classes("fault")
            if job.state != "done" and (words := job.words()):
                with (
                    ui.expansion(texts("run.log"), value=job.state == "failed").classes("folded"),
                    ui.element("pre").classes("words"),
                ):
                    ui.label(words)


def _stages(job: Job) -> None:
    """A bar for every stage of the chain."""
    now, names = job.progress(), list(STAGES)
    stage = now.get("stage", "")
    at = names.index(stage) if stage in names else -1
    with ui.element("div").classes("stages"):
        for index, name in enumerate(names):
            share = 1.0 if index < at else float(now.get("share", 0.0)) if index == at else 0.0
            with ui.element("div").classes("stage"):
                ui.label(name)
                with (
                    ui.element("div")
                    .classes("bar")
                    .props(f'role=progressbar aria-valuenow={100 * share:.0f} aria-label="{name}"')
                ):
                    ui.element("div").style(f"width:{100 * share:.1f}%")
                if index == at and share < 1.0:
                    left = now.get("seconds_left")
                    ui.label(f"{now.get('detail', '')} {'' if left is None else duration(left)}".strip()).classes(
                        "detail"
                    )
