"""Exposed sites: paths, hits and landings in prisms against closed forms and against the flight's other counts."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flight
from flight.hazard.exposed import Prism, count_exposed, surfaces_of
from flight.scene.targets import contains
from tests.flight.clouds import cloud


def square(x: float, y: float, side: float) -> np.ndarray:
    half = 0.5 * side
    return np.array([[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]])


def flown(fragments, prisms, **options):
    result = flight.fly(fragments, witnesses=surfaces_of(prisms), sample=0, threads=1, **options)
    speed = np.linalg.norm(fragments.velocity, axis=1)
    return result, count_exposed(result, prisms, 0, fragments.position, speed)


def test_density_of_straight_paths_is_that_of_a_point_source():
    number, generator = 200_000, np.random.default_rng(4)
    way = generator.normal(size=(number, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    fragments = flight.Fragments(0.01, (0.0, 0.0, 0.9), 1000.0 * way)
    prism = Prism(square(8.0, 3.0, 4.0), -1.0, 1.8)
    scene = {"gravity": 0.0, "ground": 0.0, "domain": flight.Domain(radius=50.0)}
    _, counts = flown(fragments, [prism], air="vacuum", ricochet="none", **scene)
    # mean of 1 / (4 pi r^2) over the prism, by Gauss points
    x, w = np.polynomial.legendre.leggauss(12)
    gx, gy, gz = np.meshgrid(8.0 + 2.0 * x, 3.0 + 2.0 * x, 0.9 + 0.9 * x, indexing="ij")
    weight = w[:, None, None] * w[None, :, None] * w[None, None, :] / 8.0
    exact = float((weight / (4.0 * math.pi * (gx**2 + gy**2 + (gz - 0.9) ** 2))).sum())
    found = counts["track"][0] / prism.volume / number
    error = math.sqrt(counts["track_squares"][0]) / prism.volume / number
    assert error < 0.03 * exact
    assert abs(found - exact) < 3.0 * error


def test_landings_inside_are_those_of_the_landing_table():
    fragments = cloud(30_000, seed=2)
    prisms = [Prism(square(60.0, 20.0, 30.0), -1.0, 1.8), Prism(square(-90.0, 0.0, 50.0), -1.0, 1.8, energy=20.0)]
    result, counts = flown(fragments, prisms)
    x, y = result.landing["position"][:, 0], result.landing["position"][:, 1]
    for prism, row in zip(prisms, counts, strict=True):
        low, high = prism.corners.min(axis=0), prism.corners.max(axis=0)
        inside = (x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1])
        expected = int((inside & (result.landing["energy"] >= prism.energy)).sum())
        assert expected > 15
        assert row["landings"] == expected


def test_hits_on_a_building_are_those_that_the_obstacle_stops():
    fragments = cloud(30_000, seed=3)
    box = flight.Building((40.0, 10.0), 12.0, 8.0, 5.0, azimuth=30.0)
    turn = math.radians(30.0)
    along, across = np.array([math.cos(turn), math.sin(turn)]), np.array([-math.sin(turn), math.cos(turn)])
    sides = ((6, 4), (-6, 4), (-6, -4), (6, -4))
    plan = np.array([np.array([40.0, 10.0]) + a * along + b * across for a, b in sides])
    prism = Prism(plan, -1.0, 5.0, height=5.0)
    result, counts = flown(fragments, [prism], obstacles=[box])
    struck = result.obstacle_hits
    assert len(struck) > 80
    assert counts["any_hits"][0] == len(np.unique(struck["fragment"]))
    assert abs(int(counts["hits"][0]) - int((struck["energy"] >= 79.0).sum())) <= 1  # 1 mm before the wall
    assert counts["energy"][0] == pytest.approx(struck["energy"].max(), rel=1e-3)


def test_a_fragment_that_begins_inside_counts_from_there():
    fragments = flight.Fragments([0.01, 0.01], [(0.0, 0.0, 1.0), (-5.0, 0.0, 1.0)], [(100.0, 0.0, 0.0)] * 2)
    prism = Prism(square(0.0, 0.0, 4.0), -1.0, 1.8, energy=1.0)
    scene = {"gravity": 0.0, "ground": 0.0, "domain": flight.Domain(radius=50.0)}
    _, counts = flown(fragments, [prism], air="vacuum", ricochet="none", **scene)
    assert counts["track"][0] == pytest.approx(2.0 + 4.0, abs=0.01)
    assert counts["hits"][0] == 1


def test_a_bank_shields_the_place_behind_it():
    fragments = cloud(20_000, seed=5)
    low = fragments.select(np.abs(fragments.velocity[:, 2]) < 0.05 * np.linalg.norm(fragments.velocity, axis=1))
    prism = Prism(square(0.0, 20.0, 5.0), -1.0, 1.8)
    _, bare = flown(low, [prism])
    bank = flight.Barricade((-30.0, 10.0), (30.0, 10.0), 4.0, slope=0.5)
    _, shielded = flown(low, [prism], obstacles=[bank])
    assert bare["hits"][0] > 10
    assert shielded["hits"][0] == 0
    assert shielded["track"][0] == 0.0


def test_area_seen_of_a_box():
    prism = Prism(square(0.0, 0.0, 2.0), -1.0, 3.0, height=3.0)
    diagonal = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [1.0, 1.0, 0.0]])
    diagonal /= np.linalg.norm(diagonal, axis=1, keepdims=True)
    assert prism.seen_area(diagonal) == pytest.approx([6.0, 4.0, 6.0 * math.sqrt(2.0)])
    assert prism.min_shadow == pytest.approx(4.0)
    plan, rise = np.array([[1.0, 2.0], [9.0, 3.0], [4.0, 8.0]]), math.radians(25.0)
    prism, turn = Prism(plan, -1.0, 3.0, height=2.0), np.radians([10.0, 75.0, 200.0, 303.0])
    way = np.column_stack([math.cos(rise) * np.cos(turn), math.cos(rise) * np.sin(turn), np.full(4, -math.sin(rise))])
    width = np.ptp(plan @ [-np.sin(turn), np.cos(turn)], axis=0)  # of the triangle across each direction
    assert prism.seen_area(way) == pytest.approx(2.0 * math.cos(rise) * width + 22.5 * math.sin(rise))


def test_messages():
    with pytest.raises(flight.InputError, match="enclose no area"):
        Prism(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]), 0.0, 1.0)
    for corners in (np.zeros((2, 2)), np.eye(3), np.zeros(6), [[0.0, 0.0], [1.0, 0.0], [1.0, math.nan]]):
        with pytest.raises(
            flight.InputError, match=r"corners have shape .*, needed \(k, 2\) with k of 3 or more, finite"
        ):
            Prism(corners, 0.0, 1.0)
    with pytest.raises(flight.InputError, match="not above the bottom"):
        Prism(square(0.0, 0.0, 1.0), 1.0, 1.0)


def test_surfaces_of_one_name_are_found_as_if_each_had_its_own():
    fragments = cloud(4000, seed=9)
    prisms = [Prism(square(20.0 * k, 15.0, 8.0), -1.0, 3.0) for k in range(-3, 4)]
    alike = surfaces_of(prisms)
    own = [
        flight.Polygon(one.corners, name=str(k))
        if isinstance(one, flight.Polygon)
        else flight.Panel(one.centre, one.normal, one.width, one.height, name=str(k))
        for k, one in enumerate(alike)
    ]
    ring = flight.Cylinder(10.0)
    first, second = (flight.fly(fragments, witnesses=[ring, *some], sample=0, threads=1) for some in (alike, own))
    assert len(first.hits) > 1000
    assert (first.hits == second.hits).all()


def test_points_of_a_triangle_are_those_between_its_sides() -> None:
    """Even-odd rule against the signs of the areas that a point spans with each side; no side lies along an axis."""
    corners, points = np.array([[1.0, 2.0], [9.0, 3.0], [4.0, 8.0]]), np.random.default_rng(3).uniform(0, 10, (400, 2))
    along, away = np.roll(corners, -1, axis=0) - corners, points[:, None] - corners
    between = (along[:, 0] * away[..., 1] - along[:, 1] * away[..., 0] > 0.0).all(axis=1)
    assert 50 < between.sum() < 150
    assert np.array_equal(contains(corners, points), between)
