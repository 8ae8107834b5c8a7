"""Constants and defaults beside their sources, beside each other, and beside closed forms."""

from __future__ import annotations

import inspect
import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import PchipInterpolator
from scipy.stats import norm, t

import flight
from burst_fenicsx.problem import ContactSettings
from flight import Contact, Wind
from flight.arena import ArenaTable
from flight.fluence import FluenceGrid, PolarGrid
from flight.hazard.criteria import Criteria, hit_probability
from flight.hazard.density.directions import Directions, _raised_cosine
from flight.hazard.density.expected import _student
from flight.hazard.density.sectors import tally
from flight.hazard.exposed import Prism
from flight.hazard.pool import TOLERANCE
from flight.scene.obstacles import count_by_face
from flight.scene.ricochet import KINDS
from flight.scene.tables import evaluate_pieces, monotone_pieces, monotone_slopes
from fragfield.case.tables.flight import HazardTable
from fragfield.hazard.tp12 import effective_number
from fragfield.hazard.walls import FRAGMENT_DENSITY, StoppingWall, concrete_limit

FOOT, POUND_FORCE = 0.3048, 4.4482216


def default(function, name):
    return inspect.signature(function).parameters[name].default


def test_the_criterion_is_fifty_eight_foot_pounds_and_one_in_six_hundred_square_feet():
    criteria = Criteria()
    assert criteria.energy == pytest.approx(58.0 * FOOT * POUND_FORCE, rel=0.01)
    assert criteria.density == pytest.approx(1.0 / (600.0 * FOOT**2), rel=1e-3)
    assert criteria.person_area == pytest.approx(6.2 * FOOT**2, rel=0.01)
    assert criteria.person_height == pytest.approx(6.0 * FOOT, rel=0.02)


def test_what_is_left_out_is_that_criterion_everywhere():
    of_energy = (ArenaTable.by_zone, flight.FlightResult.by_face, count_by_face, Prism, tally, FluenceGrid)
    assert [default(one, "energy") for one in of_energy] == [Criteria().energy] * len(of_energy)
    assert default(Prism, "height") == default(FluenceGrid, "height") == Criteria().person_height
    assert default(hit_probability, "person_area") == Criteria().person_area


def test_the_library_and_the_case_have_the_same_defaults():
    """72 sectors, cells of 10 m, a kernel of 10 degrees: the distance of both is one."""
    case, grid = HazardTable(), PolarGrid.of()
    assert (case.sectors, case.distance_cell, case.tolerance) == (grid.sectors, grid.cell, TOLERANCE)
    assert (grid.sectors, grid.cell, TOLERANCE) == (72, 10.0, 0.02)
    assert math.degrees(case.kernel) == pytest.approx(default(flight.hazard_distance, "kernel"), rel=1e-15)
    assert 360.0 / default(tally, "sector_width") == grid.sectors
    assert default(ArenaTable.of, "width") == 360.0 / grid.sectors
    wanted = Criteria()
    assert [case.energy, case.density, case.person_area, case.person_height] == list(vars(wanted).values())


@pytest.mark.parametrize(("name", "density"), [("water", 1000.0), ("soft_soil", 1500.0), ("sand", 1700.0)])
def test_critical_angle_is_johnson_and_reids_for_the_density(name, density):
    """18 degrees over the root of the ratio of densities (1975), for steel of 7850 kg/m3."""
    assert KINDS[name].critical_angle == pytest.approx(18.0 / math.sqrt(7850.0 / density), abs=0.05)


def test_steel_and_its_friction_are_those_of_the_burst():
    assert Contact().density == FRAGMENT_DENSITY == 7850.0
    assert Contact().friction_angle_deg == ContactSettings().surface_friction_angle


