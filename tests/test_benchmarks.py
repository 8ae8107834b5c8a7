"""The benchmarks: command line, what they print, the baseline's physics, and how they count."""

from __future__ import annotations

import json
import logging
import re

import numpy as np
import pytest

pytestmark = pytest.mark.dolfinx


@pytest.fixture(autouse=True, scope="module")
def _log_level():
    """The benchmarks ask for errors alone; other tests of this process look at warnings."""
    logger = logging.getLogger("burst_fenicsx")
    level = logger.level
    yield
    logger.setLevel(level)


def test_an_unknown_benchmark_is_refused_with_the_nearest_name(capsys):
    from benchmarks.__main__ import main

    assert main(["stepp"]) == 2
    reported = capsys.readouterr().err
    assert "none is named 'stepp' (did you mean \"step\"?); there are step, flight, whole, ranks, compile" in reported


def test_a_binary_of_lulesh_that_is_not_there_is_refused(capsys, tmp_path):
    from benchmarks.__main__ import main

    assert main(["step", "--lulesh", str(tmp_path / "lulesh2.0")]) == 2
    assert "there is no file" in capsys.readouterr().err


def test_a_run_that_stops_is_reported_and_the_others_go_on(capsys, monkeypatch):
    from benchmarks import flight, step
    from benchmarks.__main__ import main
    from burst_fenicsx.errors import NumericalStop

    def stops(options):
        raise NumericalStop("the volume of cell 7 is not positive", 8e-5)

    monkeypatch.setattr(step, "step", stops)
    monkeypatch.setattr(flight, "flight", lambda options: {"fragments": 1})
    assert main(["step", "flight", "--json"]) == 3
    reported = capsys.readouterr()
    assert "step stopped: the volume of cell 7 is not positive (at 80.00 us)" in reported.err
    assert set(json.loads(reported.out)) == {"flight", "machine"}


@pytest.mark.parametrize("points", [1, 8])
def test_the_plain_baseline_swings_as_a_bar_does(points):
    """Free bar without lateral contraction: after half a period L / c its first mode has turned round."""
    from benchmarks.plain import Material, PlainBox

    steel = Material(poisson_ratio=0.0, yield_stress=np.inf)
    bar = PlainBox((40, 1, 1), 5e-3, points, steel)
    mode = np.cos(np.pi * bar.position[:, 0] / (40 * 5e-3))
    bar.velocity[:, 0] = mode
    steps = 40 * 5e-3 / np.sqrt(steel.elastic_modulus / steel.density) / bar.step_size
    assert steps == pytest.approx(round(steps))
    for _ in range(round(steps)):
        bar.step()
    assert bar.velocity[:, 0] == pytest.approx(-mode, abs=2e-3)
    assert np.abs(bar.velocity[:, 1:]).max() < 1e-9


@pytest.mark.parametrize("points", [1, 8])
def test_the_plain_baseline_flows_and_keeps_its_energy(points):
    from benchmarks.plain import straining_box, von_mises

    box = straining_box(1000, points, cell_size=20e-3)
    before = box.kinetic_energy
    for _ in range(40):
        box.step()
    law = box.material
    assert 0.2 < (box.plastic_strain > 0.0).mean() < 1.0
    assert (von_mises(box.stress) <= (law.yield_stress + law.hardening * box.plastic_strain) * (1.0 + 1e-9)).all()
    assert box.plastic_work > 0.1 * before
    assert box.kinetic_energy + box.elastic_energy + box.plastic_work == pytest.approx(before, rel=0.01)


def test_the_grind_time_of_lulesh_is_read():
    from benchmarks.step import parsed

    assert parsed("Grind time (us/z/c)  =  1.0831312 (per dom)  (  0.173301 overall)\n") == pytest.approx(1.0831312e-6)
    with pytest.raises(RuntimeError, match="is this LULESH"):
        parsed("usage: cat FILE")


def test_tables_are_put_between_the_marks_of_the_readme(tmp_path):
    from benchmarks.machine import machine
    from benchmarks.readme import README, write_tables
    from benchmarks.table import at_most

    copy = tmp_path / "README.md"
    copy.write_text(README.read_text(encoding="utf-8"), encoding="utf-8")
    write_tables({"step": {"cells": 7, **at_most(1.25, 1.0, "this over that")}, "machine": machine()}, copy)
    text = copy.read_text(encoding="utf-8")
    found = re.search("<!-- begin step -->(.*)<!-- end step -->", text, re.DOTALL)
    assert found is not None
    assert "| cells | 7 |" in found[1]
    assert "| this over that | 1.25 | 1 | MISSED |" in found[1]
    assert machine()["processor"] in found[1]
    assert text.replace(found[1], "") == re.sub(
        "(<!-- begin step -->).*(<!-- end step -->)", r"\1\2", README.read_text(encoding="utf-8"), flags=re.DOTALL
    )


def test_the_readme_has_a_filled_table_for_every_benchmark():
    from benchmarks.__main__ import BENCHMARKS
    from benchmarks.readme import README

    text = README.read_text(encoding="utf-8")
    for name in BENCHMARKS:
        found = re.search(f"<!-- begin {name} -->(.*?)<!-- end {name} -->", text, re.DOTALL)
        assert found is not None, name
        assert "| what | figure |" in found[1], f"python -m benchmarks {name} --readme"
