"""Fragments of the round by direction and by what they still carry at the boards."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

import flight
from transition import BreakUp
from validation.runs import reference_beside

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from transition import BreakUpSettings
    from transition.snapshot import Snapshot

    Array = NDArray[np.float64]

__all__ = ["REFERENCE", "Sample", "Zones", "deciding_scatter", "polar_angles", "sample_of", "zones_of"]

REFERENCE = reference_beside(__file__)
FOOT = 0.3048
SEED = 1938
_SLIDE = 0.5  # degrees by which the window of the peak is moved
_TIME_LIMIT = 10.0  # s


@dataclass(frozen=True, eq=False)
class Sample:
    """Fragments of all realisations with their energies at the boards; directions are drawn for every scatter.

    Attributes
    ----------
    prepared : BreakUp
        The burst casing, of which the settings' scatter is replaced.
    realisations : int
        How many.
    energy : (boards, n) float64
        Kinetic energy at each distance (J).
    """

    prepared: BreakUp
    realisations: int
    energy: Array

    def angles(self, scatter: float) -> tuple[Array, Array]:
        """`polar_angles` of the sample for a scatter (rad)."""
        return polar_angles(self.prepared, self.realisations, scatter)

    def limit(self, number: float, board: int = 0) -> float:
        """Energy (J) above which `number` fragments of a round arrive at a board."""
        return float(np.sort(self.energy[board])[::-1][round(number * self.realisations)])


@dataclass(frozen=True)
class Zones:
    """Fragments by polar zone: number of a round, percentages, and the peak of the side spray over the mean."""

    number: float
    side: float
    base: float
    nose: float
    peak: float

    @property
    def between(self) -> float:
        """Percentage in none of the zones."""
        return 100.0 - self.side - self.base - self.nose


def sample_of(snapshot: Snapshot, settings: BreakUpSettings, realisations: int) -> Sample:
    """Break the casing up and fly its fragments to the boards.

    Without gravity a speed depends on the length of the path alone: all fly level, and cylinders stand for boards all
    around.
    """
    prepared = BreakUp(snapshot, settings)
    parts = prepared.many(SEED, range(realisations))
    mass = np.concatenate([part.mass for part in parts])
    speed = np.concatenate([part.speed for part in parts])
    level = np.column_stack([speed, np.zeros((len(speed), 2))])
    radii = FOOT * np.asarray(REFERENCE["boards"]["distance_ft"])
    result = flight.fly(
        flight.Fragments(mass, (0.0, 0.0, 0.0), level, settings.shape_factor),
        air=flight.ConstantAir(1.225, 340.294),
        drag="shell_fragment",
        gravity=0.0,
        ground=None,
        time_limit=_TIME_LIMIT,
        witnesses=[flight.Cylinder(radius, name=str(board)) for board, radius in enumerate(radii)],
        domain=flight.Domain(radius=1.01 * float(radii.max())),
    )
    energy = np.zeros((len(radii), len(mass)))
    for board in range(len(radii)):
        hits = result.hits_on(str(board))
        energy[board, hits["fragment"]] = hits["energy"]
    return Sample(prepared, realisations, energy)


def polar_angles(prepared: BreakUp, realisations: int, scatter: float) -> tuple[Array, Array]:
    """Angle between velocity and axis (degrees from the nose) and mass (kg) of every fragment, for a scatter (rad)."""
    prepared.settings = replace(prepared.settings, direction_scatter=scatter)
    axis = np.asarray(prepared.rounds[0].axis)
    parts = prepared.many(SEED, range(realisations))
    cosine = np.concatenate([part.velocity @ axis / part.speed for part in parts])
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))), np.concatenate([part.mass for part in parts])


def zones_of(angle: Array, realisations: int) -> Zones:
    """Fragments of these polar angles by zone."""

    def percent(low: float, high: float) -> float:
        return 100.0 * float(np.mean((angle >= low) & (angle <= high)))

    side, base, nose = (percent(z["from"], z["to"]) for z in (REFERENCE["zones"][n] for n in ("side", "base", "nose")))
    half = 0.5 * REFERENCE["peak"]["width"]
    zone = REFERENCE["zones"]["side"]
    centres = np.arange(zone["from"] + half, zone["to"] - half + 1e-9, _SLIDE)
    ordered = np.sort(angle)
    counts = np.searchsorted(ordered, centres + half) - np.searchsorted(ordered, centres - half)
    solid = 0.5 * (np.cos(np.radians(centres - half)) - np.cos(np.radians(centres + half)))  # of the sphere
    return Zones(len(angle) / realisations, side, base, nose, float((counts / solid).max()) / len(angle))


def deciding_scatter(scatters: Array, peaks: Array, measured: Array, error: Array) -> tuple[float, float, float]:
    """Scatter of the least sum of squared deviations of the peaks from the measured ones, and where that is 1 more.

    Parameters
    ----------
    scatters : (k,)
        Scatters that were tried, rising (any unit; that of the result).
    peaks : (k, boards)
        Peak over mean that each gave at each board.
    measured, error : (boards,)
        The test's peak over mean and its standard error.

    Returns
    -------
    Best value, and the ends of its interval of one standard error; interpolated in the logarithm of the peaks.
    """
    fine = np.linspace(scatters[0], scatters[-1], 2001)
    found = np.exp([np.interp(fine, scatters, np.log(column)) for column in peaks.T])
    misfit = (((found - measured[:, None]) / error[:, None]) ** 2).sum(axis=0)
    inside = fine[misfit <= misfit.min() + 1.0]
    return float(fine[misfit.argmin()]), float(inside[0]), float(inside[-1])
