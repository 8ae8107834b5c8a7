"""Grid convergence of runs: which have one, what is computed for it, what is said, and that nothing is left behind."""

from __future__ import annotations

import math
import signal
import subprocess
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fragfield.case import load_case
from fragfield.errors import InputError
from fragfield.files.run_directory import SCRATCH, STAGES, RunDirectory
from fragfield.pipeline import convergence as module
from fragfield.pipeline.convergence import convergence_of, convergence_words, with_cells
from fragfield.pipeline.job import Job
from fragfield.pipeline.parallel import Team
from fragfield.report.findings.hazard import convergence_findings
from fragfield.report.tables.convergence import convergence_tables
from fragfield.terminal.progress import ProgressReporter
from tests.fragfield.short_run import ROOT, command, environment

BURST = {"geometry": "axisymmetric", "wall_seconds": 10.0, "start_seconds": 0.5, "stepping_seconds": 8.0, "cells": 1600,
         "cell_size": 0.003, "mean_initial_speed": 1009.0, "max_initial_speed": 1400.0, "outer_diameter": 0.4,
         "speed_quantiles": {"90": 1200.0, "99": 1300.0}}  # fmt: skip
HEADLINE = {"realisations": 20, "determined": True, "distance": 100.0, "upper": 103.0, "standard_error": 1.0}


class _Directory(RunDirectory):
    """A run directory whose summary is in memory."""

    def summary(self):
        return {"burst": self.burst}


@pytest.fixture
def job(tmp_path):
    case = load_case(ROOT / "cases" / "m107_tnt.toml")
    directory = _Directory(tmp_path)
    object.__setattr__(directory, "burst", dict(BURST))
    # The clock began long ago enough for every size, unless a test says otherwise.
    return Job(case, directory, directory, Team(), ProgressReporter(enabled=False), began=time.perf_counter() - 1000.0)


@pytest.fixture
def flown():
    return SimpleNamespace(
        hazard=SimpleNamespace(counts=SimpleNamespace(hazardous=np.full((20, 4), 5.0))), attitude=None, flights=20
    )


def _stub(monkeypatch, values, made):
    """Other sizes that give a function of the size in place of a burst."""

    def computed(_job, size, realisations, words):
        made.append((size, realisations))
        if isinstance(found := values(size), Exception):
            words.append(str(found))
            return None
        own = module._own_result(BURST, FLOWN, HEADLINE)
        changed = {name: None if value is None else value * found / 1009.0 for name, value in own.values.items()}
        return replace(own, size=size, cells=round(1600 * (0.003 / size) ** 2), values=changed)

    monkeypatch.setattr(module, "_computed", computed)


FLOWN = SimpleNamespace(
    hazard=SimpleNamespace(counts=SimpleNamespace(hazardous=np.full((20, 4), 5.0))), attitude=None, flights=20
)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"geometry": "3d"}, "is in three dimensions; for convergence run `fragfield sweep CASE burst.cell_size="),
        ({"off": True}, 'burst.convergence = "off"; for convergence run `fragfield sweep'),
        ({"fragments": True}, "the fragments are from another source"),
        ({"lean": True}, "not computed for the runs of a sweep"),
    ],
)  # fmt: skip
def test_a_run_without_convergence_says_why(job, flown, change, words):
    if "geometry" in change:
        job.source.burst["geometry"] = change["geometry"]
    if "off" in change:
        job = replace(job, case=job.case.model_copy(update={
            "burst": job.case.burst.model_copy(update={"convergence": "off"})}))  # fmt: skip
    if "fragments" in change:
        job = replace(job, fragments=job.target.path / "fragments.h5")
    job = replace(job, lean="lean" in change)
    found = convergence_of(job, flown, HEADLINE, 1.0)
    assert set(found) == {"reason"}
    assert found["reason"].startswith("no grid convergence: ")
    assert words in found["reason"]
    assert convergence_words(found) == [found["reason"]]


