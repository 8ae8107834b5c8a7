"""Contact of charge and casing: the bond, products that press and slide (Eqs. 12-15), released cells of products."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.kernels.cells.erosion import BEFORE
from burst_fenicsx.kernels.constants import CRUSHED
from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from burst_fenicsx.meshing.cut import split_charges
from burst_fenicsx.problem import ContactSettings, Part
from burst_fenicsx.run_burst import simulate
from burst_fenicsx.simulation import Simulation
from fragfield.case import load_case
from fragfield.case.conversion.rounds import burst_rounds
from fragfield.case.problem import burst_settings
from tests.burst_fenicsx.bodies import QUIET, bodies, energy, momentum
from tests.burst_fenicsx.boxes import ELASTIC, TNT, box, run_until
from tests.burst_fenicsx.tubes import SETTINGS, tube

pytestmark = pytest.mark.dolfinx


SIDE = 0.04
COLUMN, CELL = 0.2, 5e-3


def layered():
    """A block of 4 x 4 x 4 cells of 10 mm: two layers of casing under two layers of charge."""
    mesh = box((4, 4, 4), (SIDE, SIDE, SIDE))
    upper = mesh.nodes[mesh.cells].mean(axis=1)[:, 2] > 0.5 * SIDE
    part = np.where(upper, Part.CHARGE, Part.CASING).astype(np.int32)
    return replace(mesh, part=part, segment=np.where(upper, -1, 0).astype(np.int32))


def ends(solver):
    """Local nodes of the charge on the interface, and their interface_pairs of the casing."""
    contact = solver.contact
    charge = np.unique(contact.nodes.rows.local[contact.interface.pairs.node])
    start = solver.fields.start
    solid = []
    for node in charge:
        same = np.flatnonzero((np.abs(start - start[node]) < 1e-9).all(axis=1))
        solid.append(same[same != node][0])
    return charge, np.array(solid)


def pulled(direction, traction, rise, contact, damping=2e5, *, lateral=False):
    """Hold the casing's bottom and pull the charge's top with a traction (Pa) that grows over `rise` (s).

    With `lateral`, nothing moves sideways: the state is the same over every section.
    """
    mesh = split_charges(layered())
    settings = replace(QUIET, cell_size=0.01, damping=damping, contact=contact)
    pull = np.asarray(direction, dtype=float)
    top = {}

    def draw(time, force):
        if not top:  # the solver asks once while it is made
            return
        force[top["nodes"]] += min(time / rise, 1.0) * traction * SIDE**2 * top["share"][:, None] * pull

    solver = bodies([mesh], [(0, 0, 0)], settings, external=draw)
    start = solver.fields.start
    top["nodes"] = np.flatnonzero(start[:, 2] > SIDE - 1e-9)
    mass = solver.fields.mass[top["nodes"]]
    top["share"] = mass / mass.sum()
    everywhere, bottom = np.arange(len(start)), np.flatnonzero(start[:, 2] < 1e-9)
    if lateral:
        solver.constraints = (
            NodalConstraint(bottom, np.eye(3)[2]),
            NodalConstraint(everywhere, np.eye(3)[0]),
            NodalConstraint(everywhere, np.eye(3)[1]),
        )
    else:
        solver.constraints = tuple(NodalConstraint(bottom, axis) for axis in np.eye(3))
    return solver


def bonded(solver):
    """Whether each contact of the solver's interface is bonded."""
    return solver.contact.interface.bonds.bonded != 0


def load_at_break(solver, traction, rise):
    """Traction (Pa) at which the first bond breaks, or infinite."""
    while solver.time < rise:
        solver.step()
        if not bonded(solver).all():
            return traction * solver.time / rise
    return np.inf


@pytest.mark.parametrize("strength", [5e6, 20e6])
def test_the_bond_breaks_at_its_tensile_strength(strength):
    """Slow pull across the face: every spring carries the traction, so the first breaks at T (Eq. 15)."""
    bond = ContactSettings(tensile_strength=strength, cohesion=1e12)
    solver = pulled((0, 0, 1), 2.0 * strength, 8e-4, bond, lateral=True)
    assert load_at_break(solver, 2.0 * strength, 8e-4) == pytest.approx(strength, rel=0.02)
    assert np.isinf(load_at_break(pulled((0, 0, 1), 0.9 * strength, 8e-4, bond, lateral=True), 0.9 * strength, 8e-4))


