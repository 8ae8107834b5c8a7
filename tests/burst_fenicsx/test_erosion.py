"""Metal without strength that no continuum can be is released: its mass flies on, the ledger stays closed."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.contact import ContactForces
from burst_fenicsx.errors import NumericalStop
from burst_fenicsx.files.checkpoint import read_checkpoint, write_checkpoint
from burst_fenicsx.mechanics.erosion import erode_at_end
from burst_fenicsx.mechanics.solver import BurstSolver
from burst_fenicsx.simulation import Simulation
from fragfield.case import load_case
from fragfield.case.conversion.rounds import burst_rounds
from fragfield.case.problem import burst_settings
from tests.burst_fenicsx.axisymmetric.meridians import rectangle, ring_burst
from tests.burst_fenicsx.bodies import bodies, momentum, moved
from tests.burst_fenicsx.boxes import BARE, STEEL, box, burst, run_until, turned_inside_out
from tests.burst_fenicsx.test_interior_contact import METAL, SETTINGS, thrown, touches_inside

pytestmark = pytest.mark.dolfinx

ROOT = Path(__file__).parents[2]
SOFT = replace(STEEL, shear_softening_strain=0.5, tensile_softening_strain=0.5)
WEAK = replace(METAL, shear_softening_strain=0.3, tensile_softening_strain=0.3)
GEOMETRIES = ["one_point", "full", "ring"]


def drawn(growth=2.0, strain=1.0, geometry="one_point", *, across=True):
    """A block of steel; its middle cell has `growth` times its edges, and a corner is drawn `across` it."""
    if geometry == "ring":
        solver = ring_burst(rectangle((3, 3), (0.02, 0.023), 3e-3), BARE, casing=SOFT)
    else:
        solver = burst(box((3, 3, 3), (9e-3, 9e-3, 9e-3)), replace(BARE, quadrature=geometry), casing=SOFT)
    state = solver.fields
    cell = int(np.flatnonzero(state.mesh.cell == state.mesh.cells // 2)[0])
    position, nodes = state.nodes.position, state.mesh.dofmap[cell]
    centre = position[nodes].mean(axis=0)
    position[nodes] = centre + growth * (position[nodes] - centre)
    if across:
        # Counter-clockwise in a ring, in tensor-product order else: the corner beyond the diagonal of its neighbours.
        opposite, distance = (2, 0.1) if geometry == "ring" else (7, 0.3)
        position[nodes[0]] = centre + distance * (position[nodes[opposite]] - centre)
    state.solid.shear_strain[cell] = state.solid.volume_strain[cell] = strain
    state.solid.stress[cell, :, :3] = -2e8
    # Volumes are those of the last step.
    state.grid.volume[:] = state.blocks.by_slot(state.volumes())
    return solver, cell


def plastic_work(solver):
    """Plastic work (J) after the forces have been found again."""
    solver.add_forces(0.0)
    solver.ledger.add(solver.fields.totals.energy, solver.fields.totals.released)
    return solver.ledger.sums[0]


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_it_is_eroded_with_its_mass_and_its_energy(geometry):
    solver, cell = drawn(2.8 if geometry == "ring" else 2.0, geometry=geometry)
    state = solver.fields
    mass, volume, strain = state.mass.copy(), state.volumes()[cell], state.solid_sums()[0]
    plastic = solver.ledger.sums[0]
    assert strain > 0.0
    assert state.folded()[cell]
    solver.erode_metal()
    # What it held elastically is plastic work now, counted once; the others have borne nothing yet.
    assert plastic_work(solver) - plastic == pytest.approx(strain, rel=1e-9)
    assert np.flatnonzero(state.eroded).tolist() == [cell]
    assert not state.folded()[cell]
    assert (state.solid.stress[cell] == 0.0).all()
    np.testing.assert_array_equal(state.mass, mass)
    assert state.volumes()[cell] == volume
    assert state.solid_sums()[0] == pytest.approx(0.0, abs=1e-9 * strain)
    assert plastic_work(solver) - plastic == pytest.approx(strain, rel=1e-9)
    velocity = np.random.default_rng(1).normal(0.0, 20.0, state.nodes.velocity.shape)
    state.nodes.velocity[:] = velocity * [0.0, 0.0, 1.0] if geometry == "ring" else velocity
    kept = slice(2, 3) if geometry == "ring" else slice(0, 3)
    before = momentum(solver)[kept]
    run_until(solver, 2e-6)
    assert np.abs(state.nodes.force).max() > 0.0
    sizes = np.abs(state.mass[:, None] * state.nodes.velocity).sum()
    assert np.abs(momentum(solver)[kept] - before).max() < 1e-12 * sizes
    assert state.eroded[cell]
    assert np.isfinite(state.nodes.position).all()


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_an_eroded_cell_bears_nothing(geometry):
    """All eroded: every node flies straight on."""
    solver, _ = drawn(1.0, geometry=geometry, across=False)
    state = solver.fields
    state.solid.shear_strain[:] = state.solid.volume_strain[:] = 1.0
    state.grid.volume[:] *= 0.05
    solver.erode_metal()
    solver.add_forces(0.0)
    assert state.eroded.all()
    assert np.abs(state.nodes.force).max() == 0.0
    velocity = np.random.default_rng(1).normal(0.0, 500.0, state.nodes.velocity.shape)
    velocity[:, 1] *= geometry != "ring"
    start = state.nodes.position.copy()
    state.nodes.velocity[:] = velocity
    solver.advance(1e-6)
    np.testing.assert_allclose(state.nodes.position, start + 1e-6 * velocity, rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(state.nodes.velocity, velocity)


@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize(
    ("size", "strain", "across", "eroded"),
    [
        ("expanded", 1.0, True, True),  # folded and mostly void
        ("expanded", 0.2, True, False),  # has strength
        ("whole", 1.0, True, False),  # folded at about its old size: it may hold its neighbours apart
        ("expanded", 1.0, False, False),  # mostly void: it bears nothing, but is a surface
        ("small", 1.0, False, False),  # an eighth of its volume
        ("flat", 1.0, False, True),  # 0.09
    ],
)
def test_shape_and_strength_decide(geometry, size, strain, across, eroded):
    growths = {"expanded": 2.8, "whole": 1.1, "small": 0.35 if geometry == "ring" else 0.5}
    solver, cell = drawn(growths.get(size, 0.3 if geometry == "ring" else 0.448), strain, geometry, across=across)
    state = solver.fields
    relative = state.volumes()[cell] * SOFT.density / state.cell_mass[cell]
    assert state.folded()[cell] == across
    assert {"expanded": relative > 2.0, "whole": 0.1 < relative < 2.0, "small": relative > 0.1, "flat": relative < 0.1}[
        size
    ]
    solver.erode_metal()
    assert bool(state.eroded[cell]) is eroded
    assert state.eroded.sum() == eroded


@pytest.mark.parametrize(("relative", "eroded"), [(1.95, False), (2.05, True)])
def test_folded_metal_without_strength_is_eroded_from_twice_its_volume_on(relative, eroded):
    solver, cell = drawn(2.8)
    state = solver.fields
    state.grid.volume[state.blocks.slot_of_cell[cell]] = relative * state.cell_mass[cell] / SOFT.density
    solver.erode_metal()
    assert bool(state.eroded[cell]) is eroded


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_metal_that_is_flattened_between_two_looks_is_eroded_in_its_step(geometry):
    """Without strength below a tenth of its volume; not with it."""
    for strain in (1.0, 0.2):
        solver, cell = drawn(0.3, strain, geometry, across=False)
        solver.add_forces(0.0)
        assert bool(solver.fields.eroded[cell]) is (strain == 1.0)


def test_a_cell_with_strength_at_one_of_its_points_is_not_eroded():
    solver, cell = drawn(geometry="full")
    state = solver.fields
    state.solid.shear_strain[cell, 5] = state.solid.volume_strain[cell, 5] = 0.2
    solver.erode_metal()
    erode_at_end(solver.fields)
    assert not state.eroded.any()
    turned_inside_out(solver, cell)
    assert not state.eroded.any()
    with pytest.raises(NumericalStop, match="lost cell"):
        solver.check_cells()


@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize(("strain", "across", "eroded"), [(1.0, True, True), (0.2, True, False), (1.0, False, False)])
def test_at_the_end_folded_metal_without_strength_is_eroded_at_any_size(geometry, strain, across, eroded):
    solver, cell = drawn(0.9, strain, geometry, across=across)
    state = solver.fields
    position, mass = state.nodes.position.copy(), state.cell_mass.copy()
    erode_at_end(solver.fields)
    assert np.flatnonzero(state.eroded).tolist() == [cell] * eroded
    assert (state.solid.stress[cell] == 0.0).all() == eroded
    assert bool(state.folded()[cell]) is (across and not eroded)
    np.testing.assert_array_equal(state.nodes.position, position)
    np.testing.assert_array_equal(state.cell_mass, mass)


@pytest.mark.parametrize(
    ("geometry", "strain"), [("one_point", 0.0), ("one_point", 1.0), ("full", 0.0), ("full", 1.0), ("ring", 0.0)]
)
def test_a_cell_that_its_nodes_carry_through_itself_is_eroded_or_stops_the_run(strain, geometry):
    """With strength it is a lost cell; without, it is judged at once and reaches no state."""
    solver, cell = drawn(1.0, strain, geometry, across=False)
    state = solver.fields
    turned_inside_out(solver, cell)
    assert bool(state.eroded[cell]) is (strain > 0.0)
    if strain > 0.0:
        assert (state.solid.stress[cell] == 0.0).all()
        assert np.isfinite(state.solid.shear_strain[cell]).all()
        assert np.isfinite(state.solid.volume_strain[cell]).all()
    else:
        with pytest.raises(NumericalStop, match=r"lost cell: cell \d+ of the casing of round 0, .* inside out"):
            solver.check_cells()


@pytest.mark.parametrize("eroded", [True, False])
def test_nothing_meets_the_faces_of_eroded_metal(eroded):
    """A block flies at a thicker one; where that is eroded metal its points still meet the block's faces."""
    blocks = [
        moved(box((2, 2, 2), (0.01, 0.01, 0.01)), (0.0, 0.0, 0.0)),
        moved(box((4, 4, 4), (0.02, 0.02, 0.02)), (0.0101, -0.005, -0.005), 1),
    ]
    solver = bodies(blocks, [(400.0, 0.0, 0.0), (0.0, 0.0, 0.0)], SETTINGS, casing=WEAK)
    state = solver.fields
    target = state.mesh.round == 1
    state.solid.shear_strain[target] = state.solid.volume_strain[target] = 1.0
    if eroded:
        state.grid.volume[:] = np.where(target[state.blocks.cells.ravel()], 0.05, 1.0) * state.grid.volume
    run_until(solver, 5e-6)
    assert state.eroded[target].all() == eroded
    assert not state.eroded[~target].any()
    contact = solver.contact.collisions
    met = contact.surfaces.face_round[contact.seen.near]
    assert (met == 0).any()
    assert (met == 1).any() == (not eroded)
    pushed = state.nodes.velocity[np.unique(state.mesh.dofmap[target]), 0]
    assert pushed.max() > 50.0