def test_a_manufactured_burst_gives_its_order_and_limit(job, flown, monkeypatch):
    made = []
    _stub(monkeypatch, lambda size: 1000.0 + 1e6 * size**2, made)  # 1009 at 3 mm
    found = convergence_of(job, flown, HEADLINE, 1.0)
    assert [1e3 * size for size, _ in made] == pytest.approx([6.0, 3.0 * 2**0.5, 3.0 / 2**0.5])
    assert found["sizes"] == sorted(found["sizes"])
    assert len(found["sizes"]) == 4
    speed = found["quantities"]["mean_initial_speed"]
    assert speed["kind"] == "monotone"
    assert speed["order"] == pytest.approx(2.0, abs=0.01)
    assert speed["extrapolated"] == pytest.approx(1000.0, abs=0.1)
    assert speed["uncertainty"] == pytest.approx(1.25 * 9.0, rel=0.02)  # of the run's own size, not of the finest
    distance = found["quantities"]["hazard_distance"]
    assert distance["standard_errors"] == [1.0] * 4
    assert distance["kind"] == "statistical"  # 0.9 m of cells in differences known to 1.4 m
    (line,) = convergence_words(found)
    assert "(2.12, 3, 4.24, 6 mm): mean speed ± 11 m/s, order 2" in line


def test_the_budget_is_half_of_the_time_taken(job, flown, monkeypatch):
    made = []
    _stub(monkeypatch, lambda size: 1009.0 + size, made)
    short = replace(job, began=time.perf_counter())
    found = convergence_of(short, flown, HEADLINE, 2.0)  # 10 s and 2 s: 6 s for the others
    # sqrt(2) h: 8 s / 2.8 and its flights fit; h / sqrt(2): 8 s x 2.8 does not.
    assert [1e3 * size for size, _ in made] == pytest.approx([6.0, 3.0 * 2**0.5])
    made.clear()
    short.source.burst.update(wall_seconds=1.0, stepping_seconds=0.9, start_seconds=0.1)
    found = convergence_of(short, flown, HEADLINE, 20.0)  # flights of 1 s a realisation
    assert [(size, number) for size, number in made] == [(0.006, 12)]  # the coarsest in any case, with twelve of them
    assert "4.24 mm left out: about" in found["reason"]
    assert found["quantities"]["mean_initial_speed"]["kind"] == "two_sizes"


def test_a_size_that_fails_is_reported_and_the_others_count(job, flown, monkeypatch):
    made = []
    _stub(monkeypatch, lambda size: ValueError("6 mm: no layer") if size > 0.005 else 1009.0 + size, made)
    found = convergence_of(job, flown, HEADLINE, 1.0)
    assert len(found["sizes"]) == 3
    assert found["reason"] == "6 mm: no layer"


def test_a_run_without_a_distance_has_no_convergence_of_it(job, flown, monkeypatch):
    _stub(monkeypatch, lambda size: 1009.0 + size, [])
    found = convergence_of(job, flown, {"realisations": 20, "determined": False}, 1.0)
    assert "hazard_distance" not in found["quantities"]
    assert "mean_initial_speed" in found["quantities"]


def test_another_size_changes_the_cells_and_leaves_out_what_is_not_needed(job):
    case = with_cells(job.case, 0.012, 7)
    assert (case.burst.cell_size, case.burst.convergence, case.burst.geometry) == (0.012, "off", "axisymmetric")
    assert (case.break_up.realisations, case.hazard.max_realisations) == (7, 7)
    assert (case.witness, case.exposed, case.flight.trajectories) == ([], [], 0)
    assert (case.seed, case.round, case.hazard.energy) == (job.case.seed, job.case.round, job.case.hazard.energy)
    assert case.burst.products == job.case.burst.products
    assert job.case.witness  # the run's own case is as it was


