"""Contact by itself: bars, blocks and balls against closed forms; momentum, energy; rigid planes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.contact.forces import max_squared_phase
from burst_fenicsx.contact.planes import held_in_plane
from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from burst_fenicsx.meshing import cell_volumes, merge
from burst_fenicsx.meshing.cut import cut_mesh, split_charges
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


def test_contact_needs_no_smaller_step():
    """The stable step of the cells rules: twice as long a run of touching bars stays bounded at a CFL of 0.9."""
    fast = replace(BARE, time_step=replace(BARE.time_step, cfl=0.9))
    solver = bars((20, 20), ((4, 4), (3, 3)), fast)
    for _ in range(400):
        solver.step()
    assert energy(solver) == pytest.approx(0.5 * momentum(solver)[0] * 5.0, rel=0.01)


def sliding(settings, meshes, velocities):
    """A block that `GRAVITY` presses on what lies beneath."""

    def weigh(_, force):
        force[:, 2] -= GRAVITY * solver_mass[0]

    solver_mass = [0.0]
    solver = bodies(meshes, velocities, settings, external=weigh)
    solver_mass[0] = solver.fields.mass
    return solver


GRAVITY = 1e5  # m/s2
FRICTION = np.tan(np.radians(20.0))


def test_a_block_slides_on_a_slab_until_friction_stops_it():
    """The same on a deformable slab, held at its bottom: friction of point-face contact, nodes sliding over faces."""
    slab = box((10, 6, 2), (0.1, 0.06, 0.02))
    block = moved(box((3, 3, 3), (0.03, 0.03, 0.03)), (0.013, 0.012, 0.02), 1)
    settings = replace(QUIET, cell_size=0.01)
    solver = sliding(settings, [slab, block], [(0, 0, 0), (8.0, 0, 0)])
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
        solver = sliding(changed, [block], [(0, 0, 0)])
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


WALL = RigidPlane("wall", (0.0, 0.0, 0.0), (0.0, 0.0, 2.0))
STEP = 1e-6


def against(mesh, velocity=(0.0, 0.0, 0.0), plane=WALL):
    """A body that only a plane can meet."""
    settings = replace(QUIET, cell_size=2e-3, contact=ContactSettings(surfaces=False), planes=(plane,))
    return bodies([mesh], [velocity], settings)


@pytest.mark.parametrize("height", [0.025, 0.012, 0.005])
def test_a_plane_pushes_every_node_that_is_through_it(height):
    """Surface nodes and the one within, by equal springs to their masses; dragged along, with friction."""
    plane = replace(WALL, point=(0.0, 0.0, height), friction_angle=20.0)
    solver = against(box((2, 2, 2), (0.02,) * 3), (2e4, 0.0, 0.0), plane)
    contact, fields = solver.contact, solver.fields
    contact.add_forces(STEP, 0.0, front_is_active=False)
    contact.add_forces(STEP, STEP, front_is_active=False)
    depth = height - fields.nodes.position[:, 2]
    through = depth > 0.0
    assert through.sum() == (27 if height > 0.02 else 18 if height > 0.01 else 9)
    np.testing.assert_array_equal(contact.force[:, 2] > 0.0, through)
    np.testing.assert_array_equal(contact.force[~through], 0.0)
    ratio = contact.force[through, 2] / (depth * fields.mass)[through]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)
    np.testing.assert_allclose(contact.force[:, 0], -np.tan(np.radians(20.0)) * contact.force[:, 2], rtol=1e-9)
    (wall,) = contact.planes
    assert wall.given == pytest.approx(contact.force.sum(axis=0), rel=1e-12)  # an exact sum of rounded terms
    assert wall.deepest == pytest.approx(height, rel=1e-12)
    assert wall.deepest_inner == pytest.approx(max(height - 0.01, 0.0), abs=1e-12)


@pytest.mark.parametrize(("seen", "speed"), [(0.0, 1e4), (3e3, 1e4), (2e4, 4e4)])
def test_no_node_reaches_a_plane_unseen(seen, speed):
    """Layer by layer, in steps of any size, at 10 km/s or at twice the speed seen when one looked: pushed at once."""
    solver = against(moved(box((1, 1, 800), (0.002, 0.002, 0.2)), (0.0, 0.0, 0.011)), (0.0, 0.0, -seen))
    contact, nodes, random = solver.contact, solver.fields.nodes, np.random.default_rng(4)
    (plane,) = contact.planes
    numbers = []
    while nodes.position[:, 2].max() > 0.0:
        step = random.choice([1.2e-4, 5.2e-4, 1.9e-3]) * random.uniform(0.8, 1.0) / speed
        nodes.position[:, 2] -= step * speed
        contact.add_forces(1e-6, step, front_is_active=False)
        np.testing.assert_array_equal(contact.force[:, 2] > 0.0, nodes.position[:, 2] < 0.0)
        numbers.append(len(plane.near))
    assert numbers[0] == 0
    assert len(set(numbers)) > 30  # few at a time are looked after


@pytest.mark.parametrize(("speed", "steps"), [(100.0, 51), (1000.0, 6)])
def test_surfaces_are_searched_again_before_two_of_them_can_have_met(speed, steps):
    """Each of two comes nearer by the largest speed: the reach of 10 mm is passed by both within half as many steps."""
    pair = [box((1, 1, 1), (0.01,) * 3), moved(box((1, 1, 1), (0.01,) * 3), (0.05, 0.0, 0.0), 1)]
    solver = bodies(pair, [(0.0, 0.0, 0.0), (0.0, 0.6 * speed, 0.8 * speed)], replace(QUIET, cell_size=0.01))
    collisions = solver.contact.collisions
    assert collisions.search_is_due(0.0, collisions.fastest)  # none has been made yet
    for _ in range(2):
        collisions.search()
        due = [collisions.search_is_due(STEP, collisions.fastest) for _ in range(steps)]
        assert due == [False] * (steps - 1) + [True]
    collisions.search()
    solver.fields.nodes.velocity[:] = 0.0
    assert not any(collisions.search_is_due(STEP, collisions.fastest) for _ in range(100))


def test_a_fixed_step_leaves_the_springs_less_than_a_fifth():
    """It may be near the stable one, whatever the CFL number says."""
    budget = max_squared_phase(TimeStep(fixed=1e-9, cfl=0.1))
    assert budget == max_squared_phase(TimeStep(fixed=1e-7, cfl=0.9))
    assert budget == pytest.approx(max_squared_phase(TimeStep(cfl=0.9)), rel=1e-12)
    assert budget < 4.0 / 5.0


@pytest.mark.parametrize("planes", [(), (WALL,)])
def test_surfaces_and_planes_share_the_budget(planes, monkeypatch):
    """Where both push one node its springs are as stiff together as one of them alone; neither gets next to nothing."""
    pair = [moved(box((1, 1, 1), (0.01,) * 3), (x, 0.0, 0.02), k) for k, x in enumerate((0.0, 0.02))]
    contact = bodies(pair, [(0.0, 0.0, 0.0)] * 2, replace(QUIET, cell_size=0.01, planes=planes)).contact
    budgets = []
    for part in (contact.collisions, *contact.planes):
        monkeypatch.setattr(part, "add_forces", lambda budget, _: budgets.append(budget))
    contact.add_forces(np.sqrt(max_squared_phase(QUIET.time_step) / 8.0), 0.0, front_is_active=False)
    assert len(budgets) == 1 + len(planes)
    assert sum(budgets) == pytest.approx(8.0, rel=1e-12)
    assert min(budgets) > 8.0 / 3.0


def test_the_impulse_of_a_force_that_grows_evenly_is_exact(monkeypatch):
    """F = a t from rest: a t^2 / 2, by steps of any size."""
    contact, growth, time = against(box((1, 1, 1), (0.01,) * 3)).contact, np.array([2e9, -1e9, 5e8]), 0.0
    (plane,) = contact.planes
    monkeypatch.setattr(plane, "add_forces", lambda *_: None)
    for step in [1e-6, 3e-6, 0.5e-6, 2e-6, 2e-6]:
        time += step
        plane.given = growth * time
        contact.add_forces(STEP, step, front_is_active=False)
        assert contact.impulse == pytest.approx(0.5 * growth * time**2, rel=1e-12)


def test_what_a_plane_of_symmetry_holds_still_meets_the_deck_on_which_it_stands():
    """Half of a box on a deck: its nodes in the middle plane are held there, and no node in the deck."""
    middle, deck = (
        Mirror("middle", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        RigidPlane("deck", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    )
    whole = moved(box((4, 2, 2), (0.04, 0.02, 0.02)), (-0.02, 0.0, 0.0))
    mesh = cut_mesh(replace(whole, held=None), (middle,))
    nodes = np.arange(len(mesh.nodes))
    on_deck = mesh.nodes[:, 2] == 0.0
    np.testing.assert_array_equal(held_in_plane(mesh, nodes, middle), np.abs(mesh.nodes[:, 0]) < 1e-12)
    assert (on_deck & (mesh.held != 0)).sum() == 3
    assert not held_in_plane(mesh, nodes, deck).any()
