"""The benchmarks: command line, what they print, the baseline's physics, and how they count."""

from __future__ import annotations

import json
import logging
import re

import numpy as np
import pytest

pytestmark = pytest.mark.dolfinx

COARSE = 20e-3
EARLY = 20e-6


@pytest.fixture(autouse=True, scope="module")
def _log_level():
    """The benchmarks ask for errors alone; other tests of this process look at warnings."""
    logger = logging.getLogger("burst_fenicsx")
    level = logger.level
    yield
    logger.setLevel(level)


@pytest.fixture(scope="module")
def run():
    """A coarse run under way."""
    from benchmarks.state import in_the_middle

    return in_the_middle(COARSE, EARLY)


def test_an_unknown_benchmark_is_refused_with_the_nearest_name(capsys):
    from benchmarks.__main__ import main

    assert main(["stepp"]) == 2
    reported = capsys.readouterr().err
    assert "none is named 'stepp' (did you mean \"step\"?); there are kernel, step, plain_fenicsx, threads" in reported


def test_a_binary_of_lulesh_that_is_not_there_is_refused(capsys, tmp_path):
    from benchmarks.__main__ import main

    assert main(["step", "--lulesh", str(tmp_path / "lulesh2.0")]) == 2
    assert "there is no file" in capsys.readouterr().err


