"""One spring of contact, and one of a rigid plane: stiffness, friction and heat against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from burst_fenicsx.kernels.contact.planes import PlaneLaw, PlaneState, push_from_plane
from burst_fenicsx.kernels.contact.springs import CollisionLaw, Collisions, add_reactions, push_node, weigh_corners

BUDGET, STEP, FRICTION = 4e12, 1e-7, 0.36
DEPTH, SPEED = 1e-5, 40.0


def one_node_on_a_face(xi, eta):
    """State of a node (number 4) that lies on a face of the nodes 0 to 3, at a point of it."""
    state = Collisions(
        node=np.array([4], dtype=np.int32), other=np.zeros(1, dtype=np.int32), first=np.array([0, 1]),
        candidate=np.zeros(1, dtype=np.int32), faces=np.array([[0, 1, 2, 3]], dtype=np.int32),
        node_round=np.array([0, 0, 0, 0, 1], dtype=np.int32), edge=np.ones(1), near=np.zeros(1, dtype=np.int32),
        ball=np.zeros((1, 5)), bound=np.zeros((1, 20)), outward=np.zeros((5, 3)), sharing=np.zeros(5),
        touching=np.zeros(1, dtype=bool), normal=np.zeros((1, 3)), slip=np.zeros((1, 3)), penetration=np.zeros(1),
        unloaded=np.zeros(1), stiffness=np.zeros(1),
        face=np.full(1, -1, dtype=np.int32), weight=np.zeros((1, 4)), push=np.zeros((1, 4)), energies=np.zeros((1, 2)),
    )  # fmt: skip
    weigh_corners(xi, eta, state.weight[0])
    return state


@pytest.mark.parametrize("point", [(0.0, 0.0), (0.6, -0.3), (-1.0, 1.0)])
def test_the_reduced_mass_is_the_force_over_the_acceleration_of_the_gap(point):
    """A force between the node and the point of the face accelerates the one against the other by F / m_red."""
    state, mass = one_node_on_a_face(*point), np.array([0.3, 0.7, 0.2, 0.5, 0.4])
    normal = np.array([0.0, 0.6, 0.8])
    push_node(0, 0, DEPTH, normal, np.zeros(3), CollisionLaw(BUDGET, STEP, FRICTION), state, mass)
    sums = np.zeros((5, 4))
    add_reactions(state, mass, 1e3, 1e3, sums)
    force = np.linalg.norm(state.push[0, :3])
    acceleration = sums[:, :3] @ normal / mass
    apart = acceleration[4] - state.weight[0] @ acceleration[:4]
    assert state.push[0, 3] == pytest.approx(force / apart, rel=1e-5)
    assert sums[:, :3].sum(axis=0) == pytest.approx(0.0, abs=1e-12 * force)
    # The springs' own frequency: two equal grids share the budget, of which one node has 1 / 1.6 halves.
    assert force == pytest.approx(0.5 * BUDGET / 1.6 * state.push[0, 3] * DEPTH, rel=1e-12)


def test_friction_of_a_face_heats_by_its_force_times_the_way():
    """Dragged along at constant depth: after the spring has given way the heat is mu N v dt in every step."""
    state, mass = one_node_on_a_face(0.2, 0.1), np.full(5, 0.4)
    law, normal, along = CollisionLaw(BUDGET, STEP, FRICTION), np.array([0.0, 0.0, 1.0]), np.array([0.6, 0.8, 0.0])
    heat, work = [], 0.0
    for _ in range(30):
        state.energies[:] = 0.0
        old = state.push[0, :3].copy()
        push_node(0, 0, DEPTH, normal, SPEED * along, law, state, mass)
        heat.append(state.energies[0, 1])
        work -= 0.5 * (old + state.push[0, :3]) @ along * SPEED * STEP
    press = state.push[0, 2]
    assert state.push[0, :3] == pytest.approx(press * np.array([-0.6 * FRICTION, -0.8 * FRICTION, 1.0]), rel=1e-12)
    assert heat[0] == 0.0 or heat[0] < heat[-1]
    assert heat[-1] == pytest.approx(FRICTION * press * SPEED * STEP, rel=1e-12)
    slip = np.linalg.norm(state.slip[0])
    assert sum(heat) + 0.5 * state.stiffness[0] * slip**2 == pytest.approx(work, rel=1e-12)


def pushed(normal, velocity, steps=30):
    """Forces (3,), stored energy and heat of each step of a node that is dragged along a plane at constant depth."""
    state = PlaneState(np.zeros(1, dtype=np.int32), np.zeros((1, 3)), np.zeros(1), np.zeros(1), np.zeros((1, 2)))
    law = PlaneLaw(np.asarray(normal, dtype=float), 0.0, BUDGET, STEP, FRICTION)
    position, mass, heat = -DEPTH * np.asarray(normal, dtype=float)[None], np.array([0.4]), []
    force, near = np.zeros((1, 3)), np.zeros(1, dtype=np.int32)
    for _ in range(steps):
        force[:] = 0.0
        push_from_plane(law, near, state, mass, position, np.asarray(velocity, dtype=float)[None], force)
        heat.append(state.energies[0, 1])
    return force[0], state.energies[0, 0], np.array(heat)


def test_friction_of_a_plane_heats_by_its_force_times_the_way():
    force, _, heat = pushed((0.0, 0.0, 1.0), (0.6 * SPEED, 0.8 * SPEED, 0.0))
    press = BUDGET * 0.4 * DEPTH
    assert force == pytest.approx(press * np.array([-0.6 * FRICTION, -0.8 * FRICTION, 1.0]), rel=1e-12)
    assert heat[-1] == pytest.approx(FRICTION * press * SPEED * STEP, rel=1e-12)


def test_a_plane_rubs_alike_whichever_way_it_faces():
    """Turned as a whole, plane and motion give the turned force: axes by turns, and a skew rotation."""
    normal, velocity = np.array([0.0, 0.0, 1.0]), SPEED * np.array([0.6, 0.8, 0.1])
    force, stored, heat = pushed(normal, velocity)
    skew, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))
    for turn in (np.eye(3)[[1, 2, 0]], np.eye(3)[[2, 0, 1]], skew * np.linalg.det(skew)):
        other, also, warmth = pushed(turn @ normal, turn @ velocity)
        assert other == pytest.approx(turn @ force, rel=1e-9, abs=1e-9 * np.linalg.norm(force))
        assert also == pytest.approx(stored, rel=1e-9)
        np.testing.assert_allclose(warmth, heat, rtol=1e-9, atol=1e-15)
