"""The places by which sites in the open are judged: they cover the ground once, and a larger site is never better."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flight.fluence import PolarGrid
from fragfield.hazard.places import LARGEST, Places, PlaceSums, kernel_weights

GRID = PolarGrid.of(72, 10.0, 10.0, 300.0)
PLACES = Places(GRID)
coordinates = st.floats(-250.0, 250.0, allow_nan=False)


def fields(seed: int) -> PlaceSums:
    """Rare hits, most of them near the rounds, in twelve realisations."""
    generator, sums = np.random.default_rng(seed), PlaceSums(GRID, 1.8)
    rate = 0.2 * np.exp(-GRID.edges[1:] / 80.0) * np.ones(GRID.shape)
    for _ in range(12):
        sums.add(generator.poisson(rate).astype(float), generator.gamma(rate))
    return sums


SUMS = fields(3)


def square(x: float, y: float, half: float) -> np.ndarray:
    return np.array([[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]])


def test_places_cover_the_ground_once_and_are_of_the_size_of_a_person_or_a_vehicle() -> None:
    assert PLACES.area.sum() == pytest.approx(np.pi * GRID.reach**2, rel=1e-12)
    assert np.array_equal(np.unique(PLACES.of_cells), np.arange(len(PLACES.area)))
    size = np.sqrt(PLACES.area)
    distance = np.hypot(*PLACES.corners.mean(axis=1).T)
    near = (distance > 2.0) & (distance < 100.0)
    assert size[near].max() < 1.3 * LARGEST
    assert (size[near] > 0.4 * np.minimum(LARGEST, 0.1 * distance[near])).all()


@settings(max_examples=60, deadline=None)
@given(coordinates, coordinates, st.floats(0.5, 60.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.01, 1.0))
def test_a_larger_area_is_never_better(x: float, y: float, half: float, u: float, v: float, part: float) -> None:
    """Of any square and one within it: estimates and bounds of the larger one are no smaller."""
    shift = (1.0 - part) * half * (2.0 * np.array([u, v]) - 1.0)
    large, small = (SUMS.worst([square(*place, size)], [])[0] for place, size in
                    (((x, y), half), ((x + shift[0], y + shift[1]), part * half)))  # fmt: skip
    for inner, outer in zip(small, large, strict=True):
        assert outer.expected >= inner.expected
        assert outer.upper >= inner.upper * (1.0 - 1e-12)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(coordinates, coordinates), min_size=3, max_size=5, unique=True), st.floats(1.0, 8.0))
def test_a_longer_road_is_never_better(points: list[tuple[float, float]], width: float) -> None:
    def strips(line: list[tuple[float, float]]) -> list[np.ndarray]:
        pieces = []
        for start, end in zip(np.array(line[:-1]), np.array(line[1:]), strict=True):
            way = (end - start) / max(np.hypot(*(end - start)), 1e-9)
            side = 0.5 * width * np.array([-way[1], way[0]])
            pieces.append(np.array([start - side, end - side, end + side, start + side]))
        return pieces

    part, whole = (SUMS.worst(strips(line), [])[0] for line in (points[:-1], points))
    for shorter, longer in zip(part, whole, strict=True):
        assert longer.expected >= shorter.expected
        assert longer.upper >= shorter.upper * (1.0 - 1e-12)


def test_the_meadow_around_the_small_one_finds_its_hot_spot() -> None:
    """A spot of 5 m in a meadow of 1.4 km: the densities of both meadows are those of the spot."""
    grid = PolarGrid.of(72, 10.0, 10.0, 2000.0)
    sums = PlaceSums(grid, 1.8)
    spot = np.zeros(grid.shape)
    turn, cell = grid.cells_of(1.0, 70.0)
    spot[turn, cell] = 1.0
    for _ in range(8):
        sums.add(spot, spot)
    small = [np.array([[60.0, -20.0], [100.0, -20.0], [100.0, 20.0], [60.0, 20.0]])]
    large = [np.array([[60.0, -700.0], [1460.0, -700.0], [1460.0, 700.0], [60.0, 700.0]])]
    (one, _), centre, few = sums.worst(small, [])
    (two, _), _, many = sums.worst(large, [])
    assert one.expected == two.expected > 1.0 / LARGEST**2 / 1.7
    assert np.hypot(*(centre - [70.0, 1.2])) < LARGEST
    assert few < 200 < many, "as many places as the site touches, all counted by the flight itself"


def test_ground_under_obstacles_does_not_count() -> None:
    """A building covers five sixths of the ground: the same hits on what is left are denser by the ground covered."""
    sums = PlaceSums(GRID, 1.8)
    sums.add(np.ones(GRID.shape), np.ones(GRID.shape))
    site = [square(60.0, 0.0, 1.0)]
    (alone, _), _, _ = sums.worst(site, [])
    (beside, _), _, _ = sums.worst(site, [np.array([[50.0, -20.0], [60.5, -20.0], [60.5, 20.0], [50.0, 20.0]])])
    assert 1.2 * alone.expected < beside.expected <= 4.0 * alone.expected * 1.3


def test_a_kernel_over_azimuth_keeps_what_it_spreads() -> None:
    weights = kernel_weights(GRID, 10.0)
    assert weights.sum(axis=0) == pytest.approx(np.ones(GRID.azimuth_cells))
    assert np.count_nonzero(weights[0]) == 2 * 4 - 1, "narrower than the kernel on both sides"
    assert weights == pytest.approx(weights.T)
