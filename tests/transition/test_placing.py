"""Placing: every point is given out once, masses are exact, and fragments are compact wherever they lie."""

from __future__ import annotations

import numpy as np
import pytest

from tests.transition.synthetic import Tube
from transition import BreakUp, BreakUpSettings
from transition.cells.points import MaterialPoints
from transition.kernels.bisection import _angular, _cut, _key
from transition.placement.placing import Clusters, place


def partition(total, number, generator):
    """Random masses with a heavy tail and a given sum."""
    masses = generator.exponential(size=number) ** 3
    return masses * (total / masses.sum())


def points_of(position, mass, velocity=None):
    velocity = np.zeros_like(position) if velocity is None else velocity
    whole = np.zeros(len(mass), dtype=np.int32)
    return MaterialPoints(position, velocity, mass, whole, whole, np.zeros(len(mass), dtype=np.int64))


@pytest.mark.parametrize("seed", range(60))
def test_every_points_mass_is_given_once(seed):
    """Clouds of any shape, points of any mass, fragments from crumbs of one point to most of the cloud."""
    generator = np.random.default_rng(seed)
    count = int(np.exp(generator.uniform(0.0, np.log(3000.0))))
    position = generator.normal(size=(count, 3)) * generator.choice([1e-6, 0.02, 1.0], 3)
    mass = generator.lognormal(sigma=generator.choice([0.0, 1.0]), size=count) * 1e-3
    number = int(np.exp(generator.uniform(0.0, np.log(3.0 * count + 2.0))))
    asked = partition(mass.sum(), number, generator)
    axis = (0.0, 0.0, float(seed % 2))
    clusters = place(asked, position, mass, generator, axis)
    np.testing.assert_allclose(np.bincount(clusters.point, clusters.piece, minlength=count), mass, rtol=1e-12)
    assert clusters.mass.size == number
    np.testing.assert_allclose(clusters.mass, asked, rtol=1e-9, atol=1e-14 * mass.sum())
    assert clusters.mass.sum() == pytest.approx(mass.sum(), rel=1e-13)
    assert (clusters.piece > 0.0).all()
    assert (np.diff(clusters.offset) > 0).all()
    # A cut divides one point at most, and n fragments are separated by n - 1 cuts.
    assert count <= clusters.point.size <= count + number - 1
    for fragment in range(number):
        assert clusters.chosen[fragment] in clusters.point[clusters.offset[fragment] : clusters.offset[fragment + 1]]


def test_momenta_are_those_of_the_points():
    generator = np.random.default_rng(4)
    position, velocity = generator.normal(size=(5000, 3)), generator.normal(scale=1000.0, size=(5000, 3))
    points = points_of(position + np.array([3.0, 0.0, 5.0]), generator.lognormal(size=5000), velocity)
    clusters = place(partition(points.mass.sum(), 300, generator), points.position, points.mass, generator)
    centre, mean = clusters.means(points)
    scale = points.mass @ np.linalg.norm(velocity, axis=1)
    assert np.linalg.norm(clusters.mass @ mean - points.mass @ velocity) < 1e-13 * scale
    assert (
        np.abs(clusters.mass @ centre / points.mass.sum() - points.mass @ points.position / points.mass.sum()).max()
        < 1e-13
    )


def around(axis, angles, generator):
    """Points about an axis through a centre, at any distance and height, as rows of the kernel; and that centre."""
    unit = axis / np.linalg.norm(axis)
    first = np.linalg.svd(unit[None])[2][1]
    second, centre = np.cross(unit, first), generator.normal(size=3)
    across = np.cos(angles)[:, None] * first + np.sin(angles)[:, None] * second
    away, along = generator.uniform(0.5, 1.0, (2, len(angles), 1))
    position = centre + away * across + along * unit
    return np.column_stack([position, np.full(len(angles), 1e-3)]), centre


@pytest.mark.parametrize(
    "axis", [(0.0, 0.0, 2.0), (0.0, -1.0, 0.0), (3.0, 0.0, 0.0), (0.3, -0.5, 0.8), (1.0, 1.0, 1.0)]
)
@pytest.mark.parametrize(("gap", "turn"), [(0.0, 0.0), (1.0, 0.0), *((0.4, 0.7 * k) for k in range(9))])
def test_a_cut_from_an_axis_goes_round_it_once(axis, gap, turn):
    """Keys rise or fall with the angle about the axis, once round: those of an arc from one of its ends on."""
    generator, axis = np.random.default_rng(8), np.array(axis)
    angles = np.sort(generator.uniform(0.5 * gap, 2.0 * np.pi - 0.5 * gap, 400))
    rows, centre = around(axis, angles + turn, generator)
    senses = set()
    for side in (1.0, -1.0):
        q = np.empty(9)
        _angular(rows, 0, 400, np.array([side, 0.3, 0.1]), 0.37, centre, axis, q)
        order = np.argsort([_key(rows, i, q) for i in range(400)])
        steps = np.diff(order) % 400
        assert set(steps.tolist()) in ({1}, {399})
        senses.add(int(steps[0]))
        assert gap == 0.0 or {int(order[0]), int(order[-1])} == {0, 399}
        frame = np.array([q[:3], q[5:8], axis / np.linalg.norm(axis)])
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose([q[:3] @ centre + q[3], q[5:8] @ centre + q[8]], 0.0, atol=1e-12)
    assert senses == {1, 399}  # either way round, by the random numbers