def weak_walls(**options):
    """Two weak walls that have been thrown at each other until cells are eroded."""
    solver = thrown(speed=1200.0, casing=WEAK, **options)
    while not solver.fields.mesh.comm.allreduce(int(solver.fields.eroded.sum())) > 10:
        assert solver.time < 60e-6
        solver.step()
    return solver


def test_walls_that_tear_keep_momentum_and_throw_nothing(monkeypatch):
    """Fewer cells are folded in the end, and the fastest half per cent of the mass is no faster than without it."""
    ends = []
    for release in (True, False):
        if not release:
            monkeypatch.setattr(BurstSolver, "erode_metal", lambda self: None)
        solver = thrown(speed=1200.0, casing=WEAK)
        fields = solver.fields
        start = 0.5 * fields.mass.sum() * 1200.0**2
        run_until(solver, 45e-6)
        sizes = np.abs(fields.mass[:, None] * fields.nodes.velocity).sum()
        # Along x: the walls are mirror images. Along y and z nothing acts from outside but the plane strain's hold.
        assert np.abs(momentum(solver)[0]) < 1e-12 * sizes
        assert not (fields.volumes() <= 0.0).any()
        kinetic = 0.5 * (fields.mass[:, None] * fields.nodes.velocity**2).sum()
        taken = solver.ledger.sums[:3].sum() + fields.solid_sums()[0] + solver.contact.energy
        speeds = np.linalg.norm(fields.nodes.velocity, axis=1)
        opened = abs(kinetic + taken - start)
        fast = np.argsort(-speeds)
        exceeded = speeds[fast[np.searchsorted(np.cumsum(fields.mass[fast]), 0.005 * fields.mass.sum())]]
        ends.append((int(fields.eroded.sum()), int(fields.folded().sum()), exceeded, speeds.max(), opened))
    (released, folded, fast, fastest, error), (none, before, fast_before, at_most, error_before) = ends
    assert released > 10
    assert none == 0
    assert folded < 0.9 * before
    assert fast < fast_before
    assert fastest < 1.02 * at_most
    # Crushed to a tenth, coarse cells leave the ledger open by a tenth; eroded metal adds nothing to that.
    assert error < error_before


