"""Velocity by the shape functions at one of the fragment's points (Eqs. 30 and 31)."""

from __future__ import annotations

import numpy as np
import pytest

from tests.transition.synthetic import Tube
from transition import BreakUpSettings, break_up

SETTINGS = BreakUpSettings(velocity="interpolation", mean_mass=3e-3, direction_scatter=0.0)
GRADIENT = np.array([[900.0, -300.0, 40.0], [120.0, 800.0, -70.0], [10.0, 60.0, -500.0]])
SHIFT = np.array([5.0, -7.0, 11.0])


def turned(angle, axis):
    axis = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


@pytest.mark.parametrize("angle", [0.0, 1.0, 2.5])
def test_linear_field_is_met_exactly_on_a_stretched_and_turned_mesh(tmp_path, angle):
    rotation = turned(angle, [1.0, 2.0, -0.5])
    tube = Tube(around=16, axial=12, rotation=rotation, velocity=lambda x: x @ GRADIENT.T + SHIFT)
    fragments = break_up(tube.read(tmp_path / "s.h5"), SETTINGS, seed=2).fragments
    expected = (fragments.position @ rotation @ GRADIENT.T + SHIFT) @ rotation.T
    np.testing.assert_allclose(fragments.velocity, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


def test_two_rounds_keep_mass_and_nearly_momentum(tmp_path):
    tube = Tube(around=16, axial=12, places=((0.0, 0.0, 0.0), (0.3, 0.0, 0.0)))
    summary = break_up(tube.read(tmp_path / "s.h5"), SETTINGS, seed=2).summary
    assert abs(summary["mass_error"]) < 1e-12
    assert 1e-12 < summary["momentum_error"] < 0.02
    assert abs(summary["energy_error"]) < 0.02
