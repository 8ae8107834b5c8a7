"""Which numbers are taken and which are refused: at their limits, beyond them, and what is NaN or infinite."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flight
from flight.arena import ArenaTable
from flight.fluence import PolarGrid
from flight.hazard import Criteria
from flight.hazard.density.sectors import sectors_of, tally
from flight.hazard.exposed import Prism
from flight.rows import LANDING, Status
from fragfield.hazard.tp12 import PolarField, Retardation, beam_distance, effective_number
from fragfield.hazard.walls import StoppingWall
from fragfield.places.site import Site

CLOUD = flight.Fragments([0.01, 0.02], (0.0, 0.0, 1.0), [(8.0, 0.0, 1.0), (0.0, 9.0, 2.0)])
THIRD = flight.Fragments(0.01, (0.0, 0.0, 1.0), (8.0, 0.0, 1.0), round=2)
LANDED = np.zeros(1, dtype=LANDING)
LANDED["status"], LANDED["distance"] = Status.LANDED, 25.0
FLAT = np.zeros((99, 99))
BEAM, AIR = PolarField.of([CLOUD]), Retardation(flight.Drag.constant(1.0), 1.2, 340.0, 2600.0)


def flown(**given):
    return flight.fly(CLOUD, air="vacuum", sample=0, threads=1, **given)


ABOVE_ZERO = {
    "radius of a cylinder": lambda v: flight.Cylinder(radius=v),
    "width of a panel": lambda v: flight.Panel((0, 0, 0), (1, 0, 0), v, 2.0),
    "height of a panel": lambda v: flight.Panel((0, 0, 0), (1, 0, 0), 2.0, v),
    "height of a wall": lambda v: flight.Wall((0, 0), (1, 0), v),
    "thickness of a wall": lambda v: flight.Wall((0, 0), (1, 0), 2.0, v),
    "height of a bank": lambda v: flight.Barricade((0, 0), (1, 0), v),
    "crest of a bank": lambda v: flight.Barricade((0, 0), (1, 0), 2.0, v),
    "length of a building": lambda v: flight.Building((0, 0), v, 1.0, 1.0),
    "width of a building": lambda v: flight.Building((0, 0), 1.0, v, 1.0),
    "height of a building": lambda v: flight.Building((0, 0), 1.0, 1.0, v),
    "speed of sound": lambda v: flight.ConstantAir(1.2, v),
    "critical angle": lambda v: flight.Ricochet(v, 0.5, 0.1),
    "speed kept": lambda v: flight.Ricochet(8.0, v),
    "departure": lambda v: flight.Ricochet(8.0, 0.5, v),
    "factor of a drag table": lambda v: flight.Drag.of("sphere").scaled(v),
    "mean shape factor": flight.shape.Mean,
    "median shape factor": lambda v: flight.shape.Lognormal(0.2, v),
    "density of a box": lambda v: flight.shape.Box(density=v),
    "edge of a box": lambda v: flight.shape.Box((5.0, v, 1.0)),
    "thickness that stops": lambda v: StoppingWall("steel", v),
    "strength of concrete": lambda v: StoppingWall("concrete", 0.1, v),
    "criterion's density": lambda v: Criteria(density=v),
    "person's area": lambda v: Criteria(person_area=v),
    "step of a map": lambda v: flight.HeightMap(FLAT, v),
    "step of a map's rows": lambda v: flight.HeightMap(FLAT, (1.0, v)),
    "cell of a grid": lambda v: PolarGrid(cell=v),
    "fixed step": flight.FixedStep,
    "mass": lambda v: flight.Fragments([0.1, v], (0, 0, 1), (1, 0, 0)),
    "shape factor": lambda v: flight.Fragments(0.1, (0, 0, 1), (1, 0, 0), [2600.0, v]),
    **{
        f"{name} of a contact": lambda v, name=name: flight.Contact(**{name: v})
        for name in ("density", "distance", "time_limit", "min_speed", "duration")
    },
}  # fmt: skip
ZERO_OR_MORE = {
    "density of air": flight.ConstantAir,
    "drag coefficient": flight.Drag.constant,
    "entry of a drag table": lambda v: flight.Drag(np.array([0.0, 1.0]), np.array([1.0, v])),
    "slope of a bank": lambda v: flight.Barricade((0, 0), (1, 0), 2.0, slope=v),
    "criterion's energy": lambda v: Criteria(energy=v),
    "person's height": lambda v: Criteria(person_height=v),
    "spread of shape factors": flight.shape.Lognormal,
    "rounds on the side": lambda v: effective_number(v, 2),
    "rounds on top": lambda v: effective_number(2, v),
    "number of an arena's row": lambda v: arena(number=v),
    "mean speed of an arena's row": lambda v: arena(speed=v),
    "largest speed of an arena's row": lambda v: arena(max_speed=v),
}
FINITE = {
    "centre of a cylinder": lambda v: flight.Cylinder(7.0, (0.0, v)),
    "centre of a panel": lambda v: flight.Panel((0, v, 0), (1, 0, 0), 2.0, 3.0),
    "normal of a panel": lambda v: flight.Panel((0, 0, 0), (1, v, 0), 2.0, 3.0),
    "corner of a polygon": lambda v: flight.Polygon([(0, 0, 0), (1, 0, 0), (0, v, 0)]),
    "start of a wall": lambda v: flight.Wall((0, v), (1, 0), 2.0),
    "position of a building": lambda v: flight.Building((v, 0), 1.0, 1.0, 1.0),
    "azimuth of a building": lambda v: flight.Building((0, 0), 1.0, 1.0, 1.0, v),
    "base of a building": lambda v: flight.Building((0, 0), 1.0, 1.0, 1.0, base=v),
    "corner of a map": lambda v: flight.HeightMap(FLAT, 1.0, (v, 0.0)),
    "wind's height": lambda v: flight.Wind.profile([-9.0, v], 5.0, 0.0),
    "wind's speed": lambda v: flight.Wind.constant(v, 0.0),
    "exponent of the wind": lambda v: flight.Wind.power_law(5.0, 0.0, exponent=v),
    "corner of a prism": lambda v: Prism([(0, 0), (1, 0), (1, 1), (v, 2.0)], 0.0, 3.0),
    "bearing": lambda v: Site(0.0, 0.0, v),
    "position": lambda v: flight.Fragments(0.1, (0, v, 1), (1, 0, 0)),
    "velocity": lambda v: flight.Fragments(0.1, (0, 0, 1), (1, v, 0)),
    "height of the ground": lambda v: flown(ground=-abs(v)),
}


def arena(**changed):
    columns = {"number": 3.0, "mass": 0.1, "speed": 500.0, "max_speed": 600.0} | changed
    rows = [np.array([value, value]) for value in columns.values()]
    return ArenaTable(np.array([0.0, 90.0, 180.0]), np.array([0, 1]), np.zeros(2), np.ones(2), *rows)


@pytest.mark.parametrize("name", ABOVE_ZERO)
def test_what_must_be_above_zero_is_refused_elsewhere(name):
    ABOVE_ZERO[name](0.25)
    for value in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(flight.InputError):
            ABOVE_ZERO[name](value)


@pytest.mark.parametrize("name", ZERO_OR_MORE)
def test_what_must_not_be_negative_may_be_zero(name):
    for value in (0.0, 0.25):
        ZERO_OR_MORE[name](value)
    for value in (-1.0, math.nan, math.inf):
        with pytest.raises(flight.InputError):
            ZERO_OR_MORE[name](value)


@pytest.mark.parametrize("name", FINITE)
def test_what_must_be_finite_may_have_either_sign_or_be_zero(name):
    FINITE[name](0.25)
    for value in (math.nan, math.inf, -math.inf):
        with pytest.raises(flight.InputError):
            FINITE[name](value)


@pytest.mark.parametrize(
    ("call", "lowest", "highest"),
    [
        (flight.Adaptive, 1e-14, 1e-2),
        (flight.StandardAtmosphere, -5000.0, 84_000.0),
        (lambda v: flight.Ricochet(v, 0.5, 1.0), 5e-324, 60.0),
        (lambda v: flight.Ricochet(8.0, v), 5e-324, 1.0),
        (lambda v: flight.Ricochet(8.0, 0.5, roughness=v), 0.0, 20.0),
        (lambda v: flight.Contact(restitution=v), 0.0, 1.0),
        (lambda v: Site(v, 0.0, 0.0), -89.0, 89.0),
        (lambda v: flight.Drag(np.array([v]), np.ones(1)), 0.0, 100.0),
        (lambda v: flight.Drag(np.zeros(1), np.array([v])), 0.0, 100.0),
        (lambda v: beam_distance(BEAM, AIR, Criteria(), width=v), 1.0, 180.0),
        (lambda v: flight.hazard_distance(CLOUD, kernel=v), 1.0, 180.0),
        (lambda v: flight.Contact(friction_angle_deg=v), 0.0, math.nextafter(90.0, 0.0)),
    ],
)
def test_ranges_end_at_their_limits(call, lowest, highest):
    for value in (lowest, 0.5 * (lowest + highest), highest):
        call(value)
    for value in (math.nextafter(lowest, -math.inf), math.nextafter(highest, math.inf), math.nan):
        with pytest.raises(flight.InputError):
            call(value)


@pytest.mark.parametrize(
    "call",
    [
        lambda: flight.Cylinder(7.0, (0.0, 0.0, 1.0)),
        lambda: flight.Panel((0, 0), (1, 0, 0), 2.0, 3.0),
        lambda: flight.Panel((0, 0, 0), (1, 0, 0, 0), 2.0, 3.0),
        lambda: flight.Polygon([(0, 0), (1, 0), (0, 1)]),
        lambda: flight.Polygon([0.0, 1.0, 2.0]),
        lambda: flight.Polygon([(0, 0, 0), (1, 0, 0)]),
        lambda: flight.Wall((0, 0, 0), (1, 0), 2.0),
        lambda: flight.Building((0.0,), 1.0, 1.0, 1.0),
        lambda: flight.HeightMap(np.zeros(4), 1.0),
        lambda: flight.HeightMap(np.zeros((1, 5)), 1.0),
        lambda: flight.HeightMap(np.zeros((5, 1)), 1.0),
        lambda: flight.HeightMap(FLAT, 1.0, (0.0, 0.0, 0.0)),
        lambda: flight.shape.Box((5.0, 2.0)),
        lambda: flight.Drag(np.zeros((2, 2)), np.zeros((2, 2))),
        lambda: flight.Drag(np.zeros(0), np.zeros(0)),
        lambda: flight.Drag(np.array([0.0, 1.0]), np.ones(3)),
        lambda: flight.Wind(np.zeros(0), np.zeros((0, 2))),
        lambda: flight.Wind(np.zeros(1), np.zeros((2, 2))),
        lambda: flight.Wind(np.zeros((1, 1)), np.zeros((1, 2))),
        lambda: ArenaTable.of([THIRD], [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)]),
        lambda: ArenaTable.of([]),
        lambda: ArenaTable.of([CLOUD.select([])]),
        lambda: flight.Wind.power_law(5.0, 0.0, 0.0),
        lambda: flight.Wind.power_law(5.0, 0.0, -1.0),
        lambda: flight.Wind.power_law(5.0, 0.0, top=0.0),
        lambda: flight.Fragments(0.1, (0, 0, 1), (1, 0, 0), round=2, round_names=("a", "b")),
    ],
)
def test_shapes_that_do_not_fit_are_refused(call):
    with pytest.raises(flight.InputError):
        call()


@pytest.mark.parametrize(
    ("low", "high", "call"),
    [
        (1.0, 2.0, lambda low, high: flight.Cylinder(7.0, bottom=low, top=high)),
        (1.0, 2.0, lambda low, high: flight.Domain(floor=low, ceiling=high)),
        (1.0, 2.0, lambda low, high: Prism([(0, 0), (4, 0), (4, 4)], low, high)),
    ],
)
def test_what_ends_must_begin_below(low, high, call):
    call(low, high)
    for wrong in ((high, low), (low, low), (math.nan, high), (low, math.nan)):
        with pytest.raises(flight.InputError):
            call(*wrong)


@pytest.mark.parametrize("whole", [360.0, 180.0, 5.0, 0.1, 360.0 / 7.0])
def test_widths_that_divide_the_circle_are_taken(whole):
    azimuth = np.array([0.0, 0.49 * whole, 0.51 * whole, 359.999])
    sector, count = sectors_of(azimuth, whole)
    assert count * whole == pytest.approx(360.0, rel=1e-12)
    assert sector.tolist() == [0, 0, 1 % count, 0]


@pytest.mark.parametrize("width", [0.0, -5.0, 7.0, 400.0, 720.0, math.nan, 5.0 + 1e-7])
def test_widths_that_do_not_divide_the_circle_are_refused(width):
    for call in (lambda: sectors_of(np.zeros(1), width), lambda: ArenaTable.of([CLOUD], width=width)):
        with pytest.raises(flight.InputError):
            call()


@pytest.mark.parametrize(
    "edges", [[1.0, 180.0], [0.0, 179.0], [0.0, 90.0, 90.0, 180.0], [0.0], [0.0, 100.0, 90.0, 180.0]]
)
def test_zones_that_leave_a_gap_are_refused(edges):
    with pytest.raises(flight.InputError, match="zones must rise from 0 to 180"):
        ArenaTable(np.array(edges), *[np.zeros(0, dtype=np.int64)], *[np.zeros(0)] * 6)


def test_defaults_are_those_of_no_argument():
    """What is left out, and what is given as its default, is one."""
    assert tally(LANDED, 0.0).hazardous.sum() == 1
    assert tally(LANDED).hazardous.sum() == tally(LANDED, 79.0).hazardous.sum() == 0


def test_ground_and_ricochet_fit_together():
    assert flown(ground=None, time_limit=0.1).summary["landed"] == 0
    assert flown(ground=0.0, ricochet="rock").summary["landed"] == 2
    with pytest.raises(flight.InputError):
        flown(ground=2.0)
    assert flown(gravity=0.0, ground=None, time_limit=0.1).summary["landed"] == 0
