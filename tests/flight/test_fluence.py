"""Path lengths below a person's height, and where they lie, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flight
from flight import Adaptive, Domain, FixedStep, Fragments, HeightMap, InputError
from flight.fluence import PolarGrid
from flight.hazard.criteria import Criteria
from flight.hazard.density.density_counts import density_counts
from flight.integrate.fly import STANDARD_GRAVITY

GRID = PolarGrid(72, 2, 10.0, 20)


def launched(position, velocity, mass: float = 0.01) -> Fragments:
    return Fragments(np.full(len(np.atleast_2d(velocity)), mass), position, velocity)


def rays(number: int, speed: float, elevation: float) -> np.ndarray:
    turn, rise = np.linspace(0.0, 2.0 * np.pi, number, endpoint=False) + 0.02, math.radians(elevation)
    level = math.cos(rise) * np.column_stack([np.cos(turn), np.sin(turn)])
    return speed * np.column_stack([level, np.full(number, math.sin(rise))])


def lengths(fragments: Fragments, criteria: Criteria | None = None, grid: PolarGrid = GRID, **options):
    options = {"air": "vacuum", "threads": 1, **options}
    result = flight.fly(fragments, fluence=(criteria or Criteria()).fluence_grid(grid), **options)
    assert result.fluence is not None
    return result.fluence.lengths, result.fluence.cells.grid, result


def test_level_flight_leaves_the_width_of_every_annulus() -> None:
    """Without weight and air a fragment at 1 m flies level for ever: it leaves in every annulus its width."""
    fragments = launched([0.0, 0.0, 1.0], rays(36, 300.0, 0.0))
    found, grid, _ = lengths(fragments, gravity=0.0, domain=Domain(radius=150.0))
    width = np.diff(grid.edges)
    inside = grid.edges[1:] <= 150.0
    assert found.sum(axis=0)[inside] == pytest.approx(36 * width[inside], rel=1e-9)
    assert found.sum(axis=0)[~inside] == pytest.approx(0.0, abs=1e-6)
    hit = np.flatnonzero(found.any(axis=1))
    assert len(hit) == 36
    assert found[hit][:, inside] == pytest.approx(np.broadcast_to(width[inside], (36, inside.sum())), rel=1e-9)


def test_a_path_counts_in_the_cell_of_its_azimuth() -> None:
    """In cells of a hundredth of a degree, at all azimuths; only within 1e-7 rad of a bound not."""
    grid = PolarGrid(72, 500, 10.0, 2)
    angle = np.random.default_rng(3).uniform(-math.pi, math.pi, 3000)
    cells = (np.degrees(angle) - grid.start) / grid.width
    angle = angle[np.abs(cells - np.round(cells)) * math.radians(grid.width) > 1e-7]
    velocity = 300.0 * np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])
    found, grid, _ = lengths(launched([0.0, 0.0, 1.0], velocity), grid=grid, gravity=0.0, domain=Domain(radius=15.0))
    number = np.bincount(grid.cells_of(np.degrees(angle), 1.0)[0], minlength=grid.azimuth_cells)
    assert found.sum(axis=1) == pytest.approx(15.0 * number, rel=1e-9)


@pytest.mark.parametrize("aside", [0.0, 0.7, 7.0])
def test_a_path_that_passes_the_origin_counts_where_it_lies(aside: float) -> None:
    """One long level step past the origin: twice sqrt(R^2 - a^2) within every radius R."""
    fragments = launched([-120.0, aside, 1.0], [[300.0, 0.0, 0.0]])
    found, grid, _ = lengths(fragments, gravity=0.0, domain=Domain(radius=150.0))
    within = np.cumsum(found.sum(axis=0))
    radius = grid.edges[1:]
    exact = 2.0 * np.sqrt(np.maximum(radius**2 - aside**2, 0.0))
    near = (radius > 1.5 * aside + 1.0) & (radius < 119.0)
    assert within[near] == pytest.approx(exact[near], rel=0.02)


def test_above_a_person_nothing_counts() -> None:
    fragments = launched([0.0, 0.0, 2.0], rays(8, 300.0, 0.0))
    found, _, _ = lengths(fragments, gravity=0.0, domain=Domain(radius=100.0))
    assert not found.any()
    found, _, _ = lengths(fragments, Criteria(person_height=2.5), gravity=0.0, domain=Domain(radius=100.0))
    assert found.sum() == pytest.approx(800.0)


def arc(speed: float, elevation: float, start: float, end: float) -> float:
    """Length of a vacuum parabola between two times."""
    across, rise = speed * math.cos(math.radians(elevation)), speed * math.sin(math.radians(elevation))

    def antiderivative(w: float) -> float:
        return 0.5 * (w * math.hypot(across, w) + across**2 * math.asinh(w / across))

    gravity = STANDARD_GRAVITY
    return (antiderivative(rise - gravity * start) - antiderivative(rise - gravity * end)) / gravity


@pytest.mark.parametrize("elevation", [2.0, 8.0, 45.0, 80.0])
@pytest.mark.parametrize("integrator", [Adaptive(), FixedStep(2e-3)])
def test_a_parabola_counts_at_launch_and_where_it_comes_down(elevation: float, integrator) -> None:
    """The whole path below 1.8 m, near the charge too, as a closed form; and in the cells where it lies."""
    speed, height, gravity = 120.0, 0.5, STANDARD_GRAVITY
    fragments = launched([0.0, 0.0, height], rays(12, speed, elevation), 0.02)
    found, grid, _ = lengths(fragments, grid=PolarGrid(72, 2, 10.0, 200), integrator=integrator, ricochet="none")
    rise = speed * math.sin(math.radians(elevation))
    across = speed * math.cos(math.radians(elevation))
    down = (rise + math.sqrt(rise**2 + 2 * gravity * height)) / gravity
    root = math.sqrt(rise**2 - 2 * gravity * (1.8 - height)) if rise**2 > 2 * gravity * (1.8 - height) else 0.0
    parts = [(0.0, (rise - root) / gravity), ((rise + root) / gravity, down)] if root else [(0.0, down)]
    expected = sum(arc(speed, elevation, *part) for part in parts)
    assert found.sum() == pytest.approx(12 * expected, rel=2e-4)
    for start, end in parts:
        inner, outer = np.searchsorted(grid.edges, [across * start, across * end], side="right")
        around = found[:, max(inner - 2, 0) : outer + 1].sum()
        assert around == pytest.approx(12 * arc(speed, elevation, start, end), rel=2e-4)


def test_only_what_is_hazardous_there_counts() -> None:
    """Level flight with constant drag: v = v0 exp(-s / L), so the energy falls below 79 J at L ln(v0 / v)."""
    mass, speed, density, drag = 0.01, 400.0, 1.2, 1.0
    fragments = launched([0.0, 0.0, 1.0], rays(24, speed, 0.0), mass)
    range_of_drag = 2.0 * mass / (drag * density * (mass / fragments.shape_factor[0]) ** (2.0 / 3.0))
    reach = range_of_drag * math.log(speed / math.sqrt(2.0 * 79.0 / mass))
    assert 20.0 < reach < 200.0
    found, grid, _ = lengths(
        fragments, air=density, drag=drag, gravity=0.0, domain=Domain(radius=400.0), grid=PolarGrid(72, 2, 10.0, 50)
    )
    assert found.sum() / 24 == pytest.approx(reach, abs=0.06 * reach)
    last = grid.edges[np.flatnonzero(found.any(axis=0))[-1] + 1]
    assert last == pytest.approx(reach, rel=0.08)


def test_the_density_of_a_shower_is_that_of_the_closed_form() -> None:
    """Normal density of a ring of level paths: N / (2 pi r height), whatever the cells."""
    fragments = launched([0.0, 0.0, 1.0], rays(720, 300.0, 0.0))
    _, grid, result = lengths(fragments, gravity=0.0, domain=Domain(radius=150.0))
    _, tracks = density_counts(result)
    density = tracks.sum(axis=0) / (grid.area[: tracks.shape[1]] * grid.azimuth_cells)
    middle = 0.5 * (grid.edges[1:] + grid.edges[:-1])[: tracks.shape[1]]
    inside = middle < 149.0
    assert density[inside] == pytest.approx(720 / (2 * np.pi * middle[inside] * 1.8), rel=1e-6)


def test_on_a_slope_height_counts_from_the_ground_below() -> None:
    """Ground that rises by 10 %: paths along it at 1 m count whole, and from 1.8 m above it on not at all."""
    steps = np.arange(-200.0, 201.0, 10.0)
    heights = np.broadcast_to(0.1 * steps, (len(steps), len(steps)))
    ground = HeightMap(heights, 10.0, (-200.0, -200.0))
    slope = math.hypot(1.0, 0.1)
    along = np.array([[300.0 / slope, 0.0, 30.0 / slope]])
    found, _, _ = lengths(launched([0.0, 0.0, 1.0], along), ground=ground, gravity=0.0, domain=Domain(radius=150.0))
    assert found.sum() == pytest.approx(150.0 * slope, rel=1e-6)
    level = np.array([[300.0, 0.0, 0.0], [-300.0, 0.0, 0.0]])
    found, _, result = lengths(
        launched([0.0, 0.0, 1.0], level), ground=ground, gravity=0.0, domain=Domain(radius=150.0), ricochet="none"
    )
    # uphill it strikes the ground after 10 m; downhill it is 1.8 m above it after 8 m
    assert result.landing["distance"][0] == pytest.approx(10.0)
    assert found.sum() == pytest.approx(10.0 + 8.0, rel=1e-6)


def test_lengths_do_not_depend_on_threads_order_or_a_first_reach() -> None:
    generator = np.random.default_rng(3)
    velocity = generator.normal(size=(6000, 3)) * [200.0, 200.0, 20.0]
    velocity[:, 2] = np.abs(velocity[:, 2])
    fragments = launched([0.0, 0.0, 0.8], velocity, 0.02)
    small = PolarGrid(72, 2, 10.0, 3)
    one, grid, _ = lengths(fragments, air="standard", grid=small)
    assert grid.reach > small.reach, "extended"
    for options in ({"threads": 3, "grid": small}, {"grid": grid}):
        again, _, _ = lengths(fragments, air="standard", **options)
        assert np.array_equal(one, again)
    # Slopes of the ground go by rows, so that the order of fragments is none of theirs.
    forwards, backwards = (
        lengths(fragments.select(np.arange(6000)[::way]), air="standard", grid=grid, ricochet="none")[0]
        for way in (1, -1)
    )
    assert np.array_equal(forwards, backwards)


def test_the_flight_itself_is_the_same_to_the_last_bit() -> None:
    fragments = launched([0.0, 0.0, 0.8], rays(500, 700.0, 3.0), 0.02)
    _, _, counted = lengths(fragments, air="standard")
    plain = flight.fly(fragments, threads=1)
    assert np.array_equal(counted.landing, plain.landing)
    with pytest.raises(InputError, match="not asked to count paths"):
        density_counts(plain)
    nowhere = flight.fly(fragments, ground=None, time_limit=0.1, fluence=Criteria().fluence_grid(GRID))
    assert nowhere.fluence is None  # no height counts from a ground that is not there


def test_fragments_that_meet_count_their_paths_once() -> None:
    """Head on, elastic and alike, level without weight: each comes back on its line, two radii before the other's."""
    line = 0.5 * np.arange(9.0)
    place, velocity = np.zeros((2, 9, 3)), np.zeros((2, 9, 3))
    place[:, :, 0], place[:, :, 1], place[:, :, 2] = np.array([[-2.0], [2.0]]), line, 1.0
    velocity[:, :, 0] = np.array([[300.0], [-300.0]])
    fragments = launched(place.reshape(-1, 3), velocity.reshape(-1, 3))
    contact = flight.Contact(restitution=1.0, distance=20.0)
    found, _, result = lengths(fragments, gravity=0.0, domain=Domain(radius=150.0), contact=contact)
    assert len(result.contacts) == 9
    each = 2.0 + np.sqrt(150.0**2 - line**2) - 2.0 * contact.radius(fragments)[0]
    assert found.sum() == pytest.approx(2.0 * each.sum(), rel=1e-9)
