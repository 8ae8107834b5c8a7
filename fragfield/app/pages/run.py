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
_STATES = {"running": "runs", "stopping": "is being stopped", "stopped": "stopped; it can be resumed"}
_LOOK = 1.0  # s between looks at the run


def content(page: CasePage) -> None:
    """Build the page."""
    with box("columns"):
        with box(tag="section"):
            heading("Settings")
            _presets(page)
            _tables(page)
        with box(tag="section"):
            heading("Findings")
            findings = box().props("role=status")
            heading("What is computed")
            cost = html()
            starter = _Starter(page)
            heading("The run")
            job = _Now(page, starter)

    async def judged() -> None:
        found = await threads.io_bound(checked, page)
        starter.allow(found is not None)
        _show_findings(page, findings, found)
        cost.set_content(_cost(page, found) if found is not None else '<p class="meaning">Mend the errors first.</p>')

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
                note(severity.capitalize(), f"severity {severity}")
                with box():
                    if key:
                        ui.link(key, page.address(page_of(key), key=key))
                    ui.label(words)
        if not rows:
            note("✓ Nothing is doubtful in this case.", "good")


def kilograms(mass: float) -> str:
    """A mass in words."""
    return f"{number(mass, 3)} kg"


def _cost(page: CasePage, found: CheckedBurst | str) -> str:
    if isinstance(found, str):
        return ""
    contents, last = found.contents, _last_time(page)
    rows = {
        "Burst": f"{found.geometry.choice} ({found.geometry.reason})",
        "Cells": number(found.mesh.cells),
        "Memory": f"{found.expected.memory_bytes / 1e9:.2g} GB",
        "Besides": "bursts of the grid convergence, flights, and once the compiler (minutes)",
        "The last run took": last,
        "Net explosive quantity": kilograms(contents.explosive) if contents else "",
    }
    return facts([one for one in rows.items() if one[1]])


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
    note("A preset sets cell size, grid convergence and realisations in the case; nothing is hidden.", "meaning")

    def choose(name: str) -> None:
        case = page.case.resolved()
        diameter = max((_diameter(entry.profile) for entry in case.round), default=0.0) if case is not None else 0.0
        if not diameter:
            ui.notify("A preset needs a round with a contour, and a case without errors.", type="warning")
            return
        kept = [page.change(path, value) for path, value in preset_values(name, diameter).items()]
        if all(kept):
            ui.navigate.reload()

    with box("choices"):
        for name in PRESETS:
            ui.button(name.capitalize(), on_click=lambda _, name=name: choose(name)).props(
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
    with fold("The case file as text"):
        _source(page)


def _source(page: CasePage) -> None:
    note("The file is the truth: the pages show and change it, the command line reads it.", "meaning")
    source = ui.textarea(value=page.case.text).props("outlined autogrow spellcheck=false").classes("source")

    def take() -> None:
        if page.attempt(lambda: page.case.replace(source.value or "")):
            ui.navigate.reload()

    act("Take this text", "take-text", take)


class _Starter:
    def __init__(self, page: CasePage) -> None:
        self.page = page
        self.run = page.session.space.run_of(page.case.name)
        with box("choices"):
            self.start = act("Run", "start", self.go, "")
            self.resume = act("Continue the run", "resume", lambda: self.go("--resume"), "outline")
            self.again = act("Compute again", "again", lambda: self.go("--overwrite"), "outline")
        note(
            f"The case is saved and computed into {self.run}, one run at a time. It goes on when this page is closed, "
            "and is stopped with the application."
        )
        self.show()

    @property
    def can_resume(self) -> bool:
        return RunDirectory(self.page.session.space.folder / self.run).exists

    def show(self) -> None:
        """Offer to run, or to continue and to compute again where a run has been started."""
        self.start.set_visibility(not self.can_resume)
        self.resume.set_visibility(self.can_resume)
        self.again.set_visibility(self.can_resume)

    def allow(self, allowed: bool) -> None:
        for button in (self.start, self.resume, self.again):
            button.set_enabled(allowed)
        self.show()

    def go(self, *options: str) -> None:
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
        job = self.page.session.job
        now = None if job is None else (job, job.state, job.progress())
        if now == self.shown:
            return
        self.shown = now
        self.starter.show()
        self.place.clear()
        with self.place:
            if job is None:
                note("Nothing has been run from here.")
            else:
                self._job(job)

    def _job(self, job: Job) -> None:
        with box(f"job {job.state}").props(f"data-state={job.state}"):
            with box("choices"):
                ui.label(job.title).style("font-weight:600")
                note(_STATES.get(job.state, job.state), "state")
                if job.state == "running":
                    act("Cancel", "cancel", job.cancel)
                if job.state in ("stopped", "failed") and job.run == self.starter.run and self.starter.can_resume:
                    act("Continue the run", "resume-job", lambda: self.starter.go("--resume"), "outline dense")
                if job.state == "done":
                    ui.link("To the result", self.page.address("result", run=job.run))
            if job.is_live:
                _stages(job)
            elif job.state == "failed":
                note(f"Exit code {job.code}; the log says why.", "fault")
            if job.state != "done" and (words := job.words()):
                with fold("Log", opened=job.state == "failed"), box("words", "pre"):
                    ui.label(words)


def _stages(job: Job) -> None:
    now, names = job.progress(), list(STAGES)
    at = names.index(now.stage) if now.stage in names else -1
    with box("stages"):
        for index, name in enumerate(names):
            share = 100.0 if index < at else 100.0 * now.share if index == at else 0.0
            with box("stage"):
                words = "flight" if name == "fly" else name
                ui.label(words)
                ui.linear_progress(share / 100.0, show_value=False, size=".7rem").props(f'aria-label="{words}"')
                if index == at and share < 100.0:
                    left = "" if now.seconds_left is None else duration(now.seconds_left)
                    note(f"{now.detail} {left}".strip(), "detail")
