"""Stacks in space: where their rounds stand, and how far rounds are from each other and from planes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from burst_fenicsx.geometry import Contour, Profile, load_profile
from burst_fenicsx.meshing import mesh_profile
from burst_fenicsx.meshing.disc import equal_area_factor
from burst_fenicsx.meshing.sizing import grid_counts
from fragfield.case.conversion.clearance import Hull, clearance, min_clearance, near_pairs, placed_body
from fragfield.case.conversion.stack import pallet

RADIUS, LENGTH = 0.0775, 0.3


def _profile(points, arcs=()):
    outer = Contour.from_points(points, arcs)
    cavity = Contour.from_points([(0.0, 0.01), (outer.end, 0.01)])
    return Profile("solid", outer, cavity, 0.0)


CYLINDER = _profile([(0.0, RADIUS), (LENGTH, RADIUS)])


def _cylinder(position, axis=(0.0, 0.0, 1.0)):
    return placed_body(CYLINDER, position, axis)


def _about(centre, axis):
    """A cylinder with its middle at a point."""
    axis = np.array(axis, dtype=float)
    axis /= np.linalg.norm(axis)
    return _cylinder(np.array(centre) - 0.5 * LENGTH * axis, axis)


# ---- clear distances with closed forms


@pytest.mark.parametrize("gap", [0.0217, 1e-5, 0.0, -1e-5, -0.005, -0.07])
def test_parallel_cylinders(gap):
    """Side by side: the distance of the axes less the diameter, also where they overlap, and also shifted along."""
    for shift in (0.0, 0.1, -0.2):
        other = _cylinder(((2 * RADIUS + gap) * 0.6, (2 * RADIUS + gap) * 0.8, shift))
        assert clearance(_cylinder((0, 0, 0)), other) == pytest.approx(gap, abs=1e-9)


@pytest.mark.parametrize("gap", [0.05, 1e-4, 0.0, -0.002, -0.04])
@pytest.mark.parametrize("angle", [90.0, 35.0, 3.0])
def test_crossed_cylinders(gap, angle):
    """Axes that cross at an angle: the distance between the axes less the diameter."""
    turn = np.radians(angle)
    first = _about((0, 0, 0), (0, 0, 1))
    second = _about((2 * RADIUS + gap, 0.05 * np.sin(turn), 0.02), (0, np.sin(turn), np.cos(turn)))
    assert clearance(first, second) == pytest.approx(gap, abs=1e-8)


@pytest.mark.parametrize("gap", [0.1, 1e-6, 0.0, -0.001, -0.04])
@pytest.mark.parametrize("offset", [0.0, 0.03])
def test_coaxial_cylinders_end_to_end(gap, offset):
    assert clearance(_cylinder((0, 0, 0)), _cylinder((offset, 0, LENGTH + gap))) == pytest.approx(gap, abs=1e-9)


def test_rims_that_face_each_other_obliquely():
    """Coplanar axes, apart along and across: the distance of the two nearest points of the rims."""
    other = _cylinder((2 * RADIUS + 0.03, 0, LENGTH + 0.04))
    assert clearance(_cylinder((0, 0, 0)), other) == pytest.approx(0.05, abs=1e-9)


def test_the_rim_of_a_tilted_cylinder_over_a_flat_end():
    """A cylinder tilted by 30 degrees whose lowest point hangs above the middle of the other's end."""
    turn = np.radians(30.0)
    axis = np.array([np.sin(turn), 0.0, np.cos(turn)])
    lowest = np.array([0.0, 0.0, LENGTH + 0.007])
    rim = RADIUS * np.array([-np.cos(turn), 0.0, np.sin(turn)])  # from the lowest point to the middle of its base
    assert clearance(_cylinder((0, 0, 0)), _cylinder(lowest + rim, axis)) == pytest.approx(0.007, abs=1e-8)


def test_spheres_of_arcs():
    """Bodies whose meridian is nearly a half circle: the distance of the centres less two radii, in any direction."""
    radius, tip = 0.1, 0.02
    half = np.sqrt(radius**2 - tip**2)
    ball = _profile([(0.0, tip), (2 * half, tip)], [radius])
    random = np.random.default_rng(5)
    for _ in range(8):
        way, one, other = random.normal(size=(3, 3))
        way, one, other = (vector / np.linalg.norm(vector) for vector in (way, one, other))
        if max(abs(way @ one), abs(way @ other)) > 0.95:
            continue  # the flat tips would face each other
        first = placed_body(ball, -half * one, one)
        for gap in (0.08, 1e-4, -0.01):
            second = placed_body(ball, (2 * radius + gap) * way - half * other, other)
            assert clearance(first, second) == pytest.approx(gap, abs=1e-5), "the chords' error is 1e-6 m each"


def test_coincident_rounds_and_one_within_the_other_overlap_by_the_depth_of_the_deepest_point():
    assert clearance(_cylinder((0, 0, 0)), _cylinder((0, 0, 0))) == pytest.approx(-RADIUS, abs=1e-9)
    shell = load_profile("m107")
    bodies = [placed_body(shell, (0, 0, 0), (0, 0, 1)) for _ in range(2)]
    assert clearance(*bodies) == pytest.approx(-0.0775, abs=1e-6)
    small = placed_body(_profile([(0.0, 0.02), (0.05, 0.02)]), (0, 0, 0.1), (0, 0, 1))
    assert clearance(_cylinder((0, 0, 0)), small) == clearance(small, _cylinder((0, 0, 0)))
    assert clearance(_cylinder((0, 0, 0)), small) == pytest.approx(-RADIUS, abs=1e-9)