def test_a_broken_bond_opens_without_force():
    """Torn off, the charge leaves for good: no force, no energy in the springs, and the energies balance."""
    solver = pulled((0, 0, 1), 20e6, 1e-4, ContactSettings(tensile_strength=5e6), damping=0.0)
    run_until(solver, 2e-4)
    charge, solid = (solver.fields.nodes.position[nodes, 2] for nodes in ends(solver))
    assert (charge - solid).min() > 1e-4
    assert solver.contact.spring_energy == 0.0
    assert not bonded(solver).any()
    assert energy(solver) == pytest.approx(0.0, abs=0.01 * solver.ledger.entries[-1].external_work)


def offset_under(pressure, shear, contact):
    """Mean sliding (m) of a charge that is pressed and sheared (Pa), and whether all its bonds have broken."""
    size = np.hypot(pressure, shear)
    solver = pulled((shear / size, 0.0, -pressure / size), size, 2e-4, contact)
    run_until(solver, 4e-4)
    charge, solid = (solver.fields.nodes.position[nodes, 0] for nodes in ends(solver))
    return float(np.mean(charge - solid)), not bonded(solver).any()


def test_an_unreacted_charge_that_is_dragged_slides_without_sinking_in():
    """Over several cells, from face to face and over the rim, it stays on top of the casing."""
    solver = pulled((0.9, 0.0, -0.43589), 300e6, 5e-5, ContactSettings(cohesion=0.0, tensile_strength=0.0), damping=0.0)
    deepest, farthest = 0.0, 0.0
    while solver.time < 1.9e-4:
        solver.step()
        deepest = max(deepest, solver.contact.interface.deepest)
        charge, solid = (solver.fields.nodes.position[nodes, 0] for nodes in ends(solver))
        farthest = max(farthest, float((charge - solid).max()))
    assert farthest > 15e-3  # one and a half cells
    assert deepest < 0.5e-3  # a twentieth of a cell, under 130 MPa and more
    assert solver.contact.summary()["off_surface"] > 0  # those dragged over the rim


def test_charge_and_casing_conserve_momentum_and_angular_momentum():
    """Charge and casing that oscillate against each other give no net force and no net moment."""
    mesh, bond = split_charges(layered()), ContactSettings(tensile_strength=1e12, cohesion=1e12)
    solver = bodies([mesh], [(0, 0, 0)], replace(QUIET, cell_size=0.01, contact=bond))
    solver.fields.nodes.velocity[solver.fields.start[:, 2] > 0.7 * SIDE, :] = (3.0, -2.0, 5.0)
    start, largest = momentum(solver), 0.0
    for _ in range(200):
        solver.step()
        nodes, contact = solver.fields.nodes, solver.contact
        moment = np.cross(nodes.position, contact.force).sum(axis=0)
        size = np.abs(contact.force).sum() * SIDE
        largest = max(largest, size)
        # Tangential springs act at the node, their reaction on the face: apart by the gap.
        gap = np.abs(contact.interface.pairs.gap).max()
        assert np.abs(moment).max() <= (1e-9 + gap / SIDE) * size
    assert largest > 0.0
    size = np.abs(solver.fields.mass[:, None] * solver.fields.nodes.velocity).sum()
    assert np.abs(momentum(solver) - start).max() < 1e-11 * size  # 200 steps; 1e-12 where products are rounded apart