@pytest.mark.parametrize("number", [2, 3, 5])
def test_a_cut_of_few_points_begins_in_their_widest_gap(number):
    generator, axis = np.random.default_rng(number), np.array([0.3, -0.5, 0.8])
    tried = 0
    for _ in range(40):
        angles = np.sort(generator.uniform(0.0, 2.0 * np.pi, number))
        gaps = np.diff(np.append(angles, angles[0] + 2.0 * np.pi))
        widest = int(np.argmax(gaps))
        if np.sort(gaps)[-2] > gaps[widest] - 0.4:  # the angles are counted in bins
            continue
        tried += 1
        shuffled = generator.permutation(number)
        rows, centre = around(axis, angles[shuffled], generator)
        q = np.empty(9)
        _angular(rows, 0, number, np.array([1.0, 0.3, 0.1]), 0.37, centre, axis, q)
        order = shuffled[np.argsort([_key(rows, i, q) for i in range(number)])]
        assert {int(order[0]), int(order[-1])} == {widest, (widest + 1) % number}
    assert tried > 10


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.0, -2.0, 0.0), (0.5, 0.0, 0.0), (0.0, 0.0, 0.0)])
def test_a_ring_is_cut_from_its_axis_and_by_a_plane_where_it_has_none(axis):
    """`q[4]` says which; every cut is finite."""
    generator, axis = np.random.default_rng(9), np.array(axis)
    around_what = axis if axis.any() else np.array([0.0, 0.0, 1.0])
    rows, centre = around(around_what, np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False), generator)
    q = np.empty(9)
    _cut(rows, 0, 200, 0.5, np.array([0.4, 0.3, -0.1]), 0.37, centre, axis, np.empty(3), q)
    assert q[4] == float(axis.any())
    assert np.isfinite(q).all()


def test_means_of_two_points_by_hand():
    points = points_of(
        np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]]), np.array([1.0, 3.0]), np.array([[0.0, 0.0, 7.0], [0.0, 4.0, 7.0]])
    )
    clusters = place(np.array([4.0]), points.position, points.mass, np.random.default_rng(0))
    centre, velocity = clusters.means(points)
    np.testing.assert_allclose(centre, [[1.5, 0.0, 0.0]])
    np.testing.assert_allclose(velocity, [[0.0, 3.0, 7.0]])


def test_a_random_point_of_a_fragment_comes_by_its_mass():
    """One fragment on points of mass 1 to 5, four thousand times."""
    generator, mass = np.random.default_rng(2), np.arange(1.0, 6.0)
    chosen = [place(mass.sum(keepdims=True), np.eye(5)[:, :3], mass, generator).chosen[0] for _ in range(4000)]
    share = 4000.0 * mass / mass.sum()
    assert (np.abs(np.bincount(chosen, minlength=5) - share) < 4.0 * np.sqrt(share)).all()


def test_light_fragments_come_where_the_mass_is():
    """A bar whose points grow heavier along it: numbers of light fragments by place go with the mass there."""
    generator = np.random.default_rng(5)
    position = generator.random((4000, 3)) * [1.0, 0.1, 0.1]
    mass = 1.0 + 3.0 * position[:, 0]
    counts = []
    for _ in range(100):
        asked = np.concatenate([np.full(300, 0.0005), np.full(35, 0.85 / 35)]) * mass.sum()
        clusters = place(asked, position, mass, generator)
        centre, _ = clusters.means(points_of(position, mass))
        counts.append(np.histogram(centre[:300, 0], np.linspace(0.0, 1.0, 9))[0])
    counts = np.array(counts)
    share = np.histogram(position[:, 0], np.linspace(0.0, 1.0, 9), weights=mass / mass.sum())[0]
    error = counts.std(axis=0, ddof=1) / np.sqrt(100.0)
    assert (np.abs(counts.mean(axis=0) - 300.0 * share) < 3.5 * error).all()
    assert counts[:, -1].mean() > 2.5 * counts[:, 0].mean()