def test_a_waist_lets_another_round_come_nearer():
    """Dumb-bells interlock: the rim of one stands in the other's waist, where a convex hull would see an overlap."""
    bell = _profile([(0, 0.1), (0.1, 0.1), (0.101, 0.04), (0.499, 0.04), (0.5, 0.1), (0.6, 0.1)])
    first = placed_body(bell, (0, 0, 0), (0, 0, 1))
    second = placed_body(bell, (0.15, 0, 0.25), (0, 0, 1))
    assert clearance(first, second) == pytest.approx(0.01, abs=1e-9)  # waist of one, rim of the other: 0.15 - 0.14
    third = placed_body(bell, (0.15, 0, 0.01), (0, 0, 1))
    assert clearance(first, third) == pytest.approx(-0.05, abs=1e-6)


def test_a_tilted_pair_against_points_on_the_surfaces():
    """Two M107 at odd angles: never above the distance of any two points, and nearly that of the nearest two."""
    shell = load_profile("m107")
    random = np.random.default_rng(11)
    for _ in range(5):
        axis = random.normal(size=3)
        places = [np.zeros(3), random.normal(size=3) * 0.3 + (0.5, 0.0, 0.0)]
        axes = [np.array([0.0, 0.0, 1.0]), axis / np.linalg.norm(axis)]
        bodies = [placed_body(shell, place, one) for place, one in zip(places, axes, strict=True)]
        found = clearance(*bodies)
        clouds = [_surface(shell, place, one) for place, one in zip(places, axes, strict=True)]
        nearest = cKDTree(clouds[0]).query(clouds[1])[0].min()
        assert clearance(*reversed(bodies)) == pytest.approx(found, abs=1e-8)
        if found > 0.0:
            assert found <= nearest <= found + 3e-3


def _surface(profile, position, axis):
    station = np.linspace(0, profile.length, 201)
    radius = np.r_[profile.outer.radius(station), np.linspace(0, 1, 40) * profile.outer.radii[0],
                   np.linspace(0, 1, 40) * profile.outer.radii[-1]]  # fmt: skip
    height = profile.length - np.r_[station, np.zeros(40), np.full(40, profile.length)]
    turn = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    across = np.linalg.svd(np.array(axis)[None])[2][1:]
    circle = np.cos(turn)[:, None] * across[0] + np.sin(turn)[:, None] * across[1]
    return (np.array(position) + height[:, None, None] * np.array(axis) + radius[:, None, None] * circle[None]).reshape(
        -1, 3
    )


# ---- bodies, planes and many of them


def test_heights_of_a_body_over_a_plane():
    """A cylinder tilted by 30 degrees about its base's middle: the rim dips by r sin 30, the far rim rises."""
    turn = np.radians(30.0)
    body = _cylinder((0, 0, 1), (np.sin(turn), 0, np.cos(turn)))
    lowest, highest = body.reach((0, 0, 1))
    assert lowest == pytest.approx(1 - RADIUS * np.sin(turn))
    assert highest == pytest.approx(1 + LENGTH * np.cos(turn) + RADIUS * np.sin(turn))
    shell = placed_body(load_profile("m107"), (0, 0, 0), (0, 1, 0))
    assert shell.reach((1, 0, 0)) == pytest.approx((-0.0775, 0.0775))
    assert shell.reach((0, 1, 0)) == pytest.approx((0.0, 0.6039))


def test_a_mesh_lies_within_its_circumscribed_body_and_touches_it():
    profile, size = load_profile("m107"), 0.012
    counts = grid_counts(profile, size)
    body = placed_body(
        profile, (0.1, 0, 0), (0, 1, 1), stations=counts.stations, enlargement=equal_area_factor(4 * counts.core)
    )
    mesh = mesh_profile(profile, size, position=(0.1, 0, 0), axis=(0, 1, 1))
    directions = np.random.default_rng(1).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for direction in directions:
        assert (mesh.nodes @ direction).max() <= body.reach(direction)[1] + 1e-12
    slack = [body.reach(direction)[1] - (mesh.nodes @ direction).max() for direction in directions]
    assert min(slack) < 1e-4
    hull = Hull.of(mesh.nodes, (0, 1, 1))
    other = placed_body(profile, (0.3, 0, 0), (0, 0, 1))
    # Beyond edges a hull's distances are those from the planes of its faces.
    assert clearance(hull, other) == pytest.approx(clearance(body, other), abs=1e-3)


def test_the_nearest_pair_of_a_pallet_and_all_that_are_near():
    shell = load_profile("m107")
    places = pallet((4, 4, 1), (0.18, 0.19, 0.0)) + np.array([0.0, 0.0, 0.5])
    places[6, 0] += 0.004  # the third of the second row: nearer to the fourth
    bodies = [placed_body(shell, place, (0, 0, 1)) for place in places]
    first, second, gap = min_clearance(bodies)
    assert (first, second) == (6, 7)
    assert gap == pytest.approx(0.18 - 0.004 - 0.155, abs=1e-8)
    near = {(i, j): found for i, j, found in near_pairs(bodies, 0.026)}
    lines = {(4 * line + k, 4 * line + k + 1): 0.025 for line in range(4) for k in range(3)}
    del lines[(5, 6)]  # left behind, 29 mm away
    assert near == pytest.approx({**lines, (6, 7): 0.021}, abs=1e-8)
    assert min_clearance(bodies[:1]) is None
