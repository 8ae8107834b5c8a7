"""Parts of the break-up by closed forms: quantiles of rings, modes, laws, mirrors, settings, few and many pieces."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from transition import BreakUp, BreakUpSettings, InputError
from transition.cells import corner_coordinates, interpolated, modes
from transition.kernels import _A, _B, _C, _SHARE, _STEP, _TILE, _X, _quantiles
from transition.law.segments import _at_rupture
from transition.points import numbers


@pytest.mark.parametrize("seed", range(4))
def test_quantiles_of_a_density_are_where_its_integral_has_their_share(seed):
    """Of (p + q x)^2 and of those that vanish at an end or inside; to the ends of the interval."""
    generator, w = np.random.default_rng(seed), np.zeros((12, _TILE))
    for i in range(_TILE):
        root, lift = generator.uniform(-1.3, 1.3), generator.choice([0.0, 1e-6, 0.1, 5.0])
        w[[_A, _B, _C], i] = generator.choice(
            [(root * root + lift, -2.0 * root, 1.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0)]
        )
        w[_SHARE, i] = generator.choice([1e-9, 1e-4, generator.uniform(), 1.0 - 1e-4])
    _quantiles(w.ravel())
    a, b, c = w[[_A, _B, _C]]

    def integral(x):
        return a * (x + 1.0) + 0.5 * b * (x * x - 1.0) + c / 3.0 * (x**3 + 1.0)

    assert (np.abs(w[_X]) <= 1.0).all()
    np.testing.assert_allclose(integral(w[_X]) / integral(1.0), w[_SHARE], rtol=0.0, atol=1e-9)


def test_modes_give_the_field_back():
    generator = np.random.default_rng(6)
    corners, points = generator.normal(size=(4, 8, 3)), generator.random((4, 3))
    made = modes(corners)
    x, y, z = (2.0 * points - 1.0).T
    values = np.stack([np.ones(4), x, y, z, x * y, x * z, y * z, x * y * z])
    np.testing.assert_allclose(
        interpolated(corners, points), np.einsum("ak,kaj->kj", values, made), rtol=1e-12, atol=1e-13
    )
    at_corners = np.stack(
        [interpolated(corners[:1], 0.5 * (corner[None] + 1.0))[0] for corner in corner_coordinates(8)]
    )
    np.testing.assert_allclose(at_corners, corners[0], rtol=1e-13, atol=1e-14)


def test_trilinear_is_exact_for_its_own_monomials():
    corners, points = 0.5 * (corner_coordinates(8) + 1.0), np.random.default_rng(8).random((20, 3))
    x, y, z = corners.T
    u, v, w = points.T
    values = np.stack([x, y, z, x * y * z, x * y - 2 * z, y * z + 3], axis=-1)
    expected = np.column_stack([u, v, w, u * v * w, u * v - 2 * w, v * w + 3])
    for columns in (slice(0, 3), slice(3, 6)):
        found = interpolated(np.repeat(values[None, :, columns], 20, axis=0), points)
        np.testing.assert_allclose(found, expected[:, columns], atol=1e-14)


def test_a_million_points_are_shared_out_in_proportion():
    """Eight for the lightest fragment; at least eight a cell of few cells, one start a cell of many, and never more."""
    cells = [np.full(100, 0.01), np.full(50, 0.04)]
    plenty = numbers(cells, [0.001, 0.02])
    assert [set(found.tolist()) for found in plenty] == [{80}, {16}]
    assert [set(found.tolist()) for found in numbers(cells, [1.0, 1.0])] == [{8}, {8}]
    assert [set(found.tolist()) for found in numbers(cells, [1.0, 1.0], together=4)] == [{8}, {8}]
    assert all((found % 4 == 0).all() for found in numbers(cells, [0.0009, 0.019], together=4))
    few = numbers(cells, [0.001, 0.02], most=3000)
    total = sum(int(found.sum()) for found in few)
    assert 0.75 * 3000 < total <= 3000
    assert few[0][0] > few[1][0] >= 8
    many = [np.full(50_001, 1e-3)]
    assert set(numbers(many, [1.0])[0].tolist()) == {2}
    assert set(numbers([many[0][:50_000]], [1.0])[0].tolist()) == {8}
    # however few are allowed, every cell has its least
    assert set(numbers(cells, [0.001, 0.02], most=10)[0].tolist()) == {8}


def segment(**changed):
    data = {"outer_radius": 0.08, "wall_thickness": 0.02, "start": 0.1, "end": 0.115}
    return SimpleNamespace(data=SimpleNamespace(**data | changed), is_end=False)


def test_radius_and_wall_at_rupture_follow_from_the_critical_strain():
    settings = BreakUpSettings(critical_strain=0.5)
    found = _at_rupture(segment(), settings, "")
    assert found == (pytest.approx(0.12), pytest.approx(0.02 / 1.5))
    for name in ("outer_radius", "wall_thickness"):
        for value in (math.nan, math.inf, 0.0, -0.1):
            with pytest.raises(InputError, match=f"here: {name} is .* m; above zero is needed"):
                _at_rupture(segment(**{name: value}), settings, "here")


@pytest.mark.parametrize(("end", "wall"), [(0.115, 0.015), (0.2, 0.02)])
def test_an_end_is_as_thick_as_it_is_long_where_that_is_less(end, wall):
    """A nose as it was before the burst; a base stretched by the critical strain in both directions."""
    piece = segment(end=end, kind="nose")
    piece.is_end = True
    assert _at_rupture(piece, BreakUpSettings(), "") == (0.08, pytest.approx(wall))
    piece = segment(end=end, kind="base")
    piece.is_end = True
    found = _at_rupture(piece, BreakUpSettings(critical_strain=0.5), "")
    assert found == (pytest.approx(0.12), pytest.approx(wall / 2.25))


def test_a_law_that_makes_dust_is_refused_before_it_fills_the_memory():
    """Twenty million fragments with all images; just as many are drawn."""
    law = SimpleNamespace(n0=1e7, law=SimpleNamespace(mean=1e-6))
    one = BreakUp.__new__(BreakUp)
    one.laws, one._images, one.snapshot = [law], (), SimpleNamespace(source="file")
    BreakUp._check_number(one)
    one._images = (None,)
    BreakUp._check_number(one)
    one._images = (None, None)
    with pytest.raises(InputError, match=r"file: the casings would break into 3e\+07 fragments .mean masses 1e-06 kg"):
        BreakUp._check_number(one)
    law.n0, one._images = math.nan, ()
    with pytest.raises(InputError):
        BreakUp._check_number(one)


def test_strides_of_the_points_are_powers_of_the_root_of_roberts():
    """1/g, 1/g2 and 1/g3 with g4 = g + 1, the generalised golden ratio of three dimensions."""
    first, second, third = _STEP
    root = 1.0 / first
    assert root**4 == pytest.approx(root + 1.0, rel=1e-14)
    assert (second, third) == (pytest.approx(first**2, rel=1e-14), pytest.approx(first**3, rel=1e-14))
