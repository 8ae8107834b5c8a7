"""The benchmarks: command line, what they print, their history, and the physics of the baselines."""

from __future__ import annotations

import json
import logging
import re
import shutil

import numpy as np
import pytest

from benchmarks import history
from benchmarks.history import changes, compare, flat, remember
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


def found(ratio, machine=MACHINE):
    step = {**at_most(ratio, 0.45, "step over the other"), "share": {"burnt": 1.0}, "rows": [1, 2]}
    return {"step": step, "machine": machine}


def test_figures_are_named_by_their_place():
    assert dict(flat(found(0.4)["step"])) == {"ratio": 0.4, "target": 0.45, "share.burnt": 1.0}


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


def test_what_was_not_measured_last_time_is_compared_with_the_time_before():
    earlier = [
        {"date": "a", "revision": "1", "figures": {"step.ratio": 1.0}},
        {"date": "b", "revision": "2", "figures": {"whole.ratio": 2.0}},
    ]
    words = changes(earlier, {"figures": {"step.ratio": 1.5, "new.ratio": 3.0, "step.seconds": 9.0}})
    assert words == ["step.ratio: 1 on a (1), now 1.5"]


def test_two_revisions_are_measured_in_turns(monkeypatch):
    seen = []

    def figures(root, arguments):
        seen.append((root == history._ROOT, arguments))
        slower = 1.0 if root == history._ROOT else 2.0
        return {"step.seconds_per_cell_step": slower * (1.0 + 0.1 * len(seen)), "step.cells": 8.0, "step.target": 0.5}

    monkeypatch.setattr(history, "_figures_in", figures)
    monkeypatch.setattr(history, "_unpack", lambda revision, folder: None)
    result = compare("v1", ["step"], ["--cell-size", "5"])
    assert [here for here, _ in seen] == [False, True, False, True]
    assert seen[0][1] == ["step", "--cell-size", "5"]
    (row,) = result["figures"]
    assert row["figure"] == "step.seconds_per_cell_step"
    assert row["before"] == pytest.approx(2.2)
    assert row["now_over_before"] == pytest.approx(1.2 / 2.2)


@pytest.mark.skipif(shutil.which("git") is None, reason="needs git")
def test_an_unknown_revision_is_refused(capsys):
    from benchmarks.__main__ import main

    assert main(["step", "--compare", "no-such-revision"]) == 2
    assert "git has no revision 'no-such-revision'" in capsys.readouterr().err
    assert main(["--compare", "HEAD"]) == 2
    assert "--compare needs the names of benchmarks" in capsys.readouterr().err


def test_the_cloud_is_what_the_target_names():
    from benchmarks.flight_plain import burst_cloud

    fragments = burst_cloud(20_000)
    assert 1e-4 <= fragments.mass.min() < 1.1e-4
    assert 0.45 < fragments.mass.max() <= 0.5
    assert 300.0 <= fragments.speed.min() < 310.0
    assert 1990.0 < fragments.speed.max() <= 2000.0
    assert abs((fragments.velocity[:, 2] > 0.0).mean() - 0.5) < 0.02


def test_no_crossing_is_missed_or_invented():
    from benchmarks.flight import crossing_faults

    there, missed, invented = crossing_faults(20_000)
    assert there > 20
    assert (missed, invented) == (0, 0)


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
