"""The speed that products can give, and metal that is faster."""

from __future__ import annotations

import logging
from dataclasses import replace

import pytest
from scipy.integrate import quad

pytest.importorskip("dolfinx")

from burst_fenicsx.problem import Round
from burst_fenicsx.records.speed_bound import escape_speed, speeds_and_bound
from tests.burst_fenicsx.bodies import bodies, moved
from tests.burst_fenicsx.boxes import ELASTIC, TNT, box

pytestmark = pytest.mark.dolfinx

CELL = 0.01
ROUNDS = [Round(name, TNT, ELASTIC) for name in ("left", "right")]


def test_products_escape_with_the_speed_of_their_riemann_invariant():
    """Particle speed at the front and the integral of c over the density to nothing, on the isentrope of gamma = 3."""
    gamma, velocity = 3.0, TNT.detonation_velocity
    at_front, sound, density = velocity / (gamma + 1), gamma * velocity / (gamma + 1), 1.0
    gained, _ = quad(lambda rho: sound * (rho / density) ** (0.5 * (gamma - 1)) / rho, 0.0, density)
    assert escape_speed(ROUNDS) == pytest.approx(at_front + gained, rel=1e-9)
    faster = replace(TNT, detonation_velocity=2 * velocity)
    assert escape_speed([ROUNDS[0], Round("other", faster, ELASTIC)]) == 2 * velocity


def test_metal_above_the_bound_is_weighed_and_warned_of(caplog):
    """Two boxes, one at half of the bound, one a tenth above it: all of its mass, twice for two images."""
    caplog.set_level(logging.WARNING)
    bound = TNT.detonation_velocity
    one, other = (moved(box((2, 2, 2), (2 * CELL,) * 3), (shift, 0.0, 0.0), k) for k, shift in enumerate((0.0, 0.1)))
    slow = bodies([one, other], [(0.5 * bound, 0.0, 0.0), (0.0, -bound, 0.0)])
    found = speeds_and_bound(slow.fields, ROUNDS, 1)
    assert found == {
        "fastest_casing_node": bound,
        "escape_speed_of_products": bound,
        "casing_mass_above_escape_speed": 0,
    }
    assert not caplog.records
    fast = bodies([one, other], [(0.5 * bound, 0.0, 0.0), (0.0, -1.1 * bound, 0.0)])
    found = speeds_and_bound(fast.fields, ROUNDS, 2)
    assert found["fastest_casing_node"] == pytest.approx(1.1 * bound)
    assert found["casing_mass_above_escape_speed"] == pytest.approx(2 * 8 * CELL**3 * ELASTIC.density)
    (record,) = caplog.records
    assert record.code == "faster_than_products"
    assert "faster than products can expand: up to 7" in record.message
