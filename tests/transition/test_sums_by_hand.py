"""Sums of casings and rings, the ledger and what a meridian must hold, on bodies small enough for a sheet of paper."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from flight.fragments import Fragments
from transition import InputError
from transition.cells.meridian import HalfPlane
from transition.cells.meridian_checks import check_meridian
from transition.cells.shape_functions import CORNERS
from transition.ledger import casing_sums, ledger, ring_sums
from transition.placement.isometry import Isometry, rotation

UPRIGHT = HalfPlane(np.zeros(3), np.eye(3))


def square(size, place=(0.0, 0.0)):
    """One quadrilateral of the half plane y = 0, counter-clockwise, as nodes (4, 3) and their cell."""
    flat = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]) * size + place
    return np.column_stack([flat[:, 0], np.zeros(4), flat[:, 1]]), np.array([[0, 1, 2, 3]])


def check(size=0.5, mass=1.0, stretch=1.0, moved=None, spin=0.0):
    """Check a ring (inner radius 0, outer `size`, as high as wide) of density 1000 kg/m3."""
    reference, cells = square(size)
    nodes = {"reference": reference, "position": stretch * reference, "velocity": 100.0 * reference + [0.0, 0.0, 5.0]}
    for name, offset in (moved or {}).items():
        nodes[name] = nodes[name] + [0.0, offset, 0.0]
    nodes["velocity"][1, 1] = spin
    whole = 1000.0 * np.pi * size**3
    check_meridian("file", UPRIGHT, nodes, cells, np.array([mass * whole]), np.array([True]), 1000.0)


def test_a_node_may_leave_the_half_plane_by_a_billionth_of_the_largest_coordinate():
    """Before the burst by that before the burst; now by the larger of both, as a casing grows."""
    for size in (0.5, 3.0):
        check(size, moved={"reference": 0.9e-9 * size, "position": 0.9e-9 * size})
        check(size, stretch=2.0, moved={"position": 1.9e-9 * size})
        check(size, stretch=0.5, moved={"position": 0.9e-9 * size})
        for moved in ({"reference": 1.1e-9 * size}, {"position": -1.1e-9 * size}):
            with pytest.raises(InputError, match="outside the half plane"):
                check(size, moved=moved)
        with pytest.raises(InputError, match="position of node 0 lies"):
            check(size, stretch=2.0, moved={"position": 2.1e-9 * size})


def test_a_ring_may_turn_by_a_billionth_of_the_largest_speed():
    fastest = 100.0 * 0.5 + 5.0
    check(spin=0.9e-9 * fastest)
    with pytest.raises(InputError, match=r"node 1 has a velocity of .* m/s across the half plane"):
        check(spin=1.1e-9 * fastest)


@pytest.mark.parametrize(("share", "refused"), [(0.951, False), (1.049, False), (0.949, True), (1.051, True)])
def test_masses_must_be_those_of_whole_rings_to_a_twentieth(share, refused):
    if refused:
        with pytest.raises(InputError, match="cells/mass must be that of whole rings"):
            check(mass=share)
    else:
        check(mass=share)


def test_a_round_may_reach_to_its_axis_but_not_beyond():
    nodes, cells = square(0.5, (-0.9e-9 * 0.5, 0.0))
    still = {"reference": nodes, "position": nodes, "velocity": np.ones((4, 3)) * [1.0, 0.0, 1.0]}
    masses = np.array([1000.0 * np.pi * 0.125]), np.array([True])
    check_meridian("file", UPRIGHT, still, cells, *masses, 1000.0)
    beyond = nodes - [0.2e-9, 0.0, 0.0]
    with pytest.raises(InputError, match="beyond the axis"):
        check_meridian("file", UPRIGHT, still | {"reference": beyond}, cells, *masses, 1000.0)


def test_sums_of_a_ring_that_flies_as_one():
    """A thin ring about an axis askew: m v, m v2 / 2, m |v| and m |x| |v|, with |x| of all points of its circle."""
    frame = np.array([[0.6, 0.8, 0.0], [0.0, 0.0, -1.0], [-0.8, 0.6, 0.0]])
    half, radius, height = HalfPlane(np.array([1.0, -2.0, 0.5]), frame), 0.4, 1.5
    state = np.tile([radius, height, 30.0, 40.0], (1, 4, 1))
    found = ring_sums(np.array([2.0]), np.array([[0.1, 0.2, 0.3, 0.4]]), state, half)
    assert found.mass == 2.0
    assert found.momentum == pytest.approx(2.0 * 40.0 * frame[2], rel=1e-12)
    assert found.scale == pytest.approx(2.0 * 50.0, rel=1e-12)
    assert found.energy == found.cell_energy == pytest.approx(0.5 * 2.0 * 50.0**2, rel=1e-12)
    assert found.angular_momentum == pytest.approx(np.cross(half.origin, found.momentum), rel=1e-12)
    turn = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)[:, None]
    circle = half.origin + height * frame[2] + radius * (np.cos(turn) * frame[0] + np.sin(turn) * frame[1])
    distance = math.sqrt((circle**2).sum(axis=1).mean())
    assert found.angular_scale == pytest.approx(2.0 * distance * 50.0, rel=1e-12)


def test_sums_of_rings_are_by_their_nodes():
    """Two rings whose nodes move apart: the energy of the nodes, and that of their mean for the rings as one piece."""
    state = np.zeros((2, 4, 4))
    state[..., 0], state[0, :, 3], state[1, :, 3] = 1.0, [10.0, -10.0, 10.0, -10.0], [5.0, 5.0, -3.0, -3.0]
    shares = np.array([[0.25] * 4, [0.1, 0.2, 0.3, 0.4]])
    found = ring_sums(np.array([1.0, 2.0]), shares, state, UPRIGHT)
    mean = 0.3 * 5.0 - 0.7 * 3.0
    assert found.energy == pytest.approx(0.5 * (100.0 + 2.0 * (0.3 * 25.0 + 0.7 * 9.0)), rel=1e-12)
    assert found.cell_energy == pytest.approx(0.5 * 2.0 * mean**2, rel=1e-12)
    assert found.momentum == pytest.approx([0.0, 0.0, 2.0 * mean], rel=1e-12)
    assert found.scale == pytest.approx(10.0 + 2.0 * (0.3 * 5.0 + 0.7 * 3.0), rel=1e-12)


def test_sums_of_cells_that_fly_as_one_or_spin():
    """A cube of edge 2 b that turns about an axis through its centre: the moment of inertia is m (2 b)^2 / 6."""
    corners = 0.3 * CORNERS[None]
    spin = np.array([0.0, 0.0, 50.0])
    turning = casing_sums(np.array([4.0]), corners, np.cross(spin, corners))
    inertia = 4.0 * 0.6**2 / 6.0
    assert turning.angular_momentum == pytest.approx(inertia * spin, rel=1e-12, abs=1e-12)
    assert turning.momentum == pytest.approx(np.zeros(3), abs=1e-12)
    assert turning.cell_energy == pytest.approx(0.0, abs=1e-12)
    speed = 50.0 * 0.3 * math.sqrt(2.0)  # of every corner
    assert turning.energy == pytest.approx(0.5 * 4.0 * speed**2, rel=1e-12)
    assert turning.scale == pytest.approx(4.0 * speed, rel=1e-12)
    assert turning.angular_scale == pytest.approx(4.0 * speed * 0.3 * math.sqrt(3.0), rel=1e-12)
    place_, velocity = np.array([3.0, -1.0, 2.0]), np.array([10.0, 20.0, -30.0])
    flying = casing_sums(np.array([4.0]), corners + place_, np.broadcast_to(velocity, (1, 8, 3)))
    assert flying.angular_momentum == pytest.approx(4.0 * np.cross(place_, velocity), rel=1e-12)
    assert flying.energy == flying.cell_energy == pytest.approx(2.0 * 1400.0, rel=1e-12)
    both = turning + flying
    assert both.mass == 8.0
    assert both.scale == turning.scale + flying.scale
    assert both.momentum == pytest.approx(4.0 * velocity)


def test_sums_move_with_the_casing():
    """Turned and shifted, or mirrored: as the sums of the cells there; momentum across the shift turns as well."""
    generator = np.random.default_rng(4)
    corners, velocity = CORNERS + generator.uniform(-0.3, 0.3, (5, 8, 3)), generator.normal(size=(5, 8, 3))
    mass = generator.uniform(1.0, 2.0, 5)
    here = casing_sums(mass, corners, velocity)
    mirror = Isometry(np.diag([-1.0, 1.0, 1.0]), np.array([0.8, 0.0, 0.0]))
    for motion in (rotation((1.0, 2.0, -0.5), (0.3, -0.2, 1.0), 0.7), mirror):
        there = casing_sums(mass, motion.place(corners), motion.vector(velocity))
        if motion is mirror:  # corners in the order of a mirrored cell are no cell; the field is the same
            assert np.linalg.det(motion.matrix) == pytest.approx(-1.0)
        moved = here.moved(motion)
        assert moved.momentum == pytest.approx(there.momentum, rel=1e-12)
        assert moved.angular_momentum == pytest.approx(there.angular_momentum, rel=1e-11)
        assert moved.energy == here.energy


def test_a_ledger_by_hand():
    """Two fragments against a casing that had more of everything."""
    fragments = Fragments.from_arrays([1.0, 3.0], [(0, 0, 2.0), (1.0, 0, 0)], [(5.0, 0, 0), (0, 2.0, 0)])
    spin = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.5]])
    casing = casing_sums(np.array([5.0]), CORNERS[None] * 0.0, np.broadcast_to([6.0, 7.0, 0.0], (1, 8, 3)))
    casing = replace(casing, angular_momentum=np.array([0.0, 9.0, 5.0]), angular_scale=20.0, scale=50.0)
    found = ledger(fragments, spin, casing)
    assert (found.mass, found.casing_mass) == (4.0, 5.0)
    assert found.mass_error == pytest.approx(-0.2)
    assert found.momentum == (5.0, 6.0, 0.0)
    assert found.casing_momentum == (30.0, 35.0, 0.0)
    assert found.momentum_error == pytest.approx(math.hypot(25.0, 29.0) / 50.0)
    # (0, 0, 2) x (5, 0, 0) = (0, 10, 0) and 3 (1, 0, 0) x (0, 2, 0) = (0, 0, 6)
    assert found.angular_momentum == (0.0, 10.0, 6.0)
    assert found.spin == (0.0, 1.0, 0.5)
    assert found.angular_momentum_error == pytest.approx(math.hypot(2.0, 1.5) / 20.0)
    assert found.energy == pytest.approx(0.5 * 25.0 + 1.5 * 4.0)
    assert found.energy_error == pytest.approx(18.5 / (2.5 * 85.0) - 1.0)
    at_rest = casing_sums(np.array([5.0]), CORNERS[None], np.zeros((1, 8, 3)))
    still = ledger(fragments, spin, at_rest)
    assert still.momentum_error == still.angular_momentum_error == still.energy_error == 0.0
