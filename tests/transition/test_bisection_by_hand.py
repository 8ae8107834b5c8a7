"""Cuts of the bisection: pivots, order by mass, directions, hollow regions and division of fragments, each alone."""

from __future__ import annotations

import math

import numpy as np
import pytest

from transition.kernels.bisection import _cut, _direction, _divide, _key, _partition, _pivot, _select


def line_of_points(keys, seed=3):
    """Rows of the kernels on the x axis, of random masses, and the cut that orders them by x."""
    row = np.zeros((len(keys), 4))
    row[:, 0], row[:, 3] = keys, np.random.default_rng(seed).uniform(0.5, 2.0, len(keys))
    q = np.zeros(9)
    q[0] = 1.0
    return row, q


@pytest.mark.parametrize("share", [0.0, 0.2, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize(("begin", "end"), [(0, 2000), (300, 1300), (40, 60), (7, 9), (5, 6)])
def test_a_pivot_has_about_its_share_of_the_rows_below_it(share, sense, begin, end):
    row, q = line_of_points(sense * np.arange(2000.0))
    found = _pivot(row, begin, end, q, share, np.full((33, 2), np.nan))
    number = end - begin
    below = found - begin if sense > 0.0 else end - 1 - found
    assert 0 <= below < number
    assert abs(below - share * number) <= (0.12 if number > 300 else 0.3) * number + 1.0  # of few, four are looked at


@pytest.mark.parametrize("kind", ["plane", "sphere", "angle", "angle about the origin"])
@pytest.mark.parametrize("seed", range(5))
def test_rows_are_ordered_so_far_that_the_mass_is_reached(kind, seed):
    """All before have keys no larger, all behind none smaller; their mass with the part of one is what is needed."""
    generator = np.random.default_rng(seed)
    count = int(generator.integers(2, 400))
    row = np.column_stack([generator.normal(size=(count, 3)), generator.uniform(0.1, 1.0, count)])
    row[generator.integers(0, count, count // 3), :3] = row[0, :3]  # several in one place
    ident, before = np.arange(count), row.copy()
    q = {"plane": [0.3, -0.5, 0.8, 0, 0, 0, 0, 0, 0], "sphere": [-2.0, 0.4, 0.0, 1, 0, 0, 0, 0, 0],
         "angle": [1.0, 0.0, 0, 0.1, 1, 0, 1.0, 0, -0.2],
         "angle about the origin": [0.8, 0.6, 0, 0, 1, -0.6, 0.8, 0, 0]}[kind]  # fmt: skip
    q = np.array(q, dtype=float)
    total = row[:, 3].sum()
    for share in (0.5, 0.03, 0.97, 1.0):
        need = share * total
        at, part = _select(row, ident, 0, count, q, need, total, np.empty((33, 2)))
        np.testing.assert_array_equal(row, before[ident])
        keys = np.array([_key(row, i, q) for i in range(count)])
        assert row[:at, 3].sum() + part == pytest.approx(need, rel=1e-12, abs=1e-12)
        assert -1e-12 <= part <= row[at, 3] + 1e-12
        assert keys[:at].max(initial=-np.inf) <= keys[at] <= keys[at + 1 :].min(initial=np.inf)
    pivot = float(np.median(keys))
    below, behind = _partition(row, ident, 0, count, q, pivot)
    keys = np.array([_key(row, i, q) for i in range(count)])
    assert (keys[:behind] < pivot).all()
    assert (keys[behind:] >= pivot).all()
    assert below == pytest.approx(row[:behind, 3].sum(), rel=1e-12)


def test_a_direction_lies_along_the_longest_extent():
    """Of a rod that stands anywhere, whatever the random vector: within a few degrees, and of length one."""
    generator, mean = np.random.default_rng(5), np.empty(3)
    for _ in range(20):
        turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
        place_ = generator.normal(size=3) * 5.0
        row = np.zeros((200, 4))
        row[:, :3] = (generator.normal(size=(200, 3)) * [1.0, 0.1, 0.1]) @ turn + place_
        found = np.array(_direction(row, 0, 200, generator.normal(size=3), mean))
        assert np.linalg.norm(found) == pytest.approx(1.0, rel=1e-12)
        assert abs(found @ turn[0]) > 0.97
        np.testing.assert_allclose(mean, row[:, :3].mean(axis=0), atol=0.3)
    row[:, :3] = row[:50, :3].repeat(4, axis=0)
    _direction(row, 0, 50, np.ones(3), mean)
    np.testing.assert_allclose(mean, row[:50, :3].mean(axis=0), rtol=1e-12)
    row[:, :3] = 2.0  # all in one place: the random vector itself
    np.testing.assert_allclose(_direction(row, 0, 200, np.array([3.0, 0.0, 4.0]), mean), [0.6, 0.0, 0.8], rtol=1e-12)


@pytest.mark.parametrize(("share", "plane"), [(0.24, False), (0.26, True)])
def test_a_part_below_a_quarter_is_taken_from_around_a_point(share, plane):
    generator, q = np.random.default_rng(6), np.empty(9)
    row = np.column_stack([generator.normal(size=(40, 3)) * [3.0, 1.0, 1.0], np.ones(40)])
    _cut(row, 0, 40, share, np.array([1.0, 0.2, 0.1]), 0.6, np.zeros(3), np.zeros(3), np.empty(3), q)
    keys = np.array([_key(row, i, q) for i in range(40)])
    if plane:
        direction = -q[:3]
        np.testing.assert_allclose(keys, -row[:, :3] @ direction, rtol=1e-12)
        assert abs(direction[0]) > 0.95
    else:
        distance = ((row[:, :3] - row[24, :3]) ** 2).sum(axis=1)  # the row at 0.6 of them
        np.testing.assert_allclose(keys - keys[24], distance, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("square", "hollow"), [(0.085, False), (0.098, True)])
@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 2.0)])
def test_a_region_is_hollow_from_a_tenth_of_its_mean_square(square, hollow, axis):
    """Twenty points at a distance of 1 about the centre and two nearer: smallest over mean square passes a tenth."""
    generator, q, centre = np.random.default_rng(7), np.empty(9), np.array([4.0, -3.0, 1.0])
    way = generator.normal(size=(10, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    near = math.sqrt(square) * way[:1]
    row = np.column_stack([np.concatenate([way, -way, near, -near]) + centre, np.ones(22)])
    _cut(row, 0, 22, 0.5, np.ones(3), 0.3, centre, np.array(axis), np.empty(3), q)
    assert (q[4] == 1.0) == hollow
    _cut(row, 0, 22, 0.5, np.ones(3), 0.3, centre, np.zeros(3), np.empty(3), q)
    assert q[4] == 0.0


@pytest.mark.parametrize("seed", range(5))
def test_fragments_are_divided_as_near_as_can_be_to_a_random_share(seed):
    """From three to seven tenths of their mass; one that outweighs the others together stands alone."""
    generator = np.random.default_rng(seed)
    mass, number = generator.uniform(0.8, 1.2, 40), 30
    for uniform in (0.0, 0.25, 0.9, 1.0):
        fragment = generator.permutation(40)
        before = fragment.copy()
        at = _divide(fragment, mass, 5, 5 + number, uniform)
        np.testing.assert_array_equal(fragment, before)
        sums = np.cumsum(mass[fragment[5 : 5 + number]])
        wanted = (0.3 + 0.4 * uniform) * sums[-1]
        assert at - 5 == np.argmin(np.abs(sums[:-1] - wanted)) + 1
    heavy = fragment[9]
    for weight, alone in ((1.02, True), (0.98, False)):
        others = np.delete(fragment[5 : 5 + number], 4)
        mass[heavy] = weight * mass[others].sum()
        order = fragment.copy()
        at = _divide(order, mass, 5, 5 + number, 0.5)
        assert (at == 4 + number and order[4 + number] == heavy) == alone
        assert sorted(order[5 : 5 + number].tolist()) == sorted(fragment[5 : 5 + number].tolist())
    assert _divide(np.array([0, 1]), np.array([1.0, 1.0]), 0, 2, 0.5) == 1