def test_json_is_one_object_with_ratios_beside_targets(capsys):
    from benchmarks.__main__ import main

    assert main(["step", "plain_fenicsx", "threads", "--json", "--cell-size", f"{1e3 * COARSE:g}"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found) == {"step", "plain_fenicsx", "threads", "machine"}
    for comparison in (found["step"], found["step"]["full_quadrature"]):
        assert comparison["met"] == (comparison["ratio"] <= comparison["target"])
        assert 1e-8 < comparison["seconds_per_cell_step"] < 1e-3
    ratio = found["step"]["seconds_per_cell_step"] / found["plain_fenicsx"]["seconds_per_cell_step"]
    assert found["step"]["ratio"] == pytest.approx(ratio)
    assert "absent" in found["step"]["lulesh"]
    if found["threads"]["threads"] > 1:
        assert found["threads"]["target"] == 1.85


def test_a_run_that_stops_is_reported_and_the_others_go_on(capsys, monkeypatch):
    from benchmarks import kernel, resources
    from benchmarks.__main__ import main
    from burst_fenicsx.errors import NumericalStop

    def stops(options):
        raise NumericalStop("the volume of cell 7 is not positive", 8e-5)

    monkeypatch.setattr(kernel, "kernel", stops)
    monkeypatch.setattr(resources, "memory", lambda options: {"cells": 1})
    assert main(["kernel", "memory", "--json"]) == 3
    reported = capsys.readouterr()
    assert "kernel stopped: the volume of cell 7 is not positive (at 80.00 us)" in reported.err
    assert set(json.loads(reported.out)) == {"memory", "machine"}


def test_work_of_others_is_distinguished_from_our_own(monkeypatch):
    from benchmarks import machine

    seconds = iter([100.0, 103.0, 103.0])
    monkeypatch.setattr(machine, "_seconds_of_others", lambda: next(seconds))
    clock = iter([0.0, 2.0, 2.5])
    monkeypatch.setattr(machine.time, "perf_counter", lambda: next(clock))
    others = machine.Others()
    assert others.cores == pytest.approx(1.5)


def test_growth_is_a_power_of_the_number_of_cells():
    from benchmarks.growth import growth_of

    found = growth_of([20e-3, 12e-3])
    (few, more), names = found["sizes"], ("cells", "surface_nodes", "seconds_per_step", "seconds_per_search")
    assert all(more[name] > 0.0 for name in names)
    assert more["time_step"] < few["time_step"]
    cost = (more["seconds_per_step"] / more["cell_size"]) / (few["seconds_per_step"] / few["cell_size"])
    assert found["exponent"] == pytest.approx(np.log(cost) / np.log(more["cells"] / few["cells"]))
    assert found["ratio"] == pytest.approx(found["exponent"] / (4 / 3))
    assert found["met"] == (abs(found["ratio"] - 1.0) <= 0.05)


def test_a_fresh_process_reports_its_times_and_memory():
    from benchmarks.fresh import fresh_run

    reported = fresh_run(COARSE, 1e-6)
    assert (
        0.0 < reported["seconds_to_imports"] < reported["seconds_to_set_up"] < reported["seconds_to_first_step"] < 120.0
    )
    assert 5e7 < reported["peak_bytes"] < 1e9


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


def test_the_block_flows_at_its_shear_strength_and_stays_at_rest_as_a_whole():
    """Half the difference of the principal stresses, within; forces of a free body add up to nothing."""
    from benchmarks.block import stretched_block

    solver = stretched_block(6)
    for _ in range(3):
        solver.step()
    state, strength = solver.fields, solver.fields.solid.parameters[0, 2]
    centre = state.nodes.position[state.mesh.dofmap].mean(axis=1)
    inner = np.flatnonzero(np.abs(centre).max(axis=1) < 3e-3)  # whom the release from the sides has not reached
    assert len(inner) == 8
    stress = state.solid.stress[inner, 0][:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)
    principal = np.linalg.eigvalsh(stress)
    shear = 0.5 * (principal[:, 2] - principal[:, 0])
    assert ((shear <= strength * (1.0 + 1e-9)) & (shear > 0.995 * strength)).all()  # it has begun to soften
    momentum = state.mass @ state.nodes.velocity
    assert np.abs(momentum).max() < 1e-12 * (state.mass @ np.abs(state.nodes.velocity)).max()


def test_the_cells_are_solid_or_charge(run):
    from benchmarks.parts import count, forces_of_part
    from benchmarks.state import forces_alone

    force = run.fields.nodes.force
    with forces_alone(run) as forces:
        parts = []
        for charge in (False, True):
            forces_of_part(run, charge=charge)()
            parts.append(force.copy())
        forces()
        assert parts[0] + parts[1] == pytest.approx(force, rel=1e-3, abs=1e-3 * np.abs(force).max())
    assert count(run, charge=False) + count(run, charge=True) == len(run.mesh.cells)


def test_forces_alone_leave_the_run_as_it_was(run):
    from benchmarks.state import forces_alone

    arrays = (run.fields.nodes.position, run.fields.nodes.force, run.fields.solid.stress)
    before = [array.copy() for array in arrays]
    with forces_alone(run) as forces:
        assert run.solver.contact is None
        forces()
    assert run.solver.contact is run.contact
    for old, new in zip(
        before, (run.fields.nodes.position, run.fields.nodes.force, run.fields.solid.stress), strict=True
    ):
        assert new == pytest.approx(old, rel=1e-2, abs=1e-2 * np.abs(old).max())


def test_full_quadrature_takes_over_the_state_of_the_one_point():
    from benchmarks.state import in_the_middle, in_the_middle_full

    one, full = in_the_middle(COARSE, EARLY), in_the_middle_full(COARSE, EARLY)
    assert full.fields.solid.stress.shape[1] == 8
    assert full.solver.time > EARLY
    moved = np.linalg.norm(full.fields.nodes.position - one.fields.nodes.position, axis=1)
    assert moved.max() < 2000.0 * (full.solver.time - EARLY)


def test_every_array_of_the_kernels_is_counted(run):
    """An array that is new in the kernels must be entered in `traffic.TRAFFIC`, or in `STILL`."""
    from benchmarks.traffic import bytes_per_cell, uncounted

    assert not uncounted(run.fields)
    nodes = len(run.fields.nodes.position) / len(run.mesh.cells)
    solid = bytes_per_cell(run.fields, "solid")
    assert solid["nodes.position"] == pytest.approx(24 * nodes)
    assert solid["solid.stress"] == 2 * 6 * 8
    assert solid["solid.hourglass"] == 2 * 12 * 8


def test_a_number_counts_what_is_done_with_it():
    from benchmarks.operations import Counted

    Counted.done.update(dict.fromkeys(Counted.done, 0))
    a, b = Counted(3.0), np.array([Counted(4.0)], dtype=object)
    result = np.sqrt(a * a + b[0] ** 2) / 2.0 - np.float64(0.5)
    result += np.exp(b)[0] * 0.0
    assert float(min(result, 9.0)) == 2.0
    assert Counted.done == {"add": 3, "multiply": 3, "divide": 1, "root": 1, "power": 1}


def test_operations_are_counted_as_the_kernels_do_them(run):
    from benchmarks.operations import operations_per_cell

    found = operations_per_cell(run, charge=True, blocks=2)
    assert 300.0 < found["add"] < 3000.0
    assert 300.0 < found["multiply"] < 3000.0
    assert found["divide"] + found["root"] < 0.1 * found["multiply"]


def test_shared_nodes_are_counted_in_the_partition():
    """A bar of 12 cells in runs of 3 and 4: each of the cuts has four nodes, the ranks in the middle have two."""
    from benchmarks.rank_estimate import shared_nodes, slabs
    from tests.burst_fenicsx.boxes import box

    bar = box((12, 1, 1), (12.0, 1.0, 1.0))
    for ranks, expected in ((1, (0, 0)), (2, (4, 1)), (4, (8, 2))):
        assert shared_nodes(bar, slabs(bar, ranks), ranks) == expected


def test_the_balance_is_that_of_the_slowest_rank_in_every_step():
    from benchmarks.rank_estimate import balance

    owner, cost = np.arange(8) // 2, np.ones(8)
    even = np.zeros((1, 8), dtype=np.int8)
    times = np.array([1e-6]), np.array([1e-7])
    assert balance(times, even, owner, 4, cost) == 1.0
    # Two of eight cells take two steps: on one rank of two it makes 4 + 2 in place of (8 + 2) / 2.
    level = np.array([[1, 1, 0, 0, 0, 0, 0, 0]], dtype=np.int8)
    assert balance(times, level, owner // 2, 2, cost) == pytest.approx(6.0 / 5.0)
    # A choice counts by how long it was kept; a dearer cell by its cost.
    times = np.array([1e-6, 3e-6]), np.array([1e-7, 1e-7])
    assert balance(times, np.concatenate([level, even]), owner // 2, 2, cost) == pytest.approx(
        (6 + 3 * 4) / (5 + 3 * 4)
    )
    assert balance((times[0][:1], times[1][:1]), even, owner // 2, 2, cost + (np.arange(8) == 0)) == pytest.approx(
        10 / 9
    )


@pytest.fixture(scope="module")
def recorded():
    """A pair of tubes with cells of 12 mm, of which a front has passed a third, and what was measured of it."""
    from benchmarks.rank_estimate import History, Measured, mesh_of
    from tests.burst_fenicsx.tubes import tube

    rounds = tube(), tube(name="right", position=(0.16, 0.0, 0.0))
    mesh = mesh_of(rounds, 12e-3)
    near_front = np.abs(mesh.station / mesh.lengths[0] - 0.33) < 0.1
    level = np.where(near_front, 2, 0).astype(np.int8)[None]
    history = History(mesh, rounds, np.array([1e-6]), np.array([1e-7]), level)
    cells = len(mesh.cells)
    measured = Measured(
        cells=cells, cell_size=12e-3, seconds_per_cell_step=2e-7, cell_steps=100.0 * cells, exchanges=0, contacts=0,
        searches=0, seconds_per_search=0.0, near=100.0, searched=0.0, bytes_per_own_cell=1000.0, bytes_per_cell=100.0,
        base_bytes=1e8,
    )  # fmt: skip
    return history, measured


def test_ranks_with_whole_rounds_are_fully_used(recorded):
    from benchmarks.rank_estimate import estimate

    history, measured = recorded
    found = estimate(history, measured, 8, 4, 12e-3)
    assert found["efficiency"] == pytest.approx(1.0)
    assert (found["balance"], found["shared_nodes"], found["neighbours"]) == (1.0, 0, 0)
    assert found["cells"] == len(history.mesh.cells)  # two of the rounds
    assert found["memory_bytes"] == pytest.approx(1e8 + 1000.0 * found["cells"] + 100.0 * 4.0 * found["cells"])


def test_neighbours_on_other_ranks_are_counted_in_the_pallet():
    """Two layers of 4 x 4: a layer a rank has 16 neighbours below; an inner round alone has five."""
    from benchmarks.rank_estimate import sides

    assert [sides(32, ranks) for ranks in (1, 2, 32, 1024)] == [0, 16, 5, 5]
    assert [sides(2, ranks) for ranks in (1, 2, 8)] == [0, 1, 1]


def test_sectors_stay_busy_where_slabs_wait(recorded):
    """A front in a fifth of the length: one or two of four slabs have most of the short steps."""
    from benchmarks.rank_estimate import estimate

    history, measured = recorded
    found = estimate(history, measured, 2, 8, 12e-3)
    assert found["balance"] < 1.05
    assert found["balance_of_slabs"] > 1.5
    assert found["efficiency"] == pytest.approx(1.0 / found["balance"])
    assert found["shared_nodes"] > 0
    assert 0 < found["searched_nodes"] < found["all_surface_nodes"]


def test_a_finer_mesh_has_the_levels_of_the_nearest_cells(recorded):
    from benchmarks.rank_estimate import mesh_of

    history, _ = recorded
    finer = mesh_of(history.rounds[:1], 8e-3)
    level = history.on(finer)[0]
    share = finer.station / finer.lengths[0]
    assert (level[np.abs(share - 0.33) < 0.05] == 2).all()
    assert (level[np.abs(share - 0.33) > 0.2] == 0).all()


def test_memory_is_split_into_own_cells_and_all():
    from benchmarks.ranks import measured_by

    common = {"cells": 1000, "base_bytes": 5e7, "cell_steps": 1e6, "contacts": 1, "searches": 2, "exchanges": 3}
    one = {**common, "memory_bytes": 5e7 + 1000 * 700.0, "processor_seconds": 3.0, "seconds_searching": 1.0}
    two = {**common, "memory_bytes": 5e7 + 500 * 600.0 + 1000 * 100.0, "halo_nodes": 9.0, "searched_nodes": 12.0}
    found = measured_by(one, two)
    assert found.bytes_per_own_cell == pytest.approx(600.0)
    assert found.bytes_per_cell == pytest.approx(100.0)
    assert found.seconds_per_cell_step == pytest.approx(2e-6)
    assert found.seconds_per_search == pytest.approx(0.5)


def test_the_grind_time_of_lulesh_is_read():
    from benchmarks.lulesh import parsed

    assert parsed("Grind time (us/z/c)  =  1.0831312 (per dom)  (  0.173301 overall)\n") == pytest.approx(1.0831312e-6)
    with pytest.raises(RuntimeError, match="is this LULESH"):
        parsed("usage: cat FILE")


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("seconds_per_step", 2.5e-7, "250 ns"),
        ("seconds", 59.96, "60 s"),
        ("bytes_per_second", 1.5e10, "15 GB/s"),
        ("cell_steps_per_second_on_1", 9.0e6, "9 M/s"),
        ("peak_bytes", 1_130_000_000, "1.13 GB"),
        ("cell_size", 3e-3, "3 mm"),
        ("cells", 349200, "349200"),
        ("lulesh", "absent", "absent"),
    ],
)
def test_figures_are_shown_with_their_units(key, value, text):
    from benchmarks.table import shown

    assert shown(key, value) == text


