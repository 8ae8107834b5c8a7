"""The slide line of the meridian: even pressure, sliding without friction, hollow corners, the rim of a fuze."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.axisymmetric.mesh import mesh_meridian
from burst_fenicsx.axisymmetric.slide_line import line_edges
from burst_fenicsx.geometry import load_profile
from burst_fenicsx.kernels.cells.erosion import BEFORE
from burst_fenicsx.kernels.contact.law import Law
from burst_fenicsx.meshing.cut import split_charges
from burst_fenicsx.problem import ContactSettings, Part
from tests.burst_fenicsx.axisymmetric.meridians import (
    contacts_of,
    hold,
    line_forces,
    meridian,
    named,
    ring_burst,
    whole_steps,
)
from tests.burst_fenicsx.bodies import QUIET
from tests.burst_fenicsx.boxes import STEEL as TUBE
from tests.burst_fenicsx.boxes import TNT, run_until

pytestmark = pytest.mark.dolfinx

PRESSURE, COUNT, LENGTH = 3e9, 24, 0.06
LAW = Law(1e8, 1e-7, 0.0, 0.0, 0.0)
STIFF = Law(1e14, 1e-7, 0.0, 0.0, 0.0)  # as in a step of 50 ns


def bench(shape):
    """A layer of charge on a layer of casing whose line is a cylinder, a disc to the axis, or a cone cut short."""

    def carry(points):
        along, across = LENGTH * points[:, 0], 0.02 * (points[:, 1] - 0.5)
        if shape == "cylinder":
            return np.stack([0.03 - across, along], axis=1)
        if shape == "disc":
            return np.stack([along, across], axis=1)
        return np.stack([0.01 + along, across + 0.7 * along], axis=1)

    mesh = meridian((COUNT, 4), carry)
    upper = np.tile([False, False, True, True], COUNT)
    return split_charges(named(mesh, np.where(upper, Part.CHARGE, Part.CASING)))


def pressed(solver, pressure=PRESSURE, law=LAW):
    """Forces of contact (nodes, 3) under an even pressure, at the places that the nodes now have."""
    fields = solver.fields
    fields.charge.burn_fraction[:] = 1.0
    fields.charge.pressure[:] = pressure
    return line_forces(solver, law)


def line_load(solver):
    """Consistent nodal forces (nodes, 3) of the even pressure on all edges of the line that the charge covers."""
    line, position = contacts_of(solver), solver.fields.nodes.position
    force = np.zeros_like(position)
    for a, b in line.edges:
        (ra, _, za), (rb, _, zb) = position[a], position[b]
        for node, radius in ((a, 2.0 * ra + rb), (b, ra + 2.0 * rb)):
            share = PRESSURE * 2.0 * np.pi / 6.0 * radius
            force[node, 0] -= share * (zb - za)
            force[node, 2] += share * (rb - ra)
    return force


@pytest.mark.parametrize("shape", ["cylinder", "disc", "cone"])
def test_an_even_pressure_loads_the_line_evenly_wherever_the_charge_has_slid(shape):
    """Both sides' nodes are shifted along the line at random, its own also gathered under single edges of the charge.

    Every node of the line, the end ones and that on the axis included, takes the consistent load of the line.
    """
    solver = ring_burst(bench(shape), QUIET)
    contacts, position, start = contacts_of(solver), solver.fields.nodes.position, solver.fields.start
    line = contacts
    first, last = start[line.edges[0, 0]], start[line.edges[-1, 1]]
    along = last - first
    random = np.random.default_rng(3)

    def shifted(nodes, power):
        """Nodes at other places of the line, in their order; the ends stay."""
        share = ((start[nodes] - first) @ along) / (along @ along)
        inner = (share > 1e-9) & (share < 1.0 - 1e-9)
        share[inner] = np.clip(share[inner] ** power, 1e-6, 1.0 - 1e-6)
        order = np.argsort(share)
        gaps = np.diff(share[order])
        moved = share[order][1:-1] + 0.35 * random.uniform(-1, 1, len(gaps) - 1) * np.minimum(gaps[1:], gaps[:-1])
        share[order[1:-1]] = moved
        position[nodes] = first + share[:, None] * along

    shifted(np.unique(line.edges), 1.35)
    shifted(np.unique(contacts.slave), 0.85)
    force = pressed(solver)
    exact = line_load(solver)
    on_line = np.unique(line.edges)
    bearers = contacts.spread.bearing
    assert bearers.min() >= 2
    assert bearers.max() >= 5  # several of the line's nodes under one of the charge's
    assert (contacts.off == 0).all()
    size = np.abs(exact).max()
    assert np.abs(force[on_line] - exact[on_line]).max() < 1e-12 * size
    # The charge's own nodes take the consistent load of its own edges, so that nothing is left over in all.
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()


def gas_tube():
    """Burnt products at rest in a rigid tube, 10 mm in radius, 120 mm long, open above; the tube is longer."""
    cell = 2.5e-3
    mesh = meridian((6, 96), lambda p: np.stack([6 * cell * p[:, 0], 0.24 * p[:, 1]], axis=1))
    centre = mesh.nodes[mesh.cells].mean(axis=1)
    gas = centre[:, 0] < 4 * cell
    keep = ~gas | (centre[:, 2] < 0.12)
    used = np.zeros(len(mesh.nodes), dtype=bool)
    used[mesh.cells[keep]] = True
    number = np.cumsum(used) - 1
    part = np.where(gas, Part.CHARGE, Part.CASING)[keep]
    mesh = replace(
        mesh, nodes=mesh.nodes[used], cells=number[mesh.cells[keep]], round=mesh.round[keep],
        station=mesh.station[keep],
    )  # fmt: skip
    mesh = split_charges(named(mesh, part))
    solver = ring_burst(mesh, whole_steps(replace(QUIET, cell_size=cell, contact=ContactSettings())), casing=TUBE)
    fields, start = solver.fields, solver.fields.start
    in_gas = np.zeros(len(start), dtype=bool)
    in_gas[fields.mesh.dofmap[fields.mesh.part == Part.CHARGE]] = True
    fields.charge.burn_fraction[: fields.mesh.cells][fields.mesh.part == Part.CHARGE] = 1.0
    solver.control.uncut_step = 1e-10
    hold(solver, np.stack([~in_gas, ~in_gas | (start[:, 2] < 1e-9)], axis=1))
    return solver, in_gas, cell


def test_gas_expands_along_a_rigid_tube_as_without_one():
    """Centred rarefaction of a gas of gamma = 3, u = (c0 + (z - L) / t) / 2, on the wall and on the axis as well."""
    solver, in_gas, cell = gas_tube()
    run_until(solver, 15e-6)
    sound = TNT.detonation_velocity * np.sqrt(3.0 * 27.0 / 256.0)
    fields = solver.fields
    radius = fields.start[:, 0]
    force = solver.contact.force
    for place in (0.0, 4 * cell):
        line = in_gas & (np.abs(radius - place) < 1e-9)
        z, speed = fields.nodes.position[line, 2], fields.nodes.velocity[line, 2]
        fan = (z - 0.12) / (sound * solver.time)
        inside = (fan > -0.75) & (fan < 0.1)
        assert inside.sum() > 12
        assert (z - fields.start[line, 2])[inside].max() > 3 * cell
        error = speed[inside] - 0.5 * sound * (1.0 + fan[inside])
        assert np.abs(error).max() < 0.02 * sound
    # No tangential momentum passes, and the gas does not sink in.
    assert np.abs(force[:, 2]).max() < 1e-9 * np.abs(force[:, 0]).max()
    assert solver.contact.penetrations.interface_at_front < 0.02 * cell
    assert solver.contact.penetrations.interface_after < 0.02 * cell


def test_a_node_slides_through_a_hollow_corner_and_one_that_began_there_has_both_sides():
    """The flat base of a cavity: from its wall on to the base; the corner's own node is held by both."""
    mesh = meridian((6, 8), lambda p: np.stack([0.03 * p[:, 0], 0.04 * p[:, 1]], axis=1))
    centre = mesh.nodes[mesh.cells].mean(axis=1)
    gas = (centre[:, 0] < 0.02) & (centre[:, 2] > 0.01)
    solver = ring_burst(split_charges(named(mesh, np.where(gas, Part.CHARGE, Part.CASING))), QUIET)
    contacts = line = contacts_of(solver)
    position, start = solver.fields.nodes.position, solver.fields.start
    assert (line.hollow >= 0).sum() == 2  # the edges that meet in the corner
    at = start[contacts.slave]
    corner = np.flatnonzero((np.abs(at[:, 0] - 0.02) < 1e-9) & (np.abs(at[:, 2] - 0.01) < 1e-9))
    assert len(corner) == 2
    assert (contacts.of_node[corner] == 2.0).all()
    (c,) = np.flatnonzero((np.abs(at[:, 0] - 0.02) < 1e-9) & (np.abs(at[:, 2] - 0.015) < 1e-9))
    node = contacts.slave[c]
    pressed(solver)
    assert contacts.normal[c, 0] == pytest.approx(-1.0)
    # The node is drawn down the wall, round the corner's own and on along the base.
    for place, gap in (([0.02, 0.0, 0.0101], 0.0), ([0.0195, 0.0, 0.0099], -1e-4), ([0.017, 0.0, 0.01], 0.0)):
        position[node] = place
        pressed(solver)
        assert contacts.off[c] == 0
        assert contacts.gap[c] == pytest.approx(gap, abs=1e-12)
    np.testing.assert_allclose(contacts.normal[c], [0.0, 0.0, 1.0], atol=1e-12)
    assert start[line.edges[contacts.facet[c]], 2] == pytest.approx([0.01, 0.01])


