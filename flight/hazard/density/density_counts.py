"""What flights add to the densities by cell of azimuth and distance, and sums of it over groups of realisations.

Landings, and lengths of paths near the ground over a person's height, are counted cell by cell.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from flight.errors import InputError
from flight.hazard.criteria import SHALLOWEST
from flight.hazard.density.directions import Directions
from flight.rows import Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.result import FlightResult

    Array = NDArray[np.float64]


def density_counts(result: FlightResult, *, ricochet: bool = True) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What one flight adds to the densities, by cell of azimuth and distance, up to the farthest that holds anything.

    The flight must have counted near the ground (else InputError); `ricochet`: what fragments do after their first
    impact on the ground counts too.

    Returns
    -------
    landings, path_length_per_height : (a, r) float64
        Hazardous impacts on the ground in a cell, every one of a fragment that ricochets; and lengths of hazardous
        paths below a person's height over that height (of no height: 1 / sin of the angle of impact, which it goes
        over to).
    """
    counted = result.fluence
    if counted is None:
        raise InputError("hazard: the flight was not asked to count paths near the ground (fluence)")
    grid, energy, height = counted.cells.grid, counted.cells.energy, counted.cells.height
    rows, later = result.landing, result.ricochets[result.ricochets["number"] > 0]
    dangerous = (rows["status"] == Status.LANDED) & (rows["energy"] >= energy)
    later = later[(later["energy"] >= energy) & ricochet]
    azimuth, distances, angle = (
        np.concatenate([rows[name][dangerous], later[name]]) for name in ("azimuth", "distance", "angle")
    )
    weights = np.ones(len(distances))
    if counted.weights is not None:
        weights = np.concatenate([counted.weights[dangerous], counted.weights[later["fragment"]]])
    if len(distances):
        grid = grid.up_to(max(grid.reach, float(distances.max()) + grid.cell))
    turn, cell = grid.cells_of(azimuth, distances)
    flat, size = turn * grid.shape[1] + cell, grid.shape[0] * grid.shape[1]
    landings = np.bincount(flat, weights=weights, minlength=size).astype(np.float64).reshape(grid.shape)
    path_length_per_height = np.zeros(grid.shape)
    if height > 0.0:
        lengths = counted.lengths if ricochet else counted.before
        path_length_per_height[:, : lengths.shape[1]] = lengths / height
    else:
        steepness = np.sin(np.maximum(np.radians(angle), SHALLOWEST))
        path_length_per_height += np.bincount(flat, weights=weights / steepness, minlength=size).reshape(grid.shape)
    held = np.flatnonzero(landings.any(axis=0) | path_length_per_height.any(axis=0))
    end = int(held[-1]) + 1 if held.size else 1
    return landings[:, :end], path_length_per_height[:, :end]


MEMORY = 96e6  # bytes of the groups' fields


class DensityGroups:
    """Numbers of hazardous fragments by kind, direction class and distance, summed over groups of realisations.

    A group is one realisation, all of which are independent of each other. Once memory is full neighbouring groups are
    joined in pairs, so that the fields of any number of realisations take no more than `MEMORY` bytes (64 groups at
    least).

    Fields that reach beyond the grid of `directions` extend it.

    Parameters
    ----------
    directions : Directions
        Of the densities.
    """

    def __init__(self, directions: Directions) -> None:
        self.directions = directions
        self.size, self.realisations = 1, 0  # of a full group; of all
        self._sums: list[Array] = []

    def add(self, landings: Array, path_length_per_height: Array) -> Array:
        """Add one realisation: numbers and path lengths over height (a, r) on the grid or up to a nearer reach.

        Returns
        -------
        (2, c, r) float64
            What was added, by direction class; not to be written to.
        """
        here = np.stack([self.directions.folded(values) for values in (landings, path_length_per_height)])
        cells = max(here.shape[-1], self.cells)
        if cells > self.directions.grid.shape[1]:
            self.directions = replace(self.directions, grid=self.directions.grid.holding(cells))
        if cells > self.cells:
            self._sums = [_padded(one, cells) for one in self._sums]
        here = _padded(here, cells)
        if self.realisations % self.size == 0:
            if len(self._sums) >= max(64, 2 * int(MEMORY / here.nbytes / 2)):
                self._join()
            self._sums.append(here)
        else:
            self._sums[-1] = self._sums[-1] + here
        self.realisations += 1
        return here

    def _join(self) -> None:
        self._sums = [one + other for one, other in zip(self._sums[::2], self._sums[1::2], strict=True)]
        self.size *= 2

    @property
    def cells(self) -> int:
        """Distance cells so far."""
        return self._sums[0].shape[-1] if self._sums else 0

    @property
    def sums(self) -> Array:
        """Sums of the groups (g, 2, c, r)."""
        return np.stack(self._sums)

    @property
    def sizes(self) -> NDArray[np.int64]:
        """Realisations of every group (g,)."""
        sizes = np.full(len(self._sums), self.size)
        sizes[-1] -= self.size * len(self._sums) - self.realisations
        return sizes

    @classmethod
    def of(cls, directions: Directions, sums: Array, sizes: NDArray[np.int64] | None = None) -> DensityGroups:
        """Groups whose folded sums (g, 2, c, r) are known."""
        made = cls(directions)
        made._sums = list(sums)
        made.size = 1 if sizes is None else int(sizes[0])
        made.realisations = len(sums) if sizes is None else int(sizes.sum())
        return made


def _padded(values: Array, cells: int) -> Array:
    if values.shape[-1] == cells:
        return values
    empty = [(0, 0)] * (values.ndim - 1) + [(0, cells - values.shape[-1])]
    return np.pad(values, empty)
