"""Material points of cells: the field's mass, momentum and angular momentum, at places spread evenly."""

from __future__ import annotations

import numpy as np
import pytest

from tests.transition.synthetic import Tube, volumes
from transition.cells.cell_points import POINTS_PER_FRAGMENT, CellPoints, lightest_that_matters, numbers
from transition.cells.points import MaterialPoints
from transition.cells.shape_functions import field_angular_momentum, modes, trilinear
from transition.law.mott import MottLaw


def cells_of(generator, number):
    """Hexahedra bent at random, and velocities that differ wildly from node to node."""
    cube = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    places = cube + generator.normal(scale=0.15, size=(number, 8, 3)) + generator.normal(size=(number, 1, 3))
    return places, generator.normal(scale=500.0, size=(number, 8, 3))


def source(generator, count):
    places, velocity = cells_of(generator, len(count))
    mass = generator.lognormal(size=len(count))
    made = CellPoints.of_segment((0, 3), np.arange(len(count)) + 7, mass, places, velocity, np.asarray(count))
    return made, places, velocity


@pytest.mark.parametrize("seed", range(5))
def test_mass_and_momentum_and_centre_are_those_of_every_cell(seed):
    generator = np.random.default_rng(seed)
    made, places, velocity = source(generator, generator.choice([2, 4, 8, 16, 24, 80], 60))
    points = made.draw(generator)
    assert len(points) == made.number.sum()
    np.testing.assert_array_equal(np.bincount(points.cell - 7), made.number)
    np.testing.assert_allclose(np.bincount(points.cell - 7, points.mass), made.cell_mass, rtol=1e-14)
    for values, field in ((points.position, places), (points.velocity - turned(made, points), velocity)):
        found = np.stack([np.bincount(points.cell - 7, points.mass * values[:, i]) for i in range(3)], axis=1)
        scale = made.cell_mass[:, None] * np.abs(field).max()
        assert (np.abs(found - made.cell_mass[:, None] * field.mean(axis=1)) / scale).max() < 1e-13


def turned(made, points):
    """The rigid rotation that the points were given, from what it did to the momenta of whole cells."""
    cells = np.stack([np.bincount(points.cell - 7, points.velocity[:, i]) for i in range(3)], axis=1)
    change = cells / made.number[:, None] - made.modes[:, 0, 3:]
    centre = made.cell_mass @ made.modes[:, 0, :3] / made.cell_mass.sum()
    away = made.modes[:, 0, :3] - centre
    x, y, z, zero = *away.T, np.zeros(len(away))
    columns = np.stack([np.stack([zero, -z, y], 1), np.stack([z, zero, -x], 1), np.stack([-y, x, zero], 1)], axis=2)
    rate, residual, *_ = np.linalg.lstsq(columns.reshape(-1, 3), change.reshape(-1), rcond=None)
    assert residual.sum() < 1e-18 * (change**2).sum() + 1e-18
    return np.cross(rate, points.position - centre)


@pytest.mark.parametrize("seed", range(5))
def test_momenta_are_those_of_the_field(seed):
    generator = np.random.default_rng(seed)
    made, places, velocity = source(generator, generator.choice([2, 4, 8, 16, 40], 200))
    points = made.draw(generator)
    speed = np.linalg.norm(points.velocity, axis=1)
    wanted = made.cell_mass @ velocity.mean(axis=1)
    assert np.linalg.norm(points.mass @ points.velocity - wanted) < 1e-13 * (points.mass @ speed)
    # The field's own, by 2x2x2 Gauss points, which is exact for products of two trilinear functions
    gauss = (np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1]), axis=-1).reshape(-1, 3) / np.sqrt(3.0) + 1.0) / 2.0
    exact = np.zeros(3)
    for point in gauss:
        at = np.tile(point, (len(places), 1))
        exact += made.cell_mass @ np.cross(trilinear(places, at), trilinear(velocity, at)) / 8.0
    scale = points.mass @ (np.linalg.norm(points.position, axis=1) * speed)
    found = points.mass @ np.cross(points.position, points.velocity)
    assert np.linalg.norm(found - exact) < 1e-12 * scale
    both = modes(np.concatenate([places, velocity], axis=2))
    assert np.linalg.norm(field_angular_momentum(made.cell_mass, both, np.zeros(3)) - exact) < 1e-13 * scale