def test_products_behind_the_line_are_moved_back_by_a_force_of_the_size_of_their_pressure():
    """The spring is as stiff as the step bears, far too stiff for a node that is 1 mm away at once; before it is none.

    Deeper than half an edge a node has left.
    """
    gone = []
    for gap in (-1e-3, 1e-3, -1.4e-3):
        solver = ring_burst(bench("cylinder"), QUIET)
        contacts, position = contacts_of(solver), solver.fields.nodes.position
        pressed(solver, law=STIFF)
        (c,) = np.flatnonzero(np.abs(solver.fields.start[contacts.slave, 2] - 0.5 * LENGTH) < 1e-9)
        own = contacts.gas[c]
        assert contacts.stiffness[c] * abs(gap) > 50.0 * own
        position[contacts.slave[c], 0] -= gap
        pressed(solver, law=STIFF)
        assert contacts.gap[c] == pytest.approx(gap)
        gone.append(int(contacts.off[c]))
        correction = contacts.force[c] @ contacts.normal[c]
        if gap == -1e-3:
            assert 5.0 * own < correction < 50.0 * own
            position[contacts.slave[c], 0] += gap
            pressed(solver, law=STIFF)
            assert np.linalg.norm(contacts.force[c]) < 1e-9 * own
        else:
            assert contacts.stiffness[c] == correction == 0.0
    assert gone == [0, 0, 1]


