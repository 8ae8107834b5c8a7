"""Page 5, check and run: findings by severity, presets, what it will cost, and the run itself."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from nicegui import run as threads
from nicegui import ui

import fragfield
from fragfield.app.fields import fields_of
from fragfield.app.forms import folded, form
from fragfield.app.page import act, box, facts, fold, heading, html, note, page_of
from fragfield.errors import InputError
from fragfield.files.run_directory import STAGES, RunDirectory
from fragfield.numbers import number
from fragfield.terminal.progress import duration
from fragfield_base.reading import read_text

if TYPE_CHECKING:
    from fragfield.app.page import CasePage
    from fragfield.app.workspace import Job
    from fragfield.results.check import CheckedBurst


PRESETS = {"quick": (13, "off", 8), "standard": (26, "standard", None), "final": (39, "final", 100)}
"""Cells across the largest diameter, grid convergence and fewest realisations (None: the default) of each preset."""
_DONE = re.compile(r": ([a-z-]+): done in ([\d.]+) s")
_LOOK = 1.0  # s between looks at the run


def content(page: CasePage) -> None:
    """Build the page."""
    texts = page.texts
    with box("columns"):
        with box(tag="section"):
            heading(texts("run.settings"))
            _presets(page)
            _tables(page)
        with box(tag="section"):
            heading(texts("run.findings"))
            findings = box().props("role=status")
            heading(texts("run.cost"))
            cost = html()
            starter = _Starter(page)
            heading(texts("run.now"))
            job = _Now(page, starter)

    async def judged() -> None:
        found = await threads.io_bound(checked, page)
        starter.allow(found is not None)
        _show_findings(page, findings, found)
        cost.set_content(_cost(page, found) if found is not None else f'<p class="meaning">{texts("run.no_cost")}</p>')

    page.follow(judged)
    ui.timer(_LOOK, job.look)


def checked(page: CasePage) -> CheckedBurst | str | None:
    """What `fragfield check` reports of the draft, or why it refuses it; None of one with faults, which stand there."""
    case = page.case.resolved()
    if case is None:
        return None
    from fragfield.checking.check import check_report

    try:
        return check_report(case)
    except fragfield.InputError as error:
        return str(error)


def _show_findings(page: CasePage, place: Any, found: CheckedBurst | str | None) -> None:  # noqa: ANN401 - an element
    texts = page.texts
    rows = [("error", fault.key, fault.words) for fault in page.case.faults()]
    if isinstance(found, str):
        rows.append(("error", "", found))
    elif found is not None:
        rows += [("warning", getattr(words, "key", ""), words) for words in found.warnings]
    place.clear()
    place.props("data-box=findings")  # known from now on
    with place:
        for severity, key, words in rows[:60]:
            with box("finding"):
                note(texts(f"run.{severity}"), f"severity {severity}")
                with box():
                    if key:
                        ui.link(key, page.address(page_of(key), key=key))
                    ui.label(words)
        if not rows:
            note(texts("run.nothing"), "good")


def kilograms(mass: float) -> str:
    """A mass in words."""
    return f"{number(mass, 3)} kg"


def _cost(page: CasePage, found: CheckedBurst | str) -> str:
    texts = page.texts
    if isinstance(found, str):
        return ""
    contents, last = found.contents, _last_time(page)
    rows = {
        "geometry": f"{found.geometry.choice} ({found.geometry.reason})",
        "cells": number(found.mesh.cells),
        "memory": f"{found.expected.memory_bytes / 1e9:.2g} GB",
        "also": texts("run.also_is"),
        "last": last,
        "neq": kilograms(contents.explosive) if contents else "",
    }
    return facts([(texts(f"run.{name}"), words) for name, words in rows.items() if words])


def _last_time(page: CasePage) -> str:
    try:
        log = RunDirectory(page.session.space.inside(page.session.space.run_of(page.case.name))).log_file
        times = dict(_DONE.findall(read_text(log, InputError, most=1 << 26)))
    except InputError:
        return ""
    return duration(sum(map(float, times.values()))) if times.keys() == STAGES.keys() else ""


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
    note(texts("run.presets_why"), "meaning")

    def choose(name: str) -> None:
        case = page.case.resolved()
        diameter = max((_diameter(entry.profile) for entry in case.round), default=0.0) if case is not None else 0.0
        if not diameter:
            ui.notify(texts("run.no_preset"), type="warning")
            return
        kept = [page.change(path, value) for path, value in preset_values(name, diameter).items()]
        if all(kept):
            ui.navigate.reload()

    with box("choices"):
        for name in PRESETS:
            ui.button(texts(f"run.{name}"), on_click=lambda _, name=name: choose(name)).props(
                f"outline data-preset={name}"
            )


def _diameter(profile: Any) -> float:  # noqa: ANN401 - tables of a contour, or none
    from burst_fenicsx.geometry import profile_from_table

    return 2.0 * profile_from_table(profile, "round").max_radius if isinstance(profile, dict) else 0.0


def _tables(page: CasePage) -> None:
    form(page, (), only=("title", "seed"))
    if page.case.get(("burst",)) is not None:
        form(page, ("burst",), only=("cell_size", "convergence", "geometry", "end_time"))
    for entry in fields_of(()):
        if entry.form in ("table", "tables") and page_of(entry.name) == "run":
            folded(page, (entry.name,), entry, without=("ground",) if entry.name == "flight" else ())
    with fold(page.texts("run.text")):
        _source(page)


def _source(page: CasePage) -> None:
    note(page.texts("run.text_why"), "meaning")
    source = ui.textarea(value=page.case.text).props("outlined autogrow spellcheck=false").classes("source")

    def take() -> None:
        if page.attempt(lambda: page.case.replace(source.value or "")):
            ui.navigate.reload()

    act(page.texts("run.take_text"), "take-text", take)


class _Starter:
    def __init__(self, page: CasePage) -> None:
        self.page, texts = page, page.texts
        self.run = page.session.space.run_of(page.case.name)
        with box("choices"):
            self.start = act(texts("run.start"), "start", self.go, "")
            self.resume = act(texts("run.resume"), "resume", lambda: self.go("--resume"), "outline")
            self.again = act(texts("run.again"), "again", lambda: self.go("--overwrite"), "outline")
        note(texts("run.writes", run=self.run))
        self.show()

    @property
    def can_resume(self) -> bool:
        """Whether a run has been started."""
        return RunDirectory(self.page.session.space.folder / self.run).exists

    def show(self) -> None:
        """Offer to run, or to continue and to compute again where a run has been started."""
        self.start.set_visibility(not self.can_resume)
        self.resume.set_visibility(self.can_resume)
        self.again.set_visibility(self.can_resume)

    def allow(self, allowed: bool) -> None:
        """Let a case without faults be run."""
        for button in (self.start, self.resume, self.again):
            button.set_enabled(allowed)
        self.show()

    def go(self, *options: str) -> None:
        """Save the case and start its run."""
        page = self.page
        title = str(page.case.get(("title",)) or page.case.name)
        page.compute(title, self.run, ["run", page.case.name, "--out", self.run, *options])


class _Now:
    def __init__(self, page: CasePage, starter: _Starter) -> None:
        self.page, self.starter = page, starter
        self.place = box().props("data-box=job")
        self.shown: object = ()
        self.look()

    def look(self) -> None:
        """Show it again where something has changed."""
        job = self.page.session.job
        now = None if job is None else (job, job.state, job.progress())
        if now == self.shown:
            return
        self.shown = now
        self.starter.show()
        self.place.clear()
        with self.place:
            if job is None:
                note(self.page.texts("run.no_job"))
            else:
                self._job(job)

    def _job(self, job: Job) -> None:
        texts = self.page.texts
        with box(f"job {job.state}").props(f"data-state={job.state}"):
            with box("choices"):
                ui.label(job.title).style("font-weight:600")
                note(texts(f"job.{job.state}"), "state")
                if job.state == "running":
                    act(texts("run.cancel"), "cancel", job.cancel)
                if job.state in ("stopped", "failed") and job.run == self.starter.run and self.starter.can_resume:
                    act(texts("run.resume"), "resume-job", lambda: self.starter.go("--resume"), "outline dense")
                if job.state == "done":
                    ui.link(texts("run.to_result"), self.page.address("result", run=job.run))
            if job.is_live:
                _stages(texts, job)
            elif job.state == "failed":
                note(texts("job.code", code=job.code), "fault")
            if job.state != "done" and (words := job.words()):
                with fold(texts("run.log"), opened=job.state == "failed"), box("words", "pre"):
                    ui.label(words)


def _stages(texts: Any, job: Job) -> None:  # noqa: ANN401 - texts
    now, names = job.progress(), list(STAGES)
    at = names.index(now.stage) if now.stage in names else -1
    with box("stages"):
        for index, name in enumerate(names):
            share = 100.0 if index < at else 100.0 * now.share if index == at else 0.0
            with box("stage"):
                words = texts(f"stage.{name}")
                ui.label(words)
                with box("bar").props(f'role=progressbar aria-valuenow={share:.0f} aria-label="{words}"'):
                    box().style(f"width:{share:.1f}%")
                if index == at and share < 100.0:
                    left = "" if now.seconds_left is None else duration(now.seconds_left)
                    note(f"{now.detail} {left}".strip(), "detail")
