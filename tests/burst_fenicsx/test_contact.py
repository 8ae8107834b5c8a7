"""Contact by itself: bars, blocks and balls against closed forms; momentum, energy, symmetry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.contact.forces import Penetrations, max_squared_phase
from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from burst_fenicsx.meshing import cell_volumes, merge
from burst_fenicsx.meshing.cut import split_charges
from burst_fenicsx.problem import ContactSettings, Hourglass, Mirror, RigidPlane, TimeStep
from tests.burst_fenicsx.bodies import BAR, QUIET, ball, bodies, energy, mean_velocity, momentum, moved
from tests.burst_fenicsx.boxes import BARE, ELASTIC, box, grid
from tests.burst_fenicsx.test_sliding import layered

pytestmark = pytest.mark.dolfinx

WAVE = np.sqrt(BAR.elastic_modulus / BAR.density)
CELL, CELLS = 5e-3, 240


def bars(lengths, counts, settings=BARE, speeds=(5.0, 0.0)):
    """Two square bars along x, lengths in cells, a hair apart, with sections of `counts` cells and speeds in m/s."""
    first = moved(box((lengths[0], *counts[0]), (lengths[0] * CELL, 0.02, 0.02)), (-lengths[0] * CELL, 0.0, 0.0))
    second = moved(box((lengths[1], *counts[1]), (lengths[1] * CELL, 0.02, 0.02)), (1e-6, 0.0, 0.0), 1)
    changed = replace(settings, cell_size=CELL, contact=ContactSettings(surface_friction_angle=0.0))
    return bodies([first, second], [(speed, 0.0, 0.0) for speed in speeds], changed, casing=BAR)


@pytest.mark.parametrize("counts", [((2, 2), (2, 2)), ((2, 2), (3, 2))])
def test_equal_bars_exchange_their_velocities(counts):
    """Bars of equal length: the wave returns after 2 L / c, they part, and the first one stands (St. Venant)."""
    solver = bars((CELLS, CELLS), counts)
    start = momentum(solver)
    energy_before = 0.5 * start[0] * 5.0
    struck = np.unique(solver.fields.mesh.dofmap[solver.fields.mesh.round == 1])
    times, forces = [], []
    while solver.time < 1.6 * 2 * CELLS * CELL / WAVE:
        solver.step()
        times.append(solver.time)
        forces.append(solver.contact.force[struck, 0].sum())
    plateau = 0.5 * BAR.density * WAVE * 5.0 * 0.02**2
    pressed = np.array(times)[np.array(forces) > 0.5 * plateau]
    assert pressed[-1] - pressed[0] == pytest.approx(2 * CELLS * CELL / WAVE, rel=0.01)
    during = slice(*np.searchsorted(times, (0.2 * solver.time, 0.5 * solver.time)))
    assert np.mean(forces[during]) == pytest.approx(plateau, rel=0.01)  # about which the springs swing
    assert mean_velocity(solver, 0)[0] == pytest.approx(0.0, abs=0.05)
    assert mean_velocity(solver, 1)[0] == pytest.approx(5.0, rel=0.01)
    assert momentum(solver) == pytest.approx(start, abs=1e-12 * start[0])
    assert energy(solver) == pytest.approx(energy_before, rel=0.01)


def test_a_short_bar_is_thrown_back_by_a_long_one():
    """Head on at the same speed: the bar of half the length leaves with its speed reversed, the long one vibrates."""
    solver = bars((160, 320), ((2, 2), (2, 3)), speeds=(5.0, -5.0))
    while solver.time < 1.5 * 2 * 160 * CELL / WAVE:
        solver.step()
    assert mean_velocity(solver, 0)[0] - 5.0 == pytest.approx(-10.0, rel=0.01)
    assert mean_velocity(solver, 1)[0] == pytest.approx(0.0, abs=0.05)


def test_contact_needs_no_smaller_step():
    """The stable step of the cells rules: twice as long a run of touching bars stays bounded at a CFL of 0.9."""
    fast = replace(BARE, time_step=replace(BARE.time_step, cfl=0.9))
    solver = bars((20, 20), ((4, 4), (3, 3)), fast)
    for _ in range(400):
        solver.step()
    assert energy(solver) == pytest.approx(0.5 * momentum(solver)[0] * 5.0, rel=0.01)


def sliding(settings, meshes, velocities, gravity, hold=None):
    """A block that gravity (m/s2) presses on what lies beneath."""

    def weigh(_, force):
        force[:, 2] -= gravity * solver_mass[0]

    solver_mass = [0.0]
    solver = bodies(meshes, velocities, settings, external=weigh, constraints=hold or ())
    solver_mass[0] = solver.fields.mass
    return solver


GRAVITY = 1e5
FRICTION = np.tan(np.radians(20.0))


def test_a_block_slides_on_a_plane_until_friction_stops_it():
    """Distance v^2 / (2 tan(phi) g), heat m v^2 / 2; it starts with its weight on the springs."""
    ground = RigidPlane("ground", (0.0, 0.0, 0.0), (0.0, 0.0, 2.0))
    settings = replace(QUIET, cell_size=0.01, planes=(ground,), contact=ContactSettings(surfaces=False))
    block = box((4, 4, 2), (0.04, 0.04, 0.02))
    solver = sliding(settings, [block], [(5.0, 0, 0)], GRAVITY)
    solver.step()
    # Equal springs under the bottom's share of the mass carry the whole.
    bottom = solver.fields.start[:, 2] < 1e-9
    stiffness = (0.9 * 4 * (1 - 0.8**2) * 0.4 / solver.time_step**2) * solver.fields.mass[bottom].sum()
    solver.fields.nodes.position[:, 2] -= GRAVITY * solver.fields.mass.sum() / stiffness
    weight = solver.fields.mass.sum()
    deceleration = FRICTION * GRAVITY
    while solver.time < 5.0 / deceleration * 1.3:
        solver.step()
    travelled = (solver.fields.nodes.position - solver.fields.start)[:, 0]
    assert solver.fields.mass @ travelled / weight == pytest.approx(25.0 / (2.0 * deceleration), rel=0.01)
    assert abs(mean_velocity(solver, 0)[0]) < 0.1
    assert solver.contact.friction == pytest.approx(0.5 * weight * 25.0, rel=0.025)


def test_a_block_slides_on_a_slab_until_friction_stops_it():
    """The same on a deformable slab, held at its bottom: friction of point-face contact, nodes sliding over faces."""
    slab = box((10, 6, 2), (0.1, 0.06, 0.02))
    block = moved(box((3, 3, 3), (0.03, 0.03, 0.03)), (0.013, 0.012, 0.02), 1)
    settings = replace(QUIET, cell_size=0.01)
    solver = sliding(settings, [slab, block], [(0, 0, 0), (8.0, 0, 0)], GRAVITY)
    bottom = np.flatnonzero(solver.fields.start[:, 2] < 1e-9)
    solver.constraints = tuple(NodalConstraint(bottom, axis) for axis in np.eye(3))
    deceleration = FRICTION * GRAVITY
    block_nodes = np.unique(solver.fields.mesh.dofmap[solver.fields.mesh.round == 1])
    while solver.time < 8.0 / deceleration * 1.3:
        solver.step()
    moved_by = (solver.fields.nodes.position - solver.fields.start)[block_nodes, 0]
    mass = solver.fields.mass[block_nodes]
    assert mass @ moved_by / mass.sum() == pytest.approx(64.0 / (2.0 * deceleration), rel=0.015)
    # The rest of its energy is in the block's and the slab's vibrations.
    assert solver.contact.friction == pytest.approx(0.5 * mass.sum() * 64.0, rel=0.025)
    assert abs(mean_velocity(solver, 1)[0]) < 0.3


def test_a_block_rests_where_friction_holds_it():
    """On a slope below the friction angle it creeps no more than its springs give."""
    slope = np.radians(15.0)
    plane = RigidPlane("slope", (0.0, 0.0, 0.0), (-np.sin(slope), 0.0, np.cos(slope)))
    turn = np.array([[np.cos(slope), 0, np.sin(slope)], [0, 1, 0], [-np.sin(slope), 0, np.cos(slope)]])
    block = box((3, 3, 2), (0.03, 0.03, 0.02))
    block = replace(block, nodes=block.nodes @ turn)
    settings = replace(QUIET, cell_size=0.01, planes=(plane,), damping=2e4, contact=ContactSettings(surfaces=False))
    for angle, holds in ((20.0, True), (10.0, False)):
        changed = replace(settings, planes=(replace(plane, friction_angle=angle),))
        solver = sliding(changed, [block], [(0, 0, 0)], GRAVITY)
        while solver.time < 3e-4:
            solver.step()
        speed = np.linalg.norm(mean_velocity(solver, 0))
        assert (speed < 0.02) == holds


SOFT = replace(ELASTIC, elastic_modulus=2e9)
MIRROR = Mirror("mirror", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))


def test_a_ball_bounces_as_hertz_says():
    """Contact time 2.868 (m^2 / (R E*^2 v))^(1/5) (Hertz 1882; Johnson 1985, Eq. 11.24) and nearly all of its speed."""
    radius, speed, count = 0.03, 5.0, 16
    settings = replace(QUIET, cell_size=2 * radius / count, planes=(MIRROR,), hourglass=Hourglass(casing_viscous=0.0))
    solver = bodies([moved(ball(count, radius), (radius + 1e-5, 0.0, 0.0))], [(-speed, 0, 0)], settings, casing=SOFT)
    mass = solver.fields.mass.sum()
    modulus = SOFT.elastic_modulus / (1.0 - SOFT.poisson_ratio**2)
    hertz = 2.868 * (mass**2 / (radius * modulus**2 * speed)) ** 0.2
    touched = []
    while solver.time < 1.5 * hertz:
        solver.step()
        if solver.contact.spring_energy > 0.0:
            touched.append(solver.time)
    assert touched[-1] - touched[0] == pytest.approx(hertz, rel=0.05)
    assert 0.95 * speed < mean_velocity(solver, 0)[0] <= speed
    # Strains under the patch reach a tenth, where the rate form of Hooke's law keeps its energy to second order only.
    assert energy(solver) == pytest.approx(0.5 * mass * speed**2, rel=0.02)


def test_a_ball_bounces_from_its_twin_as_from_a_mirror():
    """The plane of symmetry stands for the mirrored body: the same velocity to 1 %, and the twin's to round-off."""
    one = moved(ball(8, 0.03), (0.03001, 0.0, 0.0))
    other = replace(one, nodes=one.nodes * [-1, 1, 1], cells=one.cells[:, [1, 0, 3, 2, 5, 4, 7, 6]])
    settings = replace(QUIET, cell_size=0.0075)
    mirrored = bodies([one], [(-20.0, 0, 0)], replace(settings, planes=(MIRROR,)), casing=SOFT)
    pair = bodies([one, moved(other, (0, 0, 0), 1)], [(-20.0, 0, 0), (20.0, 0, 0)], settings, casing=SOFT)
    for solver in (mirrored, pair):
        while solver.time < 7e-4:
            solver.step()
    speed = mean_velocity(pair, 0)[0]
    assert mean_velocity(mirrored, 0)[0] == pytest.approx(speed, rel=0.01)
    assert speed > 15.0
    assert mean_velocity(pair, 1)[0] == pytest.approx(-speed, rel=1e-9)
    assert np.abs(momentum(pair)).max() < 1e-12 * pair.fields.mass.sum() * 20.0


