"""Energies of the product models by quadrature of their pressures, without the closed forms that the burst uses."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import quad

from burst_fenicsx.materials.products.jwl import JwlProducts
from burst_fenicsx.materials.products.landau import LandauProducts

if TYPE_CHECKING:
    from collections.abc import Callable

    from burst_fenicsx.problem import Explosive, ProductModel

__all__ = ["Law", "energy_given", "gurney_velocity", "isentrope", "progressive_share"]

Law = LandauProducts | JwlProducts
"""Models whose isentropes are known here."""


def isentrope(products: Law, explosive: Explosive) -> Callable[[float], float]:
    """Pressure (Pa) over V/V0 on the isentrope through the Chapman-Jouguet state.

    For JWL the energy on it is A/R1 exp(-R1 v) + B/R2 exp(-R2 v) + C/omega v^-omega, with C from the energy at that
    state, E0 + P (1 - v)/2 (Lee, Hornig and Kury 1968); the pressure is then the model's own of volume and energy.
    """
    if isinstance(products, LandauProducts):
        return lambda v: float(products.pressure(v))
    energy = _jwl_energy(products, explosive)
    return lambda v: float(products.pressure(v, energy(v)))


def _jwl_energy(products: JwlProducts, explosive: Explosive) -> Callable[[float], float]:
    c, start = products.constants, products.cj_volume

    def cold(v: float) -> float:
        return float(c.A / c.R1 * np.exp(-c.R1 * v) + c.B / c.R2 * np.exp(-c.R2 * v))

    loose = c.E0 + _front(explosive, start) - cold(start)
    return lambda v: cold(v) + loose * (v / start) ** -c.omega


def _front(explosive: Explosive, volume: float) -> float:
    """What the front puts in by compressing to V/V0 = v: P (1 - v)/2 with P = rho D^2 (1 - v) (J/m3)."""
    return 0.5 * explosive.density * explosive.detonation_velocity**2 * (1.0 - volume) ** 2


def energy_given(products: Law, explosive: Explosive, model: ProductModel) -> float:
    """Energy that a charge gives to what surrounds it on the way to infinity, per initial volume (J/m3).

    `landau` starts from rest at V0, as an instantaneous explosion does; the others from the Chapman-Jouguet
    state, less what the front put in.
    """
    start = 1.0 if model == "landau" else products.cj_volume
    pressure = isentrope(products, explosive)
    front = 0.0 if model == "landau" else _front(explosive, start)
    return _work(pressure, start, products) - front


def _work(pressure: Callable[[float], float], start: float, products: Law) -> float:
    """Work of the pressure from V/V0 = start to infinity (J/m3)."""
    knee = products.knee_volume if isinstance(products, LandauProducts) else 7.0
    dense, _ = quad(pressure, start, knee, epsabs=0.0, epsrel=1e-12, limit=200)
    # A power of the volume: v = u^(-1/k) makes P dv a constant times du for P ~ v^-(1 + k).
    power = 1.0 / 3.0 if isinstance(products, LandauProducts) else products.constants.omega
    tail, _ = quad(
        lambda u: pressure(u ** (-1.0 / power)) * u ** (-1.0 / power - 1.0) / power,
        0.0, knee**-power, epsabs=0.0, epsrel=1e-12, limit=200,
    )  # fmt: skip
    return dense + tail


def gurney_velocity(products: Law, explosive: Explosive, volume: float) -> float:
    """sqrt(2 E(v)) (m/s), E the energy given until V/V0 = v by a charge that is initiated progressively, per mass."""
    if isinstance(products, LandauProducts):
        return products.gurney_velocity(volume)
    left = _jwl_energy(products, explosive)(volume)
    return float(np.sqrt(2.0 * (products.energy - left) / explosive.density))


def progressive_share(explosive: Explosive, model: ProductModel) -> float:
    """Energy that a progressively initiated charge gives, over its heat, in theory.

    1 for an isentrope through the Chapman-Jouguet state. That of `landau` lies higher: burnt by compression, its
    front runs where its own Rayleigh line touches, at sqrt(32/27) D and v = 3/4, P = 8/27 rho D^2; the isentrope's
    work from there less the front's own is rho Q + 5/432 rho D^2.
    """
    if model != "landau":
        return 1.0
    return 1.0 + 5.0 / 432.0 * explosive.detonation_velocity**2 / explosive.heat_of_detonation
