"""Contact of charge and casing: the bond of the unreacted charge, and products that press and slide (Eqs. 12-15)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from burst_fenicsx.meshing.cut import split_charges
from burst_fenicsx.problem import ContactSettings, Part
from burst_fenicsx.run_burst import simulate
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
    interface = solver.contact.interface
    own = interface.contacts.contact
    order = np.argsort(interface.contacts.row[own])
    pairs = interface.contacts.row[own][order]
    _, first = np.unique(pairs, return_index=True)
    charge = interface.contacts.slave[own][order][first]
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
    contacts = solver.contact.interface.contacts
    return contacts.bonded[contacts.contact] != 0


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


def test_pressed_and_sheared_it_slides_at_the_friction_limit():
    """Shear traction against Mohr-Coulomb: below c + p tan(phi) it holds, above it slides (Eq. 15)."""
    pressure, cohesion = 40e6, 5e6
    limit = cohesion + pressure * np.tan(np.radians(20.0))
    for factor, slides in ((0.7, False), (1.5, True)):
        offset, broken = offset_under(pressure, factor * limit, ContactSettings(cohesion=cohesion))
        assert (offset > 1e-4) == slides
        assert broken == slides


def test_friction_holds_no_more_than_the_explosive_bears():
    """Where c + p tan(phi) exceeds the shear strength of the explosive (50 MPa), that strength is the limit."""
    for factor, slides in ((0.8, False), (1.3, True)):
        offset, _ = offset_under(40e6, factor * TNT.shear_strength, ContactSettings(cohesion=1e9))
        assert (offset > 2e-4) == slides


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
        gap = np.abs(contact.interface.contacts.gap).max()
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


def test_a_bond_that_breaks_turns_its_stored_slip_into_heat():
    """Sheared and pulled at once: what a tangential spring held at the break is the heat of that step."""
    solver = pulled((0.6, 0.0, 0.8), 60e6, 2e-4, ContactSettings(tensile_strength=10e6, cohesion=1e12), damping=0.0)
    contacts = solver.contact.interface.contacts
    own, found = contacts.contact, 0
    while solver.time < 2e-4:
        whole, stiffness = contacts.bonded[own] != 0, contacts.stiffness[own].copy()
        held = 0.5 * stiffness * (contacts.slip[own] ** 2).sum(axis=1)
        solver.step()
        broken = whole & (contacts.bonded[own] == 0) & (contacts.stiffness[own] == 0.0)
        assert contacts.tally[own][broken, 1] == pytest.approx(held[broken], rel=1e-12)
        found += int((broken & (held > 0.0)).sum())
    assert found > 5


@pytest.mark.parametrize(("factor", "broken"), [(0.85, False), (1.1, True)])
def test_the_bond_gives_way_by_the_law_of_mohr_and_coulomb(factor, broken):
    """A little below c + p tan(phi) it holds, a little above it does not; friction is three quarters of the limit."""
    pressure, cohesion = 40e6, 5e6
    limit = cohesion + pressure * np.tan(np.radians(20.0))
    assert offset_under(pressure, factor * limit, ContactSettings(cohesion=cohesion))[1] == broken