def test_a_checkpoint_keeps_eroded_metal_to_the_last_bit(tmp_path):
    solver = weak_walls()
    assert solver.contact.eroded.any()
    write_checkpoint(tmp_path / "checkpoint.h5", solver, {}, "walls")
    again = thrown(speed=1200.0, casing=WEAK)
    read_checkpoint(tmp_path / "checkpoint.h5", again, "walls")
    assert np.array_equal(again.fields.eroded, solver.fields.eroded)
    assert touches_inside(solver)
    searches = solver.contact.collisions.searches
    count = solver.fields.eroded.sum()
    for going in (solver, again):
        for _ in range(60):
            going.step()
    assert solver.fields.eroded.sum() > count
    for name in ("position", "velocity", "force"):
        assert np.array_equal(getattr(again.fields.nodes, name), getattr(solver.fields.nodes, name)), name
    assert np.array_equal(again.fields.eroded, solver.fields.eroded)
    assert np.array_equal(again.contact.eroded, solver.contact.eroded)
    assert solver.contact.collisions.searches > searches
    assert np.array_equal(again.contact.force, solver.contact.force)
    assert again.contact.penetrations == solver.contact.penetrations


STATES = """
import sys
from mpi4py import MPI
from tests.burst_fenicsx.test_erosion import torn_state
found = torn_state(MPI.COMM_WORLD)
if MPI.COMM_WORLD.rank == 0:
    print(*found)
"""


