"""The benchmarks: command line, what they print, their history, and the physics of the baselines."""

from __future__ import annotations

import json
import logging
import re

import numpy as np
import pytest

from benchmarks.history import remember
from benchmarks.table import at_most

pytestmark = pytest.mark.dolfinx
MACHINE = {"date": "2026-11-24", "processor": "AMD EPYC(R), family 25", "cores": 2}


@pytest.fixture(autouse=True, scope="module")
def _log_level():
    """The benchmarks ask for errors alone; other tests of this process look at warnings."""
    logger = logging.getLogger("burst_fenicsx")
    level = logger.level
    yield
    logger.setLevel(level)


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


def test_the_readme_has_a_filled_table_for_every_benchmark():
    from benchmarks.__main__ import BENCHMARKS
    from benchmarks.readme import README

    text = README.read_text(encoding="utf-8")
    for name in BENCHMARKS:
        found = re.search(f"<!-- begin {name} -->(.*?)<!-- end {name} -->", text, re.DOTALL)
        assert found is not None, name
        assert "| what | figure |" in found[1], f"python -m benchmarks {name} --readme"


def found(ratio, machine=MACHINE):
    step = {**at_most(ratio, 0.45, "step over the other"), "share": {"burnt": 1.0}, "rows": [1, 2]}
    return {"step": step, "machine": machine}


def test_a_ratio_that_moves_is_said_and_every_run_is_kept(tmp_path):
    assert remember(found(0.40), tmp_path) == []
    assert remember(found(0.43), tmp_path) == []
    (moved,) = remember(found(0.50), tmp_path)
    assert moved.startswith("step.ratio: 0.43 on 2026-11-24 (")
    assert moved.endswith("now 0.5")
    (path,) = tmp_path.iterdir()
    assert path.name == "amd_epyc_family_25_2_cores.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert [line["figures"]["step.ratio"] for line in lines] == [0.40, 0.43, 0.50]


def test_the_plain_flight_lands_where_the_library_does():
    from benchmarks.flight_plain import PlainFlight, burst_cloud, plain_seconds
    from flight import fly

    fragments = burst_cloud(3)
    landing = fly(fragments).landing
    plain = PlainFlight(fragments)
    exact = np.array([plain.exact_range(i, float(landing["time"][i])) for i in range(3)])
    assert landing["distance"] == pytest.approx(exact, rel=1e-6)
    rows = plain_seconds(plain, [0, 1], exact[:2], 1e-4)
    assert [row["method"] for row in rows] == ["RK45", "DOP853"]
    assert all(row["error"] <= 1e-4 for row in rows)