def test_wind_grows_with_the_seventh_root_from_ten_metres():
    wind = Wind.power_law(5.0, 90.0)
    assert wind.at(10.0) == pytest.approx([0.0, 5.0], abs=0.02)
    for height in (2.0, 40.0, 300.0):
        assert wind.at(height)[1] == pytest.approx(5.0 * (height / 10.0) ** (1.0 / 7.0), rel=5e-3)
    assert wind.at(1e5) == pytest.approx(wind.at(1000.0))
    assert wind.at(999.0)[1] < wind.at(1000.0)[1]
    assert wind.at(0.0) == pytest.approx([0.0, 0.0])
    assert wind.at(1.5e-3)[1] < 0.4 * wind.at(0.1)[1]


@pytest.mark.parametrize(("side", "top", "open_", "earth"), [(10, 0, 9.0, 7.0), (0, 10, 1.0, 1.0), (4, 2, 3.8, 3.0)])
def test_the_effective_number_of_a_stack_is_the_published_one(side, top, open_, earth):
    """0.9 of the side and 0.1 of the top in the open, 0.7 and 0.1 under earth."""
    assert effective_number(side, top) == effective_number(side, top, "open") == pytest.approx(open_)
    assert effective_number(side, top, "earth") == pytest.approx(earth)


@pytest.mark.parametrize("freedom", [5, 8, 12, 30, 300])
def test_students_quantile_is_that_of_its_expansion(freedom):
    """To the next term of the series (Abramowitz and Stegun 26.7.5), and the normal one's without end."""
    z = norm.ppf(0.95)
    rest = (79 * z**9 + 776 * z**7 + 1482 * z**5 - 1920 * z**3 - 945 * z) / (92160.0 * freedom**4)
    assert _student(freedom) == pytest.approx(t.ppf(0.95, freedom), abs=1.2 * rest + 1e-12)
    assert _student(10**7) == pytest.approx(z, rel=1e-6)
    assert _student(0) == _student(1)


def test_the_azimuth_kernel_has_unit_area_and_its_own_second_moment():
    """A raised cosine (1 + cos(pi x / h)) / 2 h; on a grid narrowed so that both together are as wide as it was."""
    for half in (3.0, 10.0):
        ends = _raised_cosine(np.array([-2.0 * half, -half, 0.0, half, 5.0 * half]), half)
        assert ends == pytest.approx([0.0, 0.0, 0.5, 1.0, 1.0], abs=1e-15)
        for gap in (-0.7 * half, 0.2 * half):
            area = quad(lambda x, h=half: (1.0 + math.cos(math.pi * x / h)) / (2.0 * h), -half, gap)[0]
            assert _raised_cosine(np.array([gap]), half) == pytest.approx([area], rel=1e-10)
    moment = quad(lambda x: x * x * (1.0 + math.cos(math.pi * x)) / 2.0, -1.0, 1.0)[0]
    for kernel, sectors in ((10.0, 72), (20.0, 72), (30.0, 24)):
        grid = PolarGrid.of(sectors, kernel, 10.0, 500.0)
        directions = Directions(grid, "worst_direction", kernel)
        weights = directions.weights()
        assert weights.sum(axis=1) == pytest.approx(1.0, rel=1e-12)
        centre = grid.start + grid.width * (np.arange(grid.azimuth_cells) + 0.5)
        away = (centre - directions.azimuth[0] + 180.0) % 360.0 - 180.0
        assert weights[0] @ away**2 == pytest.approx(moment * kernel**2, rel=0.01)


# --- Walls: what counts as stopped, on both sides of each printed limit, margin and range

G, MASS, STRENGTH = 3.8e-5, 0.05, 30e6


def speed_of_depth(depth: float, nose: float = 1.14) -> float:
    """Speed (m/s) at which a steel cylinder of `MASS` enters concrete by so many diameters, by the printed relation."""
    diameter = (4.0 * MASS / (math.pi * 7850.0)) ** (1.0 / 3.0)
    g = depth**2 / 4.0 if depth <= 2.0 else depth - 1.0
    return (g * diameter**2.8 * math.sqrt(STRENGTH) / (G * nose * MASS)) ** (1.0 / 1.8)


