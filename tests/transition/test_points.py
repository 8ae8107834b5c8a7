"""Material points of cells: the field's mass and momentum, at positions spread evenly."""

from __future__ import annotations

import numpy as np
import pytest

from tests.transition.synthetic import Tube
from transition import BreakUpSettings, break_up
from transition.points import PointSource


def cells_of(generator, number):
    """Hexahedra bent at random, and velocities that differ wildly from node to node."""
    cube = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    places = cube + generator.normal(scale=0.15, size=(number, 8, 3)) + generator.normal(size=(number, 1, 3))
    return places, generator.normal(scale=500.0, size=(number, 8, 3))


def source(generator, count):
    places, velocity = cells_of(generator, len(count))
    mass = generator.lognormal(size=len(count))
    state = np.concatenate([places, velocity, 0.5 * places], axis=2)
    return PointSource.of_cells(np.arange(len(count)) + 7, mass, np.asarray(count), state), places, velocity


@pytest.mark.parametrize("seed", range(5))
def test_mass_and_momentum_and_centre_are_those_of_every_cell(seed):
    generator = np.random.default_rng(seed)
    made, places, velocity = source(generator, generator.choice([2, 4, 8, 16, 24, 80], 60))
    points = made.draw(generator)
    assert len(points) == made.number.sum()
    np.testing.assert_array_equal(np.bincount(points.cell - 7), made.number)
    np.testing.assert_allclose(np.bincount(points.cell - 7, points.mass), made.cell_mass, rtol=1e-14)
    np.testing.assert_allclose(points.reference, 0.5 * points.position, rtol=1e-12, atol=1e-13)
    for values, field in ((points.position, places), (points.velocity, velocity)):
        found = np.stack([np.bincount(points.cell - 7, points.mass * values[:, i]) for i in range(3)], axis=1)
        scale = made.cell_mass[:, None] * np.abs(field).max()
        assert (np.abs(found - made.cell_mass[:, None] * field.mean(axis=1)) / scale).max() < 1e-13


@pytest.mark.parametrize("count", [2, 4, 8, 24])
def test_points_fill_a_cell_evenly(count):
    """Chi-square of 4 x 4 x 4 boxes over many cells, at 1 %; a point is one of `count` of its cell, all alike."""
    generator = np.random.default_rng(count)
    cells = 40_000 // count
    corners = np.tile(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
                               float), (cells, 1, 1))  # fmt: skip
    state = np.concatenate([corners, np.zeros_like(corners), corners], axis=2)
    made = PointSource.of_cells(np.arange(cells), np.ones(cells), np.full(cells, count), state)
    points = made.draw(generator)
    assert points.position.min() >= 0.0
    assert points.position.max() <= 1.0
    box = (points.position * 4.0).astype(int) @ [16, 4, 1]
    found = np.bincount(box, minlength=64)
    assert ((found - len(points) / 64.0) ** 2).sum() / (len(points) / 64.0) < 92.0  # 63 degrees of freedom
    again = made.draw(generator)
    assert np.abs(again.position - points.position).max() > 0.1


# --- Velocity by the shape functions at one of the fragment's points (Eqs. 30 and 31)

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
