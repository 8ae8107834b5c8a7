"""Sums of casings and rings, the ledger and what a meridian must hold, on bodies small enough for a sheet of paper."""

from __future__ import annotations

import numpy as np
import pytest

from flight.fragments import Fragments
from transition import InputError
from transition.cells import HalfPlane, check_meridian
from transition.results import casing_sums, cell_shares, compare_directions, ledger, ring_shares, ring_sums

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
    """A ring about an axis askew: m v, m v2 / 2 and m |v|."""
    axis = np.array([-0.8, 0.6, 0.0])
    velocity = np.tile([30.0, 40.0], (1, 4, 1))
    found = ring_sums(np.array([2.0]), np.array([[0.1, 0.2, 0.3, 0.4]]), velocity, axis)
    assert found.mass == 2.0
    assert found.momentum == pytest.approx(2.0 * 40.0 * axis, rel=1e-12)
    assert found.scale == pytest.approx(2.0 * 50.0, rel=1e-12)
    assert found.energy == pytest.approx(0.5 * 2.0 * 50.0**2, rel=1e-12)


def test_sums_of_rings_are_by_their_nodes():
    """Two rings whose nodes move apart: their energy is that of the nodes."""
    velocity = np.zeros((2, 4, 2))
    velocity[0, :, 1], velocity[1, :, 1] = [10.0, -10.0, 10.0, -10.0], [5.0, 5.0, -3.0, -3.0]
    shares = np.array([[0.25] * 4, [0.1, 0.2, 0.3, 0.4]])
    found = ring_sums(np.array([1.0, 2.0]), shares, velocity, UPRIGHT.frame[2])
    mean = 0.3 * 5.0 - 0.7 * 3.0
    assert found.energy == pytest.approx(0.5 * (100.0 + 2.0 * (0.3 * 25.0 + 0.7 * 9.0)), rel=1e-12)
    assert found.momentum == pytest.approx([0.0, 0.0, 2.0 * mean], rel=1e-12)
    assert found.scale == pytest.approx(10.0 + 2.0 * (0.3 * 5.0 + 0.7 * 3.0), rel=1e-12)


# --- What is handed over, and where it flies, of a few pieces whose sums are known


def two_cells():
    """Cells of 2 and 3 kg, flying apart along x at 30 and 20 m/s."""
    velocity = np.zeros((2, 8, 3))
    velocity[0, :, 0], velocity[1, :, 0] = 30.0, -20.0
    return np.array([2.0, 3.0]), velocity


def handed_over(*, speed=30.0, missing=0.0):
    """Ledger of the two cells against one fragment of each, the first changed."""
    fragments = Fragments(
        np.array([2.0 - missing, 3.0]),
        np.array([[1.5, 0.5, 0.5], [-1.5, 0.5, 0.5]]), np.array([[speed, 0.0, 0.0], [-20.0, 0.0, 0.0]]),
    )  # fmt: skip
    return ledger(fragments, casing_sums(*two_cells()))


def test_errors_are_differences_over_the_sum_of_sizes():
    """Sum of mass times speed 120 kg m/s, kinetic energy 1,500 J, mass 5 kg."""
    same = handed_over()
    assert (same.casing_momentum, same.casing_energy) == (pytest.approx((0.0, 0.0, 0.0), abs=1e-12), 1500.0)
    for name in ("mass_error", "momentum_error", "energy_error"):
        assert getattr(same, name) == pytest.approx(0.0, abs=1e-12)
    faster = handed_over(speed=33.0)
    assert faster.momentum_error == pytest.approx(2.0 * 3.0 / 120.0, rel=1e-12)
    assert faster.energy_error == pytest.approx((33.0**2 - 30.0**2) / 1500.0, rel=1e-12)
    assert handed_over(missing=0.5).mass_error == pytest.approx(-0.1, rel=1e-12)


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.0, 0.0, 2.0)])
def test_polar_angles_count_from_the_nose(axis):
    """Of an upright round with its nose up: 60 % fly up at 31 degrees from the axis, 40 % down at 148 degrees."""
    up, down = np.radians(31.0), np.radians(148.0)
    velocity = 500.0 * np.array([[np.sin(up), 0.0, np.cos(up)], [0.0, np.sin(down), np.cos(down)]])
    mass = np.array([0.6, 0.4])
    cells = cell_shares(mass, np.repeat(velocity[:, None], 8, axis=1), axis)
    found = compare_directions(mass, velocity, cells, axis)
    for polar in (found.polar_fragments, found.polar_cells):
        assert found.polar_deg[polar > 0.0].tolist() == [32.5, 147.5]
        assert polar[polar > 0.0] == pytest.approx([0.6, 0.4], rel=1e-12)
    for azimuth in (found.azimuth_fragments, found.azimuth_cells):
        assert found.azimuth_deg[azimuth > 0.0].tolist() == [0.0, 90.0]


def test_rings_fly_on_cones_about_the_axis():
    """A ring at 31 degrees from the nose of a lying round: the cone's azimuths by geometry, its mass all there."""
    angle = np.radians(31.0)
    ring = np.array([[[0.05, 0.0], [0.06, 0.0], [0.06, 0.01], [0.05, 0.01]]])
    velocity = np.broadcast_to(800.0 * np.array([np.sin(angle), np.cos(angle)]), (1, 4, 2))
    polar, azimuth = ring_shares(np.array([2.0]), ring, velocity, (1.0, 0.0, 0.0))
    assert polar[6] == pytest.approx(1.0, rel=1e-12)  # 30 to 35 degrees
    assert azimuth.sum() == pytest.approx(1.0, rel=1e-9)
    # Horizontal direction of the cone around +x: tan(azimuth) = tan(31 deg) sin(turn).
    turn = np.radians(np.arange(0.25, 360.0, 0.5))
    bearing = np.degrees(np.arctan2(np.sin(angle) * np.sin(turn), np.cos(angle)))
    expected = np.bincount(np.round(bearing / 5.0).astype(int) % 72, minlength=72) / len(turn)
    np.testing.assert_allclose(azimuth, expected, atol=0.02)
    assert azimuth[np.abs((np.arange(72) * 5 + 180) % 360 - 180) > 35].sum() == 0.0
