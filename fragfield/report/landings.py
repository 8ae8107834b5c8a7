"""Where fragments came down and how densely, in the columns that figures and tables need."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fragfield.report.quantities import si_value

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.hazard.ensemble import EnsembleHazard
    from fragfield.report.run_files import RunFiles

__all__ = ["Landings", "ensemble", "hazard_density", "hazard_energy", "landings"]

HAZARDOUS_ENERGY = 79.0
"""J; 58 ft lb."""
ACCEPTABLE_DENSITY = 1.0 / 55.7
"""1/m2; one per 600 ft2."""
_LANDED = 1  # of flight's Status


@dataclass(frozen=True)
class Landings:
    """Fragments that reached the ground: place from the origin of distances (m), impact energy (J)."""

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    distance: NDArray[np.float64]
    energy: NDArray[np.float64]
    hazardous: NDArray[np.bool_]


def hazard_energy(run: RunFiles) -> float:
    """Impact energy from which a fragment counts as hazardous (J)."""
    return si_value(run.case.get("hazard", {}).get("energy"), HAZARDOUS_ENERGY)


def hazard_density(run: RunFiles) -> float:
    """Acceptable number of hazardous fragments per area (1/m2)."""
    return si_value(run.case.get("hazard", {}).get("density"), ACCEPTABLE_DENSITY)


def landings(run: RunFiles) -> Landings | None:
    """The fragments that landed, or None while the flight has not been run."""
    if run.landing is None:
        return None
    rows = run.landing[run.landing["status"] == _LANDED]
    # Distance and azimuth count from the origin that the case gives.
    turn, distance, energy = np.radians(rows["azimuth"]), rows["distance"], rows["energy"]
    return Landings(distance * np.cos(turn), distance * np.sin(turn), distance, energy, energy >= hazard_energy(run))


def ensemble(run: RunFiles) -> EnsembleHazard | None:
    """The hazard over the run's realisations; None where nothing landed, or the run was flown by an earlier version."""
    if run.landing is None or not (run.landing["status"] == _LANDED).any():
        return None
    return run.ensemble
