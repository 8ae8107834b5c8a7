"""The integral of the expected density: against closed forms, against flown realisations, and what must not move it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.integrate import quad

import flight
from flight.fluence import PolarGrid
from flight.hazard.criteria import Criteria
from flight.hazard.density.directions import Directions
from flight.hazard.integral import integrate
from flight.hazard.pool import FlightCounts, PooledFlights
from flight.scene.air import ConstantAir

GRID = PolarGrid.of(72, 10.0, 10.0, 500.0)
UPRIGHT, DIRECTED = Directions(GRID, "all_azimuths"), Directions(GRID, "worst_direction")
SCATTER = math.radians(6.0)


@dataclass(frozen=True)
class Spray:
    """Fragments of masses uniform in ln m, thrown at one angle to the axis from a ring about it."""

    number: float = 3000.0
    mass: tuple[float, float] = (0.005, 0.2)
    speed: float = 900.0
    polar: float = 0.5 * math.pi  # rad
    radius: float = 0.1
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    place: tuple[float, float, float] = (0.0, 0.0, 1.2)
    scatter: float = SCATTER
    shape_factor: float = 2600.0

    def masses(self, quantiles):
        """At quantiles (kg)."""
        low, high = np.log(self.mass)
        return np.exp(low + (high - low) * quantiles)

    def at(self, points):
        """As `flight.hazard.integral.Source`."""
        one = np.ones(len(points))
        radial, axial = self.speed * math.sin(self.polar) * one, self.speed * math.cos(self.polar) * one
        return self.number * one, self.masses(points[:, 0]), self.radius * one, 0.0 * one, radial, axial

    def drawn(self, generator):
        """One realisation: directions deviate by two normal angles across them."""
        number = generator.poisson(self.number)
        turn = 2.0 * math.pi * generator.random(number)
        axis = np.array(self.axis)
        first = np.cross(axis, [0.6, 0.0, 0.8])
        first /= np.linalg.norm(first)
        outward = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * np.cross(axis, first)
        direction = math.sin(self.polar) * outward + math.cos(self.polar) * axis
        across = np.cross(direction, [0.36, 0.48, 0.8])
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        angle = self.scatter * np.linalg.norm(generator.standard_normal((number, 2)), axis=1)[:, None]
        roll = 2.0 * math.pi * generator.random(number)[:, None]
        aside = np.cos(roll) * across + np.sin(roll) * np.cross(direction, across)
        velocity = self.speed * (np.cos(angle) * direction + np.sin(angle) * aside)
        position = np.array(self.place) + self.radius * outward
        return flight.Fragments(self.masses(generator.random(number)), position, velocity, self.shape_factor)


def elevations(spray: Spray):
    """Density of the elevation (1/rad) of an upright spray, by an integral over the deviation and its direction."""
    before = 0.5 * math.pi - spray.polar

    def density(e: float) -> float:
        def at(turn: float) -> float:
            cosine = math.sin(e) * math.sin(before) + math.cos(e) * math.cos(before) * math.cos(turn)
            gap = math.acos(min(cosine, 1.0))
            ratio = gap / math.sin(gap) if gap > 1e-9 else 1.0
            return ratio * math.exp(-0.5 * (gap / spray.scatter) ** 2) / (2.0 * math.pi * spray.scatter**2)

        return 2.0 * math.cos(e) * quad(at, 0.0, min(math.pi, 9.0 * spray.scatter), limit=200)[0]

    return density


def test_ranges_in_vacuum_are_those_of_parabolas() -> None:
    """Landings beyond a distance: the elevations between the two that reach it, from a height."""
    spray = Spray(speed=60.0, polar=math.radians(60.0), radius=0.0)
    found = integrate(spray, UPRIGHT, Criteria(), air=ConstantAir(0.0), ricochet="none")
    beyond = np.append(np.cumsum(found.rest[::-1])[::-1], 0.0)
    density, (speed, height, g) = elevations(spray), (60.0, 1.2, 9.80665)

    def reach(e: float) -> float:
        up = speed * math.sin(e)
        return speed * math.cos(e) * (up + math.sqrt(up * up + 2.0 * g * height)) / g

    fine = np.linspace(-0.6, 1.4, 2001)
    weight = np.array([density(e) for e in fine]) * (fine[1] - fine[0])
    assert weight.sum() == pytest.approx(1.0, abs=1e-6)
    assert found.rest.sum() == pytest.approx(spray.number, rel=0.01)
    ranges = np.array([reach(e) for e in fine])
    for distance in (250.0, 300.0, 340.0):
        cell = int(np.searchsorted(GRID.edges, distance))
        exact = spray.number * weight[ranges > GRID.edges[cell]].sum()
        assert beyond[cell] == pytest.approx(exact, rel=0.02), distance


def test_straight_paths_with_constant_drag_end_where_their_energy_does() -> None:
    """Without gravity: in the layer between two elevations, up to L ln(v / v_c), L = 2 m / (Cd rho A); landings too."""
    mass, speed = 0.02, 900.0
    spray = Spray(mass=(mass, mass * (1.0 + 1e-12)), radius=0.0)
    found = integrate(
        spray, UPRIGHT, Criteria(), air=ConstantAir(1.2), drag=1.1, gravity=1e-7, ricochet="none", points=4096
    )
    length = 2.0 * mass / (1.1 * 1.2 * (mass / 2600.0) ** (2.0 / 3.0))
    end = length * math.log(speed / math.sqrt(2.0 * 79.0 / mass))
    density, (landings, lengths) = elevations(spray), found.fields[0, :, :, 0].mean(axis=0)

    def per_metre(r: float) -> float:
        low, high = -math.atan(1.2 / r), math.atan(0.6 / r)
        return spray.number / 1.8 * quad(lambda e: density(e) / math.cos(e), low, high)[0]

    for low, high in ((20.0, 30.0), (50.0, 60.0), (150.0, 160.0)):
        cells = slice(*np.searchsorted(GRID.edges, [low, high]))
        exact = quad(per_metre, low, high, epsrel=1e-4)[0]
        assert lengths[cells].sum() == pytest.approx(exact, rel=0.01), low
        exact = spray.number * quad(density, -math.atan(1.2 / low), -math.atan(1.2 / high))[0]
        assert landings[cells].sum() == pytest.approx(exact, rel=0.03), low
    for values in (lengths, landings):
        assert values[np.searchsorted(GRID.edges, end - 5.0)] > 0.0
        assert values[np.searchsorted(GRID.edges, end + 2.0) :].sum() == 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spray", "directions"),
    [
        (Spray(), UPRIGHT),
        (Spray(polar=math.radians(75.0), axis=(math.sqrt(0.5), 0.0, math.sqrt(0.5))), DIRECTED),
    ],
    ids=["upright", "leaning"],
)
@pytest.mark.parametrize("ground", ["soft_soil", "rock"])
def test_it_is_the_mean_of_realisations(spray: Spray, directions: Directions, ground: str) -> None:
    """With slopes drawn by the flight and integrated here: both densities, with ricochet and without."""
    criteria = Criteria()
    found = integrate(spray, directions, criteria, ricochet=ground, points=4096)
    pool = PooledFlights(directions, criteria)
    generator = np.random.default_rng(5)
    near, realisations = criteria.fluence_grid(GRID), 16
    for number in range(realisations):
        fragments = spray.drawn(generator)
        result = flight.fly(fragments, ricochet=ground, fluence=near, seed=number)
        pool.add(FlightCounts.of(result, fragments))
    rings = np.searchsorted(GRID.edges, [30.0, 60.0, 90.0, 130.0, 180.0])
    for groups, fields in ((pool.groups, found.fields[0]), (pool._short, found.fields[1])):
        cells = fields.sum(axis=2, keepdims=True) if directions.axisymmetric else fields
        for kind in range(2):
            drawn = np.stack([np.add.reduceat(one[kind].sum(axis=0), rings)[:-1] for one in groups.sums])
            mean, error = drawn.mean(axis=0), drawn.std(axis=0, ddof=1) / math.sqrt(len(drawn))
            whole = np.add.reduceat(cells.mean(axis=0)[kind].sum(axis=0), rings)[:-1]
            assert (np.abs(whole - mean) < 4.0 * error + 0.01 * mean).all(), (kind, whole, mean, error)


def test_a_vertical_axis_has_one_distance_in_all_directions() -> None:
    """The weights in every direction of an upright round are those of the integral over all azimuths."""
    one = integrate(Spray(), UPRIGHT, Criteria()).expected()
    every = integrate(Spray(), DIRECTED, Criteria()).expected()
    assert np.ptp(every.by_direction) < 0.02
    assert every.distance == pytest.approx(one.distance, rel=2e-3)
    assert every.without_ricochet.distance == pytest.approx(one.without_ricochet.distance, rel=2e-3)


def test_a_lying_round_turned_in_azimuth_turns_its_directions() -> None:
    lying = Spray(axis=(1.0, 0.0, 0.0), polar=math.radians(80.0))
    turn = math.radians(40.0)  # sixteen cells
    turned = replace(lying, axis=(math.cos(turn), math.sin(turn), 0.0))
    one, other = (integrate(spray, DIRECTED, Criteria(), points=1024).expected() for spray in (lying, turned))
    assert np.roll(one.by_direction, 16) == pytest.approx(other.by_direction, rel=1e-6)
    assert one.direction in (77.5, 80.0, 82.5, 277.5, 280.0, 282.5)


def test_neither_a_last_bit_nor_the_threads_move_it() -> None:
    first = integrate(Spray(), UPRIGHT, Criteria(), threads=1, points=1024)
    assert np.array_equal(first.fields, integrate(Spray(), UPRIGHT, Criteria(), threads=2, points=1024).fields)
    base = first.expected().distance
    for change in (1e-6, -1e-6):
        moved = integrate(Spray(speed=900.0 * (1.0 + change)), UPRIGHT, Criteria(), points=1024)
        assert abs(moved.expected().distance - base) < 2e-3


def test_its_error_is_that_of_its_points() -> None:
    few, many = (integrate(Spray(), UPRIGHT, Criteria(), points=n).expected() for n in (512, 8192))
    assert many.standard_error < 0.3 * few.standard_error
    assert abs(few.distance - many.distance) < 4.0 * few.standard_error


def test_one_event_in_twenty_throws_beyond_the_throw() -> None:
    spray = Spray(number=100.0)
    throw = integrate(spray, UPRIGHT, Criteria()).throw
    generator = np.random.default_rng(8)
    farther = [
        flight.fly(spray.drawn(generator), seed=number).landing["last_distance"].max() > throw for number in range(400)
    ]
    assert np.mean(farther) == pytest.approx(0.05, abs=0.04)  # 3.7 standard errors


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"scatter": math.radians(0.5)}, "integrate: scatter is 0.0087.* rad, needed: 0.0174533 or more"),
        ({"gravity": 0.0}, "integrate: gravity is 0.0 m/s2"),
    ],
)
def test_messages(change, message) -> None:
    spray = Spray(scatter=change.pop("scatter", SCATTER))
    with pytest.raises(flight.InputError, match=message):
        integrate(spray, UPRIGHT, Criteria(), **change)


@pytest.mark.parametrize("directions", [UPRIGHT, DIRECTED], ids=["upright", "directed"])
def test_the_distance_alone_is_that_of_whole_flights(directions: Directions) -> None:
    """Flights that end where nothing makes them hazardous again count the same."""
    whole, short = (integrate(Spray(), directions, Criteria(), points=256, distance_alone=one) for one in (False, True))
    assert short.fields[0] == pytest.approx(whole.fields[0], rel=1e-12)
    assert short.expected().distance == pytest.approx(whole.expected().distance, rel=1e-12)
    assert short.expected().without_ricochet is None
    assert math.isnan(short.throw)
    assert whole.throw > 0.0


def test_the_points_of_samples_give_their_differences() -> None:
    """Few points, the same for all masses: distances follow those of many within 1 %, where they differ by 20 %."""
    sprays = [Spray(mass=(0.005 * one, 0.2 * one), polar=math.radians(80.0)) for one in (0.5, 0.7, 1.0, 1.4, 2.0)]
    few, many = (
        np.array([
            integrate(one, UPRIGHT, Criteria(), points=points, distance_alone=True).expected().distance
            for one in sprays
        ])
        for points in (512, 4096)
    )  # fmt: skip
    assert many.max() / many.min() > 1.2
    assert (few / many).std() < 0.01
