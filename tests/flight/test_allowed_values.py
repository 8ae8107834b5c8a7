"""Which numbers are taken and which are refused: at their limits, beyond them, and what is NaN or infinite."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flight
from flight.arena import ArenaTable
from flight.fluence import PolarGrid
from flight.hazard import Criteria
from flight.hazard.density.sectors import sectors_of
from flight.hazard.exposed import Prism
from fragfield.hazard.tp12 import PolarField, Retardation, beam_distance, effective_number
from fragfield.hazard.walls import StoppingWall
from fragfield.places.site import Site

CLOUD = flight.Fragments([0.01, 0.02], (0.0, 0.0, 1.0), [(8.0, 0.0, 1.0), (0.0, 9.0, 2.0)])
THIRD = flight.Fragments(0.01, (0.0, 0.0, 1.0), (8.0, 0.0, 1.0), round=2)
FLAT = np.zeros((99, 99))
BEAM, AIR = PolarField.of([CLOUD]), Retardation(flight.Drag.constant(1.0), 1.2, 340.0, 2600.0)


def flown(**given):
    return flight.fly(CLOUD, air="vacuum", sample=0, threads=1, **given)


OBJECTS = [
    # what is made, what it needs, numbers that must be above zero, zero or more, finite
    (flight.Cylinder, {"radius": 7.0}, "radius", "", ""),
    (flight.Panel, {"centre": (0, 0, 0), "normal": (1, 0, 0), "width": 2.0, "height": 3.0}, "width height", "", ""),
    (flight.Wall, {"start": (0, 0), "end": (1, 0), "height": 2.0}, "height thickness", "", "base"),
    (flight.Barricade, {"start": (0, 0), "end": (1, 0), "height": 2.0}, "height crest_width", "slope", "base"),
    (flight.Building, {"position": (0, 0), "length": 1.0, "width": 1.0, "height": 1.0}, "length width height", "",
     "azimuth base"),
    (flight.ConstantAir, {}, "sound_speed_everywhere", "density_everywhere", ""),
    (flight.Ricochet, {"critical_angle": 8.0, "speed_kept": 0.5}, "critical_angle speed_kept departure", "", ""),
    (flight.shape.Mean, {}, "shape_factor", "", ""),
    (flight.shape.Lognormal, {"spread": 0.2}, "median", "spread", ""),
    (flight.shape.Box, {}, "density", "", ""),
    (flight.FixedStep, {}, "step", "", ""),
    (flight.Contact, {}, "density distance time_limit min_speed duration", "", ""),
    (flight.Fragments, {"mass": 0.1, "position": (0, 0, 1), "velocity": (1, 0, 0)}, "mass shape_factor", "", ""),
    (flight.Wind.power_law, {"speed": 5.0, "towards_deg": 0.0}, "reference_height top", "", "speed exponent"),
    (flight.HeightMap, {"heights": FLAT, "step": 1.0}, "step", "", ""),
    (StoppingWall, {"material": "steel", "thickness": 0.1}, "thickness", "", ""),
    (Criteria, {}, "density person_area", "energy person_height", ""),
    (PolarGrid, {}, "cell", "", ""),
    (Site, {"latitude": 0.0, "longitude": 0.0, "bearing": 0.0}, "", "", "bearing"),
    (effective_number, {"side": 2, "top": 2}, "", "side top", ""),
]  # fmt: skip
FINITE = {
    "centre of a cylinder": lambda v: flight.Cylinder(7.0, (0.0, v)),
    "centre of a panel": lambda v: flight.Panel((0, v, 0), (1, 0, 0), 2.0, 3.0),
    "normal of a panel": lambda v: flight.Panel((0, 0, 0), (1, v, 0), 2.0, 3.0),
    "corner of a polygon": lambda v: flight.Polygon([(0, 0, 0), (1, 0, 0), (0, v, 0)]),
    "start of a wall": lambda v: flight.Wall((0, v), (1, 0), 2.0),
    "corner of a map": lambda v: flight.HeightMap(FLAT, 1.0, (v, 0.0)),
    "wind's height": lambda v: flight.Wind.profile([-9.0, v], 5.0, 0.0),
    "corner of a prism": lambda v: Prism([(0, 0), (1, 0), (1, 1), (v, 2.0)], 0.0, 3.0),
    "position": lambda v: flight.Fragments(0.1, (0, v, 1), (1, 0, 0)),
    "velocity": lambda v: flight.Fragments(0.1, (0, 0, 1), (1, v, 0)),
}


def arena(**changed):
    columns = {"number": 3.0, "mass": 0.1, "speed": 500.0, "max_speed": 600.0} | changed
    rows = [np.array([value, value]) for value in columns.values()]
    return ArenaTable(np.array([0.0, 90.0, 180.0]), np.array([0, 1]), np.zeros(2), np.ones(2), *rows)


@pytest.mark.parametrize(
    ("make", "needed", "above", "low", "finite"), OBJECTS, ids=lambda one: getattr(one, "__name__", "")
)
def test_numbers_of_an_object_are_refused_beyond_their_ends(make, needed, above, low, finite):
    """NaN and infinity too; a fourth is taken everywhere, zero where it may be."""
    for names, taken, refused in (
        (above, (0.25,), (0.0, -1.0)), (low, (0.0, 0.25), (-1.0,)), (finite, (0.25,), (-math.inf,)),
    ):  # fmt: skip
        for name in names.split():
            for value in taken:
                make(**needed | {name: value})
            for value in (*refused, math.nan, math.inf):
                with pytest.raises(flight.InputError):
                    make(**needed | {name: value})


@pytest.mark.parametrize("name", ["number", "mass", "speed", "max_speed"])
def test_numbers_of_an_arena_are_zero_or_more(name):
    arena(**{name: 0.25})
    for value in (-1.0, math.nan, math.inf):
        with pytest.raises(flight.InputError):
            arena(**{name: value})


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
