"""Walls: what counts as stopped, on both sides of each printed limit, margin and range."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flight
from flight.scene.walls import StoppingWall, concrete_limit

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
