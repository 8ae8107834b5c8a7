"""Casings of a section that meet each other and planes: lever rule, momentum, energy, nothing passes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from burst_fenicsx.kernels.contact.planes import PlaneLaw, PlaneState, push_from_plane
from burst_fenicsx.plane_section.passage import SectionPassage
from burst_fenicsx.plane_section.surfaces import section_surfaces
from burst_fenicsx.problem import ContactSettings, RigidPlane, Round
from tests.burst_fenicsx.boxes import BARE, ELASTIC, TNT
from tests.burst_fenicsx.plane_section.sections import blocks, section_burst
from tests.burst_fenicsx.plane_section.test_plane_mesh import tube_section

pytestmark = pytest.mark.dolfinx

SIZE = 2e-3
TOUCHING = replace(BARE, cell_size=SIZE, contact=ContactSettings(surfaces=True, surface_friction_angle=0.0))


def two_blocks(gap, offset=0.37, settings=TOUCHING, **options):
    """Blocks of 4 x 4 cells that face each other along u, the second one shifted along v by a share of a cell."""
    mesh = blocks((4, 4), SIZE, [(-4 * SIZE, 0.0), (gap, offset * SIZE)])
    return section_burst(mesh, settings, **options)


def run(solver, time):
    while solver.time < time:
        solver.step(time)
    return solver


def momentum(solver):
    """Momentum (3,) of all nodes in the middle of the present step (kg m/s per metre)."""
    fields = solver.fields
    half = 0.5 * solver.time_step * fields.nodes.force
    return (fields.mass[:, None] * fields.nodes.velocity + half).sum(axis=0)


def test_edges_are_drawn_out_to_faces_that_look_outward():
    """A face's normal leads away from its cell; faces lie at equal distances on both sides of the section."""
    mesh = tube_section(8e-3)
    surfaces = section_surfaces(mesh, 8e-3)
    place = np.zeros((len(surfaces.node), 3))
    nodes = len(surfaces.node) - len(surfaces.copy_of)
    place[:nodes] = mesh.nodes[surfaces.node[:nodes]]
    place[nodes:] = place[surfaces.copy_of]
    place[:, 1] += surfaces.height
    corner = place[surfaces.faces]
    normal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    centre = corner.mean(axis=1)
    radius = np.linalg.norm(centre, axis=1)
    outwards = np.einsum("ij,ij->i", normal, centre) > 0.0
    np.testing.assert_array_equal(outwards, radius > 0.07)  # the others look into the bore
    assert outwards.any()
    assert not outwards.all() or (radius > 0.07).all()
    assert np.abs(centre[:, 1]).max() == 0.0
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1) / 2.0, surfaces.edge**2, rtol=1e-12)


def test_a_node_in_an_edge_is_pushed_by_the_lever_rule():
    """Of a node that has entered an edge at a quarter of its length, the nearer end bears three quarters."""
    mesh = blocks((1, 1), SIZE, [(-SIZE, 0.0), (0.01 * SIZE, -0.75 * SIZE)])
    solver = section_burst(mesh, TOUCHING)
    contact, fields = solver.contact, solver.fields
    position, velocity = fields.nodes.position, fields.nodes.velocity
    second = fields.mesh.local_node(np.unique(mesh.cells[1]))
    velocity[second, 0] = -100.0
    position[second, 0] -= 0.03 * SIZE
    contact.add_forces(1e-7, 0.03 * SIZE / 100.0, front_near=False)
    force = contact.force
    first = fields.mesh.local_node(np.unique(mesh.cells[0]))
    right = first[position[first, 0] > -0.5 * SIZE]
    upper = right[np.argmax(position[right, 2])]
    # The second block's upper node lies at a quarter of the first one's edge, the first one's lower node at three
    # quarters of the second one's: each is pushed by the other's edge.
    upper_of_second = second[np.argmax(position[second, 2] - 1e-3 * position[second, 0])]
    assert force[right, 0].max() < 0.0 < force[upper_of_second, 0]
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-9 * np.abs(force).max())
    torque = (position[:, 0] * force[:, 2] - position[:, 2] * force[:, 0]).sum()
    # Both springs press along u: their moments cancel but for the depth, which has no arm in u.
    assert abs(torque) < 1e-6 * np.abs(force).max() * SIZE
    assert force[upper, 0] == pytest.approx(-0.25 * contact.collisions.state.push[:, 0].max(), rel=0.35)
    assert np.abs(force[:, 1:]).max() < 1e-9 * np.abs(force).max()


@pytest.mark.parametrize("friction", [0.0, 20.0])
def test_two_blocks_collide_and_part_with_momentum_and_energy_kept(friction):
    """At 200 m/s against each other, askew: momentum to 1e-12, the ledger to 1 %, and they part again."""
    settings = replace(TOUCHING, contact=ContactSettings(surfaces=True, surface_friction_angle=friction))
    solver = two_blocks(0.05 * SIZE, settings=settings)
    fields = solver.fields
    of_node = np.zeros(len(fields.mass), dtype=int)
    of_node[fields.mesh.dofmap] = fields.mesh.round[:, None]
    fields.nodes.velocity[of_node == 0] = [100.0, 0.0, 20.0]
    fields.nodes.velocity[of_node == 1] = [-100.0, 0.0, 0.0]
    before = (fields.mass[:, None] * fields.nodes.velocity).sum(axis=0)
    kinetic = 0.5 * (fields.mass * (fields.nodes.velocity**2).sum(axis=1)).sum()
    size = (fields.mass * np.linalg.norm(fields.nodes.velocity, axis=1)).sum()
    run(solver, 1.5e-5)
    assert np.abs(momentum(solver) - before).max() < 1e-12 * size
    speed = np.array(
        [np.average(fields.nodes.velocity[of_node == k, 0], weights=fields.mass[of_node == k]) for k in (0, 1)]
    )
    assert speed[0] < 0.0 < speed[1]  # reflected
    held = solver.ledger
    solver.ledger.external_work += kinetic  # they began in motion
    entry = held.record(fields, solver.time, solver.time_step, solver.resultant, 0.0, solver.contact)
    parts = ("kinetic", "strain", "plastic", "viscous", "hourglass", "contact", "damping")
    stored = sum(getattr(entry, name) for name in parts)
    assert abs(stored / kinetic - 1.0) < 0.01
    assert max(entry.energy_error, entry.contact_error) < 0.02  # each by itself; of opposite signs here
    assert 0.0 < solver.contact.penetrations.collision < 0.5 * SIZE
    assert solver.contact.collisions.deepest == 0.0  # apart