@pytest.mark.parametrize("around", [24, 96])
def test_fragments_are_compact_chips(tmp_path, around):
    """Radius of gyration beside that of a cube, or of a square plate of the wall's thickness where that is thinner."""
    tube = Tube(around=around, axial=30, stretch=1.5, ends=(), kinds=("wall",))
    prepared = BreakUp(tube.read(tmp_path / "s.h5"), BreakUpSettings(mean_mass=12e-3))
    ratios = []
    for number in range(5):
        result = prepared.realisation(3, number)
        clusters, points = result.clusters, result.points
        owner = np.repeat(np.arange(clusters.mass.size), np.diff(clusters.offset))
        away = points.position[clusters.point] - clusters.means(points)[0][owner]
        gyration = np.sqrt(np.bincount(owner, clusters.piece * (away**2).sum(axis=1)) / clusters.mass)
        volume = clusters.mass / (7850.0 / 1.5**2)  # the tube is stretched without getting thinner
        wall = 1.5 * 0.018
        chip = np.where(volume < wall**3, 0.5 * np.cbrt(volume), np.sqrt((2.0 * volume / wall + wall**2) / 12.0))
        matter = clusters.mass > result.segments[0].resolved
        ratios.append((gyration / chip)[matter])
    ratio = np.concatenate(ratios)
    assert np.median(ratio) < 1.3
    assert np.quantile(ratio, 0.95) < 1.8
    assert (ratio > 3.0).mean() < 2e-3


def test_a_ring_falls_into_arcs():
    """Ten equal pieces of a thin ring: each one arc of 36 degrees, at another angle each time."""
    generator = np.random.default_rng(6)
    angle = np.linspace(0.0, 2.0 * np.pi, 20_000, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0.01 * generator.random(angle.size)])
    begins = []
    for _ in range(20):
        clusters = place(np.full(10, 0.1), ring, np.full(angle.size, 1.0 / angle.size), generator, (0.0, 0.0, 2.0))
        for f in range(10):
            own = np.sort(angle[clusters.point[clusters.offset[f] : clusters.offset[f + 1]]])
            gap = np.diff(np.append(own, own[0] + 2.0 * np.pi)).max()
            assert 2.0 * np.pi - gap < np.radians(36.0 + 8.0)
        begins.append(np.degrees(own[0]) % 36.0)
    assert np.ptp(begins) > 20.0


def test_less_than_the_whole_mass_leaves_the_rest_everywhere():
    generator = np.random.default_rng(4)
    position = generator.random((4000, 3)) * [1.0, 0.1, 0.1]
    asked = np.full(60, 1.0 / 100.0)
    left = np.zeros(4)
    for _ in range(40):
        clusters = place(asked, position, np.full(4000, 1.0 / 4000.0), generator)
        np.testing.assert_allclose(clusters.mass, asked, rtol=0.0, atol=1e-13)  # of 1 kg
        given = np.bincount(clusters.point, clusters.piece, minlength=4000)
        assert given.max() <= (1.0 + 1e-12) / 4000.0
        left += np.histogram(position[:, 0], np.linspace(0.0, 1.0, 5), weights=1.0 / 4000.0 - given)[0]
    assert left.sum() == pytest.approx(40 * 0.4, rel=1e-12)
    assert (np.abs(left / 40.0 - 0.1) < 0.03).all()


def test_clusters_of_segments_stand_one_after_the_other():
    generator = np.random.default_rng(1)
    parts = [(place(np.full(3, 1.0), generator.random((9, 3)), np.full(9, 1 / 3), generator), 9) for _ in range(2)]
    both = Clusters.concatenate(parts)
    assert both.offset[-1] == both.point.size
    np.testing.assert_allclose(np.bincount(both.point, both.piece), 1.0 / 3.0)
    assert (both.chosen[3:] >= 9).all()


@pytest.mark.parametrize(
    ("asked", "message"),
    [([], "above zero"), ([0.0, 1.0], "above zero"), ([2.0], "fragments of 2 kg do not fit on points of 1 kg")],
)
def test_masses_that_cannot_be_placed_are_refused(asked, message):
    with pytest.raises(ValueError, match=message):
        place(np.array(asked), np.zeros((1, 3)), np.ones(1), np.random.default_rng(0))


def test_light_fragments_come_at_all_depths_of_a_wall(tmp_path):
    """Numbers by fifths of the wall's volume: what is cut off at the surfaces alone would be 35 % off."""
    tube = Tube(around=96, axial=60, radial_cells=4, stretch=1.5, ends=(), kinds=("wall",))
    prepared = BreakUp(tube.read(tmp_path / "s.h5"))
    counts = []
    for number in range(30):
        fragments = prepared.fragments(1, number)
        light = (fragments.mass < 1e-3) & (fragments.mass > 1e-4)
        radius = np.hypot(fragments.position[light, 0], fragments.position[light, 1]) / 1.5
        counts.append(np.histogram((radius**2 - 0.0595**2) / (0.0775**2 - 0.0595**2), np.linspace(0.0, 1.0, 6))[0])
    counts = np.array(counts)
    error = counts.std(axis=0, ddof=1) / np.sqrt(30.0) / counts.mean()
    assert error.max() < 0.05
    assert (np.abs(counts.mean(axis=0) / counts.mean() - 1.0) < 0.15 + 3.0 * error).all()
