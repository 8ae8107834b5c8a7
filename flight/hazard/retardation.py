"""Straight flight against drag alone, and free fall: DDESB Technical Paper 12 (Zaker 1975), p. 7-10 and 14."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flight.arguments import require_numbers
from flight.scene.air import STANDARD_GRAVITY

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from flight.drag import Drag

    Array = NDArray[np.float64]


_FINEST = 2e-3  # in ln v, of the integral over the drag table


@dataclass(frozen=True, eq=False)
class Retardation:
    """Straight flight against drag alone, and free fall.

    Along a path dv/ds = -C_D(v/a) rho v (m/k)^(2/3) / (2 m), so that the distance in which a fragment slows down from
    one speed to another is m^(1/3) times a function of the speeds: for a constant C_D it is L1 m^(1/3) ln(v0 / v).

    Attributes
    ----------
    drag : Drag
        Coefficient over Mach number.
    density, sound_speed : float
        Of the air (kg/m3, m/s).
    shape_factor : float
        k of the presented area (m/k)^(2/3) (kg/m3).
    gravity : float
        m/s2.

    Raises
    ------
    InputError
        A value that is not a number above zero; density and gravity may be zero.
    """

    drag: Drag
    density: float
    sound_speed: float
    shape_factor: float
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        """Refuse values that mean nothing."""
        require_numbers("retardation", self, {"density": "kg/m3", "gravity": "m/s2"}, low=0.0)
        require_numbers("retardation", self, {"sound_speed": "m/s", "shape_factor": "kg/m3"}, above=0.0)

    @property
    def scale(self) -> float:
        """2 k^(2/3) / rho (m/kg^(1/3)): L1 times C_D; infinite in a vacuum."""
        return 2.0 * self.shape_factor ** (2.0 / 3.0) / self.density if self.density > 0.0 else math.inf

    def distance(self, mass: ArrayLike, start: ArrayLike, end: ArrayLike) -> Array:
        """Distance (m) in which fragments (kg) slow down from `start` to `end` (m/s); 0 where they start slower."""
        mass, start, end = np.broadcast_arrays(*(np.asarray(one, dtype=np.float64) for one in (mass, start, end)))
        slows = start > end
        between = np.zeros(mass.shape)
        if slows.any():
            between[slows] = self._between(start[slows], end[slows])
        with np.errstate(invalid="ignore"):
            return np.where(slows, self.scale * np.cbrt(mass) * between, 0.0)

    def _between(self, start: Array, end: Array) -> Array:
        """Integral of dv / (C_D v) between speeds, by the trapezoidal rule in ln v; exact for a constant C_D."""
        low, high = np.log(np.maximum(end, 1e-9)), np.log(start)
        grid = np.linspace(low.min(), high.max(), 2 + math.ceil((high.max() - low.min()) / _FINEST))
        with np.errstate(divide="ignore"):
            slowness = 1.0 / self.drag.at(np.exp(grid) / self.sound_speed)
        whole = np.concatenate([[0.0], np.cumsum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(grid))])
        return np.asarray(np.interp(high, grid, whole) - np.interp(low, grid, whole))

    def lightest_in_free_fall(self, energy: float) -> float:
        """Mass (kg) from which on the terminal speed alone gives this energy (J); infinite without weight."""
        if energy <= 0.0 or not math.isfinite(self.scale):
            return 0.0
        if not self.gravity > 0.0:
            return math.inf
        low, high = math.log(1e-12), math.log(1e12)
        for _ in range(80):  # m g against the drag at the speed sqrt(2 E / m): the one rises, the other falls
            middle = 0.5 * (low + high)
            mass = math.exp(middle)
            speed = math.sqrt(2.0 * energy / mass)
            falls = mass * self.gravity * self.scale * mass ** (1.0 / 3.0) > speed**2 * mass * float(
                self.drag.at(speed / self.sound_speed)
            )
            low, high = (low, middle) if falls else (middle, high)
        return math.exp(high)

    def reach(self, mass: ArrayLike, speed: ArrayLike, energy: float) -> Array:
        """Distances (m) up to which fragments (kg) launched at speeds (m/s) have an energy (J).

        What has it in free fall has it as far as it may fly at all, V^2 / g.
        """
        mass, speed = np.broadcast_arrays(*(np.asarray(one, dtype=np.float64) for one in (mass, speed)))
        near = self.distance(mass, speed, np.sqrt(2.0 * energy / mass))
        if not self.gravity > 0.0:
            return near
        falls = mass >= self.lightest_in_free_fall(energy)
        return np.where(falls, np.maximum(near, speed**2 / self.gravity), near)
