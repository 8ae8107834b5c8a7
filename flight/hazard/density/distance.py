"""The hazard distance of an ensemble: its value, bound, direction and curves."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class ExpectedDistance:
    """The hazard distance of an ensemble; lengths in m.

    Attributes
    ----------
    distance, upper, standard_error : float or None
        Distance of the expected density, its one-sided 95 % upper bound, standard error; the last two None for a
        single realisation.
    ground, normal : float
        Distances of both densities alone (plain largest over directions).
    basis : str
        "all_azimuths" or "worst_direction".
    direction : float or None
        Worst direction (degrees), None over all azimuths.
    realisations, groups : int
        Realisations, and groups of them that the bootstrap draws.
    kernel : float or None
        Half-width of the azimuth kernel (degrees), None over all azimuths.
    mirrors : tuple of float
        Azimuths of mirror planes about which directions were folded (degrees).
    max_bias : float
        Bias of taking the worst direction, taken off `distance`.
    azimuth, by_direction, upper_by_direction : (k,) float64
        Directions all around (degrees), the distance in each, and its one-sided 95 % bound in that direction (NaN for
        a single realisation), neither beyond the distance and the bound above. Over all azimuths one entry.
    radius : (j,) float64
        Places of the curves.
    density, density_low, density_high : (2, j) float64
        Expected density on the ground and normal to the path (1/m2) over all azimuths or in the worst direction, and
        its one-sided bounds of 95 % at each place: the certainty of the mean, not the scatter of single events.
    without_ricochet : ExpectedDistance or None
        The same of what fragments do before their first impact on the ground; None where they stay there.
    density_by_direction : (2, k, j) float32
        The expected densities in every direction of `azimuth`; empty over all azimuths, or where not asked for.
    """

    distance: float
    upper: float | None
    standard_error: float | None
    ground: float
    normal: float
    basis: str
    direction: float | None
    realisations: int
    groups: int
    kernel: float | None
    mirrors: tuple[float, ...]
    max_bias: float
    azimuth: Array
    by_direction: Array
    upper_by_direction: Array
    radius: Array
    density: Array
    density_low: Array = field(default_factory=lambda: np.zeros((2, 0)))
    density_high: Array = field(default_factory=lambda: np.zeros((2, 0)))
    without_ricochet: ExpectedDistance | None = None
    density_by_direction: NDArray[np.float32] = field(default_factory=lambda: np.zeros((2, 0, 0), np.float32))

    def __repr__(self) -> str:
        bound = "no upper bound" if self.upper is None else f"upper bound (95 %) {self.upper:.4g} m"
        return f"<flight.ExpectedDistance: {self.distance:.4g} m, {bound}, {self.realisations} realisations>"

    @property
    def relative_error(self) -> float:
        """Standard error over the distance; infinite for a single realisation, 0 where there is no hazard."""
        if self.standard_error is None:
            return math.inf
        return self.standard_error / self.distance if self.distance > 0.0 else 0.0

    @property
    def uncertainty(self) -> float:
        """The larger of standard error and `max_bias` over the distance: what more realisations reduce."""
        return max(self.relative_error, self.max_bias / self.distance if self.distance > 0.0 else 0.0)
