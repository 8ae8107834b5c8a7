"""From rounds to files: what `simulate` writes, its summary, ends, refusals; stress projected to the nodes."""

from __future__ import annotations

from dataclasses import replace

import h5py
import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx import simulation
from burst_fenicsx.errors import InputError
from burst_fenicsx.geometry import load_profile
from burst_fenicsx.kernels.geometry.faces import reordered
from burst_fenicsx.mechanics import fields
from burst_fenicsx.meshing import mesh_profile
from burst_fenicsx.meshing.placement import frame
from burst_fenicsx.problem import BurstSettings, ContactSettings, IgnitionPoint, Leakage, Part
from burst_fenicsx.records.gather import nodal_stress
from burst_fenicsx.run_burst import simulate
from burst_fenicsx.simulation import Simulation
from tests.burst_fenicsx.boxes import STEEL, TNT, boundary_nodes, box, burst, distorted_box
from tests.burst_fenicsx.tubes import SETTINGS, profile, tube
from tests.datasets import datasets

pytestmark = pytest.mark.dolfinx


PROVENANCE = {"case": "title = 'ü'", "versions": "{}", "seed": "1", "program_version": "0"}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A run of two tubes, one initiated later and at both ends, with its folder and the progress reports."""
    out, reports = tmp_path_factory.mktemp("run"), []
    ends = (IgnitionPoint(0.0, delay=4e-6), IgnitionPoint(0.3, delay=4e-6))
    rounds = [tube(), tube(name="second", position=(0.4, 0.0, 0.0), ignition=ends)]
    usual, simulation._PROGRESS_SECONDS = simulation._PROGRESS_SECONDS, 0.0
    settings = replace(SETTINGS, end_time=50e-6, leakage=Leakage(True, 1.1, parts=6))
    try:
        run = Simulation(rounds, settings, out, MPI.COMM_SELF, PROVENANCE, reports.append)
        run.run()
        result = run.finish()
    finally:
        simulation._PROGRESS_SECONDS = usual
    return run, result, out, reports


def test_snapshot_holds_the_contract(finished):
    """Names, orders and sums: masses of cells, segments and rounds, momentum of the nodes."""
    run, _, out, _ = finished
    with h5py.File(out / "burst_snapshot.h5") as file:
        assert file.attrs["format"] == "fragfield burst snapshot"
        assert file.attrs["format_version"] == 1
        assert file.attrs["time"] == pytest.approx(50e-6, rel=1e-12)
        assert {key: file.attrs[key] for key in PROVENANCE} == PROVENANCE
        np.testing.assert_array_equal(file["nodes/reference"], run.mesh.nodes)
        np.testing.assert_array_equal(file["cells/nodes"], reordered(run.mesh.cells))
        for name in ("part", "round", "segment", "station"):
            np.testing.assert_array_equal(file[f"cells/{name}"], getattr(run.mesh, name))
        mass, part, of_round = file["cells/mass"][()], file["cells/part"][()], file["cells/round"][()]
        segment, cells = file["cells/segment"][()], file["cells/nodes"][()]
        assert part.dtype == np.uint8
        assert file["cells/plastic_shear_strain"][()].max() > 0.05
        assert file["cells/plastic_volumetric_strain"][()].max() > 0.0
        nodal = np.zeros(len(file["nodes/position"]))
        np.add.at(nodal, cells.ravel(), np.repeat(mass / 8.0, 8))
        velocity = file["nodes/velocity"][()]
        momentum = nodal[:, None] * velocity
        assert np.linalg.norm(momentum.sum(axis=0)) < 1e-11 * np.linalg.norm(momentum, axis=1).sum()
        moved = np.linalg.norm(file["nodes/position"][()] - file["nodes/reference"][()], axis=1)
        assert moved.max() > 5e-3
        for index in (0, 1):
            group, own = file[f"rounds/{index}"], of_round == index
            attributes = dict(group.attrs)
            assert attributes["casing_mass"] == pytest.approx(mass[own & (part == Part.CASING)].sum(), rel=1e-12)
            assert attributes["charge_mass"] == pytest.approx(mass[own & (part == Part.CHARGE)].sum(), rel=1e-12)
            assert attributes["fuze_mass"] == 0.0
            assert attributes["explosive"] == "tnt"
            assert attributes["name"] == ("tube", "second")[index]
            assert attributes["length"] == pytest.approx(0.3)
            assert attributes["casing_density"] == STEEL.density
            assert attributes["casing_yield"] == 2.0 * STEEL.shear_strength
            assert attributes["explosive_density"] == TNT.density
            assert attributes["detonation_velocity"] == TNT.detonation_velocity
            assert attributes["gurney_velocity"] == pytest.approx(2518.0, abs=1.0)
            assert attributes["position"].tolist() == [0.4 * index, 0.0, 0.0]
            assert attributes["axis"].tolist() == [0.0, 0.0, 1.0]
            rows = group["segments"][()]
            assert [name.decode() for name in rows["name"]] == [s.name for s in profile().segments]
            assert {kind.decode() for kind in rows["kind"]} <= {"nose", "wall", "base"}
            assert rows["casing_mass"].sum() == pytest.approx(attributes["casing_mass"], rel=1e-12)
            assert rows["charge_mass"].sum() == pytest.approx(attributes["charge_mass"], rel=1e-12)
            np.testing.assert_allclose(rows["outer_radius"], 77.5e-3, rtol=0.01)
            np.testing.assert_allclose(rows["wall_thickness"], 22.5e-3, rtol=0.01)
            np.testing.assert_allclose(rows["charge_radius"], 55e-3, rtol=0.01)
            speeds = np.linalg.norm(velocity[cells].mean(axis=1), axis=1)
            for row, item in enumerate(rows):
                mine = own & (segment == row)
                assert item["speed"] == pytest.approx(np.average(speeds[mine], weights=mass[mine]), rel=1e-12)
            along = group["along"][()]
            assert along["casing_mass"].sum() == pytest.approx(attributes["casing_mass"], rel=1e-12)
            assert (along["max_speed"] >= along["mean_speed"]).all()
            assert along["outer_diameter"].max() <= file["history/outer_diameter"][-1]


def test_history_holds_the_ledger(finished):
    run, result, out, _ = finished
    stores = ("kinetic", "strain", "plastic", "viscous", "hourglass", "contact", "damping")
    contact = ("contact_gain", "contact_error")
    rest = ("products_work", "products_energy_left", "energy_error", *contact, "mean_casing_speed", "outer_diameter")
    names = ("time", "time_step", "kinetic_casing", *stores, *rest)
    with h5py.File(out / "burst_snapshot.h5") as file:
        history = {name: file[f"history/{name}"][()] for name in names}
    time = history["time"]
    assert time[0] == 0.0
    assert time[-1] == pytest.approx(50e-6, rel=1e-12)
    assert (np.diff(time)[:-1] >= 1e-6).all()
    assert {len(column) for column in history.values()} == {len(time)}
    for name in names:
        np.testing.assert_array_equal(history[name], result.history[name])
    last = {name: column[-1] for name, column in history.items()}
    stored = sum(last[name] for name in stores) - last["contact_gain"]
    assert last["energy_error"] == pytest.approx(abs(stored / last["products_work"] - 1.0), abs=1e-12)
    missing = history["energy_error"] * np.maximum(history["products_work"], run.ledger.min_work)
    assert (missing < 0.02 * np.maximum(history["products_work"], 0.01 * run.ledger.chemical_energies.sum())).all()
    gain, scale = history["contact_gain"], np.maximum(history["products_work"], 10.0 * run.ledger.min_work)
    np.testing.assert_allclose(history["contact_error"], np.abs(gain) / scale, rtol=1e-12)
    assert result.summary["contact"]["gain"] == gain[-1] != 0.0
    assert (np.diff(history["products_work"])[2:] > 0.0).all()
    assert result.summary["products_balance"] == pytest.approx(0.9, abs=0.1)
    of_rounds = [item["products_balance"] for item in result.summary["rounds"]]
    whole = np.average(of_rounds, weights=run.ledger.chemical_energies)
    assert whole == pytest.approx(result.summary["products_balance"], rel=1e-12)


def test_summary_repeats_what_the_files_say(finished):
    run, result, _, _ = finished
    summary = result.summary
    assert summary["cells"] == len(run.mesh.cells)
    assert summary["nodes"] == len(run.mesh.nodes)
    assert summary["steps"] == run.solver.steps > 50
    assert summary["end_time"] == pytest.approx(50e-6, rel=1e-12)
    assert summary["casing_mass"] == pytest.approx(sum(item["casing_mass"] for item in summary["rounds"]), rel=1e-12)
    for name in ("energy_error", "contact_error"):
        assert summary[name] == result.history[name].max()
        assert summary[f"{name}_at_end"] == result.history[name][-1]
    assert summary["momentum_error"] < 1e-12
    assert summary["lost_cells"] == 0
    assert summary["max_initial_speed"] == max(item.max_speed.max() for item in result.rounds)
    assert summary["mean_initial_speed"] == pytest.approx(result.history["mean_casing_speed"][-1], rel=1e-12)
    assert summary["outer_diameter"] == pytest.approx(max(i["outer_diameter"] for i in summary["rounds"]), rel=1e-12)
    first, second = summary["rounds"]
    assert first["mean_initial_speed"] != second["mean_initial_speed"]
    assert first["outer_diameter"] > 0.155


def test_progress_is_reported(finished):
    _, _, _, reports = finished
    steps = [report.step for report in reports]
    assert steps == sorted(steps)
    assert len(steps) > 50
    last = reports[-1]
    assert last.end_time == 50e-6
    assert last.steps_per_second > 0.0
    assert last.cell_steps_per_second >= 0.999 * last.steps_per_second * 1920
    assert reports[len(reports) // 2].seconds_left > 0.0


def test_series_opens_in_vtk_and_equals_the_state(finished):
    """The last output against the state in memory: places exactly, fields to single precision."""
    pyvista = pytest.importorskip("pyvista")
    run, _, out, _ = finished
    reader = pyvista.get_reader(str(out / "burst.xdmf"))
    np.testing.assert_allclose(reader.time_values, np.arange(6) * 10e-6, rtol=1e-12)
    reader.set_active_time_value(reader.time_values[-1])
    grid, fields, mesh = reader.read(), run.fields, run.fields.mesh
    np.testing.assert_array_equal(grid.points, mesh.gather_nodes(fields.nodes.position))
    np.testing.assert_array_equal(grid.cells_dict[pyvista.CellType.HEXAHEDRON], reordered(run.mesh.cells))
    np.testing.assert_allclose(grid.point_data["velocity"], mesh.gather_nodes(fields.nodes.velocity), rtol=1e-6)
    moved = mesh.gather_nodes(fields.nodes.position - fields.start)
    np.testing.assert_allclose(grid.point_data["displacement"], moved, rtol=1e-6, atol=1e-12)
    for name in ("part", "round", "segment"):
        np.testing.assert_array_equal(grid.cell_data[name], getattr(run.mesh, name))
    burnt = mesh.gather_cells(fields.charge.burn_fraction)
    np.testing.assert_allclose(grid.cell_data["burn_fraction"], burnt, rtol=1e-6)
    casing = run.mesh.part == Part.CASING
    stress = mesh.gather_cells(fields.solid.stress[:, 0])[casing]
    found = grid.cell_data["stress"].reshape(-1, 3, 3)
    np.testing.assert_allclose(found[casing][:, [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]], stress, rtol=1e-6)
    values = np.linalg.eigvalsh(found.astype(float))
    largest = 0.5 * (values[:, 2] - values[:, 0])
    np.testing.assert_allclose(grid.cell_data["shear_stress"], largest, atol=1e-6 * np.abs(values).max())
    np.testing.assert_allclose(
        grid.cell_data["pressure"], -np.trace(found, axis1=1, axis2=2) / 3.0, rtol=1e-3, atol=1e3
    )
    volume = np.abs(grid.compute_cell_sizes()["Volume"])
    mass = mesh.gather_cells(fields.cell_mass)
    ratio = grid.cell_data["density"] * volume / mass
    assert np.median(ratio) == pytest.approx(1.0, abs=1e-3)  # VTK cuts warped cells into tetrahedra
    # Products push as leakage lets them.
    charge = ~casing
    pushed = mesh.gather_cells(fields.charge.pressure * fields.charge.leakage[fields.charge.axial_slice])[charge]
    np.testing.assert_allclose(grid.cell_data["pressure"][charge], pushed, rtol=1e-6)


def test_the_time_limit_ends_a_run_that_keeps_accelerating(tmp_path):
    settings = replace(SETTINGS, end_time=None, time_limit=15e-6)
    result = simulate([tube()], settings, tmp_path, comm=MPI.COMM_SELF)
    assert result.summary["end_time"] == pytest.approx(15e-6, rel=1e-12)
    assert result.summary["acceleration_complete"] is None


def test_a_mesh_from_a_file_bursts_as_the_one_it_was_written_from(tmp_path):
    meshio = pytest.importorskip("meshio")
    mesh = mesh_profile(profile(), SETTINGS.cell_size)
    tags = [mesh.part.astype(np.int32) + 1]
    path = tmp_path / "tube.msh"
    names = {"casing": np.array([1, 3]), "charge": np.array([2, 3])}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.Mesh(mesh.nodes, [("hexahedron", reordered(mesh.cells))], cell_data=data, field_data=names).write(
        path, file_format="gmsh22", binary=True
    )
    settings = replace(SETTINGS, end_time=12e-6)
    ours = simulate([tube()], settings, tmp_path, comm=MPI.COMM_SELF)
    coarser = replace(settings, cell_size=8.0 * settings.cell_size)  # of no concern to a file
    theirs = simulate([tube(profile=None, mesh_file=path)], coarser, tmp_path, comm=MPI.COMM_SELF)
    assert theirs.summary["cell_size"] == pytest.approx(settings.cell_size, rel=0.1)
    for name in ("cells", "nodes", "steps"):
        assert theirs.summary[name] == ours.summary[name]
    for name in ("casing_mass", "charge_mass", "mean_initial_speed", "max_initial_speed", "outer_diameter"):
        assert theirs.summary[name] == pytest.approx(ours.summary[name], rel=1e-8), name


@pytest.mark.parametrize(
    ("rounds", "settings", "message"),
    [
        ([], SETTINGS, "there is no round to burst"),
        ([tube()], replace(SETTINGS, cell_size=0.0), "cell_size = 0.0 m; it must be positive"),
        ([tube()], replace(SETTINGS, cell_size=float("nan")), "cell_size = nan m; it must be positive"),
        ([tube(ignition=())], SETTINGS, "round 'tube' has no ignition point; give at least one"),
    ],
)
def test_what_cannot_be_computed_is_refused(tmp_path, rounds, settings, message):
    with pytest.raises(InputError, match=message):
        simulate(rounds, settings, tmp_path, comm=MPI.COMM_SELF)


def test_a_folder_that_cannot_be_written_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"nowhere.burst.xdmf: cannot be written: .*; .* name a folder"):
        simulate([tube()], SETTINGS, tmp_path / "nowhere", comm=MPI.COMM_SELF)


def test_a_snapshot_that_cannot_be_written_is_refused(tmp_path):
    from burst_fenicsx.files.snapshot import EndState, write_snapshot

    with pytest.raises(InputError, match=r"nowhere.burst_snapshot.h5: cannot be written: .*; .* name a folder"):
        write_snapshot(tmp_path / "nowhere" / "burst_snapshot.h5", EndState(0.0, {}, {}, [], [], {}), {})


def test_cells_that_nothing_has_reached_take_no_steps_and_change_nothing(monkeypatch, tmp_path):
    settings, states = BurstSettings(cell_size=8e-3, end_time=4e-6), []
    for ahead in (fields.AHEAD, 1e9):
        monkeypatch.setattr(fields, "AHEAD", ahead)
        run = Simulation([tube(profile=load_profile("m107"))], settings, tmp_path, MPI.COMM_SELF, {})
        run.writes_series = False
        run.run()
        states.append(run)
    resting, stepping = states
    assert resting.solver.cell_steps < 0.9 * stepping.solver.cell_steps
    for name, function in resting.fields.functions.items():
        np.testing.assert_array_equal(function.x.array, stepping.fields.functions[name].x.array, err_msg=name)
    np.testing.assert_array_equal(resting.fields.nodes.position, stepping.fields.nodes.position)
    np.testing.assert_array_equal(resting.ledger.sums, stepping.ledger.sums)


SHARED = ContactSettings(charge_casing="shared", surfaces=False)
SLOPE = np.random.default_rng(5).normal(size=(3, 6)) * 1e11  # Pa/m


def at_nodes(state, stress):
    """Stress (cells, 6) of a burst on one rank at its nodes; eroded cells have no weight."""
    mesh = state.mesh
    weight = np.where(state.eroded, 0.0, state.volumes())
    return nodal_stress(mesh.dofmap, len(mesh.node), stress, weight, mesh.part != Part.CHARGE)


def projected(mesh, change=None):
    """Nodes (m), stress there by the projection of a linear field at the cells' centres, and the field itself."""
    state = burst(mesh).fields
    if change is not None:
        change(state)
    centre = state.start[state.mesh.dofmap].mean(axis=1)
    found = at_nodes(state, 1e9 + centre @ SLOPE)
    return state, found, 1e9 + state.start @ SLOPE


