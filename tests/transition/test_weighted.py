"""Weighted fragments: of any casing the mean of the realisations, with directions that weigh as the scatter has it."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from tests.transition.meridian import Meridian
from transition import BreakUp, BreakUpSettings
from transition.draws import Draws
from transition.law.mott import MottLaw, Quantile
from transition.law.segments import SegmentLaw
from transition.weighted import Runs, aimed, unit_points

POINTS, SETS, REALISATIONS = 2**12, 6, 30


@pytest.fixture(scope="module")
def meridian(tmp_path_factory):
    return Meridian().write(tmp_path_factory.mktemp("meridian") / "burst_snapshot.h5")


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("meridian", {}), ("snapshot", {}), ("pair", {}), ("meridian", {"velocity": "interpolation"}),
        ("meridian", {"direction_scatter": 0.0}), ("pair", {"tilt": 0.2}),
        ("meridian", {"sampler": "graded", "graded_dm": 5e-4}),
    ],
)  # fmt: skip
def test_they_are_the_mean_of_the_realisations(kind, change, request):
    """Numbers above masses, within 4 degrees of the level and to one side, and moments of those above 1 g."""
    settings = BreakUpSettings(mean_mass=0.01, random_roll=kind == "meridian", **change)
    broken = BreakUp(request.getfixturevalue(kind), settings)

    def counted(made, weight):
        heavy = weight * (made.mass > 1e-3)
        momentum = (heavy * made.mass)[:, None] * made.velocity
        level = np.abs(made.velocity[:, 2]) < math.sin(math.radians(4.0)) * made.speed
        return np.array([
            *((weight * (made.mass > limit)).sum() for limit in (1e-3, 1e-2, 3e-2)), (heavy * level).sum(),
            (heavy * (made.velocity[:, 0] > 0.5 * made.speed)).sum(), (heavy * made.mass * made.speed**2).sum(),
            (heavy * made.mass * made.position[:, 2]).sum(), *momentum.sum(axis=0),
        ])  # fmt: skip

    sets = np.array([counted(one.fragments, one.number) for one in (broken.weighted(n, POINTS) for n in range(SETS))])
    drawn = np.array([counted(one, np.ones(len(one))) for one in broken.many(3, range(REALISATIONS))])
    found, mean = sets.mean(axis=0), drawn.mean(axis=0)
    error = np.sqrt(sets.var(axis=0, ddof=1) / SETS + drawn.var(axis=0, ddof=1) / REALISATIONS)
    scale = np.abs(mean)
    scale[-3:] = 0.0
    assert (np.abs(found - mean) < 4.0 * error + 0.015 * scale).all(), (found, mean, error)


def test_directions_near_the_level_weigh_as_the_scatter_has_them():
    """Fractions by elevation after the scatter, from 10 degrees above the level, against drawn ones."""
    scatter, before = (
        math.radians(6.0),
        np.tile([math.cos(math.radians(10.0)), 0.0, math.sin(math.radians(10.0))], (2**16, 1)),
    )
    points = unit_points(5, 2**16)
    after, weight = aimed(before, points[:, 3:5], scatter)
    angles = np.random.default_rng(2).standard_normal((400_000, 2)) * scatter
    size = np.linalg.norm(angles, axis=1)
    up = np.cos(size) * before[0, 2] + np.sin(size) * angles[:, 0] / size * before[0, 0]
    edges = np.sin(np.radians([-8.0, -4.0, -1.0, 0.0, 1.0, 4.0, 10.0, 20.0]))
    expected = np.histogram(up, edges)[0] / len(up)
    found = np.histogram(after[:, 2], edges, weights=weight)[0] / len(after)
    assert np.abs(found - expected).max() < 3e-3
    assert found[2:5] == pytest.approx(expected[2:5], rel=0.04)
    level = np.abs(after[:, 2]) < edges[4]
    assert level.mean() > 3.0 * expected[2:4].sum()  # they are many
    assert weight.max() <= 4.0 + 1e-9


def test_moved_velocities_move_them_as_little(meridian):
    broken = BreakUp(meridian, BreakUpSettings(mean_mass=0.004, random_roll=True))
    moved = replace(broken.snapshot, velocity=broken.snapshot.velocity * (1.0 + 1e-6))
    one, other = (BreakUp(snapshot, broken.settings).weighted(0, 1024) for snapshot in (broken.snapshot, moved))
    assert one.fragments.mass == pytest.approx(other.fragments.mass, rel=1e-5)
    assert np.abs(one.fragments.velocity - other.fragments.velocity).max() < 0.01
    assert one.number == pytest.approx(other.number, rel=1e-4)


@pytest.mark.parametrize(("dimension", "mass"), [(2, 6.0), (3, 60.0)])
def test_runs_lie_where_fragments_in_random_order_do(dimension, mass):
    """Along a curve: masses drawn and laid one after the other, more often near its ends than elsewhere."""
    law = MottLaw.from_mean(0.1, dimension)
    points, drawings = 4000, 1000
    segment = SegmentLaw(law, mass, mass / law.mean, 1000.0, 0.1)
    states = np.zeros((points, 6))
    states[:, 0] = (np.arange(points) + 0.5) / points
    sums = np.concatenate([np.zeros((1, 6)), np.cumsum(states * mass / points, axis=0)])
    runs = Runs(
        None, segment, Quantile(), np.linspace(0.0, mass, points + 1), sums, np.zeros(3), True, 1, states[:, 0]
    )  # fmt: skip
    edges, count = [0.0, 0.1, 0.3, 0.7, 0.9, 1.0], 2**15
    masses, per_mass, means = runs.at(*((np.arange(count)[:, None] * np.sqrt([2.0, 3.0]) + 0.37) % 1.0).T)
    heavy = masses > 0.5 * law.mean
    found = np.histogram(means[heavy, 0], edges, weights=mass * per_mass[heavy] / count)[0]
    drawn = []
    for number in range(drawings):
        draws = Draws(5, number, (0, 0))
        laid = np.random.default_rng(number).permutation(Quantile().draw(law, mass, draws))
        middle = (np.cumsum(laid) - 0.5 * laid) / mass
        drawn.append(np.histogram(middle[laid > 0.5 * law.mean], edges)[0])
    error = np.std(drawn, axis=0) / math.sqrt(drawings)
    assert (np.abs(found - np.mean(drawn, axis=0)) < 3.0 * error + 0.04 * found).all(), (found, np.mean(drawn, axis=0))


def test_sets_made_in_threads_are_those_made_one_after_another():
    """The first of a process, in which SciPy makes its table of direction numbers."""
    made = """
from concurrent.futures import ThreadPoolExecutor
import numpy as np
from transition.weighted import unit_points
def of(number): return unit_points(number, 2**9)
with ThreadPoolExecutor(4) as pool: together = list(pool.map(of, range(4)))
for number, found in enumerate(together): np.testing.assert_array_equal(found, of(number))
"""
    done = subprocess.run([sys.executable, "-c", made], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