def test_eroded_products_and_products_on_eroded_metal_press_no_more():
    """A node whose cells have all been eroded, and one on an edge whose metal has, have left the line for good."""
    solver = ring_burst(bench("cylinder"), QUIET)
    contacts = line = contacts_of(solver)
    pressed(solver)
    touching = contacts.stiffness > 0.0
    assert touching.all()
    eroded, slot = solver.fields.solid.eroded, solver.fields.blocks.slot_of_cell
    attached = solver.contact.interface.attached
    (k,) = np.flatnonzero(attached.row == contacts.node[3])
    eroded[slot[attached.cell[attached.first[k] : attached.first[k + 1]]]] = BEFORE
    torn = contacts.facet[15]
    mesh = solver.fields.mesh
    at_edge = np.isin(mesh.dofmap, line.edges[torn]).sum(axis=1) == 2
    metal = at_edge & (mesh.part == Part.CASING)
    assert metal.sum() == 1
    eroded[slot[np.flatnonzero(metal)]] = BEFORE
    solver.contact.drop_faces(solver.fields.eroded_metal)
    force = pressed(solver)
    gone = np.flatnonzero(contacts.off == 1)
    np.testing.assert_array_equal(gone, np.union1d([3], np.flatnonzero(contacts.facet == torn)))
    assert (contacts.stiffness[gone] == 0.0).all()
    assert (force[contacts.slave[gone]] == 0.0).all()
    # A node with one live cell left goes on pressing.
    assert (contacts.stiffness[[2, 4]] > 0.0).all()
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()


def test_the_charges_nodes_at_the_rim_of_a_fuze_belong_to_both_sides():
    """The M107: one node of charge, casing and fuze, without a contact's force; all others are split."""
    mesh = split_charges(mesh_meridian(load_profile("m107"), 8e-3))
    solver = ring_burst(mesh, QUIET)
    contacts = contacts_of(solver)
    (rim,) = np.flatnonzero(contacts.off == 2)
    touched = [np.unique(mesh.cells[mesh.part == part]) for part in (Part.CHARGE, Part.CASING, Part.FUZE)]
    node = solver.fields.mesh.node[contacts.slave[rim]]
    assert all(node in nodes for nodes in touched)
    charge, casing, fuze = touched
    np.testing.assert_array_equal(np.intersect1d(charge, casing), [node])
    assert len(np.intersect1d(charge, fuze)) > 2  # the charge's front is tied to the fuze
    pressed(solver)
    assert contacts.stiffness[rim] == 0.0
    assert (contacts.stiffness[contacts.off == 0] > 0.0).all()