def test_a_linear_stress_is_reproduced_inside():
    """At the surface the projection has that of the cells there, half a cell away."""
    mesh = box((4, 5, 6), (0.02, 0.03, 0.04))
    state, found, exact = projected(mesh)
    surface = boundary_nodes(mesh)[state.mesh.node]
    np.testing.assert_allclose(found[~surface], exact[~surface], rtol=0.0, atol=1e-12 * np.abs(exact).max())
    inward = np.clip(
        state.start, 0.5 * (h := np.array([0.005, 0.006, 0.04 / 6])), np.array([0.02, 0.03, 0.04]) - 0.5 * h
    )
    np.testing.assert_allclose(found, 1e9 + inward @ SLOPE, rtol=0.0, atol=1e-12 * np.abs(exact).max())


def test_the_integral_over_distorted_cells_is_kept():
    state, found, _ = projected(distorted_box(4, 5e-3))
    volume, centre = state.volumes(), state.start[state.mesh.dofmap].mean(axis=1)
    share = np.bincount(state.mesh.dofmap.ravel(), np.repeat(volume / 8.0, 8), minlength=len(found))
    np.testing.assert_allclose(share @ found, volume @ (1e9 + centre @ SLOPE), rtol=1e-12)


def test_metal_and_charge_are_not_mixed_and_eroded_cells_do_not_count():
    mesh = box((3, 1, 1), (0.03, 0.01, 0.01))
    mesh = replace(mesh, part=np.array([Part.CASING, Part.CASING, Part.CHARGE], dtype=np.int32))
    state = burst(mesh).fields
    stress = np.outer([1e9, 3e9, 7e9], np.ones(6))
    column = np.rint(state.start[:, 0] / 0.01).astype(int)
    found = at_nodes(state, stress)
    np.testing.assert_allclose(found, np.array([1e9, 2e9, 3e9, 7e9])[column][:, None] * np.ones(6), rtol=1e-12)
    flags = np.zeros(3, dtype=np.int8)
    flags[1] = 1
    state.solid.eroded[:] = state.blocks.by_slot(flags)
    stress[1] = np.nan
    found = at_nodes(state, stress)
    np.testing.assert_allclose(found, np.array([1e9, 1e9, 7e9, 7e9])[column][:, None] * np.ones(6), rtol=1e-12)
    state.solid.eroded[:] = 1
    assert (at_nodes(state, stress) == 0.0).all()


