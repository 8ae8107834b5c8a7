"""The intensity of an axisymmetric round against the realisations that are drawn from the same laws."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.transition.meridian import Meridian
from transition import BreakUp, BreakUpSettings
from transition.intensity import CURVES, END_CURVES

POINTS, REALISATIONS = 2**15, 60


def points(number: int = POINTS) -> np.ndarray:
    """Points of the unit cube (n, 3): multiples of irrational numbers."""
    return (np.arange(number)[:, None] * np.sqrt([2.0, 3.0, 5.0]) + 0.37) % 1.0


@pytest.fixture(scope="module")
def snapshot(tmp_path_factory):
    return Meridian().write(tmp_path_factory.mktemp("meridian") / "burst_snapshot.h5")


@pytest.mark.parametrize(
    "settings",
    [
        BreakUpSettings(mean_mass=0.004),
        BreakUpSettings(mean_mass=0.004, dimension=3),
        BreakUpSettings(mean_mass=0.004, dimension="mixed"),
        BreakUpSettings(mean_mass=0.004, velocity="interpolation"),
        BreakUpSettings(mean_mass=0.004, sampler="graded", graded_dm=5e-4),
    ],
    ids=["plane", "solid", "mixed", "at points", "graded"],
)
def test_it_is_the_mean_of_the_realisations(snapshot, settings):
    """Numbers above masses, momentum along the axis and kinetic energy of those above 1 g, within 4 standard errors."""
    broken = BreakUp(snapshot, settings)
    rings = broken.intensity().at(points())
    speed = np.hypot(rings.radial, rings.axial)

    def counted(mass, along, speed, weight):
        heavy = mass > 1e-3
        numbers = [(weight * (mass > limit)).sum() for limit in (1e-3, 4e-3, 1e-2)]
        return [*numbers, (weight * mass * along)[heavy].sum(), (weight * mass * speed**2)[heavy].sum()]

    found = np.array(counted(rings.mass, rings.axial, speed, rings.number / POINTS))
    drawn = np.array(
        [
            counted(one.mass, one.velocity[:, 2], one.speed, np.ones(len(one)))
            for one in broken.many(3, range(REALISATIONS))
        ]
    )
    error = drawn.std(axis=0, ddof=1) / math.sqrt(REALISATIONS)
    scale = np.abs(drawn.mean(axis=0))
    scale[3] = (rings.number / POINTS * rings.mass * np.abs(rings.axial)).sum()
    assert (np.abs(found - drawn.mean(axis=0)) < 4.0 * error + 0.01 * scale).all(), (found, drawn.mean(axis=0), error)


def test_before_nose_and_behind_base_it_is_the_mean_of_the_realisations(tmp_path):
    """Numbers in zones about the axis, by the curves that single directions have there, within 4 standard errors."""
    solid = Meridian(inner=0.0, velocity=lambda r, z: np.column_stack([2e4 * r, 6e3 * (z - 0.15)]))
    snapshot = solid.write(tmp_path / "burst_snapshot.h5")
    broken = BreakUp(snapshot, BreakUpSettings(mean_mass=0.1, direction_scatter=0.0))
    intensity = broken.intensity(directions=True)
    assert [one.curves for one in intensity.segments] == [
        END_CURVES if one.segment.is_end else CURVES for one in intensity.segments
    ]
    rings, axis = intensity.at(points()), np.array(broken.rounds[0].axis)

    def by_zone(cosine, mass, weight):
        edges = np.radians([0.0, 15.0, 30.0, 60.0, 120.0, 150.0, 165.0, 180.0])
        return np.histogram(np.arccos(np.clip(cosine, -1.0, 1.0)), edges, weights=weight * (mass > 0.01))[0]

    found = by_zone(rings.axial / np.hypot(rings.radial, rings.axial), rings.mass, rings.number / POINTS)
    drawn = np.array(
        [by_zone(one.velocity @ axis / one.speed, one.mass, np.ones(len(one)))
         for one in broken.many(3, range(REALISATIONS))]
    )  # fmt: skip
    error = drawn.std(axis=0, ddof=1) / math.sqrt(REALISATIONS)
    mean = drawn.mean(axis=0)
    assert (np.abs(found - mean) < 4.0 * error + 0.02 * mean).all(), (found, mean, error)


def test_it_closes_on_the_mass(snapshot):
    rings = BreakUp(snapshot, BreakUpSettings(mean_mass=0.02)).intensity().at(points())
    mass = BreakUp(snapshot).laws
    assert float((rings.number * rings.mass).mean()) == pytest.approx(sum(law.mass for law in mass), rel=1e-3)


def test_a_segment_of_one_piece_flies_as_its_centre(snapshot):
    """The mean over all the metal: nothing outwards, the mean speed along the axis."""
    broken = BreakUp(snapshot, BreakUpSettings(mean_mass=100.0, direction_scatter=0.0))
    segment = broken.intensity().segments[0]
    mass, _, states = segment.at(np.full(9, 1.0 - 1e-9), np.linspace(0.05, 0.95, 9))
    assert mass == pytest.approx(np.full(9, segment.law.mass), rel=1e-3)
    outward, along = states[:, 3:5], states[:, 5]
    assert np.abs(outward).max() < 1e-3 * float(np.abs(broken.snapshot.velocity).max())
    assert along == pytest.approx(np.full(9, along[0]), rel=1e-3)


def test_moved_velocities_move_it_as_little(snapshot):
    broken = BreakUp(snapshot, BreakUpSettings(mean_mass=0.004))
    moved = replace(broken.snapshot, velocity=broken.snapshot.velocity * (1.0 + 1e-6))
    one, other = (BreakUp(state, broken.settings).intensity().at(points(512)) for state in (broken.snapshot, moved))
    assert np.array_equal(one.mass, other.mass)
    assert other.radial == pytest.approx(one.radial * (1.0 + 1e-6), rel=1e-9)


def test_means_are_those_of_the_fragments_that_are_drawn(tmp_path):
    """Metal that shears through a thick wall: how widely the polar angles of fragments of three classes of mass lie."""
    wall = Meridian(
        inner=0.05, velocity=lambda r, z: np.column_stack([np.full(r.shape, 1000.0), 2e4 * (r / 1.9 - 0.06375)])
    )
    broken = BreakUp(wall.write(tmp_path / "burst_snapshot.h5"), BreakUpSettings(mean_mass=0.01, direction_scatter=0.0))
    rings = broken.intensity().at(points())

    def spread(mass, angle, weight):
        for low, high in ((2e-3, 6e-3), (6e-3, 2e-2), (2e-2, 0.1)):
            mine = (mass > low) & (mass < high)
            mean = np.average(angle[mine], weights=weight[mine])
            yield np.sqrt(np.average((angle[mine] - mean) ** 2, weights=weight[mine]))

    drawn = broken.many(3, range(20))
    mass, along = np.concatenate([one.mass for one in drawn]), np.concatenate([one.velocity[:, 2] for one in drawn])
    angle = np.arccos(along / np.concatenate([one.speed for one in drawn]))
    found = list(spread(rings.mass, np.arctan2(rings.radial, rings.axial), rings.number))
    assert found == pytest.approx(list(spread(mass, angle, np.ones(len(mass)))), rel=0.1)