def test_tables_are_put_between_the_marks_of_the_readme(tmp_path):
    from benchmarks.goal import at_most
    from benchmarks.machine import machine
    from benchmarks.readme import README, write_tables

    copy = tmp_path / "README.md"
    copy.write_text(README.read_text(encoding="utf-8"), encoding="utf-8")
    write_tables({"memory": {"cells": 7, **at_most(1.25, 1.0, "this over that")}, "machine": machine()}, copy)
    text = copy.read_text(encoding="utf-8")
    found = re.search("<!-- begin memory -->(.*)<!-- end memory -->", text, re.DOTALL)
    assert found is not None
    assert "| cells | 7 |" in found[1]
    assert "| this over that | 1.25 | 1 | MISSED |" in found[1]
    assert machine()["processor"] in found[1]
    assert text.replace(found[1], "") == re.sub(
        "(<!-- begin memory -->).*(<!-- end memory -->)", r"\1\2", README.read_text(encoding="utf-8"), flags=re.DOTALL
    )


def test_the_readme_has_a_filled_table_for_every_benchmark():
    from benchmarks.__main__ import BENCHMARKS
    from benchmarks.readme import README

    text = README.read_text(encoding="utf-8")
    for name in BENCHMARKS:
        found = re.search(f"<!-- begin {name} -->(.*?)<!-- end {name} -->", text, re.DOTALL)
        assert found is not None, name
        assert "| what | figure |" in found[1], f"python -m benchmarks {name} --readme"