def last_state(folder):
    """Fields of the last state of the series."""
    return datasets(max((folder / "burst").iterdir()))


@pytest.mark.parametrize("asked", [True, False])
def test_the_series_has_it_where_it_is_asked_for(tmp_path, asked):
    settings = replace(SETTINGS, contact=SHARED, nodal_stress=asked)
    simulate([tube()], settings, tmp_path, comm=MPI.COMM_SELF)
    found = last_state(tmp_path)
    assert ("point/nodal_stress" in found) == asked
    if asked:
        cell, point = found["cell/stress"], found["point/nodal_stress"]
        assert point.shape[1] == 9
        assert np.abs(point).max() > 0.5 * np.abs(cell).max() > 0.0
        rounding = 1e-6 * np.abs(cell).max()
        assert (point.min(axis=0) >= cell.min(axis=0) - rounding).all()
        assert (point.max(axis=0) <= cell.max(axis=0) + rounding).all()


def test_mirrored_rounds_have_mirrored_stresses(tmp_path):
    """Two tubes of which a quarter each is computed, against both in full."""
    rounds = [tube(name="left"), tube(name="right", position=(0.4, 0.0, 0.0))]
    found = {}
    for symmetry in ("off", "auto"):
        settings = replace(SETTINGS, end_time=10e-6, symmetry=symmetry, nodal_stress=True)
        run = Simulation(rounds, settings, tmp_path / symmetry, MPI.COMM_SELF, {})
        (tmp_path / symmetry).mkdir()
        run.run()
        state = last_state(tmp_path / symmetry)
        place, stress = state["position"], state["point/nodal_stress"]
        # Nodes in a cut have the cells of one side.
        away = (np.abs(place[:, 1]) > 1e-3) & (np.abs(place[:, 0] - 0.2) < 0.199) & (place[:, 0] > 1e-9)
        order = np.lexsort(np.round(place[away], 6).T)
        found[symmetry] = place[away][order], stress[away][order]
    assert run.completion.trivial is False
    np.testing.assert_allclose(found["auto"][0], found["off"][0], atol=1e-8)
    np.testing.assert_allclose(found["auto"][1], found["off"][1], atol=1e-4 * np.abs(found["off"][1]).max())


