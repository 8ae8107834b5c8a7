"""Products by Jones, Wilkins and Lee with an internal energy of their own (Lee, Hornig and Kury 1968)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.errors import InputError
from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.cells.charge_pressure import mix, unreacted
from burst_fenicsx.kernels.lanes import LANES, block_kernel, widest_vectors
from fragfield_base.elementary import exp, power

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from burst_fenicsx.problem import Explosive, JonesWilkinsLee


NAMES = ("jwl",)
PARAMETERS = ("A", "B", "R1", "R2", "omega")

_ESCAPE_POINTS = 200  # of Gauss and Legendre


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
    def start_energy(self) -> float:
        """Internal energy of their own to start with (J/m3)."""
        return self.constants.E0

    @property
    def dilute_exponent(self) -> float:
        """Isentropic exponent of products that have expanded far."""
        return 1.0 + self.constants.omega

    @property
    def parameters(self) -> tuple[float, ...]:
        """Columns of the table of explosives."""
        c = self.constants
        return c.A, c.B, c.R1, c.R2, c.omega

    @property
    def escape_speed(self) -> float:
        """Speed (m/s) at which products expand into a vacuum from behind a plane front, as `LandauProducts` has it.

        On the isentrope P = A exp(-R1 v) + B exp(-R2 v) + C v^-(1 + omega) of the energy that they have in the
        Chapman-Jouguet state, E0 + P (1 - v) / 2 with the pressure on the Rayleigh line, by Gauss and Legendre over
        x = (v/v_CJ)^(-omega/2), from 0 to 1, in which the integrand goes to a constant at infinite volume.
        """
        c, start = self.constants, self.cj_volume
        energy = c.E0 + 0.5 * self.density * self.front_speed**2 * (1.0 - start) ** 2
        cold = c.A / c.R1 * math.exp(-c.R1 * start) + c.B / c.R2 * math.exp(-c.R2 * start)
        tail = c.omega * (energy - cold) * start**c.omega
        nodes, weights = np.polynomial.legendre.leggauss(_ESCAPE_POINTS)
        x = 0.5 * (nodes + 1.0)
        v = start * power(x, -2.0 / c.omega)
        slope = c.A * c.R1 * exp(-c.R1 * v) + c.B * c.R2 * exp(-c.R2 * v)
        slope += (1.0 + c.omega) * tail * power(v, -(2.0 + c.omega))
        gained = 0.5 * weights @ (np.sqrt(slope / self.density) * (2.0 / c.omega) * v / x)
        return float((1.0 - start) * self.front_speed + gained)

    def pressure(self, volume: ArrayLike, energy: ArrayLike) -> np.ndarray:
        """Pressure (Pa) at the relative volume and the internal energy per initial volume (J/m3)."""
        c = self.constants
        v, e = np.asarray(volume, dtype=float), np.asarray(energy, dtype=float)
        first = c.A * (1.0 - c.omega / (c.R1 * v)) * exp(-c.R1 * v)
        second = c.B * (1.0 - c.omega / (c.R2 * v)) * exp(-c.R2 * v)
        return first + second + c.omega * e / v

    def remaining_work(self, volume: ArrayLike, energy: ArrayLike) -> np.ndarray:
        """Internal energy that is left: all of it is given off on the way to infinity (J/m3)."""
        del volume
        return np.asarray(energy, dtype=float)


def make(explosive: Explosive, model: str) -> JwlProducts:
    """Products of an explosive.

    Raises
    ------
    InputError
        If its constants are missing.
    """
    del model
    if explosive.jwl is None:
        raise InputError(f"explosive '{explosive.name}' has no JWL constants; give them, or choose landau_cj")
    products = JwlProducts(explosive.density, explosive.jwl, 0.0, explosive.detonation_velocity)
    inertia = explosive.density * explosive.detonation_velocity**2

    def mismatch(v: float) -> float:
        # On the Hugoniot E = E0 + P (1 - v)/2; on the Rayleigh line P = rho D^2 (1 - v).
        p = inertia * (1.0 - v)
        return float(products.pressure(v, products.energy + 0.5 * p * (1.0 - v))) - p

    # The two meet tangentially at the Chapman-Jouguet point, so the difference is smallest there.
    grid = np.linspace(0.5, 0.95, 2001)
    values = np.array([mismatch(v) for v in grid])
    pressure = inertia * (1.0 - float(grid[np.argmin(values)]))
    return replace(products, cj_volume=1.0 - pressure / inertia)


@block_kernel
def press(parameters: np.ndarray, scratch: np.ndarray) -> None:
    """Pressure of Jones, Wilkins and Lee with its own internal energy, mixed with that of the unreacted part.

    dE = -P dV per initial volume, P the mean over the step of what the whole cell exerts (products and unreacted part);
    P is linear in E, so the implicit step is solved directly.
    """
    widest_vectors()
    a, b, r1 = parameters[at.CHARGE_OWN], parameters[at.CHARGE_OWN + 1], parameters[at.CHARGE_OWN + 2]
    r2, omega = parameters[at.CHARGE_OWN + 3], parameters[at.CHARGE_OWN + 4]
    for lane in range(LANES):
        per_volume = parameters[0] / scratch[at.MASS * LANES + lane]
        v = scratch[at.VOLUME * LANES + lane] * per_volume
        xi = scratch[at.BURN * LANES + lane]
        change = v - scratch[at.OLD_VOLUME * LANES + lane] * per_volume
        e1, e2 = a * np.exp(-r1 * v), b * np.exp(-r2 * v)
        cold = (1.0 - omega / (r1 * v)) * e1 + (1.0 - omega / (r2 * v)) * e2
        others = scratch[at.OLD_GAS_PRESSURE * LANES + lane] + (1.0 - xi) * unreacted(v, parameters)[0]
        rest = scratch[at.GAS_ENERGY * LANES + lane] - 0.5 * others * change
        p = max((cold + omega * rest / v) / (1.0 + 0.5 * xi * omega * change / v), 0.0)
        e = rest - 0.5 * xi * p * change
        scratch[at.GAS_ENERGY * LANES + lane] = e
        slope = e1 * (r1 * v - omega - omega / (r1 * v)) + e2 * (r2 * v - omega - omega / (r2 * v))
        # On the isentrope.
        mix(v, p, max(slope + omega * (e / v + p), p), parameters, scratch, lane)
