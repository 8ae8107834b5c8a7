"""Maps from files: one slope in every form, files of others' troubles, and what must not leak in."""

from __future__ import annotations

import functools
import warnings
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

from flight import FlightWarning, Fragments, HeightMap, fly, hazard, hazard_distance
from flight.hazard import DensityGroups, Directions, PolarGrid, density_counts, expected_distance
from tests.flight.maps import CELL, FORMS, HALF, SITE, slope

if TYPE_CHECKING:
    from pathlib import Path

    from flight.hazard import ExpectedDistance

rasterio = pytest.importorskip("rasterio")
pytest.importorskip("pyproj")


@functools.cache
def round_of_fragments() -> Fragments:
    generator = np.random.default_rng(11)
    direction = generator.normal(size=(1500, 3)) * [1.0, 1.0, 0.35]
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    mass = generator.exponential(0.02, 1500) + 1e-3
    return Fragments(mass, (0.0, 0.0, 1.5), direction * generator.uniform(600.0, 1400.0, (1500, 1)))


def distance(ground: HeightMap) -> float:
    return hazard_distance([round_of_fragments()], ground=ground, ricochet="none").distance


@functools.cache
def expected() -> float:
    """The distance on the slope as an array: nothing of a file takes part."""
    along = np.arange(-HALF, HALF + 1.0, CELL)
    heights = slope(*np.meshgrid(along, along)) - slope(np.zeros(1), np.zeros(1))
    return distance(HeightMap(heights, CELL, (-HALF, -HALF), datum=float(slope(np.zeros(1), np.zeros(1))[0])))


def read(form: str, folder: Path) -> HeightMap:
    path, arguments = FORMS[form](folder)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FlightWarning)
        return HeightMap.read(path, datum="site", **arguments)


@pytest.mark.parametrize("form", FORMS)
def test_one_slope_has_one_distance_in_every_form(form: str, tmp_path: Path) -> None:
    ground = read(form, tmp_path)
    found = distance(ground)
    assert found == pytest.approx(expected(), rel=1e-3), f"{form}: {found:.3f} m for {expected():.3f} m"
    assert ground.datum == pytest.approx(slope(np.zeros(1), np.zeros(1))[0], abs=0.06)  # its air is that of the place
    if "holes" not in form:
        x, y = np.random.default_rng(2).uniform(-900.0, 900.0, (2, 500))
        off = ground.at(x, y) + ground.datum - slope(x, y)
        assert np.abs(off).max() < 0.25, "interpolation of the wave between nodes 20 to 30 m apart"


def test_the_slope_matters_to_the_distance() -> None:
    """Else the test above would hold for any map: turned over, level, and in decimetres the distance is another."""
    along = np.arange(-HALF, HALF + 1.0, CELL)
    heights = slope(*np.meshgrid(along, along)) - slope(np.zeros(1), np.zeros(1))
    for other in (heights[::-1], 0.0 * heights, 0.1 * heights):
        assert distance(HeightMap(other, CELL, (-HALF, -HALF), datum=300.0)) != pytest.approx(expected(), rel=5e-3)
    assert distance(HeightMap(heights, CELL, (-HALF, -HALF))) != pytest.approx(expected(), rel=2e-3), "air of sea level"


def test_only_what_is_within_25_km_is_read(tmp_path: Path) -> None:
    from tests.flight.maps import metres, write

    heights = np.zeros((121, 131), dtype="f4")
    heights[60, 0] = heights[0, 60] = np.nan
    path = write(tmp_path / "large.tif", heights, metres(cell=500.0, half=30_000.0))
    ground = HeightMap.read(path, site=SITE)
    assert ground.corner[0] == pytest.approx(-25_500.0, abs=501.0)
    assert ground.end[0] == pytest.approx(25_500.0, abs=501.0)
    assert any("those within 25 km" in note for note in ground.facts["notes"])


# --- A distance that lies on a map of heights is that of a larger map, whatever the ground does beyond

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
