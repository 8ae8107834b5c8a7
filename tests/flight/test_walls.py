"""Walls: the relations in SI against their printed forms in inches and pounds, and what counts as stopped."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flight
from flight.scene.walls import Wall, concrete_limit, diameter_of, steel_limit


@pytest.mark.parametrize("speed", [150.0, 400.0, 900.0])
def test_concrete_agrees_with_the_relation_in_inches_and_pounds(speed):
    # x = sqrt(4 K N W d (V / 1000 d)^1.8), or K N W (V / 1000 d)^1.8 + d; K = 180 / sqrt(f) (Kennedy 1976)
    mass, diameter, strength, nose = 0.5, 0.04, 30e6, 1.0
    pounds, inches, feet, psi = mass / 0.45359237, diameter / 0.0254, speed / 0.3048, strength / 6894.757
    g = 180.0 / math.sqrt(psi) * nose * pounds / inches * (feet / (1000.0 * inches)) ** 1.8
    depth = 2.0 * math.sqrt(g) if g <= 1.0 else g + 1.0
    limit = 3.19 * depth - 0.718 * depth**2 if depth <= 1.35 else 1.32 + 1.24 * depth
    found = concrete_limit(np.array([mass]), np.array([speed]), np.array([diameter]), strength, nose)[0]
    assert found == pytest.approx(limit * diameter, rel=0.01)


def test_both_branches_of_the_concrete_relation_meet():
    speed = np.linspace(50.0, 800.0, 2000)
    limit = concrete_limit(np.full(2000, 0.5), speed, np.full(2000, 0.04), 30e6)
    change = np.diff(limit) / limit[1:]
    assert change.min() > -0.0015  # the printed relation falls by 0.1 % where its branches meet
    assert change.max() < 0.01


def test_steel_agrees_with_the_printed_form():
    mass, speed, diameter = 2.0, 300.0, 0.08
    slug, feet, inches = mass / 14.593903, speed / 0.3048, diameter / 0.0254
    plate = (0.5 * slug * feet**2) ** (2.0 / 3.0) / (672.0 * inches)
    found = steel_limit(np.array([mass]), np.array([speed]), np.array([diameter]))[0]
    assert found == pytest.approx(0.0254 * plate, rel=1e-6)


def test_stopped_only_where_shown():
    mass, speed = np.array([0.02, 0.02, 0.02]), np.array([100.0, 600.0, 3000.0])
    wall = Wall("concrete", 0.15)
    assert wall(mass, speed).tolist() == [True, True, False]  # the last lies beyond the relation's range
    assert Wall("concrete", 100.0)(mass, speed).tolist() == [True, True, False]
    assert not Wall("steel", 0.001)(mass, speed)[1]
    assert diameter_of(np.array([7850.0 * math.pi / 4.0]))[0] == pytest.approx(1.0)


def test_without_a_strength_concrete_has_30_megapascals():
    """Its limit thickness, with the margin of a fifth, decides."""
    mass, speed = np.array([0.05]), np.array([400.0])
    needed = 1.2 * float(concrete_limit(mass, speed, diameter_of(mass), 30e6)[0])
    assert Wall("concrete", 1.001 * needed)(mass, speed)[0]
    assert not Wall("concrete", 0.999 * needed)(mass, speed)[0]


def test_masonry_has_no_relation():
    with pytest.raises(flight.InputError, match="material is 'masonry', allowed: concrete or steel"):
        Wall("masonry", 0.3)