def test_stresses_of_a_meridian_turn_with_its_axis(tmp_path):
    axis, states = (2.0, -1.0, 2.0), {}
    for name, along in (("upright", (0.0, 0.0, 1.0)), ("tilted", axis)):
        settings = replace(SETTINGS, geometry="axisymmetric", cell_size=14e-3, nodal_stress=True)
        (tmp_path / name).mkdir()
        burst = Simulation([tube(axis=along)], settings, tmp_path / name, MPI.COMM_SELF, {})
        burst.run()
        burst.finish()
        revolved = datasets(tmp_path / name / "burst_revolved" / "0000.h5")["cell/stress"]
        states[name] = last_state(tmp_path / name) | {"revolved": revolved}
    own = np.eye(3)  # burst.xdmf shows the meridian in a plane of its own
    for name, turn in (("cell/stress", own), ("point/nodal_stress", own), ("revolved", frame(axis).T)):
        upright, tilted = (states[run][name].reshape(-1, 3, 3) for run in ("upright", "tilted"))
        assert np.abs(tilted).max() > 5e8  # Pa: of the metal
        assert turn is own or np.abs(tilted - upright).max() > 5e8
        np.testing.assert_allclose(tilted, turn @ upright @ turn.T, rtol=0.0, atol=1e-6 * np.abs(upright).max())
