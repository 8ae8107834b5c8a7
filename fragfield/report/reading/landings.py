"""Landings and densities, in the columns that figures and tables need."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.hazard.ensemble import EnsembleHazard
    from fragfield.report.reading.run_files import RunFiles

__all__ = ["Landings", "ensemble", "hazard_density", "hazard_energy", "landings"]

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
    return run.criteria.energy


def hazard_density(run: RunFiles) -> float:
    """Acceptable number of hazardous fragments per area (1/m2)."""
    return run.criteria.density


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
