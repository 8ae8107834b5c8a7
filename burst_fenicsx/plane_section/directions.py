"""In which directions of a section its casings fly: mass and momentum by azimuth, focus between rounds, speeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.axisymmetric.rings import areas
from burst_fenicsx.kernels.constants import FOLDED_VOLUME
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from burst_fenicsx.axisymmetric.fields import RingFields

__all__ = ["HALF_WIDTHS", "Flight", "casing_flight", "direction_summary", "focus_ratio", "weighted_quantile"]

HALF_WIDTHS = (5.0, 10.0, 20.0, 35.0)
"""Degrees to each side of the focus within which the casing's mass is summed."""

_BEYOND = 60.0  # degrees from the focus beyond which the mass per degree is that of the undisturbed rounds
_SECTOR = 5.0  # degrees of a sector of the table
_NEAR = 5.0  # degrees to each side of the focus within which speeds are read


@dataclass(frozen=True, eq=False)
class Flight:
    """Casing cells of a section in flight.

    Attributes
    ----------
    mass : (cells,) kg/m. velocity : (cells, 2) m/s. azimuth : (cells,) degrees from u to v, 0 to 360.
    speed : (cells,) m/s. torn : (cells,) bool, whether the cell is torn metal and no continuum any more.
    """

    mass: NDArray[np.float64]
    velocity: NDArray[np.float64]
    torn: NDArray[np.bool_]

    @property
    def speed(self) -> NDArray[np.float64]:
        """Speeds (cells,) in m/s."""
        speeds: NDArray[np.float64] = np.linalg.norm(self.velocity, axis=1)
        return speeds

    @property
    def azimuth(self) -> NDArray[np.float64]:
        """Directions of flight (cells,) in degrees from u towards v, 0 to 360."""
        angles: NDArray[np.float64] = np.degrees(np.arctan2(self.velocity[:, 1], self.velocity[:, 0])) % 360.0
        return angles

    def off(self, azimuth: float) -> NDArray[np.float64]:
        """Angles (cells,) in degrees, 0 to 180, between the directions of flight and an azimuth (degrees)."""
        angles: NDArray[np.float64] = np.abs((self.azimuth - azimuth + 180.0) % 360.0 - 180.0)
        return angles


def casing_flight(fields: RingFields, index: int) -> Flight:
    """The casing's cells of the round `index` now: a cell flies with the mean velocity of its nodes."""
    casing = np.flatnonzero((fields.mesh.part == Part.CASING) & (fields.mesh.round == index))
    return Flight(
        mass=fields.cell_mass[casing],
        velocity=fields.cell_velocities()[casing][:, [0, 2]],
        torn=_torn(fields)[casing],
    )


def _torn(fields: RingFields) -> NDArray[np.bool_]:
    """Whether cells are torn metal (cells,): released, folded, or without strength and twice as large as at first."""
    stretched = fields.volumes() > FOLDED_VOLUME * areas(fields.start, fields.mesh.dofmap)
    torn: NDArray[np.bool_] = fields.eroded | fields.folded() | (fields.without_strength() & stretched)
    return torn


def focus_ratio(flight: Flight, focus: float, half_width: float) -> float:
    """Mass per degree within `half_width` of an azimuth (degrees), over that beyond 60 degrees from its line.

    The directions on both sides of the line count: within `half_width` of the focus or of its opposite, and beyond 60
    degrees from both.
    """
    off = np.minimum(flight.off(focus), flight.off(focus + 180.0))
    undisturbed = flight.mass[off > _BEYOND].sum() / (4.0 * (90.0 - _BEYOND))
    return float(flight.mass[off <= half_width].sum() / (4.0 * half_width) / undisturbed) if undisturbed > 0.0 else 0.0


def weighted_quantile(values: NDArray[np.float64], mass: NDArray[np.float64], share: float) -> float:
    """Value that a share of the mass does not exceed, cells' masses at the middle of their steps; 0 without cells."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(mass[order])
    if not len(total):
        return 0.0
    return float(np.interp(share, (total - 0.5 * mass[order]) / total[-1], values[order]))


def direction_summary(flight: Flight, focus: float | None) -> dict[str, Any]:
    """Part of the summary: sectors of 5 degrees by their centres and, where rounds face each other, their focus.

    `focus` is the azimuth at right angles to the line through two neighbouring rounds (degrees); None: a single round.
    """
    count = round(360.0 / _SECTOR)
    sector = np.floor(((flight.azimuth + 0.5 * _SECTOR) % 360.0) / _SECTOR).astype(int)
    mass = np.bincount(sector, weights=flight.mass, minlength=count)
    momentum = np.bincount(sector, weights=flight.mass * flight.speed, minlength=count)
    largest = np.zeros(count)
    np.maximum.at(largest, sector, flight.speed)
    found: dict[str, Any] = {
        "momentum": [float(value) for value in flight.mass @ flight.velocity],
        "by_azimuth": [
            {
                "azimuth_deg": _SECTOR * index,
                "mass": float(mass[index]),
                "momentum": float(momentum[index]),
                "max_speed": float(largest[index]),
            }
            for index in range(count)
        ],
        "focus": None,
    }
    if focus is not None:
        off = np.minimum(flight.off(focus), flight.off(focus + 180.0))
        near = off <= _NEAR
        found["focus"] = {
            "azimuth_deg": focus % 180.0,
            "mass_ratio": {f"{width:g}": focus_ratio(flight, focus, width) for width in HALF_WIDTHS},
            "speed_99_percent": weighted_quantile(flight.speed[near], flight.mass[near], 0.99),
            "max_speed": float(flight.speed[near].max(initial=0.0)),
            "undisturbed_speed": _mean(flight, off > _BEYOND),
            "torn_share": float(flight.mass[near & flight.torn].sum() / max(flight.mass[near].sum(), 1e-300)),
            "max_speed_of_whole": float(flight.speed[near & ~flight.torn].max(initial=0.0)),
        }
    return found


def _mean(flight: Flight, chosen: NDArray[np.bool_]) -> float:
    total = flight.mass[chosen].sum()
    return float((flight.mass * flight.speed)[chosen].sum() / total) if total > 0.0 else 0.0
