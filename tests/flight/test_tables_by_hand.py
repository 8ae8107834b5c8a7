"""Piecewise cubics beside scipy's: slopes of unevenly spaced tables, pieces with given slopes, their values."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from flight.scene.tables import evaluate_pieces, hermite_pieces, monotone_pieces, monotone_slopes


@pytest.mark.parametrize("seed", range(6))
def test_slopes_and_values_are_those_of_scipys_shape_preserving_cubic(seed):
    """Rising, falling, level and turning, with steps that differ by a factor of ten."""
    generator = np.random.default_rng(seed)
    x = np.cumsum(10.0 ** generator.uniform(-0.5, 0.5, 12))
    y = np.cumsum(generator.normal(0.3 * (seed % 3), 1.0, 12))
    y[5] = y[4]
    expected = PchipInterpolator(x, y)
    np.testing.assert_allclose(monotone_slopes(x, y), expected.derivative()(x), rtol=1e-12, atol=1e-14)
    at = generator.uniform(x[0], x[-1], 200)
    np.testing.assert_allclose(evaluate_pieces(x, monotone_pieces(x, y), at), expected(at), rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize(
    ("x", "y"),
    [
        ([0.0, 1.0, 4.0], [0.0, 1.0, 1.5]),  # an end that is level by the limit, or steep
        ([0.0, 3.0, 4.0], [0.0, 1.0, 5.0]),
        ([0.0, 1.0, 1.5], [0.0, 1.0, -4.0]),  # a turn: at most three times the secant
        ([0.0, 1.0, 4.0], [0.0, -1.0, 9.0]),
        ([0.0, 2.0], [1.0, 5.0]),
    ],
)
def test_slopes_at_the_ends_are_limited(x, y):
    x, y = np.array(x), np.array(y)
    found = monotone_slopes(x, y)
    np.testing.assert_allclose(found, PchipInterpolator(x, y).derivative()(x), rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(monotone_slopes(x, -y), -found, rtol=1e-12, atol=1e-14)


def test_one_entry_is_a_constant():
    assert monotone_slopes(np.array([2.0]), np.array([7.0])).tolist() == [0.0]


def test_pieces_have_the_slopes_given_on_both_sides_of_a_kink():
    generator = np.random.default_rng(8)
    x = np.cumsum(generator.uniform(0.2, 3.0, 6))
    y, after, before = generator.normal(size=(3, 6))
    pieces = hermite_pieces(x, y, after, before)
    for k in range(5):
        expected = CubicHermiteSpline(x[k : k + 2], y[k : k + 2], [after[k], before[k + 1]])
        np.testing.assert_allclose(pieces[k], expected.c[::-1, 0], rtol=1e-10, atol=1e-12)