def torn_state(comm):
    """Digest of the places 20 steps after walls began to tear, and how much was eroded."""
    solver = weak_walls(counts=(4, 12, 4), comm=comm)
    for _ in range(20):
        solver.step()
    found = solver.fields.mesh.gather_nodes(solver.fields.nodes.position)
    return "" if found is None else hashlib.sha256((found + 0.0).tobytes()).hexdigest(), int(
        solver.contact.eroded.sum()
    )


@pytest.mark.mpi
def test_ranks_change_no_bit_where_metal_tears(tmp_path, on_ranks):
    script = tmp_path / "states.py"
    script.write_text(STATES)
    digest, eroded = torn_state(MPI.COMM_SELF)
    assert eroded > 10
    assert on_ranks(3, script).split() == [digest, str(eroded)]


@pytest.mark.parametrize("opens", [True, False])
def test_metal_in_a_hole_of_eroded_metal_pushes_the_sides_of_the_whole_cells(monkeypatch, opens):
    """A cube flies sideways in a hole that a released cell has left in a block: it must not enter the cells beside."""
    if not opens:
        monkeypatch.setattr(
            ContactForces, "restore_eroded", lambda self, eroded: self.collisions.take(self.collisions.surfaces, eroded)
        )
    blocks = [
        moved(box((1, 1, 1), (0.003, 0.003, 0.003)), (0.0066, 0.0069, 0.0102)),
        moved(box((3, 3, 3), (0.015, 0.015, 0.015)), (0.0, 0.0, 0.0), 1),
    ]
    solver = bodies(blocks, [(200.0, 0.0, 0.0), (0.0, 0.0, 0.0)], SETTINGS, casing=WEAK)
    state = solver.fields
    centre = state.start[state.mesh.dofmap].mean(axis=1)
    hole = (state.mesh.round == 1) & (np.abs(centre - [0.0075, 0.0075, 0.0125]) < 1e-3).all(axis=1)
    assert hole.sum() == 1
    state.solid.shear_strain[hole] = state.solid.volume_strain[hole] = 1.0
    state.grid.volume[:] = np.where(hole[state.blocks.cells.ravel()], 0.05, 1.0) * state.grid.volume
    run_until(solver, 40e-6)
    cube = np.unique(state.mesh.dofmap[state.mesh.round == 0])
    farthest = state.nodes.position[cube, 0].max()
    assert state.eroded[hole].all()
    block = momentum(solver)[0] - state.mass[cube] @ state.nodes.velocity[cube, 0]
    assert bool(block > 0.5 * state.mass[cube].sum() * 200.0) is opens
    assert bool(farthest < 0.012) is opens


