"""Grid convergence of runs: which have one, what is computed for it, what is said, and that nothing is left behind."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fragfield.case import load_case
from fragfield.errors import InputError
from fragfield.files.run_directory import RunDirectory
from fragfield.hazard.recommended import recommended_of
from fragfield.pipeline import convergence as module
from fragfield.pipeline.convergence import COMMON, convergence_of
from fragfield.pipeline.grid_convergence import grid_convergence
from fragfield.pipeline.job import Job, RunOptions
from fragfield.pipeline.parallel import Team
from fragfield.report.findings import convergence_findings
from fragfield.results.burst import Burst
from fragfield.results.hazard import Hazard
from fragfield.results.part import to_json
from fragfield.results.summary import Summary
from fragfield.results.words import not_included_words
from fragfield.terminal.progress import ProgressReporter
from fragfield.terminal.show import convergence_words
from tests.fragfield.example_results import example
from tests.fragfield.plain_reports import plain_report
from tests.fragfield.short_run import ROOT
from tests.fragfield.synthetic_run import write_run

BURST = {"geometry": "axisymmetric", "wall_seconds": 10.0, "cells": 1600,
         "cell_size": 0.003, "mean_initial_speed": 1009.0, "max_initial_speed": 1400.0, "outer_diameter": 0.4,
         "speed_quantiles": {"90": 1200.0, "99": 1300.0}}  # fmt: skip
HEADLINE = example(
    Hazard, realisations=20, determined=True, expected=100.0, upper=103.0, standard_error=1.0, method="realisations"
)


class _Directory(RunDirectory):
    """A run directory whose summary is in memory."""

    def results(self):
        return example(Summary, burst=self.burst)


@pytest.fixture
def job(tmp_path):
    case = load_case(ROOT / "cases" / "m107_tnt.toml")
    directory = _Directory(tmp_path)
    object.__setattr__(directory, "burst", dict(BURST))
    return Job(case, directory, directory, Team(), ProgressReporter(enabled=False), RunOptions(tmp_path))


def _with(job, asked):
    """The job with a preset of other cell sizes."""
    burst = job.case.burst.model_copy(update={"convergence": asked})
    return replace(job, case=job.case.model_copy(update={"burst": burst}))


def _stub(monkeypatch, values, made):
    """Other sizes that give a function of the size in place of a burst and its flight."""

    def burst(case, *_):
        size = case.burst.cell_size
        made.append((size, case.break_up.realisations))
        if isinstance(found := values(size), Exception):
            raise found
        share = found / 1009.0
        scaled = {key: share * BURST[key] for key in ("mean_initial_speed", "max_initial_speed", "outer_diameter")}
        quantiles = {key: share * value for key, value in BURST["speed_quantiles"].items()}
        cells = round(1600 * (0.003 / size) ** 2)
        burst = {**BURST, **scaled, "speed_quantiles": quantiles, "cell_size": size, "cells": cells}
        return example(Burst, **burst), share

    def flown(_case, share, *_):
        headline = to_json(replace(HEADLINE, expected=share * HEADLINE.expected))
        return SimpleNamespace(hazard=SimpleNamespace(hazardous=FLOWN.hazard.hazardous, headline=headline)), 5

    monkeypatch.setattr(module, "burst_beside", burst)
    monkeypatch.setattr(module, "flown_beside", flown)


FLOWN = SimpleNamespace(hazard=SimpleNamespace(hazardous=(20.0, 0.0)), attitude=None, flights=20)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"geometry": "3d"}, 'has it with burst.convergence = "final" alone, and this run has "standard"'),
        ({"off": True}, 'burst.convergence = "off"'),
        ({"fragments": True}, "the fragments are from another source"),
        ({"lean": True}, "not computed for the runs of a sweep"),
    ],
)  # fmt: skip
def test_a_run_without_convergence_says_why(job, change, words):
    if "geometry" in change:
        job.source.burst["geometry"] = change["geometry"]
    if "off" in change:
        job = _with(job, "off")
    if "fragments" in change:
        job = replace(job, options=replace(job.options, fragments=job.target.path / "fragments.h5"))
    job = replace(job, options=replace(job.options, lean="lean" in change))
    found = convergence_of(job, FLOWN, HEADLINE)
    assert set(to_json(found)) == {"reason"}
    assert found.reason.startswith("no grid convergence: ")
    assert words in found.reason
    assert convergence_words(found) == []  # the recommended distance says it
    assert words in not_included_words(recommended_of(HEADLINE, found))


def test_a_manufactured_burst_gives_its_order_and_limit(job, monkeypatch):
    made = []
    _stub(monkeypatch, lambda size: 1000.0 + 1e6 * size**2, made)  # 1009 at 3 mm
    found = convergence_of(_with(job, "final"), FLOWN, HEADLINE)
    assert [1e3 * size for size, _ in made] == pytest.approx([6.0, 3.0 * 2**0.5, 3.0 / 2**0.5])
    assert list(found.sizes) == sorted(found.sizes)
    assert len(found.sizes) == 4
    speed = found.quantities["mean_initial_speed"]
    assert speed.kind == "monotone"
    assert speed.order == pytest.approx(2.0, abs=0.01)
    assert speed.extrapolated == pytest.approx(1000.0, abs=0.1)
    assert speed.uncertainty == pytest.approx(1.25 * 9.0, rel=0.02)  # of the run's own size, not of the finest
    distance = found.quantities["expected_distance"]
    assert list(distance.standard_errors) == [1.0] * 4
    assert distance.kind == "statistical"  # 0.9 m of cells in differences known to 1.4 m
    (line,) = convergence_words(found)
    assert "(2.12, 3, 4.24, 6 mm): mean initial speed, by mass ± 11\u00a0m/s, order 2" in line


@pytest.mark.parametrize(
    ("asked", "geometry", "factors"),
    [
        ("quick", "axisymmetric", [2.0]),
        ("standard", "axisymmetric", [2.0, 2**0.5]),
        ("final", "axisymmetric", [2.0, 2**0.5, 0.5**0.5]),
        ("final", "3d", [2.0, 2**0.5]),
    ],
)
def test_the_case_alone_decides_sizes_and_realisations(job, monkeypatch, asked, geometry, factors):
    made = []
    _stub(monkeypatch, lambda size: 1009.0 + size, made)
    job.source.burst["geometry"] = geometry
    for realisations, number in ((20, 20), (module._MOST + 30, module._MOST)):
        made.clear()
        found = convergence_of(_with(job, asked), FLOWN, replace(HEADLINE, realisations=realisations))
        assert [size / 0.003 for size, _ in made] == pytest.approx(factors)
        assert {count for _, count in made} == {number}
        assert len(found.sizes) == 1 + len(factors)


def test_an_unknown_preset_is_refused_with_those_that_exist():
    words = r'burst\.convergence: found "?auto"?; allowed: "off", "quick", "standard" or "final"'
    with pytest.raises(InputError, match=words):
        load_case(ROOT / "cases" / "m107_tnt.toml", ["burst.convergence=auto"])


def test_sizes_count_by_the_number_of_cells(job, monkeypatch):
    made = []
    _stub(monkeypatch, lambda size: 1009.0 + size, made)
    flat = convergence_of(_with(job, "final"), FLOWN, HEADLINE)
    assert flat.representative_sizes == pytest.approx(flat.sizes, rel=1e-3)
    job.source.burst["geometry"] = "3d"  # the stub's cells are as many as in two dimensions
    solid = convergence_of(_with(job, "final"), FLOWN, HEADLINE)
    assert solid.representative_sizes[1:] == pytest.approx([0.003 * 2 ** (1 / 3), 0.003 * 4 ** (1 / 3)], rel=1e-3)


def test_a_size_that_fails_is_reported_and_the_others_count(job, monkeypatch):
    made = []
    _stub(monkeypatch, lambda size: InputError("no layer") if size > 0.005 else 1009.0 + size, made)
    found = convergence_of(job, FLOWN, HEADLINE)
    assert len(found.sizes) == 2
    assert found.reason == "6 mm could not be computed: no layer"
    _stub(monkeypatch, lambda _: InputError("no layer"), made)
    found = convergence_of(job, FLOWN, HEADLINE)
    assert found.reason == "6 mm could not be computed: no layer; 4.24 mm could not be computed: no layer"
    assert recommended_of(HEADLINE, found).not_included["grid"] == found.reason


def test_a_run_without_a_distance_has_no_convergence_of_it(job, monkeypatch):
    _stub(monkeypatch, lambda size: 1009.0 + size, [])
    found = convergence_of(job, FLOWN, replace(HEADLINE, determined=False))
    assert "expected_distance" not in found.quantities
    assert "mean_initial_speed" in found.quantities


@pytest.mark.parametrize("error", [InputError("the mesh cannot be made"), KeyboardInterrupt()])
def test_nothing_is_left_behind(job, monkeypatch, error):
    import burst_fenicsx

    def simulate(*_, **__):
        raise error

    monkeypatch.setattr(burst_fenicsx, "simulate", simulate)
    job = _with(job, "quick")
    if isinstance(error, KeyboardInterrupt):
        with pytest.raises(KeyboardInterrupt):
            convergence_of(job, FLOWN, HEADLINE)
    else:
        assert convergence_of(job, FLOWN, HEADLINE).reason == "6 mm could not be computed: the mesh cannot be made"
    assert list(job.target.path.iterdir()) == []


def _run(share, *, kind="monotone", tolerance=0.02):
    quantity = {"values": [100.0, 101.0, 103.0], "standard_errors": [1.0, 1.0, 1.0], "order": 1.5, "order_used": 1.5,
                "extrapolated": 99.0, "uncertainty": 100.0 * share, "factor": 1.25, "kind": kind}  # fmt: skip
    sizes = [0.003, 0.0042, 0.006]
    parts = {"convergence": {"sizes": sizes, "quantities": {"expected_distance": quantity}, "reason": ""},
             "hazard": {"expected": 100.0, "determined": True, "tolerance": tolerance},
             "burst": {"cell_size": 0.003}}  # fmt: skip
    return SimpleNamespace(summary=example(Summary, **parts))


def test_a_distance_that_its_cells_leave_open_is_a_warning():
    (warning,) = convergence_findings(_run(0.07, kind="oscillating"))
    assert warning.weight == "warning"
    assert "The cell size leaves the expected distance uncertain by 7.0 %" in warning.text
    assert "(oscillating), several times `hazard.tolerance` (2 %): the sizes differ to both sides" in warning.text
    (good,) = convergence_findings(_run(0.05))
    assert good.weight == "good"


def test_the_report_has_a_line_for_each_quantity(tmp_path):
    folder = write_run(tmp_path / "run")
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    summary["convergence"] = to_json(_run(0.03).summary.convergence)
    summary["burst"]["cell_size"] = 0.003
    (folder / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
    head, line = plain_report(folder).tables["Grid convergence"]
    assert head[1] == "3 mm (this run)"
    assert line == (
        "Expected distance (m)", "100 ± 1", "101 ± 1", "103 ± 1", "1.5", "99", "3", "order observed",
    )  # fmt: skip


def test_values_of_an_integral_have_a_line_with_the_scatter_about_it():
    """Distances of an M107 with 3, 4, 6 and 8 mm, which show no order: 1.25 times the line's rise, and its error."""
    sizes, values = [3.0, 4.0, 6.0, 8.0], [142.23, 141.85, 141.35, 140.82]
    found = grid_convergence(sizes, values, [COMMON] * 4, at=6.0)
    slope, (left,) = np.polyfit(sizes, values, 1)[0], np.polyfit(sizes, values, 1, full=True)[1]
    error = math.sqrt(left / 2.0 / float(((np.array(sizes) - 5.25) ** 2).sum()))
    assert found.kind == "diverging"
    assert found.uncertainty == pytest.approx(6.0 * (1.25 * abs(slope) + 1.96 * error), rel=1e-6)
    assert found.uncertainty < 2.5
