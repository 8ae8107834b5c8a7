"""Products on the isentrope of two branches by Landau and Stanyukovich: P v^3, then P v^(4/3), constant.

See Wang et al., Eq. 4; Baum, Stanyukovich and Shekhter, Physics of an Explosion (1959).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.errors import InputError
from burst_fenicsx.kernels.cells.charge_pressure import mix
from burst_fenicsx.kernels.cells.layout import CHARGE_OWN, MASS, VOLUME
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function, widest_vectors

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from burst_fenicsx.problem import Explosive


NAMES = ("landau", "landau_cj")
PARAMETERS = ("P0", "Pk", "Vk")

GAMMA_DENSE = 3.0
GAMMA_DILUTE = 4.0 / 3.0


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
    def start_energy(self) -> float:
        """Internal energy of their own to start with: they keep account of none."""
        return 0.0

    @property
    def parameters(self) -> tuple[float, ...]:
        """Columns of the table of explosives."""
        return self.initial_pressure, self.knee_pressure, self.knee_volume

    @property
    def dilute_exponent(self) -> float:
        """Isentropic exponent of products that have expanded far."""
        return GAMMA_DILUTE

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

    def remaining_work(self, volume: ArrayLike, energy: ArrayLike = 0.0) -> np.ndarray:
        """Work from the relative volume to infinity, per initial volume (J/m3)."""
        del energy
        v = np.asarray(volume, dtype=float)
        tail = 3.0 * self.knee_pressure * self.knee_volume
        dense = 0.5 * self.initial_pressure * (v**-2.0 - self.knee_volume**-2.0) + tail
        return np.where(v < self.knee_volume, dense, tail * (self.knee_volume / v) ** (1.0 / 3.0))

    def gurney_velocity(self, volume: float) -> float:
        """sqrt(2 E(v)) (m/s), E the work of a progressively initiated charge up to v, per mass of the charge."""
        return float(np.sqrt(2.0 * (self.energy - float(self.remaining_work(volume))) / self.density))


def make(explosive: Explosive, model: str) -> LandauProducts:
    """Products of an explosive.

    Parameters
    ----------
    explosive : the charge.
    model : "landau" starts from the pressure of an instantaneous explosion, rho D^2/8; "landau_cj" takes the isentrope
        through the Chapman-Jouguet state, 27/256 rho D^2 at v = 1, and counts the front's own compression.

    Raises
    ------
    InputError
        If the heat of detonation is too small for the isentrope (Q <= D^2/16).
    """
    rho, speed, heat = explosive.density, explosive.detonation_velocity, explosive.known("heat_of_detonation")
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


@lane_function
def inverse_cube_root(x: float) -> np.float64:
    """x^(-1/3) by Newton's iteration from a guess made on the exponent; vectorises where a power does not."""
    bits = np.float64(x).view(np.int64)
    third = (bits >> 2) + (bits >> 4) + (bits >> 6) + (bits >> 8) + (bits >> 10) + (bits >> 12) + (bits >> 14)
    y = np.int64(6142909891733356544 - third).view(np.float64)
    for _ in range(5):
        y *= (4.0 - x * y * y * y) * (1.0 / 3.0)
    return y


@block_kernel
def press(parameters: np.ndarray, scratch: np.ndarray) -> None:
    """Pressure of the products on the isentrope of Landau and Stanyukovich, mixed with that of the unreacted part."""
    widest_vectors()
    p0, pk, knee = parameters[CHARGE_OWN], parameters[CHARGE_OWN + 1], parameters[CHARGE_OWN + 2]
    inverse_knee = 1.0 / knee
    for lane in range(LANES):
        v = scratch[VOLUME * LANES + lane] * parameters[0] / scratch[MASS * LANES + lane]
        root = inverse_cube_root(v * inverse_knee)
        squared = root * root
        inverse = 1.0 / v
        dense = v < knee
        p = p0 * (inverse * inverse * inverse) if dense else pk * (squared * squared)
        mix(v, p, 3.0 * p if dense else 4.0 / 3.0 * p, parameters, scratch, lane)
