"""Flights of weighted fragments: the integral in calm air, and many realisations in scenes that it does not admit."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

import flight
from flight.fluence import PolarGrid, Weights
from flight.hazard.criteria import Criteria
from flight.hazard.density.directions import Directions
from flight.hazard.density.expected import expected_distance
from flight.hazard.integral import integrate
from flight.hazard.pool import FlightCounts, PooledFlights
from flight.hazard.weighted import count_weighted, expected_of
from fragfield.case import load_case
from fragfield.pipeline.flown import above_ground
from fragfield.pipeline.integral import why_not_integrated
from fragfield.pipeline.weighted import why_not_weighted
from tests.fragfield.short_run import ROOT
from tests.transition.meridian import Meridian
from transition import BreakUp, BreakUpSettings

GRID = PolarGrid.of(72, 10.0, 10.0, 600.0)
CRITERIA = Criteria()
SETS, POINTS, REALISATIONS = 8, 2**12, 60
SLOPE = 0.02


def hill():
    """A map that falls by 2 % towards x, level about the round."""
    x = np.arange(-600.0, 601.0, 20.0)
    heights = -SLOPE * np.sign(x) * np.maximum(np.abs(x) - 5.0, 0.0)
    return flight.HeightMap(np.tile(heights, (len(x), 1)), (20.0, 20.0), (-600.0, -600.0))


SCENES = {
    "calm": {},
    "wind": {"wind": flight.Wind.constant(20.0, 0.0)},
    "map": {"ground": hill()},
    "wall": {"obstacles": (flight.Wall((8.0, -6.0), (8.0, 6.0), height=2.5, thickness=0.3),)},
    "areas": {"shape": flight.shape.Lognormal(0.4, 2600.0)},
}


@pytest.fixture(scope="module")
def broken(tmp_path_factory):
    path = Meridian(position=(0.0, 0.0, 0.8)).write(tmp_path_factory.mktemp("meridian") / "burst_snapshot.h5")
    return BreakUp(path, BreakUpSettings(mean_mass=0.03, random_roll=True))


def weighted(broken, scene, basis="worst_direction"):
    """The expected density of the sets, and what each gave."""
    sets = []
    for number in range(SETS):
        made = broken.weighted(number, POINTS)
        fragments = above_ground(made.fragments, scene.get("ground", 0.0), warn=False)
        sets.append(count_weighted(fragments, Weights(made.number, made.slopes), GRID, CRITERIA, seed=number, **scene))
    return expected_of(sets, Directions(GRID, basis), CRITERIA), sets


def by_quadrant(counts):
    """Landings and path lengths (2, 4, 3) in quadrants about x, -y, ... and between some distances."""
    edges = np.searchsorted(GRID.edges, [10.0, 50.0, 120.0, 240.0])
    turn = np.roll(np.arange(GRID.azimuth_cells), GRID.azimuth_cells // 8).reshape(4, -1)
    padded = [np.pad(one, ((0, 0), (0, max(0, GRID.shape[1] - one.shape[1])))) for one in counts]
    return np.array([
        [[one[quadrant][:, low:high].sum() for low, high in pairwise(edges)] for quadrant in turn]
        for one in padded
    ])  # fmt: skip


def test_in_calm_air_they_are_the_integral(broken):
    found, _ = weighted(broken, {}, "all_azimuths")
    exact = integrate(broken.intensity(), Directions(GRID, "all_azimuths"), CRITERIA)
    for one, other in ((found.expected(), exact.expected()),
                       (found.expected().without_ricochet, exact.expected().without_ricochet)):  # fmt: skip
        assert other.standard_error < 1.0
        assert one.standard_error < 0.02 * one.distance
        assert abs(one.distance - other.distance) < 3.5 * math.hypot(one.standard_error, other.standard_error)
    assert found.hazardous == pytest.approx(exact.hazardous, abs=4.0 * found.hazardous_error + 0.02 * exact.hazardous)
    assert found.throw == pytest.approx(exact.throw, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("name", list(SCENES)[1:])
def test_elsewhere_they_are_the_mean_of_realisations(broken, name):
    """In every quadrant within 4.5 standard errors, and the distance within 3.5."""
    scene = SCENES[name]
    found, sets = weighted(broken, scene)
    directions = Directions(GRID, "worst_direction")
    pool, drawn = PooledFlights(directions, CRITERIA), []
    for number in range(REALISATIONS):
        fragments = above_ground(broken.fragments(1, number), scene.get("ground", 0.0), warn=False)
        result = flight.fly(fragments, **scene, fluence=CRITERIA.fluence_grid(GRID), seed=number)
        counts = FlightCounts.of(result, fragments, ground=scene.get("ground", 0.0))
        pool.add(counts)
        drawn.append(by_quadrant(counts.density))
    made, drawn = np.array([by_quadrant(one.whole) for one in sets]), np.array(drawn)
    error = np.sqrt(made.var(axis=0, ddof=1) / SETS + drawn.var(axis=0, ddof=1) / REALISATIONS)
    gap = made.mean(axis=0) - drawn.mean(axis=0)
    assert (np.abs(gap) < 4.5 * error + 0.01 * drawn.mean(axis=0)).all(), gap / error
    distance, mean = found.expected(), expected_distance(pool.groups, CRITERIA.density)
    assert abs(distance.distance - mean.distance) < 3.5 * math.hypot(
        distance.standard_error, mean.standard_error + mean.max_bias
    )
    if name == "wall":  # what shields is in the count: fewer beyond it than on the other side
        assert made.mean(axis=0)[1, 0, 1] < 0.7 * made.mean(axis=0)[1, 2, 1]
    if name == "wind":
        assert math.cos(math.radians(distance.direction)) > 0.5


def test_weights_count_as_so_many_fragments(broken):
    fragments = broken.fragments(1)
    ones = Weights(np.ones(len(fragments)), np.zeros((len(fragments), 0)))
    threes = Weights(np.full(len(fragments), 3.0), np.zeros((len(fragments), 0)))
    one, three = (count_weighted(fragments, weights, GRID, CRITERIA) for weights in (ones, threes))
    plain = flight.fly(fragments, fluence=CRITERIA.fluence_grid(GRID)).fluence.lengths / CRITERIA.person_height
    assert (one.whole[1] == plain[:, : one.whole[1].shape[1]]).all()
    for single, several in zip((*one.whole, one.rest), (*three.whole, three.rest), strict=True):
        assert several == pytest.approx(3.0 * single, abs=1e-5)
    with pytest.raises(flight.InputError, match="weights together with contact"):
        flight.fly(fragments, weights=ones, contact=flight.Contact())
    with pytest.raises(flight.InputError, match="number is"):
        flight.fly(fragments, weights=Weights(np.ones(3), np.zeros((3, 0))))


def test_slopes_of_the_first_impacts_are_those_given():
    """At 3 degrees on the roughest ground: a facet of no slope lets it leave, one that is far steeper holds it."""
    fragments = flight.Fragments([0.05, 0.05], [(0.0, 0.0, 1.0)] * 2, [(700.0, 0.0, -36.0)] * 2)
    weights = Weights(np.ones(2), np.array([[0.0], [50.0]]))
    grid = CRITERIA.fluence_grid(GRID)
    assert flight.fly(fragments, fluence=grid, weights=weights).landing["ricochets"].tolist()[1] == 0
    assert flight.fly(fragments, fluence=grid, weights=weights).landing["ricochets"][0] > 0


def test_rounds_that_stand_far_apart_do_not_meet(broken):
    """So weighted fragments, which fly without contact, are those of both: none strikes another."""
    one = broken.fragments(1)
    for apart, meet in ((2.0, True), (12.0, False)):
        both = flight.Fragments(
            np.tile(one.mass, 2), np.concatenate([one.position, one.position + np.array([apart, 0.0, 0.0])]),
            np.tile(one.velocity, (2, 1)), 2600.0, np.repeat([0, 1], len(one)),
        )  # fmt: skip
        contacts = flight.fly(both, contact=flight.Contact(between="rounds")).contacts
        assert (len(contacts) > 0) == meet, apart


ROUND = ROOT / "cases" / "grenade_155_tnt.toml"


@pytest.mark.parametrize(
    ("case", "settings", "words"),
    [
        (ROUND, ("flight.wind.speed=5 m/s",), ""),
        (ROUND, ("burst.geometry=3d",), ""),
        (ROUND, ("burst.geometry=3d", "round.0.attitude=any"), "any attitude"),
        (ROOT / "cases" / "m107_pair.toml", (), "strike each other"),
        (ROOT / "cases" / "m107_pair.toml", ("flight.collisions=none",), ""),
        (ROOT / "cases" / "m107_pair.toml", ("stack.gap=9 m",), "strike each other"),
        (ROOT / "cases" / "m107_pair.toml", ("stack.gap=12 m",), ""),
        (ROOT / "cases" / "m107_pair_mirrored.toml", (), "strike each other"),
    ],
)
def test_where_weighted_fragments_are_flown(case, settings, words):
    loaded = load_case(case, settings)
    assert why_not_integrated(loaded)
    assert (words in why_not_weighted(loaded)) if words else not why_not_weighted(loaded)
