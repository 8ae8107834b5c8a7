"""Detonation products: closure of the isentropes as exact integrals, the reference numbers, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from burst_fenicsx.errors import InputError
from burst_fenicsx.materials.products import make_products
from burst_fenicsx.materials.products.jwl import JwlProducts
from burst_fenicsx.materials.products.landau import LandauProducts
from burst_fenicsx.problem import Part
from tests.burst_fenicsx.boxes import COMP_B, TNT


def integrated(products: LandauProducts, start: float) -> float:
    """Work from the relative volume `start` to infinity by quadrature, of the pressure alone (J/m3)."""
    knee = products.knee_volume
    dense, _ = quad(products.pressure, start, knee, epsabs=0.0, epsrel=1e-13)
    # v = 1/u^3 makes the tail, of power -4/3, smooth up to infinity.
    tail, _ = quad(
        lambda u: float(products.pressure(u**-3)) * 3.0 * u**-4, 0.0, knee ** (-1.0 / 3.0), epsabs=0.0, epsrel=1e-13
    )
    return dense + tail


@pytest.mark.parametrize("explosive", [TNT, COMP_B])
@pytest.mark.parametrize("model", ["landau", "landau_cj"])
def test_work_to_infinity_is_the_heat_of_detonation(explosive, model):
    """The paper's isentrope gives rho Q from V0; that through the Chapman-Jouguet state rho Q less the front's own."""
    products = make_products(explosive, model)
    inertia = explosive.density * explosive.detonation_velocity**2
    front = 0.0 if model == "landau" else (21.0 / 512.0 - 1.0 / 32.0) * inertia
    whole = explosive.density * explosive.heat_of_detonation
    assert integrated(products, 1.0) + front == pytest.approx(whole, rel=1e-12)
    assert float(products.remaining_work(1.0)) + front == pytest.approx(whole, rel=1e-12)
    assert integrated(products, 2.0) == pytest.approx(float(products.remaining_work(2.0)), rel=1e-11)
    # Continuous at the knee, in value; the isentrope passes through the state it is named for.
    knee = products.knee_volume
    assert float(products.pressure(knee * (1 - 1e-12))) == pytest.approx(products.knee_pressure, rel=1e-10)
    if model == "landau_cj":
        assert float(products.pressure(0.75)) == pytest.approx(inertia / 4.0, rel=1e-12)
    else:
        assert float(products.pressure(1.0)) == pytest.approx(inertia / 8.0, rel=1e-12)


@pytest.mark.parametrize(
    ("explosive", "model", "knee_pressure", "knee_volume", "gurney"),
    [
        (TNT, "landau", 312e6, 3.16, (2125.0, 2313.0, 2502.0)),
        (TNT, "landau_cj", 339e6, 2.90, (2180.0, 2336.0, 2518.0)),
        (COMP_B, "landau", None, None, (2446.0, 2663.0, 2815.0)),
        (COMP_B, "landau_cj", 174e6, 4.04, (2509.0, 2689.0, 2825.0)),
    ],
)
def test_reference_numbers(explosive, model, knee_pressure, knee_volume, gurney):
    """Knee and sqrt(2 E) at V/V0 = 2, 3, 7, to the digits given."""
    products = make_products(explosive, model)
    for volume, speed in zip((2.0, 3.0, 7.0), gurney, strict=True):
        assert products.gurney_velocity(volume) == pytest.approx(speed, abs=0.6)
    if knee_pressure is not None:
        assert products.knee_pressure == pytest.approx(knee_pressure, abs=0.6e6)
        assert products.knee_volume == pytest.approx(knee_volume, abs=6e-3)
    if (explosive, model) == (TNT, "landau"):
        assert products.initial_pressure == pytest.approx(9.81e9, abs=6e6)


@pytest.mark.parametrize(("explosive", "minimum"), [(TNT, "3.01"), (COMP_B, "3.99")])
@pytest.mark.parametrize("model", ["landau", "landau_cj"])
def test_too_little_heat_is_refused(explosive, minimum, model):
    speed = explosive.detonation_velocity
    poor = replace(explosive, heat_of_detonation=speed**2 / 16.0 * (1.0 - 1e-9))
    with pytest.raises(InputError, match=rf"needs more than D\^2/16 = {minimum}\d* MJ/kg at D = {speed:g} m/s"):
        make_products(poor, model)
    assert make_products(poor, "jwl").energy == explosive.jwl.E0
    enough = make_products(replace(explosive, heat_of_detonation=speed**2 / 16.0 * 1.001), model)
    assert 0.0 < enough.knee_pressure < enough.initial_pressure


def test_jwl_without_constants_is_refused():
    with pytest.raises(InputError, match="explosive 'tnt' has no JWL constants; give them, or choose landau_cj"):
        make_products(replace(TNT, jwl=None), "jwl")


def test_jwl_gives_its_energy_on_the_way_to_infinity():
    """DE = -P dv from the Chapman-Jouguet state on: the energy tends to zero as v^-omega, so all of it is work."""
    products = make_products(TNT, "jwl")
    assert isinstance(products, JwlProducts)
    c = products.constants
    v = np.geomspace(products.cj_volume, 1e4, 400_001)
    p_cj = TNT.density * TNT.detonation_velocity**2 * (1.0 - products.cj_volume)
    energy = c.E0 + 0.5 * p_cj * (1.0 - products.cj_volume)
    # In closed form: E = A/R1 exp(-R1 v) + B/R2 exp(-R2 v) + C v^-omega / omega.
    cold = lambda x: c.A / c.R1 * np.exp(-c.R1 * x) + c.B / c.R2 * np.exp(-c.R2 * x)  # noqa: E731
    on_isentrope = cold(v) + (energy - cold(v[0])) * (v / v[0]) ** -c.omega
    pressure = products.pressure(v, on_isentrope)
    work = float((0.5 * (pressure[1:] + pressure[:-1]) * np.diff(v)).sum())
    assert work == pytest.approx(energy - on_isentrope[-1], rel=1e-6)
    assert float(products.remaining_work(3.0, energy)) == energy


@pytest.mark.parametrize(("explosive", "pressure"), [(TNT, 21.0e9), (COMP_B, 29.5e9)])
def test_jwl_meets_the_rayleigh_line_at_the_published_pressure(explosive, pressure):
    """Chapman-Jouguet pressures of the sets (Dobratz): 21 GPa for TNT, 29.5 GPa for Comp B."""
    products = make_products(explosive, "jwl")
    found = explosive.density * explosive.detonation_velocity**2 * (1.0 - products.cj_volume)
    assert found == pytest.approx(pressure, rel=0.03)


@pytest.mark.dolfinx
@pytest.mark.parametrize("model", ["jwl", "landau", "landau_cj"])
@pytest.mark.parametrize("burnt", [0.0, 0.25, 1.0])
def test_what_a_charge_can_still_give_is_its_heat_until_it_burns(model, burnt):
    """Products hold all they have at their first volume; work given, less their own heat, closes the balance."""
    pytest.importorskip("burst_fenicsx.compat")
    from burst_fenicsx.kernels.cells.erosion import BEFORE
    from tests.burst_fenicsx.boxes import BARE, box, burst

    solver = burst(box((1, 1, 1), (4e-3,) * 3, Part.CHARGE), replace(BARE, products=model))
    fields, volume = solver.fields, 4e-3**3
    fields.charge.burn_fraction[:] = burnt
    products = fields.products[0]
    fields.charge.energy[:] = 0.7 * products.energy
    left = products.remaining_work(1.0, 0.7 * products.energy)
    if model == "jwl":
        assert left == pytest.approx(0.7 * products.energy, rel=1e-12)
    else:
        assert left == pytest.approx(integrated(products, 1.0), rel=1e-12)
        assert products.remaining_work(1e6) < 0.05 * left
    solver.ledger.released[:] = [[0.3 * volume * products.energy, 0.1 * volume * products.energy]]
    per_volume = burnt * left + (1.0 - burnt) * products.energy + 0.2 * products.energy
    balance = solver.ledger.products_balances(fields)
    assert balance == pytest.approx([per_volume / products.energy], rel=1e-9)
    fields.solid.eroded[:] = BEFORE  # what an eroded cell could still give is lost
    assert solver.ledger.products_balances(fields) == pytest.approx([0.2], rel=1e-9)
    solver.ledger.chemical_energies[:] = 0.0
    assert solver.ledger.products_balances(fields).tolist() == [0.0]
