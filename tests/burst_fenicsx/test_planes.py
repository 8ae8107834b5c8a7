"""Rigid planes and the margins of contact: whom they push, with what force and impulse, and when one looks again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.contact.forces import max_squared_phase
from burst_fenicsx.contact.planes import held_in_plane
from burst_fenicsx.meshing.cut import cut_mesh
from burst_fenicsx.problem import ContactSettings, Mirror, RigidPlane, TimeStep
from tests.burst_fenicsx.bodies import QUIET, bodies, moved
from tests.burst_fenicsx.boxes import box

pytestmark = pytest.mark.dolfinx

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
    assert wall.deepest_interior == pytest.approx(max(height - 0.01, 0.0), abs=1e-12)


@pytest.mark.parametrize(("seen", "speed"), [(0.0, 1e4), (3e3, 1e4), (2e4, 4e4)])
def test_no_node_reaches_a_plane_unseen(seen, speed):
    """Layer by layer, in steps of any size, at 10 km/s or at twice the speed seen when one looked: pushed at once."""
    solver = against(moved(box((1, 1, 800), (0.002, 0.002, 0.2)), (0.0, 0.0, 0.011)), (0.0, 0.0, -seen))
    (plane,), nodes, random = solver.contact.planes, solver.fields.nodes, np.random.default_rng(4)
    numbers = []
    while nodes.position[:, 2].max() > 0.0:
        step = random.choice([1.2e-4, 5.2e-4, 1.9e-3]) * random.uniform(0.8, 1.0) / speed
        nodes.position[:, 2] -= step * speed
        force = np.zeros_like(nodes.force)
        plane.add_forces(1e10, step, nodes.velocity, force)
        np.testing.assert_array_equal(force[:, 2] > 0.0, nodes.position[:, 2] < 0.0)
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
    monkeypatch.setattr(contact.collisions, "find_forces", lambda budget, _: [budgets.append(budget)][:0])
    for plane in contact.planes:
        monkeypatch.setattr(plane, "add_forces", lambda budget, *_: budgets.append(budget))
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