def test_the_line_of_a_round_with_a_fuze_runs_along_its_casing_alone():
    """The M107: every edge belongs to the casing; a charge lies at all those that casing and charge share."""
    mesh = split_charges(mesh_meridian(load_profile("m107"), 8e-3))
    edges, cell, covered = line_edges(mesh)
    assert (mesh.part[cell] == Part.CASING).all()
    assert np.isin(edges, mesh.cells[mesh.part == Part.CASING]).all()

    def edges_of(part):
        found = np.stack([mesh.cells, np.roll(mesh.cells, -1, axis=1)], axis=-1)[mesh.part == part].reshape(-1, 2)
        return {tuple(sorted(pair)) for pair in mesh.places[found].tolist()}

    shared = edges_of(Part.CASING) & edges_of(Part.CHARGE)
    assert len(shared) > 50
    assert {tuple(sorted(pair)) for pair in mesh.places[edges[covered]].tolist()} == shared
    assert covered.sum() == len(shared)
    assert len(edges_of(Part.FUZE) & edges_of(Part.CHARGE)) > 0


@pytest.mark.parametrize("order", [1, -1])
def test_the_line_leads_on_behind_a_fuze_however_cells_are_numbered(order):
    """A tube of 8 cells along the axis, half filled, with a plug on the charge: all of its wall, half of it covered."""
    mesh = meridian((6, 8), lambda p: np.stack([0.03 * p[:, 0], 0.04 * p[:, 1]], axis=1))
    mesh = replace(mesh, cells=mesh.cells[::order], station=mesh.station[::order])
    centre = mesh.nodes[mesh.cells].mean(axis=1)
    within = np.where(centre[:, 2] < 0.02, Part.CHARGE, Part.FUZE)
    mesh = split_charges(named(mesh, np.where(centre[:, 0] < 0.02, within, Part.CASING)))
    edges, cell, covered = line_edges(mesh)
    np.testing.assert_allclose(np.sort(mesh.nodes[edges[:, 1], 2]), 0.005 * np.arange(8), atol=1e-12)
    np.testing.assert_allclose(mesh.nodes[edges, 0], 0.02, atol=1e-12)
    assert (mesh.part[cell] == Part.CASING).all()
    assert (covered == (mesh.nodes[edges].mean(axis=1)[:, 2] < 0.02)).all()


@pytest.mark.parametrize(("beyond", "off"), [(0.23, False), (0.27, True)])
def test_a_node_leaves_the_line_a_quarter_of_an_edge_beyond_its_end(beyond, off):
    """It touched until then; one within the line that is as far away stays."""
    solver = ring_burst(bench("cylinder"), QUIET)
    contacts = line = contacts_of(solver)
    position, start = solver.fields.nodes.position, solver.fields.start
    pressed(solver)
    assert (contacts.stiffness > 0.0).all()
    (last,) = np.flatnonzero(np.abs(start[contacts.slave, 2] - LENGTH) < 1e-9)
    (middle,) = np.flatnonzero(np.abs(start[contacts.slave, 2] - 0.5 * LENGTH) < 1e-9)
    for c in (last, middle):
        position[contacts.slave[c], 2] += beyond * LENGTH / COUNT
    pressed(solver)
    assert bool(contacts.off[last]) is off
    assert contacts.off[middle] == 0
    assert len(line.edges) == COUNT


@pytest.mark.parametrize(("deep", "off"), [(0.04, False), (0.06, True)])
def test_a_node_newly_met_lies_no_deeper_than_it_can_have_come(deep, off):
    """Of half an edge a tenth is allowed for how the line bends, and one and a half times the way of the step."""
    edge = LENGTH / COUNT
    for way in (0.0, 0.02):
        solver = ring_burst(bench("cylinder"), QUIET)
        contacts, position = contacts_of(solver), solver.fields.nodes.position
        pressed(solver)
        (c,) = np.flatnonzero(np.abs(solver.fields.start[contacts.slave, 2] - 0.5 * LENGTH) < 1e-9)
        node = contacts.slave[c]
        position[node, 0] += (deep + 1.5 * way) * edge
        solver.fields.nodes.velocity[node, 0] = way * edge / LAW.step
        contacts.stiffness[c] = 0.0
        pressed(solver)
        assert contacts.gap[c] == pytest.approx(-(deep + 1.5 * way) * edge, rel=1e-9)
        assert bool(contacts.off[c]) is off