def summary_of_case(folder, file, changes, cell_size, **settings):
    """Summary of the whole burst of a case with some of its values replaced."""
    folder.mkdir(exist_ok=True)
    case = load_case(ROOT / file, {**changes, "burst.cell_size": cell_size})
    going = Simulation(burst_rounds(case), replace(burst_settings(case), **settings), folder, MPI.COMM_SELF, {})
    going.run()
    return going.finish().summary


@pytest.mark.slow
def test_a_charge_that_its_neighbour_has_compressed_burns_to_its_end(tmp_path):
    """Two M107 with 4 mm cells, one initiated 40 us later: too soft an unreacted charge lost cells at 91 us."""
    later = {"stack.delays": ["0 us", "40 us"]}
    summary = summary_of_case(tmp_path, "validation/stack_trends/case.toml", later, "4 mm")
    assert summary["lost_cells"] == 0
    assert summary["passed_through"]["largest_together"] < 0.005 * summary["casing_mass"]


@pytest.mark.slow
def test_both_quadratures_reach_the_end_of_a_round_and_agree(tmp_path):
    """With 2x2x2 points a cell of the fuze stopped the burst; without hourglass control half of the casing folded."""
    speeds, released = [], []
    for quadrature in ("one_point", "full"):
        chosen = {"geometry": "3d", "quadrature": quadrature, "end_time": 200e-6}
        summary = summary_of_case(tmp_path / quadrature, "cases/m107_tnt.toml", {}, "8 mm", **chosen)
        assert summary["lost_cells"] == 0
        speeds.append(summary["mean_initial_speed"])
        released.append(summary["released_casing_mass"] / summary["casing_mass"])
    assert speeds[1] == pytest.approx(speeds[0], rel=0.02)
    assert max(released) < 0.15