def test_interior_nodes_meet_the_other_rounds_faces():
    """An inner node carried beyond its own surface into the other block is pushed back out of it."""
    solver = two_blocks(0.02 * SIZE, offset=0.0)
    fields, contact = solver.fields, solver.contact
    position, velocity = fields.nodes.position, fields.nodes.velocity
    inner = np.flatnonzero((np.abs(position[:, 0] + SIZE) < 1e-9) & (np.abs(position[:, 2] - 1.5 * SIZE) < SIZE))
    surface = contact.collisions.surfaces
    assert surface.interior[: len(surface.node) - len(surface.copy_of)].sum() == 2 * 9
    contact.collisions.search()
    step = 1e-7
    velocity[inner, 0] = (1.06 * SIZE) / step  # in one step through its own layer of cells
    position[inner, 0] = 0.06 * SIZE
    contact.collisions.travel = np.inf
    contact.add_forces(step, step, front_near=False)
    assert (contact.force[inner, 0] < 0.0).all()
    assert contact.penetrations.interior_collision == pytest.approx(0.04 * SIZE, rel=0.05)


def test_every_node_of_a_casing_meets_a_plane():
    """A block thrown at a plane of symmetry comes back; nodes inside it and on its surface are held alike."""
    plane = RigidPlane("mirror", (0.0, 0.0, 0.0), (-1.0, 0.0, 0.0), symmetry=True)
    mesh = blocks((4, 4), SIZE, [(-4.05 * SIZE, 0.0)])
    solver = section_burst(mesh, TOUCHING, planes=[plane])
    fields = solver.fields
    (contact,) = solver.contact.planes
    assert len(contact.state.node) == len(fields.mass)
    fields.nodes.velocity[:] = [100.0, 0.0, 0.0]
    before = fields.mass.sum() * 100.0
    run(solver, 1e-5)
    assert fields.nodes.velocity[:, 0] @ fields.mass < -0.5 * before
    impulse = solver.contact.impulse.given()[0]
    assert momentum(solver)[0] - impulse == pytest.approx(before, rel=1e-12)
    assert fields.nodes.position[:, 0].max() < 0.0


def test_a_loaded_spring_of_a_section_gets_no_stiffer_and_so_brings_no_energy_in():
    """The step falls to a quarter while a node lies behind a plane: sixteen times the stiffness otherwise."""
    normal, mass, near = np.array([0.0, 0.0, 1.0]), np.array([2.0]), np.zeros(1, dtype=np.int32)
    stored = {}
    for steady in (False, True):
        state = PlaneState(np.zeros(1, dtype=np.int32), np.zeros((1, 3)), np.zeros(1), np.zeros(1), np.zeros((1, 2)))
        for budget in (1e12, 16e12):
            force = np.zeros((1, 3))
            law = PlaneLaw(normal, 0.0, budget, 1e-8, 0.0, steady)
            push_from_plane(law, near, state, mass, np.array([[0.0, 0.0, -1e-4]]), np.zeros((1, 3)), force)
        stored[steady] = state.energies[0].copy()
        # A softer spring, for a longer step, it takes at once.
        law = PlaneLaw(normal, 0.0, 0.25e12, 1e-8, 0.0, steady)
        push_from_plane(law, near, state, mass, np.array([[0.0, 0.0, -1e-4]]), np.zeros((1, 3)), force)
        assert state.stiffness[0] == pytest.approx(0.25e12 * 2.0)
    assert stored[False][0] == pytest.approx(16.0 * stored[True][0])


def test_metal_within_another_rounds_cells_is_found():
    """A block pushed half a cell into the other: the nodes of its front lie deeper than contact may hold them."""
    solver = two_blocks(0.0, offset=0.5)
    fields = solver.fields
    rounds = [Round("one", TNT, ELASTIC), Round("two", TNT, ELASTIC)]
    mesh = blocks((4, 4), SIZE, [(-4 * SIZE, 0.0), (0.0, 0.5 * SIZE)])
    passage = SectionPassage(mesh, fields, rounds, TOUCHING)
    assert passage.look(0.0).together.sum() == 0.0
    of_node = np.zeros(len(fields.mass), dtype=int)
    of_node[fields.mesh.dofmap] = fields.mesh.round[:, None]
    fields.nodes.position[of_node == 1, 0] -= 0.5 * SIZE
    found = passage.look(0.0)
    cell = ELASTIC.density * SIZE**2
    # Four of five nodes of each front lie within the other block, three with two cells and one with one around them.
    np.testing.assert_allclose(found.in_rounds, (3 * 0.5 + 0.25) * cell, rtol=1e-12)
    fields.nodes.position[of_node == 1, 0] += 0.4 * SIZE
    assert passage.look(0.0).together.sum() == 0.0  # in contact
