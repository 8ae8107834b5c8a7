"""Material points of rings: mass, momentum and distribution of an axisymmetric burst, placed evenly around the axis."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.stats import chi2, kstest

from tests.transition.meridian import Meridian
from transition.casing import casing_of
from transition.cells import HalfPlane, interpolated, mass_density, modes, node_shares, ring_volumes
from transition.points import PointSource

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
TILTED = HalfPlane(np.array([0.3, -0.2, 1.1]), np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0])


def quads_of(generator, number):
    """Convex quadrilaterals of a few mm near the axis, every third with an edge on it."""
    corners = 3e-3 * (SQUARE + 0.2 * (generator.random((number, 4, 2)) - 0.5)) + [2e-4, 0.0]
    corners[:, :, 0] += 0.05 * generator.random((number, 1))
    corners[::3, :, 0] -= corners[::3, :, :1].min(axis=1)
    corners[::3, [0, 3], 0] = 0.0
    corners[:, :, 1] += generator.normal(size=(number, 1))
    return corners


def source(generator, count, speeds=lambda generator, shape: generator.normal(scale=500.0, size=shape)):
    reference = quads_of(generator, len(count))
    state = np.concatenate([1.9 * reference, speeds(generator, reference.shape)], axis=2)
    mass = generator.lognormal(size=len(count))
    made = PointSource.of_rings(np.arange(len(count)) + 7, mass, np.asarray(count), reference, state, TILTED)
    return made, reference, state


def test_ring_volumes_and_nodal_shares_are_the_integrals():
    """Closed forms on the axis (1/6 and 1/3 of the ring at its inner and outer nodes), quadrature elsewhere."""
    box = SQUARE * [0.02, 0.03]
    np.testing.assert_allclose(node_shares(box[None])[0], [1 / 6, 1 / 3, 1 / 3, 1 / 6], rtol=1e-13)
    assert ring_volumes(box[None])[0] == pytest.approx(np.pi * 0.02**2 * 0.03, rel=1e-13)
    corners = quads_of(np.random.default_rng(2), 3)
    coefficients, density = modes(corners), mass_density(corners)
    for one in range(3):

        def measure(v, u, one=one):
            p = np.array([1.0, u, v, u * v]) @ coefficients[one]
            by_u, by_v = np.array([0, 1, 0, v]) @ coefficients[one], np.array([0, 0, 1, u]) @ coefficients[one]
            return p[0] * (by_u[0] * by_v[1] - by_u[1] * by_v[0])

        at = (0.3, -0.7)
        assert density[one] @ (at[1] ** np.arange(3)) @ (at[0] ** np.arange(3)) == pytest.approx(measure(at[1], at[0]))
        for node, (a, b) in enumerate(((-1, -1), (1, -1), (1, 1), (-1, 1))):
            exact = dblquad(lambda v, u, a=a, b=b: measure(v, u) * (1 + a * u) * (1 + b * v) / 4, -1, 1, -1, 1)[0]
            found = (node_shares(corners) * ring_volumes(corners)[:, None])[one, node]
            assert found == pytest.approx(2 * np.pi * exact, rel=1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_mass_momentum_and_centre_are_those_of_every_ring(seed):
    generator = np.random.default_rng(seed)
    made, reference, state = source(generator, generator.choice([4, 8, 16, 24, 80], 60))
    points = made.draw(generator)
    ring = points.cell - 7
    np.testing.assert_array_equal(np.bincount(ring), made.number)
    np.testing.assert_allclose(np.bincount(ring, points.mass), made.cell_mass, rtol=1e-14)
    mean = np.einsum("ma,maj->mj", node_shares(reference), state)
    away = points.position - TILTED.origin
    e1, e2, axis = TILTED.frame
    across = np.hypot(*points.reference[:, :2].T)
    turn = np.arctan2(points.reference[:, 1], points.reference[:, 0]) - np.arctan2(away @ e2, away @ e1)
    assert np.abs(np.sin(0.5 * turn)[np.hypot(away @ e1, away @ e2) > 1e-5]).max() < 1e-9
    for place, wanted in ((across, mean[:, 0]), (points.reference[:, 2], mean[:, 1])):  # the state is 1.9 times it
        found = np.bincount(ring, points.mass * place) / made.cell_mass
        assert np.abs(found - wanted / 1.9).max() < 4e-3
    assert np.abs(points.velocity @ axis).max() > 100.0
    for values, field in ((away, mean[:, 1]), (points.velocity, mean[:, 3])):
        scale = np.abs(values).max()
        for direction, wanted in ((e1, 0.0 * field), (e2, 0.0 * field), (axis, field)):
            found = np.bincount(ring, points.mass * (values @ direction)) / made.cell_mass
            assert np.abs(found - wanted).max() < 1e-13 * scale


def test_kinetic_energy_is_that_of_the_field():
    """Half the integral of v2 over the rings by Gauss points, for speeds that change by tenths within a ring."""
    generator = np.random.default_rng(0)
    made, reference, state = source(
        generator, np.full(400, 80), lambda g, shape: 1000.0 + g.normal(scale=50.0, size=shape)
    )
    gauss, weight = np.polynomial.legendre.leggauss(4)
    density, energy, whole = mass_density(reference), np.zeros(400), np.zeros(400)
    for u, a in zip(gauss, weight, strict=True):
        for v, b in zip(gauss, weight, strict=True):
            at = a * b * np.einsum("mij,i,j->m", density, u ** np.arange(3), v ** np.arange(3))
            velocity = interpolated(state[..., 2:], np.tile([(u + 1) / 2, (v + 1) / 2], (400, 1)))
            energy += at * (velocity**2).sum(axis=1)
            whole += at
    exact = 0.5 * made.cell_mass @ (energy / whole)
    found = [0.5 * p.mass @ (p.velocity**2).sum(axis=1) for p in (made.draw(generator) for _ in range(20))]
    # Each ring's mean is kept, so that its energy is short by half the mass times the mean's variance.
    assert abs(np.mean(found) / exact - 1.0) < 1e-5
    assert np.std(found) / exact < 1e-5


def test_places_follow_the_mass_of_the_ring():
    """Chi-square of 8 x 8 boxes of a rectangle at the axis against r dA, and of 72 sectors, at 1 %."""
    generator, rings, count, size = np.random.default_rng(4), 150, 400, np.array([0.01, 0.02])
    corners = np.tile(SQUARE * size, (rings, 1, 1))
    state = np.concatenate([corners, np.zeros_like(corners)], axis=2)
    made = PointSource.of_rings(np.arange(rings), np.ones(rings), np.full(rings, count), corners, state, TILTED)
    away = (made.draw(generator).position - TILTED.origin) @ TILTED.frame.T
    place = (np.column_stack([np.hypot(away[:, 0], away[:, 1]), away[:, 2]]) / size)[::2]  # opposite points share one
    assert -0.02 < place.min() < place.max() < 1.02  # the mean of every ring is kept by a small shift
    edges = np.linspace(0.0, 1.0, 9)
    found = np.histogram2d(*np.clip(place, 0.0, 1.0).T, bins=[edges, edges])[0]
    expected = np.diff(edges**2)[:, None] / 8.0 * len(place)
    assert ((found - expected) ** 2 / expected).sum() < chi2.ppf(0.99, 63)
    bearing = np.arctan2(away[::4, 1], away[::4, 0])  # one of each block of four
    sectors = np.histogram(bearing, np.linspace(-np.pi, np.pi, 73))[0]
    assert ((sectors - len(bearing) / 72.0) ** 2).sum() / (len(bearing) / 72.0) < chi2.ppf(0.99, 71)


def test_elevations_of_points_follow_the_exact_field(tmp_path):
    """Kolmogorov-Smirnov at 1 %, one point of each ring: v = (k r, c z) on an even wall has an even tan(elevation)."""
    steep = np.tan(np.radians(20.0))

    def field(r, z):
        return np.column_stack([500.0 * r / 0.13, 500.0 * r / 0.13 * steep * (z / 0.15 - 1.0)])

    thin = Meridian(inner=0.0684, outer=0.0685, radial_cells=1, axial=3000, velocity=field, ends=(), kinds=("wall",))
    snapshot = thin.read(tmp_path / "s.h5")
    casing = casing_of(snapshot)
    nodes = snapshot.cells[snapshot.casing]
    half = snapshot.half_plane
    mass = snapshot.mass[snapshot.casing]
    state = np.concatenate(
        [half.coordinates(snapshot.position[nodes]), half.components(snapshot.velocity[nodes])], axis=2
    )
    reference, number = half.coordinates(snapshot.reference[nodes]), np.full(len(mass), 8)
    made = PointSource.of_rings(np.arange(len(mass)), mass, number, reference, state, half)
    points = made.draw(np.random.default_rng(4))
    level = np.hypot(points.velocity[:, 0], points.velocity[:, 1])
    tangent = (points.velocity[:, 2] / level)[::8]
    assert kstest(tangent, lambda x: (x / steep + 1.0) / 2.0).pvalue > 0.01
    assert casing.sums(0).mass == pytest.approx(mass.sum(), rel=1e-14)