def test_an_oblique_hit_with_friction_keeps_momentum_and_closes_the_ledger():
    """Two blocks of different meshes, off centre, with friction: of 1.6 % that is left open contact makes a quarter."""
    first = moved(box((5, 4, 4), (0.05, 0.04, 0.04)), (-0.0501, 0.0, 0.0))
    second = moved(box((4, 5, 3), (0.04, 0.05, 0.04)), (0.0, 0.011, 0.007), 1)
    settings = replace(QUIET, cell_size=0.01)
    solver = bodies([first, second], [(30.0, 12.0, 0.0), (-10.0, 0.0, 0.0)], settings)
    start, before = momentum(solver), energy(solver)
    size = np.abs(solver.fields.mass[:, None] * solver.fields.nodes.velocity).sum()
    while solver.time < 8e-5:
        solver.step()
    assert mean_velocity(solver, 0)[0] < 10.0 < mean_velocity(solver, 1)[0]  # they have hit
    assert solver.contact.friction > 0.005 * before
    assert np.abs(momentum(solver) - start).max() < 1e-12 * size
    assert 0.0 < solver.contact.gain < 0.005 * before
    assert energy(solver) == pytest.approx(before, rel=0.02)


def test_swapping_the_bodies_changes_nothing():
    """Which body comes first in the mesh does not matter beyond round-off."""
    first = box((4, 4, 4), (0.04, 0.04, 0.04))
    second = moved(box((3, 3, 3), (0.04, 0.04, 0.04)), (0.0402, 0.005, 0.003))
    settings = replace(QUIET, cell_size=0.01)
    ways = []
    for order in ((0, 1), (1, 0)):
        meshes = [(first, second)[k] for k in order]
        speeds = [((20.0, 5.0, 0.0), (-20.0, 0.0, 0.0))[k] for k in order]
        solver = bodies([moved(mesh, (0, 0, 0), k) for k, mesh in enumerate(meshes)], speeds, settings)
        while solver.time < 4e-5:
            solver.step()
        ways.append([mean_velocity(solver, order.index(k)) for k in (0, 1)])
    assert np.allclose(ways[0], ways[1], rtol=1e-9, atol=1e-9)