def gas_column(wall_layers, gas_layers, contact, *, held, casing=None, wall_length=0.4):
    """Burnt products at rest in a column (x from 0 to `COLUMN`) above a wall that is longer; open at x = `COLUMN`.

    Nothing moves along y, the column's closed end and its top are held along x and z; with `held` the wall as well.
    """
    cells = (round(wall_length / CELL), 1, wall_layers + gas_layers)
    mesh = box(cells, (wall_length, CELL, cells[2] * CELL))
    centre = mesh.nodes[mesh.cells].mean(axis=1)
    gas = centre[:, 2] > wall_layers * CELL
    keep = ~gas | (centre[:, 0] < COLUMN)
    used = np.zeros(len(mesh.nodes), dtype=bool)
    used[mesh.cells[keep]] = True
    number = np.cumsum(used) - 1
    part = np.where(gas, Part.CHARGE, Part.CASING).astype(np.int32)[keep]
    mesh = replace(
        mesh, nodes=mesh.nodes[used], cells=number[mesh.cells[keep]], part=part, round=mesh.round[keep],
        segment=np.where(part == Part.CHARGE, -1, 0).astype(np.int32), station=mesh.station[keep],
    )  # fmt: skip
    if contact.charge_casing == "sliding":
        mesh = split_charges(mesh)
    settings = replace(QUIET, cell_size=CELL, contact=contact)
    options = {} if casing is None else {"casing": casing}
    solver = bodies([mesh], [(0, 0, 0)], settings, **options)
    fields, start = solver.fields, solver.fields.start
    everywhere, axes = np.arange(len(start)), np.eye(3)
    in_gas = np.zeros(len(start), dtype=bool)
    in_gas[fields.mesh.dofmap[fields.mesh.part == Part.CHARGE]] = True
    top = np.flatnonzero(start[:, 2] > (cells[2] - 1e-6) * CELL)
    closed = np.flatnonzero(in_gas & (start[:, 0] < 1e-9))
    holds = [NodalConstraint(everywhere, axes[1]), NodalConstraint(top, axes[2]), NodalConstraint(closed, axes[0])]
    if held:
        wall = np.unique(fields.mesh.dofmap[fields.mesh.part == Part.CASING])
        holds += [NodalConstraint(wall, axis) for axis in axes]
    solver.constraints = tuple(holds)
    fields.charge.burn_fraction[: fields.mesh.cells][fields.mesh.part == Part.CHARGE] = 1.0
    # All at once under pressure: the first steps are short, and grow by a twentieth each.
    solver.control.uncut_step = 1e-10
    solver.add_forces(0.0)
    return solver, in_gas


def test_gas_expands_along_a_rigid_wall_as_without_one():
    """Centred rarefaction of a gas of gamma = 3, u = (c0 + (x - L) / t) / 2, in the layer on the wall as well.

    The gas slides over the wall by several cells. (Courant and Friedrichs 1948, section 40.)
    """
    solver, in_gas = gas_column(1, 2, ContactSettings(), held=True)
    run_until(solver, 25e-6)
    sound = TNT.detonation_velocity * np.sqrt(3.0 * 27.0 / 256.0)
    fields = solver.fields
    on_wall = in_gas & (np.abs(fields.start[:, 2] - CELL) < 1e-9)
    x, speed = fields.nodes.position[on_wall, 0], fields.nodes.velocity[on_wall, 0]
    fan = (x - COLUMN) / (sound * solver.time)
    inside = (fan > -0.75) & (fan < 0.1)
    assert inside.sum() > 20
    assert (x - fields.start[on_wall, 0])[inside].max() > 3 * CELL
    error = speed[inside] - 0.5 * sound * (1.0 + fan[inside])
    assert np.abs(error).max() < 0.02 * sound
    assert solver.contact.interface.deepest < 0.01 * CELL
    assert np.abs(solver.contact.force[on_wall, 0]).max() < 1e-9 * np.abs(solver.contact.force[on_wall, 2]).max()