@pytest.mark.parametrize(
    ("depth", "limit"),
    [  # e/d = 3.19 x/d - 0.718 (x/d)^2 up to 1.35, 1.32 + 1.24 x/d up to 13.5 (Kennedy 1976)
        (0.5, 1.4155), (1.3, 2.93358), (1.349, 2.99671), (1.36, 3.0064), (1.5, 3.18), (1.9, 3.676), (2.25, 4.11),
        (13.49, 18.0476),
    ],
)  # fmt: skip
def test_concrete_stops_from_a_fifth_over_the_printed_limit_on(depth, limit):
    """Of the sharpest nose: 1.2 times the limit holds the fragment, half a thousandth less does not."""
    needed = 1.2 * limit * (4.0 * MASS / (math.pi * 7850.0)) ** (1.0 / 3.0)
    for factor, stopped in ((1.0005, True), (0.9995, False)):
        wall = StoppingWall("concrete", factor * needed)
        assert wall(np.array([MASS]), np.array([speed_of_depth(depth)])).tolist() == [stopped]


def test_concrete_of_any_thickness_stops_nothing_beyond_the_range_of_the_relation():
    speeds = np.array([speed_of_depth(depth) for depth in (13.4, 13.6)])
    assert StoppingWall("concrete", 100.0)(np.full(2, MASS), speeds).tolist() == [True, False]


def test_the_factor_of_the_concrete_relation_is_the_printed_one_in_inches_and_pounds():
    """Of a penetration below two diameters x^2 = 4 K N W d (V / 1000 d)^1.8 in inches, K = 180 / sqrt(psi)."""
    pounds, inches, feet, psi = 0.5 / 0.45359237, 0.04 / 0.0254, 150.0 / 0.3048, 30e6 / 6894.757
    x = math.sqrt(4.0 * 180.0 / math.sqrt(psi) * pounds * inches * (feet / (1000.0 * inches)) ** 1.8) / inches
    found = concrete_limit(np.array([0.5]), np.array([150.0]), np.array([0.04]), 30e6, 1.0)[0]
    assert found == pytest.approx((3.19 * x - 0.718 * x**2) * 0.04, rel=2e-3)


def test_steel_stops_from_a_quarter_over_the_printed_limit_on():
    """0.05 kg at 600 m/s: 6638.1 ft lb, diameter 0.79099 in; 1.25 x 353.21 / (672 x 0.79099) in = 21.098 mm."""
    mass, speed = np.array([0.05]), np.array([600.0])
    assert StoppingWall("steel", 21.11e-3)(mass, speed)[0]
    assert not StoppingWall("steel", 21.09e-3)(mass, speed)[0]


def test_masonry_has_no_relation():
    with pytest.raises(flight.InputError, match="material is 'masonry', allowed: concrete or steel"):
        StoppingWall("masonry", 0.3)


# --- Piecewise cubics beside scipy's: slopes of unevenly spaced tables, pieces with given slopes, their values


@pytest.mark.parametrize("seed", range(6))
def test_slopes_and_values_are_those_of_scipys_shape_preserving_cubic(seed):
    """Rising, falling, level and turning, with steps that differ by a factor of ten."""
    generator = np.random.default_rng(seed)
    x = np.cumsum(10.0 ** generator.uniform(-0.5, 0.5, 12))
    y = np.cumsum(generator.normal(0.3 * (seed % 3), 1.0, 12))
    y[5] = y[4]
    expected = PchipInterpolator(x, y)
    np.testing.assert_allclose(monotone_slopes(x, y), expected.derivative()(x), rtol=1e-12, atol=1e-14)
    at = generator.uniform(x[0], x[-1], 200)
    np.testing.assert_allclose(evaluate_pieces(x, monotone_pieces(x, y), at), expected(at), rtol=1e-11, atol=1e-12)