def test_the_turn_that_gives_the_angular_momentum_is_tiny(tmp_path):
    """On a real wall no velocity changes by more than 1e-4 of its own; without it the angular momentum is off."""
    snapshot = Tube(around=36, axial=34).read(tmp_path / "s.h5")
    nodes = snapshot.cells[snapshot.casing]
    corners, velocity, mass = snapshot.position[nodes], snapshot.velocity[nodes], snapshot.mass[snapshot.casing]
    made = CellPoints.of_segment((0, 0), np.arange(len(mass)), mass, corners, velocity, np.full(len(mass), 16))
    points = made.draw(np.random.default_rng(3), local=True)
    field = trilinear(velocity[points.cell], points.local)
    apart = np.abs(trilinear(corners[points.cell], points.local) - points.position)  # bilinear modes of the cells
    assert apart.max() < 2e-4
    change = np.linalg.norm(points.velocity - field, axis=1)
    assert 0.0 < change.max() < 1e-4 * np.linalg.norm(field, axis=1).min()


@pytest.mark.parametrize("count", [2, 4, 8, 24])
def test_points_fill_a_cell_evenly(count):
    """Chi-square of 4 x 4 x 4 boxes over many cells, at 1 %; a point is one of `count` of its cell, all alike."""
    generator = np.random.default_rng(count)
    cells = 40_000 // count
    corners = np.tile(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
                               float), (cells, 1, 1))  # fmt: skip
    made = CellPoints.of_segment(
        (0, 0), np.arange(cells), np.ones(cells), corners, np.zeros_like(corners), np.full(cells, count)
    )
    points = made.draw(generator, local=True)
    assert points.local.min() >= 0.0
    assert points.local.max() <= 1.0
    box = (points.local * 4.0).astype(int) @ [16, 4, 1]
    found = np.bincount(box, minlength=64)
    assert ((found - len(points) / 64.0) ** 2).sum() / (len(points) / 64.0) < 92.0  # 63 degrees of freedom
    again = made.draw(generator, local=True)
    assert np.abs(again.local - points.local).max() > 0.1


def test_the_lightest_that_matters_leaves_two_per_cent_of_the_mass():
    for dimension, in_means in ((2, 0.1609), (3, 0.1749)):
        law = MottLaw.from_mean(0.012, dimension)
        found = lightest_that_matters(law)
        assert float(law.mass_fraction_above(found)) == pytest.approx(0.98, abs=1e-9)
        assert found == pytest.approx(in_means * 0.012, rel=0.01)


def test_numbers_follow_the_lightest_fragment_and_the_cap():
    generator = np.random.default_rng(1)
    masses = [generator.uniform(0.5e-3, 8e-3, 500), generator.uniform(1e-3, 2e-3, 300)]
    found = numbers(masses, [1e-3, 2e-2])
    for number, mass, lightest in zip(found, masses, (1e-3, 2e-2), strict=True):
        assert (mass / number <= lightest / POINTS_PER_FRAGMENT * (1.0 + 1e-12)).all()
        assert (number % 2 == 0).all()
        assert number.min() >= 8
    assert (found[1] == 8).all()
    capped = numbers(masses, [1e-3, 2e-2], most=12_000)
    assert sum(int(number.sum()) for number in capped) <= 12_000
    assert (numbers(masses, [1e-9, 1e-9], most=1)[0] == 8).all()
    fine = numbers([np.full(60_000, 1e-4), np.array([1e-4, 2.5e-4, 6e-4])], [8e-4, 8e-4])
    assert (fine[0] == 2).all()
    assert fine[1].tolist() == [2, 4, 6]


def test_points_of_parts_stand_one_after_the_other():
    generator = np.random.default_rng(0)
    parts = [source(generator, [8, 16])[0].draw(generator, local=True) for _ in range(2)]
    both = MaterialPoints.concatenate(parts)
    assert len(both) == 48
    np.testing.assert_array_equal(both.velocity[24:], parts[1].velocity)
    assert (both.segment == 3).all()


def test_trilinear_is_exact_for_its_own_monomials():
    generator = np.random.default_rng(8)
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    corners, points = np.repeat(corners[None], 20, axis=0), generator.random((20, 3))
    np.testing.assert_allclose(trilinear(corners, points), points, atol=1e-15)
    x, y, z = corners[..., 0], corners[..., 1], corners[..., 2]
    values = np.stack([x * y * z, x * y - 2 * z, y * z + 3], axis=-1)
    u, v, w = points.T
    np.testing.assert_allclose(
        trilinear(values, points), np.column_stack([u * v * w, u * v - 2 * w, v * w + 3]), atol=1e-14
    )
    assert volumes(corners)[0] == pytest.approx(1.0)