@pytest.mark.parametrize("layers", [3, 6])
def test_gas_gives_a_strengthless_wall_no_tangential_momentum(layers):
    """A wall like a liquid of steel that gas streams along: its axial speed is linear through the wall.

    The wall is accelerated as a whole, so the pressure in it falls linearly to its free side, and with it the axial
    pressure gradient. Shared nodes hand the momentum of the gas's half layer to the innermost layer besides.
    """
    liquid = replace(ELASTIC, shear_strength=1e3, tensile_strength=1e3)
    bend = {}
    for kind in ("sliding", "shared"):
        solver, _ = gas_column(layers, 4, ContactSettings(charge_casing=kind), held=False, casing=liquid)
        run_until(solver, 20e-6)
        mesh, nodes = solver.fields.mesh, solver.fields.nodes
        centre = solver.fields.start[mesh.dofmap].mean(axis=1)
        axial = nodes.velocity[mesh.dofmap].mean(axis=1)[:, 0]
        there = (mesh.part == Part.CASING) & (np.abs(centre[:, 0] - 0.75 * COLUMN) < 0.1 * COLUMN)
        depth = np.round(layers - centre[:, 2] / CELL - 0.5).astype(int)
        first, second, third = (float(axial[there & (depth == layer)].mean()) for layer in range(3))
        assert first - second > 5.0  # the gradient acts
        bend[kind] = (first - second) - (second - third)
    assert abs(bend["sliding"]) < 5.0
    assert bend["shared"] > 20.0


def test_products_leave_the_wall_of_a_closed_round_nowhere(tmp_path):
    """The M107 with coarse cells to 100 us: no contact is lost, nothing sinks in, momentum and energy stay."""
    case = load_case(Path(__file__).parents[2] / "cases" / "m107_tnt.toml", {"burst.cell_size": "10 mm"})
    settings = replace(burst_settings(case), end_time=100e-6)
    found = simulate(burst_rounds(case), settings, tmp_path, comm=MPI.COMM_SELF).summary
    assert found["contact"]["off_surface"] == 0
    assert found["contact"]["max_interface_penetration_at_front"] < 0.02 * 10e-3
    assert found["contact"]["max_interface_penetration"] < 0.01 * 10e-3
    assert found["momentum_error"] < 1e-12
    # Most of it is made by contact while the front passes these cells.
    assert found["energy_error"] < 0.01
    assert 0.0 < found["contact_error"] < 0.015
    assert found["energy_error_at_end"] < 0.005
    assert found["contact_error_at_end"] < 0.005


def test_a_tube_with_open_ends_is_a_little_slower_than_with_shared_nodes(tmp_path):
    """A tube to 60 us: up to 3 % below the speed with shared nodes, since gas slides out of the open ends."""
    found = {}
    for name, contact in (("shared", ContactSettings(charge_casing="shared")), ("sliding", ContactSettings())):
        folder = tmp_path / name
        folder.mkdir()
        settings = replace(SETTINGS, cell_size=6e-3, end_time=60e-6, contact=contact)
        found[name] = simulate([tube()], settings, folder, comm=MPI.COMM_SELF).summary
    shared, sliding = found["shared"], found["sliding"]
    assert shared["max_penetration"] == 0.0
    assert shared["contact"]["bonded"] == 0
    assert sliding["contact"]["bonded"] == 0  # all has reacted
    assert sliding["contact"]["max_interface_penetration_at_front"] < 0.02 * 6e-3
    assert sliding["contact"]["max_interface_penetration"] < 0.02 * 6e-3  # at the open rims; 0.4 % in a closed round
    assert 0.97 < sliding["mean_initial_speed"] / shared["mean_initial_speed"] < 1.0
    assert sliding["momentum_error"] < 1e-12
    assert sliding["energy_error"] < 0.01


@pytest.mark.parametrize(("factor", "broken"), [(0.85, False), (1.1, True), (1.5, True)])
def test_the_bond_gives_way_by_the_law_of_mohr_and_coulomb(factor, broken):
    """Below c + p tan(phi) it holds, above it breaks (Eq. 15), and well above it the charge slides."""
    pressure, cohesion = 40e6, 5e6
    limit = cohesion + pressure * np.tan(np.radians(20.0))
    offset, gone = offset_under(pressure, factor * limit, ContactSettings(cohesion=cohesion))
    assert gone == broken
    assert (offset > 1e-4) == (factor > 1.2) or factor == 1.1


def release(fields, cells):
    """Put burnt cells of the charge into the state of released ones, crushed to the volume at which that happens."""
    assert (fields.charge.burn_fraction[cells] == 1.0).all()
    eroded, volume = (fields.blocks.by_cell(values) for values in (fields.solid.eroded, fields.grid.volume))
    eroded[cells], volume[cells] = BEFORE, CRUSHED * fields.cell_mass[cells] / TNT.density
    fields.solid.eroded[:], fields.grid.volume[:] = (fields.blocks.by_slot(values) for values in (eroded, volume))


