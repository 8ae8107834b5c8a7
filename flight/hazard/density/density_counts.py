"""Contributions of one flight to the densities by cell of azimuth and distance: landings, and paths near the ground."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flight.errors import InputError
from flight.hazard.criteria import SHALLOWEST
from flight.result import Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.result import FlightResult

__all__ = ["density_counts"]


def density_counts(result: FlightResult, *, ricochet: bool = True) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What one flight adds to the densities, by cell of azimuth and distance, up to the farthest that holds anything.

    Parameters
    ----------
    result : FlightResult
        Of a flight that counted near the ground.
    ricochet : bool
        Whether what fragments do after their first impact on the ground counts.

    Returns
    -------
    landings, path_length_per_height : (a, r) float64
        Hazardous impacts on the ground in a cell, every one of a fragment that ricochets; and lengths of hazardous
        paths below a person's height over that height (of no height: 1 / sin of the angle of impact, which it goes
        over to).

    Raises
    ------
    InputError
        The flight did not count near the ground.
    """
    counted = result.fluence
    if counted is None:
        raise InputError("hazard: the flight was not asked to count paths near the ground (near_ground)")
    grid, energy, height = counted.cells.grid, counted.cells.energy, counted.cells.height
    rows, later = result.landing, result.ricochets[result.ricochets["number"] > 0]
    dangerous = (rows["status"] == Status.LANDED) & (rows["energy"] >= energy)
    later = later[(later["energy"] >= energy) & ricochet]
    azimuth, distances, angle = (
        np.concatenate([rows[name][dangerous], later[name]]) for name in ("azimuth", "distance", "angle")
    )
    if len(distances):
        grid = grid.up_to(max(grid.reach, float(distances.max()) + grid.cell))
    turn, cell = grid.cells_of(azimuth, distances)
    flat, size = turn * grid.shape[1] + cell, grid.shape[0] * grid.shape[1]
    landings = np.bincount(flat, minlength=size).astype(np.float64).reshape(grid.shape)
    path_length_per_height = np.zeros(grid.shape)
    if height > 0.0:
        lengths = counted.lengths if ricochet else counted.before
        path_length_per_height[:, : lengths.shape[1]] = lengths / height
    else:
        steepness = np.sin(np.maximum(np.radians(angle), SHALLOWEST))
        path_length_per_height += np.bincount(flat, weights=1.0 / steepness, minlength=size).reshape(grid.shape)
    held = np.flatnonzero(landings.any(axis=0) | path_length_per_height.any(axis=0))
    end = int(held[-1]) + 1 if held.size else 1
    return landings[:, :end], path_length_per_height[:, :end]