def test_touching_surfaces_are_found_wherever_they_meet():
    """A rod driven into the side of a plate far from any node stops and the plate takes its momentum."""
    plate = box((3, 12, 12), (0.03, 0.12, 0.12))
    rod = moved(box((8, 1, 1), (0.08, 0.009, 0.009)), (-0.0802, 0.0643, 0.0587), 1)
    solver = bodies([plate, rod], [(0, 0, 0), (10.0, 0, 0)], replace(QUIET, cell_size=0.01))
    while solver.time < 1e-4:
        solver.step()
    tip = solver.fields.nodes.position[np.unique(solver.fields.mesh.dofmap[solver.fields.mesh.round == 1]), 0].max()
    assert tip < 1e-3
    assert mean_velocity(solver, 1)[0] < 1.0


def bent_strip():
    """A strip bent to a U: two legs 4 mm apart, 2 mm thick and 30 mm long, joined by half a circle."""
    arc = np.pi * 3e-3

    def carry(points):
        along = points[:, 0] * (0.06 + arc)
        radius = 4e-3 - 2e-3 * points[:, 2]
        angle = np.clip((along - 0.03) / arc, 0.0, 1.0) * np.pi
        straight = np.maximum(0.03 - along, 0.0) + np.maximum(along - 0.03 - arc, 0.0)
        return np.stack([-radius * np.cos(angle), 4e-3 * points[:, 1], straight - radius * np.sin(angle)], axis=1)

    return grid((36, 2, 1), carry)


