"""What is handed over, and where it flies, of a few pieces whose sums are known."""

from __future__ import annotations

import numpy as np
import pytest

from flight.fragments import Fragments
from transition.ledger import casing_sums, ledger
from transition.placement.directions import cell_shares, compare_directions, ring_shares


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
    found = compare_directions(mass, velocity, velocity, cells, axis)
    for polar in (found.polar_fragments, found.polar_cells):
        assert found.polar[polar > 0.0].tolist() == [32.5, 147.5]
        assert polar[polar > 0.0] == pytest.approx([0.6, 0.4], rel=1e-12)
    for azimuth in (found.azimuth_fragments, found.azimuth_cells):
        assert found.azimuth[azimuth > 0.0].tolist() == [0.0, 90.0]
    assert found.polar_difference == pytest.approx(0.0, abs=1e-12)


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
