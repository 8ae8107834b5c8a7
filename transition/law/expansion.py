"""How a casing expands during the burst: radius and rate of hoop strain at a given hoop strain.

The hoop strain is that of the outer surface, e = R/R0 - 1 (Eq. 22's), with R the azimuthal mean of the outer radius
over the part of the casing asked for. Its rate is d(ln R)/dt, that is the outward speed over the current radius (the
v/r of Mott's theory), taken as the chord between the strains e - 0.05 and e + 0.05: over 0.1 of strain the shocks that
ring in the wall average out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from transition.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["HALF_CHORD", "Expansion", "RuptureState"]

HALF_CHORD = 0.05
"""Half the width of the chord over which the rate is taken, in hoop strain."""


@dataclass(frozen=True)
class RuptureState:
    """A part of the casing at a hoop strain. SI units.

    Attributes
    ----------
    time : float
        When the strain was reached (s).
    strain : float
        Hoop strain of the outer surface.
    radius : float
        Outer radius (m).
    rate : float
        Rate of hoop strain d(ln R)/dt (1/s).
    """

    time: float
    strain: float
    radius: float
    rate: float


@dataclass(frozen=True, eq=False)
class Expansion:
    """Outer radius of a round's casing by station over the whole burst.

    Attributes
    ----------
    time : (n,) float64
        Times (s), rising.
    station : (b,) float64
        Centres of the station bins (m from the nose end), rising.
    outer_radius : (n, b) float64
        Azimuthal mean of the casing's outer radius (m); NaN in a bin without a node.

    Raises
    ------
    InputError
        The arrays do not fit each other, or times or stations do not rise.
    """

    time: NDArray[np.float64]
    station: NDArray[np.float64]
    outer_radius: NDArray[np.float64]

    def __post_init__(self) -> None:
        """Refuse what cannot be read off."""
        shape = (self.time.size, self.station.size)
        if self.outer_radius.shape != shape:
            raise InputError(f"expansion: outer_radius has shape {self.outer_radius.shape}, needed {shape}")
        for name in ("time", "station"):
            if not (np.diff(getattr(self, name)) > 0.0).all():
                raise InputError(f"expansion: {name} does not rise")

    def at_strain(self, start: float, end: float, strain: float) -> RuptureState | None:
        """State of the casing between two stations (m) when its hoop strain first reached `strain`.

        Returns
        -------
        RuptureState or None
            None where the burst ended before, or where the casing has no outer surface between the stations.
        """
        chosen = (self.station >= start) & (self.station < end)
        if not chosen.any() and self.station.size:  # shorter than a bin
            chosen[np.argmin(np.abs(self.station - 0.5 * (start + end)))] = True
        chosen &= np.isfinite(self.outer_radius).all(axis=0)
        if not chosen.any() or not self.time.size:
            return None
        outer = self.outer_radius[:, chosen].mean(axis=1)
        found = outer / outer[0] - 1.0
        largest = float(found.max())
        if not largest >= strain > 0.0:
            return None
        low, high = max(strain - HALF_CHORD, 0.0), min(strain + HALF_CHORD, largest)
        first, when, last = (_first(self.time, found, value) for value in (low, strain, high))
        rate = math.log((1.0 + high) / (1.0 + low)) / (last - first)
        return RuptureState(when, strain, float(outer[0]) * (1.0 + strain), rate)


def _first(time: NDArray[np.float64], values: NDArray[np.float64], wanted: float) -> float:
    """Time at which `values`, the first of them 0, first reach `wanted`, linearly between times."""
    if wanted <= 0.0:
        return float(time[0])
    after = int(np.argmax(values >= wanted))
    before = after - 1
    share = (wanted - values[before]) / (values[after] - values[before])
    return float(time[before] + share * (time[after] - time[before]))