def test_a_body_that_folds_meets_itself():
    """A U whose legs are driven together: they stop each other instead of passing through."""
    mesh = bent_strip()
    assert cell_volumes(mesh).min() > 0.0
    solver = bodies([mesh], [(0, 0, 0)], replace(QUIET, cell_size=2e-3))
    left = (solver.fields.start[:, 0] < -1e-3) & (solver.fields.start[:, 2] > 0.01)
    right = (solver.fields.start[:, 0] > 1e-3) & (solver.fields.start[:, 2] > 0.01)
    solver.fields.nodes.velocity[left, 0] = 60.0
    solver.fields.nodes.velocity[right, 0] = -60.0
    crossed = 0.0
    while solver.time < 8e-5:
        solver.step()
        position = solver.fields.nodes.position
        crossed = max(crossed, position[left, 0].min() - position[right, 0].max() + 4e-3)
    assert solver.contact.penetrations.collision > 0.0
    assert crossed < 0.2e-3  # a tenth of a cell


def test_merging_keeps_twins():
    """Pairs of split nodes are renumbered with their round."""
    one = split_charges(layered())
    both = merge([replace(one, segments=((),)), moved(one, (1.0, 0, 0), 1)])
    first, second = both.nodes[both.interface_pairs[:, 0]], both.nodes[both.interface_pairs[:, 1]]
    assert len(both.interface_pairs) == 2 * len(one.interface_pairs) > 0
    assert np.array_equal(first, second)


@pytest.mark.parametrize("cfl", [0.2, 0.5, 0.8, 0.95])
def test_springs_and_cells_together_stay_stable_and_use_nearly_all(cfl):
    """(omega dt)^2 of the cells, 4 c^2, and of the springs add up to less than 4: to nine tenths of what is left."""
    left = 4.0 - 4.0 * cfl**2
    assert 0.85 * left < max_squared_phase(TimeStep(cfl=cfl)) < 0.95 * left


def test_penetrations_of_the_interface_are_the_largest_so_far():
    found = Penetrations()
    for depth, near in ((3.0, True), (5.0, False), (2.0, True), (4.0, False)):
        found.at_interface(depth, front_is_active=near)
    assert found == Penetrations(interface_at_front=3.0, interface_after=5.0)
    assert found.largest == 5.0
