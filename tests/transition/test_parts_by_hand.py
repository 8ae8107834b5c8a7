"""Parts of the break-up by closed forms: sums over casings, ledgers, quantiles of rings, checks of a meridian, laws."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from flight.fragments import Fragments
from transition import BreakUp, BreakUpSettings, InputError
from transition.breaking_up import _whole
from transition.cells.cell_points import lightest_that_matters, numbers
from transition.cells.meridian import HalfPlane
from transition.cells.meridian_checks import check_meridian
from transition.cells.shape_functions import CORNERS, MODE_SQUARES, modes, trilinear
from transition.kernels import cell_sampling, ring_sampling
from transition.kernels.bisection import _cut, _direction, _divide, _key, _partition, _pivot, _select
from transition.kernels.cell_sampling import moments, turn_rigidly
from transition.kernels.ring_sampling import _quantile
from transition.law.mean_mass import explosive_constant, mott_1947, thinned
from transition.law.mott import MottLaw
from transition.law.samplers import Quantile
from transition.law.segment_law import _at_rupture
from transition.ledger import casing_sums, ledger, ring_sums
from transition.placement.isometry import Isometry, rotation
from transition.placement.mirroring import SymmetryPlane, images
from transition.placement.placing import place

UPRIGHT = HalfPlane(np.zeros(3), np.eye(3))


def square(size, place=(0.0, 0.0)):
    """One quadrilateral of the half plane y = 0, counter-clockwise, as nodes (4, 3) and their cell."""
    flat = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]) * size + place
    return np.column_stack([flat[:, 0], np.zeros(4), flat[:, 1]]), np.array([[0, 1, 2, 3]])


def check(size=0.5, mass=1.0, stretch=1.0, moved=None, spin=0.0):
    """Check a ring (inner radius 0, outer `size`, as high as wide) of density 1000 kg/m3."""
    reference, cells = square(size)
    nodes = {"reference": reference, "position": stretch * reference, "velocity": 100.0 * reference + [0.0, 0.0, 5.0]}
    for name, offset in (moved or {}).items():
        nodes[name] = nodes[name] + [0.0, offset, 0.0]
    nodes["velocity"][1, 1] = spin
    whole = 1000.0 * np.pi * size**3
    check_meridian("file", UPRIGHT, nodes, cells, np.array([mass * whole]), np.array([True]), 1000.0)


def test_a_node_may_leave_the_half_plane_by_a_billionth_of_the_largest_coordinate():
    """Before the burst by that before the burst; now by the larger of both, as a casing grows."""
    for size in (0.5, 3.0):
        check(size, moved={"reference": 0.9e-9 * size, "position": 0.9e-9 * size})
        check(size, stretch=2.0, moved={"position": 1.9e-9 * size})
        check(size, stretch=0.5, moved={"position": 0.9e-9 * size})
        for moved in ({"reference": 1.1e-9 * size}, {"position": -1.1e-9 * size}):
            with pytest.raises(InputError, match="outside the half plane"):
                check(size, moved=moved)
        with pytest.raises(InputError, match="position of node 0 lies"):
            check(size, stretch=2.0, moved={"position": 2.1e-9 * size})


def test_a_ring_may_turn_by_a_billionth_of_the_largest_speed():
    fastest = 100.0 * 0.5 + 5.0
    check(spin=0.9e-9 * fastest)
    with pytest.raises(InputError, match=r"node 1 has a velocity of .* m/s across the half plane"):
        check(spin=1.1e-9 * fastest)


@pytest.mark.parametrize(("share", "refused"), [(0.96, False), (1.04, False), (0.94, True), (1.06, True)])
def test_masses_must_be_those_of_whole_rings_to_a_twentieth(share, refused):
    if refused:
        with pytest.raises(InputError, match="cells/mass must be that of whole rings"):
            check(mass=share)
    else:
        check(mass=share)


def test_a_round_may_reach_to_its_axis_but_not_beyond():
    nodes, cells = square(0.5, (-0.9e-9 * 0.5, 0.0))
    still = {"reference": nodes, "position": nodes, "velocity": np.ones((4, 3)) * [1.0, 0.0, 1.0]}
    masses = np.array([1000.0 * np.pi * 0.125]), np.array([True])
    check_meridian("file", UPRIGHT, still, cells, *masses, 1000.0)
    beyond = nodes - [0.2e-9, 0.0, 0.0]
    with pytest.raises(InputError, match="beyond the axis"):
        check_meridian("file", UPRIGHT, still | {"reference": beyond}, cells, *masses, 1000.0)


def test_sums_of_a_ring_that_flies_as_one():
    """A thin ring about an axis askew: m v, m v2 / 2, m |v| and m |x| |v|, with |x| of all points of its circle."""
    frame = np.array([[0.6, 0.8, 0.0], [0.0, 0.0, -1.0], [-0.8, 0.6, 0.0]])
    half, radius, height = HalfPlane(np.array([1.0, -2.0, 0.5]), frame), 0.4, 1.5
    state = np.tile([radius, height, 30.0, 40.0], (1, 4, 1))
    found = ring_sums(np.array([2.0]), np.array([[0.1, 0.2, 0.3, 0.4]]), state, half)
    assert found.mass == 2.0
    assert found.momentum == pytest.approx(2.0 * 40.0 * frame[2], rel=1e-12)
    assert found.scale == pytest.approx(2.0 * 50.0, rel=1e-12)
    assert found.energy == found.cell_energy == pytest.approx(0.5 * 2.0 * 50.0**2, rel=1e-12)
    assert found.angular_momentum == pytest.approx(np.cross(half.origin, found.momentum), rel=1e-12)
    turn = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)[:, None]
    circle = half.origin + height * frame[2] + radius * (np.cos(turn) * frame[0] + np.sin(turn) * frame[1])
    distance = math.sqrt((circle**2).sum(axis=1).mean())
    assert found.angular_scale == pytest.approx(2.0 * distance * 50.0, rel=1e-12)


def test_sums_of_rings_are_by_their_nodes():
    """Two rings whose nodes move apart: the energy of the nodes, and that of their mean for the rings as one piece."""
    state = np.zeros((2, 4, 4))
    state[..., 0], state[0, :, 3], state[1, :, 3] = 1.0, [10.0, -10.0, 10.0, -10.0], [5.0, 5.0, -3.0, -3.0]
    shares = np.array([[0.25] * 4, [0.1, 0.2, 0.3, 0.4]])
    found = ring_sums(np.array([1.0, 2.0]), shares, state, UPRIGHT)
    mean = 0.3 * 5.0 - 0.7 * 3.0
    assert found.energy == pytest.approx(0.5 * (100.0 + 2.0 * (0.3 * 25.0 + 0.7 * 9.0)), rel=1e-12)
    assert found.cell_energy == pytest.approx(0.5 * 2.0 * mean**2, rel=1e-12)
    assert found.momentum == pytest.approx([0.0, 0.0, 2.0 * mean], rel=1e-12)
    assert found.scale == pytest.approx(10.0 + 2.0 * (0.3 * 5.0 + 0.7 * 3.0), rel=1e-12)


def test_sums_of_cells_that_fly_as_one_or_spin():
    """A cube of edge 2 b that turns about an axis through its centre: the moment of inertia is m (2 b)^2 / 6."""
    corners = 0.3 * CORNERS[None]
    spin = np.array([0.0, 0.0, 50.0])
    turning = casing_sums(np.array([4.0]), corners, np.cross(spin, corners))
    inertia = 4.0 * 0.6**2 / 6.0
    assert turning.angular_momentum == pytest.approx(inertia * spin, rel=1e-12, abs=1e-12)
    assert turning.momentum == pytest.approx(np.zeros(3), abs=1e-12)
    assert turning.cell_energy == pytest.approx(0.0, abs=1e-12)
    speed = 50.0 * 0.3 * math.sqrt(2.0)  # of every corner
    assert turning.energy == pytest.approx(0.5 * 4.0 * speed**2, rel=1e-12)
    assert turning.scale == pytest.approx(4.0 * speed, rel=1e-12)
    assert turning.angular_scale == pytest.approx(4.0 * speed * 0.3 * math.sqrt(3.0), rel=1e-12)
    place_, velocity = np.array([3.0, -1.0, 2.0]), np.array([10.0, 20.0, -30.0])
    flying = casing_sums(np.array([4.0]), corners + place_, np.broadcast_to(velocity, (1, 8, 3)))
    assert flying.angular_momentum == pytest.approx(4.0 * np.cross(place_, velocity), rel=1e-12)
    assert flying.energy == flying.cell_energy == pytest.approx(2.0 * 1400.0, rel=1e-12)
    both = turning + flying
    assert both.mass == 8.0
    assert both.scale == turning.scale + flying.scale
    assert both.momentum == pytest.approx(4.0 * velocity)


def test_sums_move_with_the_casing():
    """Turned and shifted, or mirrored: as the sums of the cells there; momentum across the shift turns as well."""
    generator = np.random.default_rng(4)
    corners, velocity = CORNERS + generator.uniform(-0.3, 0.3, (5, 8, 3)), generator.normal(size=(5, 8, 3))
    mass = generator.uniform(1.0, 2.0, 5)
    here = casing_sums(mass, corners, velocity)
    mirror = Isometry(np.diag([-1.0, 1.0, 1.0]), np.array([0.8, 0.0, 0.0]))
    for motion in (rotation((1.0, 2.0, -0.5), (0.3, -0.2, 1.0), 0.7), mirror):
        there = casing_sums(mass, motion.place(corners), motion.vector(velocity))
        if motion is mirror:  # corners in the order of a mirrored cell are no cell; the field is the same
            assert np.linalg.det(motion.matrix) == pytest.approx(-1.0)
        moved = here.moved(motion)
        assert moved.momentum == pytest.approx(there.momentum, rel=1e-12)
        assert moved.angular_momentum == pytest.approx(there.angular_momentum, rel=1e-11)
        assert moved.energy == here.energy


def test_a_ledger_by_hand():
    """Two fragments against a casing that had more of everything."""
    fragments = Fragments.from_arrays([1.0, 3.0], [(0, 0, 2.0), (1.0, 0, 0)], [(5.0, 0, 0), (0, 2.0, 0)])
    spin = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.5]])
    casing = casing_sums(np.array([5.0]), CORNERS[None] * 0.0, np.broadcast_to([6.0, 7.0, 0.0], (1, 8, 3)))
    casing = replace(casing, angular_momentum=np.array([0.0, 9.0, 5.0]), angular_scale=20.0, scale=50.0)
    found = ledger(fragments, spin, casing)
    assert (found.mass, found.casing_mass) == (4.0, 5.0)
    assert found.mass_error == pytest.approx(-0.2)
    assert found.momentum == (5.0, 6.0, 0.0)
    assert found.casing_momentum == (30.0, 35.0, 0.0)
    assert found.momentum_error == pytest.approx(math.hypot(25.0, 29.0) / 50.0)
    # (0, 0, 2) x (5, 0, 0) = (0, 10, 0) and 3 (1, 0, 0) x (0, 2, 0) = (0, 0, 6)
    assert found.angular_momentum == (0.0, 10.0, 6.0)
    assert found.spin == (0.0, 1.0, 0.5)
    assert found.angular_momentum_error == pytest.approx(math.hypot(2.0, 1.5) / 20.0)
    assert found.energy == pytest.approx(0.5 * 25.0 + 1.5 * 4.0)
    assert found.energy_error == pytest.approx(18.5 / (2.5 * 85.0) - 1.0)
    at_rest = casing_sums(np.array([5.0]), CORNERS[None], np.zeros((1, 8, 3)))
    still = ledger(fragments, spin, at_rest)
    assert still.momentum_error == still.angular_momentum_error == still.energy_error == 0.0


@pytest.mark.parametrize("seed", range(4))
def test_quantiles_of_a_density_are_where_its_integral_has_their_share(seed):
    """Of (p + q x)^2 and of those that vanish at an end or inside; to the ends of the interval."""
    generator = np.random.default_rng(seed)
    for _ in range(300):
        root, lift = generator.uniform(-1.3, 1.3), generator.choice([0.0, 1e-6, 0.1, 5.0])
        a, b, c = generator.choice([(root * root + lift, -2.0 * root, 1.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0)])

        def integral(x, a=a, b=b, c=c):
            return a * (x + 1.0) + 0.5 * b * (x * x - 1.0) + c / 3.0 * (x**3 + 1.0)

        share = float(generator.choice([1e-9, 1e-4, generator.uniform(), 1.0 - 1e-4]))
        found = _quantile(a, b, c, share)
        assert -1.0 <= found <= 1.0
        assert integral(found) / integral(1.0) == pytest.approx(share, abs=1e-9)


def test_modes_are_orthogonal_and_give_the_field_back():
    generator = np.random.default_rng(6)
    corners, points = generator.normal(size=(4, 8, 3)), generator.random((4, 3))
    made = modes(corners)
    x, y, z = (2.0 * points - 1.0).T
    values = np.stack([np.ones(4), x, y, z, x * y, x * z, y * z, x * y * z])
    np.testing.assert_allclose(
        trilinear(corners, points), np.einsum("ak,kaj->kj", values, made), rtol=1e-12, atol=1e-13
    )
    at_corners = np.stack([trilinear(corners[:1], 0.5 * (corner[None] + 1.0))[0] for corner in CORNERS])
    np.testing.assert_allclose(at_corners, corners[0], rtol=1e-13, atol=1e-14)
    nodes, weight = np.polynomial.legendre.leggauss(2)
    u, v, w = np.meshgrid(nodes, nodes, nodes, indexing="ij")
    each = np.stack([np.ones_like(u), u, v, w, u * v, u * w, v * w, u * v * w]).reshape(8, -1)
    products = each @ np.diag(np.einsum("i,j,k->ijk", weight, weight, weight).ravel() / 8.0) @ each.T
    np.testing.assert_allclose(products, np.diag(MODE_SQUARES), atol=1e-14)


def test_moments_are_those_of_the_points_and_a_rigid_turn_adds_its_own():
    generator = np.random.default_rng(2)
    mass, values, centre = generator.uniform(1.0, 2.0, 40), generator.normal(size=(40, 6)), generator.normal(size=3)
    inertia, momentum = moments(mass, values, centre)
    away = values[:, :3] - centre
    np.testing.assert_allclose(momentum, (mass[:, None] * np.cross(away, values[:, 3:])).sum(axis=0), rtol=1e-12)
    expected = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(mass, away, strict=True))
    np.testing.assert_allclose(inertia, expected, rtol=1e-12)
    rate = np.array([0.3, -0.7, 1.1])
    turned = values.copy()
    turn_rigidly(turned, centre, rate)
    np.testing.assert_array_equal(turned[:, :3], values[:, :3])
    np.testing.assert_allclose(turned[:, 3:] - values[:, 3:], np.cross(rate, away), rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("dimension", [2, 3])
def test_fragments_above_the_lightest_that_matters_hold_ninety_eight_per_cent(dimension):
    law = MottLaw.from_mean(0.015, dimension)
    lightest = lightest_that_matters(law)
    assert float(law.mass_fraction_above(lightest)) == pytest.approx(0.98, rel=1e-9)
    if dimension == 2:  # as the module says: a sixth of the mean
        assert lightest == pytest.approx(0.16 * 0.015, rel=0.03)


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


def test_a_wall_of_the_same_section_is_thinner_farther_out():
    """Plane strain: pi (a2 - (a - t)2) stays."""
    wall = thinned(0.08, 0.02, 0.1)
    assert 0.1**2 - (0.1 - wall) ** 2 == pytest.approx(0.08**2 - 0.06**2, rel=1e-12)
    assert thinned(0.08, 0.02, 0.08) == pytest.approx(0.02, rel=1e-12)


def test_motts_law_of_1947_by_hand():
    """x0 = sqrt(2 P / (rho gamma)) / rate = 1 mm here; breadth 1.5 mm, length 1.6 times that, 10 mm thick."""
    density, gamma, rate = 8000.0, 50.0, 1e4
    stress = 0.5 * density * gamma * (1e-3 * rate) ** 2
    mass = density * 1.5e-3 * (1.6 * 1.5e-3) * 0.01
    assert mott_1947(density, stress, gamma, 0.01, rate) == pytest.approx(mass, rel=1e-12)
    for still in (0.0, -1.0):
        assert mott_1947(density, stress, gamma, 0.01, still) == math.inf


@pytest.mark.parametrize(
    ("name", "constant"), [("TNT", 3.81), ("tnt", 3.81), ("Comp. B", 2.71), ("composition_b", 2.71)]
)
def test_explosives_are_known_by_any_spelling(name, constant):
    assert explosive_constant(name, None) == constant
    assert explosive_constant(name, 0.0) == 0.0


def segment(**changed):
    data = {"outer_radius": 0.08, "wall_thickness": 0.02, "start": 0.1, "end": 0.115, "rupture_radius": 0.13,
            "rupture_wall": 0.011}  # fmt: skip
    return SimpleNamespace(data=SimpleNamespace(**data | changed), is_end=False)


def test_radius_and_wall_at_rupture_are_those_of_the_burst_where_it_has_both():
    burst = BreakUpSettings(rupture="burst", critical_strain=0.5)
    by_strain = (pytest.approx(0.12), pytest.approx(0.02 / 1.5), "critical_strain")
    assert _at_rupture(segment(), burst, "") == (0.13, 0.011, "burst")
    for name in ("rupture_radius", "rupture_wall"):
        for value in (math.nan, math.inf, 0.0):
            assert _at_rupture(segment(**{name: value}), burst, "") == by_strain
    assert _at_rupture(segment(), BreakUpSettings(critical_strain=0.5), "") == by_strain
    for name in ("outer_radius", "wall_thickness"):
        for value in (math.nan, math.inf, 0.0, -0.1):
            with pytest.raises(InputError, match=f"here: {name} is .* m; above zero is needed"):
                _at_rupture(segment(**{name: value}), burst, "here")


@pytest.mark.parametrize(("end", "wall"), [(0.115, 0.015), (0.2, 0.02)])
def test_a_base_is_as_thick_as_it_is_long_where_that_is_less(end, wall):
    piece = segment(end=end)
    piece.is_end = True
    radius, thickness, source = _at_rupture(piece, BreakUpSettings(), "")
    assert (radius, thickness, source) == (0.08, pytest.approx(wall), "unstretched")


def test_mirrors_close_wherever_they_stand():
    """Two planes at a right angle: three images, at any distance from the origin and of any size."""
    for distance in (0.0, 1e-4, 1e3):
        planes = [
            SymmetryPlane("a", (distance, 0.0, 0.0), (1.0, 0.0, 0.0)),
            SymmetryPlane("b", (0.0, -distance, 0.0), (0.0, 1.0, 0.0)),
        ]
        found = images(planes)
        assert [image.planes for image in found] == [("a",), ("b",), ("a", "b")]
        assert found[2].place(np.zeros(3)) == pytest.approx([2.0 * distance, -2.0 * distance, 0.0], rel=1e-12)


@pytest.mark.parametrize("normal", [(-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
def test_parallel_mirrors_make_rounds_without_end(normal):
    planes = [SymmetryPlane("a", (0.0,) * 3, (1.0, 0.0, 0.0)), SymmetryPlane("b", (5.0, 0.0, 0.0), normal)]
    with pytest.raises(InputError, match="are parallel; allowed: planes that meet"):
        images(planes)


@pytest.mark.parametrize("wrong", ["fragment", "point", "none", "heavy"])
def test_masses_that_cannot_be_placed_are_refused(wrong):
    position, mass = np.eye(3), np.array([1.0, 2.0, 3.0])
    asked = {"fragment": [6.0, 0.0], "point": [2.0, 2.0], "none": [], "heavy": [4.0, 2.0 + 1e-6]}[wrong]
    mass = np.array([1.0, 0.0, 3.0]) if wrong == "point" else mass
    with pytest.raises(ValueError, match="placing: "):
        place(np.array(asked), position, mass, np.random.default_rng(1))


def test_what_is_not_asked_for_is_left_out():
    """Half of the mass: fragments of the masses asked for; the rest goes to parts as heavy as the heaviest."""
    generator = np.random.default_rng(3)
    position, mass = generator.normal(size=(500, 3)), np.full(500, 0.01)
    for asked in ([0.5, 0.7, 1.0], [2.0, 0.4], [4.9]):
        clusters = place(np.array(asked), position, mass, generator)
        assert clusters.mass == pytest.approx(asked, rel=1e-9)
        assert np.bincount(clusters.point, clusters.piece, minlength=500).max() <= 0.01 * (1.0 + 1e-12)


def test_whole_numbers_from_zero_are_taken():
    assert [_whole("seed", value) for value in (0, 7, np.int64(3), True)] == [0, 7, 3, 1]
    for value in (-1, 0.5, "1", None):
        with pytest.raises(InputError, match=r"break_up seed: found .*; a whole number from 0 upwards is needed"):
            _whole("seed", value)


@pytest.mark.parametrize(
    ("velocity", "threads", "cores", "workers"), [("mean", 3, 5, 3), ("mean", None, 5, 5), ("mean", None, None, 1),
                                                  ("interpolation", 3, 5, 1)],
)  # fmt: skip
def test_realisations_are_drawn_on_the_threads_asked_for_or_on_all_cores(
    monkeypatch, velocity, threads, cores, workers
):
    """Interpolation takes one: dolfinx evaluates for one thread at a time."""
    used = []

    class Pool:
        def __init__(self, number):
            used.append(number)

        def __enter__(self):
            return self

        def __exit__(self, *_):
            return False

        def map(self, function, numbers):
            return [function(number) for number in numbers]

    monkeypatch.setattr(os, "cpu_count", lambda: cores)
    monkeypatch.setattr("transition.breaking_up.ThreadPoolExecutor", Pool)
    prepared = SimpleNamespace(
        settings=SimpleNamespace(velocity=velocity), fragments=lambda seed, number: (seed, number)
    )
    assert BreakUp.many(prepared, 4, [1, 2], threads) == [(4, 1), (4, 2)]
    assert used == [workers]


def test_a_law_that_makes_dust_is_refused_before_it_fills_the_memory():
    """Twenty million fragments with all images; just as many are drawn."""
    law = SimpleNamespace(mass=10.0, law=SimpleNamespace(mean=1e-6))
    one = SimpleNamespace(laws=[law], _images=(), snapshot=SimpleNamespace(source="file"))
    BreakUp._check_number(one)
    one._images = (None,)
    BreakUp._check_number(one)
    one._images = (None, None)
    with pytest.raises(InputError, match=r"file: the casings would break into 3e\+07 fragments .mean masses 1e-06 kg"):
        BreakUp._check_number(one)
    law.law.mean = math.nan
    with pytest.raises(InputError):
        BreakUp._check_number(one)


@pytest.mark.parametrize("module", [cell_sampling, ring_sampling])
def test_strides_of_the_points_are_powers_of_the_root_of_roberts(module):
    """1/g, 1/g2 and 1/g3 with g4 = g + 1, the generalised golden ratio of three dimensions."""
    first, second, third = module._STEP
    root = 1.0 / first
    assert root**4 == pytest.approx(root + 1.0, rel=1e-14)
    assert (second, third) == (pytest.approx(first**2, rel=1e-14), pytest.approx(first**3, rel=1e-14))


@pytest.mark.parametrize(("number", "method"), [(7.9, "few_pieces"), (8.1, "quantile")])
def test_fewer_than_eight_pieces_follow_the_law_by_proportion_only(number, method):
    law = MottLaw.from_mean(0.5, 2)
    assert Quantile().draw(law, number * 0.5, np.random.default_rng(1)).method == method


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


@pytest.mark.parametrize("kind", ["plane", "sphere", "angle"])
@pytest.mark.parametrize("seed", range(5))
def test_rows_are_ordered_so_far_that_the_mass_is_reached(kind, seed):
    """All before have keys no larger, all behind none smaller; their mass with the part of one is what is needed."""
    generator = np.random.default_rng(seed)
    count = int(generator.integers(2, 400))
    row = np.column_stack([generator.normal(size=(count, 3)), generator.uniform(0.1, 1.0, count)])
    row[generator.integers(0, count, count // 3), :3] = row[0, :3]  # several in one place
    ident, before = np.arange(count), row.copy()
    q = {"plane": [0.3, -0.5, 0.8, 0, 0, 0, 0, 0, 0], "sphere": [-2.0, 0.4, 0.0, 1, 0, 0, 0, 0, 0],
         "angle": [1.0, 0.0, 0, 0.1, 1, 0, 1.0, 0, -0.2]}[kind]  # fmt: skip
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
    generator, q = np.random.default_rng(7), np.empty(9)
    way = generator.normal(size=(10, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    near = math.sqrt(square) * way[:1]
    row = np.column_stack([np.concatenate([way, -way, near, -near]) + 4.0, np.ones(22)])
    _cut(row, 0, 22, 0.5, np.ones(3), 0.3, np.full(3, 4.0), np.array(axis), np.empty(3), q)
    assert (q[4] == 1.0) == hollow
    _cut(row, 0, 22, 0.5, np.ones(3), 0.3, np.full(3, 4.0), np.zeros(3), np.empty(3), q)
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
