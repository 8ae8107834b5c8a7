"""The speed at which products expand into a vacuum, and metal that is faster."""

from __future__ import annotations

import itertools
import logging

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.materials.library import load_explosive
from burst_fenicsx.materials.products import make_products
from burst_fenicsx.materials.products.jwl import JwlProducts
from burst_fenicsx.problem import JonesWilkinsLee
from burst_fenicsx.records.measures import escape_speed, speeds_and_bound
from tests.burst_fenicsx.bodies import bodies, moved
from tests.burst_fenicsx.boxes import COMP_B, ELASTIC, TNT, box

pytestmark = pytest.mark.dolfinx

CELL = 0.01


def gained(pressure, density, start):
    """Integral of the sound speed over the logarithm of the density from `start` = V/V0 on, by `pressure` of V/V0."""

    def slope(v):
        return (pressure(v * (1.0 - 1e-6)) - pressure(v * (1.0 + 1e-6))) / (2e-6 * v)

    pieces = [start, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 10.0]
    total = sum(
        quad(lambda v: np.sqrt(slope(v) / density), a, b, limit=200, epsrel=1e-9)[0]
        for a, b in itertools.pairwise(pieces)
    )
    # Beyond: over the logarithm, in which it falls exponentially.
    rest, _ = quad(lambda s: np.sqrt(slope(np.exp(s)) / density) * np.exp(s), np.log(10.0), 150.0, limit=400)
    return total + rest


@pytest.mark.parametrize("explosive", [TNT, COMP_B])
@pytest.mark.parametrize("model", ["landau", "landau_cj"])
def test_products_escape_with_the_speed_of_their_own_isentrope(explosive, model):
    """Particle speed at the front and the integral of c over both branches, by quadrature: 1.40 to 1.70 D."""
    products = make_products(explosive, model)
    front = products.front_speed
    expected = front / 4.0 + gained(lambda v: float(products.pressure(v)), products.density, 0.75)
    assert products.escape_speed == pytest.approx(expected, rel=2e-4)
    assert 1.40 < products.escape_speed / explosive.detonation_velocity < 1.70


def polytropic(omega, density=1000.0, energy=4e9):
    """An ideal gas as JWL without its exponentials, at the Chapman-Jouguet state of a strong detonation."""
    gamma = 1.0 + omega
    velocity = float(np.sqrt(2.0 * (gamma**2 - 1.0) * energy / density))
    return JwlProducts(density, JonesWilkinsLee(0.0, 0.0, 5.0, 1.0, omega, energy), gamma / (gamma + 1.0), velocity)


@pytest.mark.parametrize("omega", [0.25, 0.4, 2.0])
def test_jwl_without_its_exponentials_escapes_as_an_ideal_gas(omega):
    """Riemann invariant u + 2 c / (gamma - 1), u = D / (gamma + 1) and c = gamma D / (gamma + 1), gamma = 1 + omega."""
    products, gamma = polytropic(omega), 1.0 + omega
    expected = products.front_speed / (gamma + 1.0) * (1.0 + 2.0 * gamma / (gamma - 1.0))
    assert products.escape_speed == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", ["tnt", "comp_b"])
def test_jwl_products_escape_with_the_speed_of_their_isentrope(name):
    """The isentrope stepped from the Chapman-Jouguet state by dE = -P dV, and the integral of c along it."""
    explosive = load_explosive(name)
    products = make_products(explosive, "jwl")
    front, start = products.front_speed, products.cj_volume
    pressure = products.density * front**2 * (1.0 - start)

    def flow(log_volume, state):
        v, energy = np.exp(log_volume), state[0]
        p = float(products.pressure(v, energy))
        step = 1e-6 * v
        ahead, behind = (float(products.pressure(v + s, energy - p * s)) for s in (step, -step))
        return [-p * v, np.sqrt(max((behind - ahead) / (2.0 * step), 0.0) / products.density) * v]

    energy = products.constants.E0 + 0.5 * pressure * (1.0 - start)
    last = 25.0
    path = solve_ivp(flow, (np.log(start), last), [energy, 0.0], rtol=1e-8, atol=[1e-3, 1e-6], method="LSODA")
    omega = products.constants.omega
    left = path.y[0, -1]
    # Far out it is an ideal gas: c (2 / omega) is still to come, c^2 = (1 + omega) omega E / rho0.
    rest = 2.0 / omega * np.sqrt((1.0 + omega) * omega * left / products.density)
    expected = (1.0 - start) * front + path.y[1, -1] + rest
    assert products.escape_speed == pytest.approx(expected, rel=1e-3)
    assert 1.40 < products.escape_speed / explosive.detonation_velocity < 1.70


def test_the_bound_of_several_rounds_is_that_of_the_fastest_products():
    slow, fast = make_products(TNT, "landau_cj"), make_products(COMP_B, "landau_cj")
    assert escape_speed([slow, fast]) == escape_speed([fast, slow]) == fast.escape_speed > slow.escape_speed


def test_metal_above_the_bound_is_weighed_and_warned_of(caplog):
    """Two boxes, one at half of the bound, one a tenth above it: all of its mass, twice for two images."""
    caplog.set_level(logging.WARNING)
    bound = make_products(TNT, "landau_cj").escape_speed
    one, other = (moved(box((2, 2, 2), (2 * CELL,) * 3), (shift, 0.0, 0.0), k) for k, shift in enumerate((0.0, 0.1)))
    slow = bodies([one, other], [(0.5 * bound, 0.0, 0.0), (0.0, -bound, 0.0)])
    found = speeds_and_bound(slow.fields, 1)
    assert found == {
        "fastest_casing_node": bound,
        "escape_speed_of_products": bound,
        "casing_mass_above_escape_speed": 0,
    }
    assert not caplog.records
    fast = bodies([one, other], [(0.5 * bound, 0.0, 0.0), (0.0, -1.1 * bound, 0.0)])
    found = speeds_and_bound(fast.fields, 2)
    assert found["fastest_casing_node"] == pytest.approx(1.1 * bound)
    assert found["casing_mass_above_escape_speed"] == pytest.approx(2 * 8 * CELL**3 * ELASTIC.density)
    (record,) = caplog.records
    assert record.code == "faster_than_products"
    assert "faster than products expand into a vacuum: up to 12" in record.message
