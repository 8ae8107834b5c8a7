"""Detonation products: isentropes of Landau and Stanyukovich, and Jones-Wilkins-Lee.

Volumes are relative to the unexploded charge, v = V/V0. See Wang et al., Eq. 4; Baum, Stanyukovich and
Shekhter, Physics of an Explosion (1959), for the two-branch isentrope; Lee, Hornig and Kury (1968) for JWL.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from burst_fenicsx.problem import Explosive, JonesWilkinsLee, ProductModel

__all__ = ["JwlProducts", "LandauProducts", "Products", "make_products"]

GAMMA_DENSE = 3.0
GAMMA_DILUTE = 4.0 / 3.0
_ESCAPE_POINTS = 200  # of Gauss and Legendre


@dataclass(frozen=True)
class LandauProducts:
    """P v^3 = P0 while P >= Pk, P v^(4/3) = Pk vk^(4/3) below.

    Attributes
    ----------
    density : initial (kg/m3).
    initial_pressure : P0, on the isentrope at v = 1 (Pa).
    knee_pressure, knee_volume : Pk (Pa) and vk.
    energy : rho Q, what a progressively initiated charge gives in all, per initial volume (J/m3).
    cj_volume : v at the Chapman-Jouguet state.
    """

    density: float
    initial_pressure: float
    knee_pressure: float
    knee_volume: float
    energy: float
    cj_volume: float = GAMMA_DENSE / (GAMMA_DENSE + 1.0)

    @property
    def front_speed(self) -> float:
        """Speed (m/s) of a front that compression burns by itself: P0 = 27/256 rho D^2.

        For "landau" it is the detonation velocity times the square root of 32/27.
        """
        return float(np.sqrt(256.0 / 27.0 * self.initial_pressure / self.density))

    @property
    def escape_speed(self) -> float:
        """Speed (m/s) at which products expand into a vacuum from behind a plane front.

        From the Chapman-Jouguet state, which moves with D/4, u plus the integral of the sound speed over the logarithm
        of the density is constant (Courant and Friedrichs 1948, section 40): on the isentrope in V/V0, where
        c dv/v = sqrt(-dP/dv / rho0) dv, in closed form on both branches. D is `front_speed`. With gamma = 3 throughout
        it would be D; the second branch keeps its pressure longer.
        """
        particle = (1.0 - self.cj_volume) * self.front_speed
        dense = np.sqrt(GAMMA_DENSE * self.initial_pressure / self.density)
        dense *= 1.0 / self.cj_volume - 1.0 / self.knee_volume
        knee = np.sqrt(GAMMA_DILUTE * self.knee_pressure * self.knee_volume / self.density)
        dilute = 2.0 / (GAMMA_DILUTE - 1.0) * knee
        return float(particle + dense + dilute)

    def pressure(self, volume: ArrayLike) -> np.ndarray:
        """Pressure (Pa) at the relative volume."""
        v = np.asarray(volume, dtype=float)
        knee = self.knee_pressure * self.knee_volume**GAMMA_DILUTE
        return np.where(v < self.knee_volume, self.initial_pressure * v**-GAMMA_DENSE, knee * v**-GAMMA_DILUTE)

    def remaining_work(self, volume: ArrayLike) -> np.ndarray:
        """Work from the relative volume to infinity, per initial volume (J/m3)."""
        v = np.asarray(volume, dtype=float)
        tail = 3.0 * self.knee_pressure * self.knee_volume
        dense = 0.5 * self.initial_pressure * (v**-2.0 - self.knee_volume**-2.0) + tail
        return np.where(v < self.knee_volume, dense, tail * (self.knee_volume / v) ** (1.0 / 3.0))

    def gurney_velocity(self, volume: float) -> float:
        """sqrt(2 E(v)) (m/s), E the work of a progressively initiated charge up to v, per mass of the charge."""
        return float(np.sqrt(2.0 * (self.energy - float(self.remaining_work(volume))) / self.density))


@dataclass(frozen=True)
class JwlProducts:
    """Jones-Wilkins-Lee products with their own internal energy."""

    density: float
    constants: JonesWilkinsLee
    cj_volume: float
    front_speed: float  # of a front that compression burns by itself (m/s)

    @property
    def energy(self) -> float:
        """Energy of the charge per initial volume (J/m3)."""
        return self.constants.E0

    @property
    def escape_speed(self) -> float:
        """Speed (m/s) at which products expand into a vacuum from behind a plane front, as `LandauProducts` has it.

        On the isentrope P = A exp(-R1 v) + B exp(-R2 v) + C v^-(1 + omega) of the energy that they have in the
        Chapman-Jouguet state, E0 + P (1 - v) / 2 with the pressure on the Rayleigh line, by Gauss and Legendre over
        x = (v/v_CJ)^(-omega/2), from 0 to 1, in which the integrand goes to a constant at infinite volume.
        """
        c, start = self.constants, self.cj_volume
        energy = c.E0 + 0.5 * self.density * self.front_speed**2 * (1.0 - start) ** 2
        cold = c.A / c.R1 * np.exp(-c.R1 * start) + c.B / c.R2 * np.exp(-c.R2 * start)
        tail = c.omega * (energy - cold) * start**c.omega
        nodes, weights = np.polynomial.legendre.leggauss(_ESCAPE_POINTS)
        x = 0.5 * (nodes + 1.0)
        v = start * x ** (-2.0 / c.omega)
        slope = c.A * c.R1 * np.exp(-c.R1 * v) + c.B * c.R2 * np.exp(-c.R2 * v)
        slope += (1.0 + c.omega) * tail * v ** -(2.0 + c.omega)
        gained = 0.5 * weights @ (np.sqrt(slope / self.density) * (2.0 / c.omega) * v / x)
        return float((1.0 - start) * self.front_speed + gained)

    def pressure(self, volume: ArrayLike, energy: ArrayLike) -> np.ndarray:
        """Pressure (Pa) at the relative volume and the internal energy per initial volume (J/m3)."""
        c = self.constants
        v, e = np.asarray(volume, dtype=float), np.asarray(energy, dtype=float)
        first = c.A * (1.0 - c.omega / (c.R1 * v)) * np.exp(-c.R1 * v)
        second = c.B * (1.0 - c.omega / (c.R2 * v)) * np.exp(-c.R2 * v)
        return first + second + c.omega * e / v

    def remaining_work(self, volume: ArrayLike, energy: ArrayLike) -> np.ndarray:
        """Internal energy that is left: all of it is given off on the way to infinity (J/m3)."""
        del volume
        return np.asarray(energy, dtype=float)


Products = LandauProducts | JwlProducts


def make_products(explosive: Explosive, model: ProductModel) -> Products:
    """Products of an explosive.

    Parameters
    ----------
    explosive : the charge.
    model : "landau" starts from the pressure of an instantaneous explosion, rho D^2/8; "landau_cj" takes the isentrope
        through the Chapman-Jouguet state, 27/256 rho D^2 at v = 1, and counts the front's own compression;
        "jwl" needs the explosive's JWL constants.

    Raises
    ------
    InputError
        If the heat of detonation is too small for the isentrope (Q <= D^2/16) or constants are missing.
    """
    if model == "jwl":
        if explosive.jwl is None:
            raise InputError(f"explosive '{explosive.name}' has no JWL constants; give them, or choose landau_cj")
        c = explosive.jwl
        cj = 1.0 - _cj_pressure(explosive) / (explosive.density * explosive.detonation_velocity**2)
        return JwlProducts(explosive.density, c, cj, explosive.detonation_velocity)
    rho, speed, heat = explosive.density, explosive.detonation_velocity, explosive.heat_of_detonation
    inertia = rho * speed**2
    if model == "landau":
        p0, work = inertia / 8.0, rho * heat
    else:
        p0, work = 27.0 / 256.0 * inertia, rho * heat - (21.0 / 512.0 - 1.0 / 32.0) * inertia
    # The isentrope's own work from v = 1 to infinity, P0/2 (1 - x) + 3 P0 x with x = (Pk/P0)^(2/3) = vk^-2, is `work`.
    x = (2.0 * work / p0 - 1.0) / 5.0
    # For both models x > 0 is Q > D^2/16.
    minimum = speed**2 / 16.0
    if not x > 0.0:
        raise InputError(
            f"explosive '{explosive.name}': heat_of_detonation is {heat / 1e6:.4g} MJ/kg, but the Landau isentrope "
            f"needs more than D^2/16 = {minimum / 1e6:.4g} MJ/kg at D = {speed:.5g} m/s; raise it, lower D, or choose "
            "the products jwl"
        )
    return LandauProducts(
        density=rho, initial_pressure=p0, knee_pressure=p0 * x**1.5, knee_volume=x**-0.5, energy=rho * heat
    )


def _cj_pressure(explosive: Explosive) -> float:
    """Chapman-Jouguet pressure on the JWL isentrope: where it touches the Rayleigh line, searched on a grid (Pa)."""
    assert explosive.jwl is not None
    c = explosive.jwl
    inertia = explosive.density * explosive.detonation_velocity**2
    low, high = 0.5, 0.95
    products = JwlProducts(explosive.density, c, 0.0, explosive.detonation_velocity)

    def mismatch(v: float) -> float:
        # On the Hugoniot E = E0 + P (1 - v)/2; on the Rayleigh line P = rho D^2 (1 - v).
        p = inertia * (1.0 - v)
        return float(products.pressure(v, c.E0 + 0.5 * p * (1.0 - v))) - p

    # The two meet tangentially at the Chapman-Jouguet point, so the difference is smallest there.
    grid = np.linspace(low, high, 2001)
    values = np.array([mismatch(v) for v in grid])
    return inertia * (1.0 - float(grid[np.argmin(values)]))
