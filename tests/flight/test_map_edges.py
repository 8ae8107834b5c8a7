"""A distance that lies on a map of heights is that of a larger map, whatever the ground does beyond."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

from flight import Fragments, HeightMap, fly, hazard
from flight.hazard import DensityGroups, Directions, PolarGrid, density_counts, expected_distance

if TYPE_CHECKING:
    from flight.hazard import ExpectedDistance

STEP, FAR = 10.0, 1000.0
REALISATIONS, NUMBER = 8, 1000


@cache
def ground(kind: str, half: float) -> HeightMap:
    """A square map of this half-width (m), the same within it whatever its size."""
    x = np.arange(-half, half + 0.5 * STEP, STEP)
    across, along = np.meshgrid(x, x)
    away = np.hypot(across, along)
    heights = {
        "level": 0.0 * away,
        "falls": -0.15 * away,
        "hills": 8.0 * (np.sin(across / 60.0 + 0.4) * np.cos(along / 60.0) - np.sin(0.4)),
    }[kind]
    return HeightMap(heights, STEP, (-half, -half))


def burst(number: int) -> Fragments:
    """Fragments near the horizontal, masses by Mott's law of 12 g."""
    generator = np.random.default_rng(number)
    mass = 0.006 * generator.exponential(1.0, NUMBER) ** 2 + 2e-4
    up = np.radians(generator.normal(0.0, 12.0, NUMBER))
    around, speed = generator.uniform(0.0, 2.0 * np.pi, NUMBER), generator.normal(1050.0, 120.0, NUMBER)
    velocity = np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=1)
    return Fragments(mass, (0.0, 0.0, 1.0), speed[:, None] * velocity)


@cache
def found(kind: str, half: float) -> ExpectedDistance:
    grid = PolarGrid.of(72, 10.0, 10.0, 2.0 * FAR)
    near, groups = hazard.Criteria().fluence_grid(grid), DensityGroups(Directions(grid, "worst_direction", 10.0))
    for number in range(REALISATIONS):
        # Without ricochet: how far the estimate smooths over azimuth follows what lies beyond the map's edge too.
        groups.add(
            *density_counts(fly(burst(number), ground=ground(kind, half), fluence=near, sample=0, ricochet="none"))
        )
    return expected_distance(groups, hazard.Criteria().density)


@pytest.mark.parametrize(("kind", "half"), [("falls", 100.0), ("falls", 200.0), ("hills", 200.0)])
def test_a_distance_on_the_map_is_that_of_a_larger_map(kind: str, half: float) -> None:
    small, large = found(kind, half), found(kind, FAR)
    assert small.upper is not None
    assert large.upper is not None
    reach = ground(kind, half).reach((0.0, 0.0), small.azimuth)
    if (np.fmax(small.by_direction, small.upper_by_direction) <= reach).all():
        assert small.distance == pytest.approx(large.distance, rel=2e-3)
        assert small.upper >= 0.995 * large.upper  # one draw in twenty of the bootstrap may see what lies beyond
    else:
        assert half < 200.0, "on the larger of the two maps the distance is determined"
        assert large.upper > half or kind == "falls", "level ground in place of falling gives the larger distance"


@pytest.mark.parametrize("kind", ["falls", "hills"])
def test_ricochets_and_densities_within_the_map_are_those_of_a_larger_map(kind: str) -> None:
    half, grid = 100.0, PolarGrid.of(72, 10.0, 10.0, 2.0 * FAR)
    near = hazard.Criteria().fluence_grid(grid)
    small, large = (fly(burst(0), ground=ground(kind, to), fluence=near, sample=0) for to in (half, FAR))
    within = [0.95 * half > run.landing["distance"] for run in (small, large)]
    assert np.array_equal(*within)
    assert (small.landing["ricochets"][within[0]] > 0).any()
    assert np.array_equal(small.landing["position"][within[0]], large.landing["position"][within[0]])
    inside = int(grid.first[8])  # up to 80 m
    for ours, theirs in zip(density_counts(small), density_counts(large), strict=True):
        assert np.array_equal(ours[:, :inside], theirs[:, :inside])
        assert ours[:, :inside].any()


def test_over_level_ground_the_edge_changes_nothing() -> None:
    small, large = found("level", 80.0), found("level", FAR)
    assert small.distance == pytest.approx(large.distance, rel=1e-6)
    assert small.upper == pytest.approx(large.upper, rel=1e-6)
