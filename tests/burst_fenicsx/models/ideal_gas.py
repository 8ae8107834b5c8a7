"""Products as an ideal gas with an energy of its own: P = (gamma - 1) E / v, gamma 3, from all of the heat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.cells.charge_pressure import mix, unreacted
from burst_fenicsx.kernels.lanes import LANES, block_kernel

NAMES = ("ideal_gas",)
PARAMETERS = ("gamma_less_one",)

GAMMA = 3.0


@dataclass(frozen=True)
class IdealGas:
    """Products of the model."""

    density: float
    energy: float

    cj_volume = GAMMA / (GAMMA + 1.0)
    parameters = (GAMMA - 1.0,)

    @property
    def start_energy(self):
        """All of it (J/m3)."""
        return self.energy

    @property
    def front_speed(self):
        """Of Chapman and Jouguet (m/s)."""
        return float(np.sqrt(2.0 * (GAMMA**2 - 1.0) * self.energy / self.density))

    @property
    def escape_speed(self):
        """A bound (m/s): D/4 and the sound of the front over (gamma - 1)/2."""
        return self.front_speed

    def remaining_work(self, volume, energy):
        """Their energy (J/m3)."""
        return np.asarray(energy, dtype=float)


def make(explosive, model):
    return IdealGas(explosive.density, explosive.density * explosive.heat_of_detonation)


@block_kernel
def press(parameters, scratch):
    w = parameters[at.CHARGE_OWN]
    for lane in range(LANES):
        per_volume = parameters[0] / scratch[at.MASS * LANES + lane]
        v = scratch[at.VOLUME * LANES + lane] * per_volume
        change = v - scratch[at.OLD_VOLUME * LANES + lane] * per_volume
        xi = scratch[at.BURN * LANES + lane]
        others = scratch[at.OLD_GAS_PRESSURE * LANES + lane] + (1.0 - xi) * unreacted(v, parameters)[0]
        rest = scratch[at.GAS_ENERGY * LANES + lane] - 0.5 * others * change
        # dE = -P dV with the mean of P over the step, which is linear in E.
        p = w * rest / v / (1.0 + 0.5 * xi * w * change / v)
        scratch[at.GAS_ENERGY * LANES + lane] = rest - 0.5 * xi * p * change
        mix(v, p, (1.0 + w) * p, parameters, scratch, lane)
