"""Flights of weighted fragments: the integral in calm air, and many realisations in scenes that it does not admit."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

import flight
from flight.fluence import PolarGrid, Weights
from flight.hazard.criteria import Criteria
from flight.hazard.density.density_counts import density_counts
from flight.hazard.density.directions import Directions
from flight.hazard.density.expected import expected_distance
from flight.hazard.integral import integrate
from flight.hazard.pool import FlightCounts, PooledFlights
from flight.hazard.weighted import count_weighted, expected_of
from flight.integrate.contact import legs_between
from fragfield.case import load_case
from fragfield.case.conversion.turned import Arrangement
from fragfield.pipeline.flown import above_ground
from fragfield.pipeline.integral import Integrand, why_not_integrated
from fragfield.pipeline.weighted import WeightedFlights, by_contact, may_meet, why_not_weighted
from tests.fragfield.short_run import ROOT
from tests.transition.meridian import Meridian
from transition import BreakUp, BreakUpSettings
from transition.weighted import SLOPES, WeightedFragments, spread_out

GRID = PolarGrid.of(72, 10.0, 10.0, 600.0)
CRITERIA = Criteria()
SETS, POINTS, REALISATIONS = 8, 2**12, 60
SLOPE = 0.02
CONTACT, BESIDE = flight.Contact(between="rounds"), np.array([0.2, 0.0, 0.0])


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
        (ROUND, ("burst.geometry=3d", "round.0.attitude=any"), ""),
        (ROUND, ("flight.wind.speed=5 m/s", "round.0.attitude=any"), ""),
        (ROOT / "cases" / "m107_pair.toml", (), ""),
        (ROOT / "cases" / "m107_pair.toml", ("round.0.attitude=any",), "several rounds of any attitude"),
    ],
)
def test_where_weighted_fragments_are_flown(case, settings, words):
    loaded = load_case(case, settings)
    assert why_not_integrated(loaded)
    assert (words in why_not_weighted(loaded)) if words else not why_not_weighted(loaded)


@pytest.mark.parametrize(
    ("case", "settings", "meet"),
    [
        (ROUND, ("burst.geometry=3d",), False),
        (ROOT / "cases" / "m107_pair.toml", (), True),
        (ROOT / "cases" / "m107_pair.toml", ("flight.collisions=none",), False),
        (ROOT / "cases" / "m107_pair.toml", ("stack.gap=9 m",), True),
        (ROOT / "cases" / "m107_pair.toml", ("stack.gap=12 m",), False),
        (ROOT / "cases" / "m107_pair_mirrored.toml", (), True),
    ],
)
def test_where_fragments_may_meet(case, settings, meet):
    assert may_meet(load_case(case, settings)) == meet


@pytest.fixture
def coarsely(monkeypatch):
    for name, step in (("COARSE", 45.0), ("FINE", 20.0), ("AZIMUTHS", 90.0), ("AZIMUTH", 45.0)):
        monkeypatch.setattr(f"fragfield.pipeline.integral.{name}", step)


def any_attitude(broken, *settings):
    return WeightedFlights(load_case(ROUND, ("round.0.attitude=any", "hazard.tolerance=0.15", *settings)), broken, 2)


@pytest.mark.slow
def test_the_worst_attitude_in_wind_is_that_of_the_round_which_stands_so(broken, coarsely):
    """Its distance is no less than in others, and turns with the wind; the nose is tried to one side of it."""
    along = any_attitude(broken, "flight.wind.speed=20 m/s")
    found, solved = along.solve(), {}
    for inclination, azimuth in ((0.0, 0.0), (90.0, 0.0), (45.0, 180.0)):
        turned = Arrangement(along.case).turned(inclination, azimuth=azimuth)
        solved[inclination, azimuth] = along.solve(turned).integral.expected()
    best = found.integral.expected()
    for one in solved.values():
        assert one.distance < best.distance + 3.5 * math.hypot(one.standard_error, best.standard_error)
    near, far = (pick(solved.values(), key=lambda one: one.distance) for pick in (min, max))
    assert far.distance - near.distance > 3.5 * math.hypot(near.standard_error, far.standard_error), "attitudes differ"
    assert 0.0 <= found.attitude.azimuth <= 180.0
    assert [row.inclination_deg for row in found.curve] == sorted({row.inclination_deg for row in found.curve})
    across = any_attitude(broken, "flight.wind={speed='20 m/s', towards='90 deg'}").solve()
    other = across.integral.expected()
    error = math.hypot(best.standard_error, other.standard_error)
    assert other.distance == pytest.approx(best.distance, abs=3.5 * error)
    downwind = [(one.direction - wind + 180.0) % 360.0 - 180.0 for one, wind in ((best, 0.0), (other, 90.0))]
    assert max(map(abs, downwind)) < 90.0


@pytest.mark.slow
def test_in_a_breath_of_wind_any_attitude_is_that_of_still_air(broken, coarsely):
    breath = any_attitude(broken, "flight.wind.speed=0.01 m/s")
    still = load_case(ROUND, ("round.0.attitude=any",))
    exact = Integrand(still, broken.intensity(), 2).solve().integral.expected()
    found = breath.solve().integral.expected()
    assert found.distance == pytest.approx(exact.distance, abs=3.5 * found.standard_error + 0.01 * exact.distance)


def test_elevations_spread_out_as_they_were():
    """Normal elevations keep their mean and variance, heavy fragments become more, and numbers by elevation stay."""
    degrees, scatter, width, number = 5.0, 6.0, 3.0, 20_000
    elevation = np.radians(degrees + scatter * ndtri((np.arange(number) + 0.5) / number))
    mass = np.random.default_rng(2).permutation(np.tile([0.002, 0.01, 0.02, 0.0008], number // 4))
    velocity = 1000.0 * np.column_stack([np.cos(elevation), np.zeros(number), np.sin(elevation)])
    before = flight.Fragments(mass, (0.0, 0.0, 1.0), velocity, 2600.0)
    made = spread_out(before, np.zeros(number, dtype=np.int64), math.radians(width), np.random.default_rng(1))
    fragments = made.fragments
    masses, of_each = (one.mass[np.abs(one.velocity[:, 2]) < 50.0] for one in (before, fragments))
    times = {one: (of_each == one).sum() / (masses == one).sum() for one in set(mass)}
    assert times[0.02] > 5.0 * times[0.002]
    assert made.number.sum() == pytest.approx(number, rel=0.01)
    assert fragments.speed == pytest.approx(1000.0)
    after = np.degrees(np.arcsin(fragments.velocity[:, 2] / 1000.0))
    mean = np.average(after, weights=made.number)
    assert mean == pytest.approx(degrees, abs=0.1)
    assert np.average((after - mean) ** 2, weights=made.number) == pytest.approx(scatter**2, rel=0.03)
    for low, high in ((-20.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (5.0, 6.0)):
        inside = np.where((after > low) & (after < high), made.number, 0.0)
        expected = number * float(np.diff(ndtr((np.array([low, high]) - degrees) / scatter))[0])
        assert inside.sum() == pytest.approx(expected, abs=4.0 * math.sqrt((inside**2).sum()) + 0.01 * expected)


def test_a_fragment_flies_on_after_its_last_contact():
    """One is struck twice, one never, and one comes to rest on the ground before its contact is due."""
    fragments = flight.Fragments([0.01] * 4, 1.0 + np.eye(4, 3), np.full((4, 3), 100.0))
    contacts = np.zeros(3, dtype=flight.CONTACTS)
    contacts["time"], contacts["first"], contacts["second"] = [0.1, 0.2, 0.3], [0, 0, 2], [3, 3, 3]
    contacts["first_after"], contacts["second_after"] = [[1.0], [2.0], [3.0]], [[4.0], [5.0], [6.0]]
    landing = np.zeros(4, dtype=flight.LANDING)
    landing["time"] = [9.0, 9.0, 0.25, 9.0]
    legs = legs_between(fragments, contacts)
    assert legs.fragments.velocity[legs.last(landing), 0].tolist() == [2.0, 100.0, 6.0]


def pair(source, number):
    """A realisation of two rounds side by side."""
    one, other = source.fragments(1, number), source.fragments(2, number)
    return flight.Fragments(
        np.concatenate([one.mass, other.mass]),
        np.concatenate([one.position, other.position + BESIDE]),
        np.concatenate([one.velocity, other.velocity]), 2600.0, np.repeat([0, 1], [len(one), len(other)]),
        round_names=(source.rounds[0].name, "beside"),
    )  # fmt: skip


def counted(parts):
    made = WeightedFragments.concatenate(parts)
    return count_weighted(made.fragments, Weights(made.number, made.slopes), GRID, CRITERIA, ricochet="none").whole


def test_contact_changes_no_fragment_that_it_does_not_strike(broken):
    """Of the same draws: all fragments without contact, and the difference by contact, are those flown with it."""
    fragments, generator = pair(broken, 0), np.random.default_rng(0)
    result = flight.fly(fragments, contact=CONTACT, ricochet="none", fluence=CRITERIA.fluence_grid(GRID))
    number = len(fragments)
    free = WeightedFragments(fragments, np.ones(number), np.zeros((number, SLOPES)))
    after, launched = by_contact(fragments, 0.0, generator, contact=CONTACT, ricochet="none")
    assert 0 < len(launched.fragments) < 0.5 * number
    beyond = np.searchsorted(GRID.edges, 10.0)  # legs between contacts end before
    for whole, alone, expected in zip(
        counted([free, after, launched]), counted([free]), density_counts(result), strict=True
    ):
        assert whole[:, beyond : expected.shape[1]] == pytest.approx(expected[:, beyond:], abs=1e-6)
        assert np.abs(alone[:, beyond : expected.shape[1]] - expected[:, beyond:]).max() > 0.5
    none = fragments.select(fragments.round == 0)
    assert by_contact(none, 0.05, generator, contact=CONTACT) == ()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::flight.FlightWarning")
def test_fragments_that_met_fly_as_the_mean_of_realisations(broken):
    """Two rounds side by side: in every quadrant within 4.5 standard errors of realisations."""
    met, drawn = [], []
    for number in range(REALISATIONS):
        fragments = pair(broken, number)
        result = flight.fly(fragments, contact=CONTACT, fluence=CRITERIA.fluence_grid(GRID), seed=number)
        drawn.append(by_quadrant(FlightCounts.of(result, fragments).density))
        if number < REALISATIONS // 3:
            one, other = (broken.weighted(2 * number + round_, POINTS) for round_ in (0, 1))
            other = other._replace(fragments=other.fragments.translated(BESIDE))
            generator, width = np.random.default_rng(number), 0.5 * broken.settings.direction_scatter
            changed = by_contact(pair(broken, number + REALISATIONS), width, generator, contact=CONTACT)
            made = WeightedFragments.concatenate([one, other, *changed])
            counts = count_weighted(made.fragments, Weights(made.number, made.slopes), GRID, CRITERIA)
            met.append(by_quadrant(counts.whole))
    met, drawn = np.array(met), np.array(drawn)
    error = np.sqrt(met.var(axis=0, ddof=1) / len(met) + drawn.var(axis=0, ddof=1) / len(drawn))
    gap = met.mean(axis=0) - drawn.mean(axis=0)
    assert (np.abs(gap) < 4.5 * error + 0.01 * drawn.mean(axis=0)).all(), gap / error