@pytest.mark.parametrize("error", [InputError("the mesh cannot be made"), KeyboardInterrupt()])
def test_nothing_is_left_behind(job, monkeypatch, error):
    import burst_fenicsx

    def simulate(_rounds, _settings, folder, **_):
        (folder / "burst_snapshot.h5").touch()
        raise error

    monkeypatch.setattr(burst_fenicsx, "simulate", simulate)
    words = []
    if isinstance(error, KeyboardInterrupt):
        with pytest.raises(KeyboardInterrupt):
            module._computed(job, 0.006, 2, words)
    else:
        assert module._computed(job, 0.006, 2, words) is None
        assert words == ["6 mm could not be computed: the mesh cannot be made"]
    assert list(job.target.path.iterdir()) == []


def test_what_a_killed_run_left_is_removed(tmp_path):
    directory = RunDirectory(tmp_path)
    directory.write_case(load_case(ROOT / "cases" / "m107_tnt.toml"))
    (tmp_path / SCRATCH).mkdir()
    (tmp_path / SCRATCH / "burst.h5").touch()
    directory.remove([STAGES["fly"]])
    assert not (tmp_path / SCRATCH).exists()


def _run(share, *, kind="monotone", tolerance=0.02):
    quantity = {"values": [100.0, 101.0, 103.0], "standard_errors": [1.0, 1.0, 1.0], "order": 1.5, "order_used": 1.5,
                "extrapolated": 99.0, "uncertainty": 100.0 * share, "factor": 1.25, "kind": kind}  # fmt: skip
    sizes = [0.003, 0.0042, 0.006]
    parts = {"convergence": {"sizes": sizes, "quantities": {"hazard_distance": quantity}, "reason": ""},
             "hazard": {"distance": 100.0, "determined": True, "tolerance": tolerance},
             "burst": {"cell_size": 0.003}}  # fmt: skip
    return SimpleNamespace(part=lambda name: parts.get(name, {}))


def test_a_distance_that_its_cells_leave_open_is_a_warning():
    (warning,) = convergence_findings(_run(0.07, kind="oscillating"))
    assert warning.weight == "warning"
    assert "The cell size leaves the hazard distance uncertain by 7.0 %" in warning.text
    assert "values that oscillate), several times `hazard.tolerance` (2 %): repeat with smaller cells" in warning.text
    (good,) = convergence_findings(_run(0.05))
    assert good.weight == "good"


def test_the_report_has_a_line_for_each_quantity():
    (table, words) = convergence_tables(_run(0.03))
    assert table.head[1] == "3\u00a0mm (this run)"
    (line,) = table.lines
    assert line == (
        "Distance of the expected density (m)",
        "100\u00a0±\u00a01", "101\u00a0±\u00a01", "103\u00a0±\u00a01",
        "1.5", "99", "3", "order observed",
    )  # fmt: skip
    assert "The largest speed is the mean of one cell" in words.text


@pytest.mark.slow
@pytest.mark.dolfinx
def test_an_interrupted_run_leaves_no_scratch_folder(short_case, tmp_path):
    out = tmp_path / "out"
    process = subprocess.Popen(command("run", short_case, "--out", out, "--quiet"), env=environment())
    until = time.monotonic() + 300.0
    while not (out / SCRATCH).exists():
        assert process.poll() is None, "ended before other sizes were computed"
        assert time.monotonic() < until
        time.sleep(0.002)
    process.send_signal(signal.SIGTERM)
    assert process.wait(timeout=60) == 130
    assert not (out / SCRATCH).exists()
    assert not RunDirectory(out).complete(STAGES["fly"])  # a resumed run computes it again


@pytest.mark.parametrize(("budget", "sizes"), [(math.inf, 3), (0.0, 1)])
def test_a_study_computes_every_size_whatever_it_takes(budget, sizes, monkeypatch):
    """Without a limit of time: all sizes with all realisations; so the numbers do not depend on the machine."""
    own = module._Result(0.006, 1000, 80, {}, {}, 100.0, 1000.0)
    made, words = [], []
    monkeypatch.setattr(module, "_computed", lambda job, size, number, words: made.append((size, number)) or own)
    found = list(module._other_sizes(None, own, budget, 10.0, words))
    assert len(found) == len(made) == sizes
    assert {number for _, number in made} == ({80} if budget else {12})
    assert bool(words) == (budget == 0.0)