def at_the_wall(run):
    """Cells of the charge that lie on the casing, those nearest to the middle of the round first."""
    fields = run.fields
    of_casing = np.unique(fields.mesh.dofmap[fields.mesh.part == Part.CASING])
    places = {tuple(np.round(point, 9)) for point in fields.start[of_casing]}
    at_casing = np.array([tuple(np.round(point, 9)) in places for point in fields.start])
    charge = np.flatnonzero(fields.mesh.part == Part.CHARGE)
    cells = charge[at_casing[fields.mesh.dofmap[charge]].any(axis=1)]
    centre = fields.start[fields.mesh.dofmap[cells]].mean(axis=1)
    middle = 0.5 * (fields.start[:, 2].min() + fields.start[:, 2].max())
    return cells[np.argsort(np.abs(centre[:, 2] - middle) + 1e-3 * np.abs(centre[:, 1]))]


def released_at_30(tmp_path, count):
    """The tube with `count` cells at its wall released after 30 us, to 60 us: the run, and the fastest node (m/s)."""
    folder = tmp_path / str(count)
    folder.mkdir()
    settings = replace(SETTINGS, end_time=60e-6, energy_tolerance=np.inf)
    run = Simulation([tube()], settings, folder, MPI.COMM_SELF, {})
    run_until(run.solver, 30e-6)
    cells = at_the_wall(run)[:count]
    release(run.fields, cells)
    fastest = 0.0
    while run.solver.time < 60e-6 * (1.0 - 1e-12):
        run.solver.step(60e-6)
        fastest = max(fastest, float(np.linalg.norm(run.fields.nodes.velocity, axis=1).max()))
    run._record()
    return run, cells, fastest


def test_released_products_of_a_tube_drive_no_casing(tmp_path):
    """3 of 384 cells at the wall: no pressure is left in them, no node gets faster, and contact makes no energy."""
    whole, _, fastest = released_at_30(tmp_path, 0)
    run, cells, also = released_at_30(tmp_path, 3)
    assert (run.fields.charge.pressure[cells] == 0.0).all()
    assert also < 1.01 * fastest
    before, after = whole.ledger.entries[-1], run.ledger.entries[-1]
    assert after.products_work < before.products_work
    assert after.mean_casing_speed < before.mean_casing_speed
    assert abs(after.contact_gain - before.contact_gain) < 5e-3 * before.products_work
    assert after.energy_error < 0.01


def test_a_node_of_released_products_leaves_the_wall_and_others_lose_their_share():
    """Gas at rest on a rigid wall: a row of cells is released; half of the pressure at its ends, none between."""
    solver, _ = gas_column(1, 2, ContactSettings(), held=True)
    fields, contact = solver.fields, solver.contact
    pairs, off = contact.interface.pairs, contact.interface.bonds.off
    node = contact.nodes.rows.local[pairs.node]
    place, before = fields.start[node, 0], pairs.gas.copy()
    on_wall = np.isin(fields.mesh.dofmap, node).any(axis=1) & (fields.mesh.part == Part.CHARGE)
    cells = np.flatnonzero(on_wall)
    centre = fields.start[fields.mesh.dofmap[cells]].mean(axis=1)[:, 0]
    gone = cells[(centre > 0.05) & (centre < 0.10)]
    assert len(gone) == 10
    release(fields, gone)
    solver.add_forces(0.0)
    after = pairs.gas
    within, edge = (place > 0.0501) & (place < 0.0999), (np.abs(place - 0.05) < 1e-9) | (np.abs(place - 0.1) < 1e-9)
    assert (within.sum(), edge.sum()) == (18, 4)
    assert (after[within] == 0.0).all()
    assert (off[within] == 1).all()
    np.testing.assert_allclose(after[edge], 0.5 * before[edge], rtol=1e-9)
    np.testing.assert_allclose(after[~within & ~edge], before[~within & ~edge], rtol=1e-12)
