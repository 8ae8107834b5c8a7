"""Hazardous fragments that landed, counted by azimuth sector and distance, for one realisation or many."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.arguments import real_array, require_number
from flight.errors import InputError
from flight.hazard.criteria import SHALLOWEST, Criteria
from flight.hazard.density.fields import fields_of
from flight.result import FlightResult, Status

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

__all__ = ["Tally", "sectors_of", "tally"]


@dataclass(frozen=True, eq=False, repr=False)
class Tally:
    """Counts on a grid of n realisations, s azimuth sectors and r cells of distance.

    Attributes
    ----------
    edges : (r + 1,) float64
        Edges of the distance cells (m).
    landings : (n, s, r) float64
        Hazardous impacts on the ground in the cell.
    tracks : (n, s, r) float64
        Length of hazardous fragments' paths in the cell below a person's height, over that height; see
        `flight.hazard`.
    fragments, hazardous : (n, s) int64
        Landed fragments, and those that were hazardous at their first impact.
    throw : (n, s) float64
        Farthest last landing, after any ricochets (m); 0 where there is none.
    """

    edges: NDArray[np.float64]
    landings: NDArray[np.float64]
    tracks: NDArray[np.float64]
    fragments: NDArray[np.int64]
    hazardous: NDArray[np.int64]
    throw: NDArray[np.float64]

    def __repr__(self) -> str:
        number, sectors, cells = self.landings.shape
        landed, hazardous = int(self.fragments.sum()), int(self.hazardous.sum())
        return f"<flight.Tally: {number} x {sectors} x {cells} cells, {landed} landed, {hazardous} hazardous>"

    @property
    def realisations(self) -> int:
        """Number of realisations."""
        return int(self.throw.shape[0])

    @property
    def azimuth(self) -> NDArray[np.float64]:
        """Centres of the sectors (s,) in degrees."""
        return np.arange(self.throw.shape[1]) * (360.0 / self.throw.shape[1])

    @property
    def area(self) -> NDArray[np.float64]:
        """Ground of the cells (s, r) in m2."""
        sectors = self.throw.shape[1]
        return np.outer(np.full(sectors, math.pi / sectors), np.diff(self.edges**2))

    def up_to(self, edges: NDArray[np.float64]) -> Tally:
        """The same counts with further, empty cells; `edges` begin with those of the tally."""
        here = len(self.edges)
        if len(edges) < here or not np.array_equal(edges[:here], self.edges):
            raise InputError("hazard: tallies of different distance cells cannot be put together")
        empty = ((0, 0), (0, 0), (0, len(edges) - here))
        return replace(self, edges=edges, landings=np.pad(self.landings, empty), tracks=np.pad(self.tracks, empty))

    @classmethod
    def join(cls, parts: Sequence[Tally]) -> Tally:
        """All realisations of several tallies with the same sectors and distance cells.

        Raises
        ------
        InputError
            There is none, or their sectors or cells differ.
        """
        if not parts:
            raise InputError("hazard: no realisation to assess")
        if len({part.throw.shape[1] for part in parts}) > 1:
            raise InputError("hazard: tallies of different sectors cannot be put together")
        farthest = max((part.edges for part in parts), key=len)
        alike = [part.up_to(farthest) for part in parts]
        names = ("landings", "tracks", "fragments", "hazardous", "throw")
        return cls(farthest, *(np.concatenate([getattr(part, name) for part in alike]) for name in names))


def tally(
    landing: FlightResult | NDArray[Any],
    criteria: Criteria | None = None,
    *,
    sector_width: float = 5.0,
    distance: float | ArrayLike = 10.0,
) -> Tally:
    """Count the landed fragments of one realisation.

    Parameters
    ----------
    landing : FlightResult or structured array of dtype LANDING
        Only rows that landed count. Of a flight that counted its paths near the ground (`flight.hazard.NearGround`,
        same criteria, sectors and cells), landings and tracks are those, ricochets included; else those of the first
        impacts, the ends of whose paths are taken straight.
    criteria : Criteria, optional
        Default: 79 J, 1 per 55.7 m2, a person of 0.58 m2 and 1.8 m.
    sector_width : float
        Width of a sector (degrees), a whole fraction of 360; the first is centred on azimuth 0.
    distance : float or edges
        Width of a distance cell (m), or all edges (m), rising from zero or more. Of a width, cells reach one beyond
        the farthest fragment, so that a distance does not depend on how far another realisation's fragments flew.
    """
    criteria = criteria or Criteria()
    rows = landing.landing if isinstance(landing, FlightResult) else landing
    landed = rows["status"] == Status.LANDED  # columns one by one: a table of a million rows has 171 MB
    distances = rows["distance"][landed]
    sector, sectors = sectors_of(rows["azimuth"][landed], sector_width)
    throw = np.zeros(sectors)
    moved = ((rows["ricochets"] > 0) & (rows["last_status"] == Status.LANDED))[landed]
    ends = sectors_of(np.where(moved, rows["last_azimuth"][landed], rows["azimuth"][landed]), sector_width)[0]
    np.maximum.at(throw, ends, np.where(moved, rows["last_distance"][landed], distances))
    edges = _edges(distance, float(throw.max()))
    dangerous = rows["energy"][landed] >= criteria.energy
    along = _along_paths(landing, criteria, sectors, distance)
    if along is None:
        angle = rows["angle"][landed][dangerous]
        landings, tracks = _pile(distances[dangerous], angle, sector[dangerous], sectors, edges, criteria.person_height)
    else:
        cells = max(len(edges) - 1, along[0].shape[1])
        edges = np.arange(cells + 1) * float(np.asarray(distance))
        landings, tracks = (np.pad(one, ((0, 0), (0, cells - one.shape[1]))) for one in along)
    return Tally(
        edges, landings[None], tracks[None],
        np.bincount(sector, minlength=sectors)[None].astype(np.int64),
        np.bincount(sector[dangerous], minlength=sectors)[None].astype(np.int64),
        throw[None],
    )  # fmt: skip


def sectors_of(azimuth: NDArray[np.float64], width: float) -> tuple[NDArray[np.int64], int]:
    """Return the sector of every azimuth (degrees), and the number of sectors; the first is centred on 0.

    Raises
    ------
    InputError
        The width (degrees) is not a whole fraction of 360.
    """
    require_number("hazard", "sector_width", width, "degrees")
    count = round(360.0 / width) if width > 0.0 else 0
    if count < 1 or abs(count * width - 360.0) > 1e-9:
        raise InputError(f"hazard: sector width is {width} degrees, needed: a whole fraction of 360, such as 5")
    return np.floor(azimuth / width + 0.5).astype(np.int64) % count, count


def _edges(distance: float | ArrayLike, farthest: float) -> NDArray[np.float64]:
    given = real_array("hazard", "distance", distance, "m")
    if given.ndim == 0:
        if not (np.isfinite(given) and given > 0.0):
            raise InputError(f"hazard: distance cells of {given} m, needed: above zero")
        return np.arange(max(1, math.ceil(farthest / float(given) + 1e-12)) + 2) * float(given)
    if (
        given.ndim != 1
        or given.size < 2
        or not np.isfinite(given).all()
        or given[0] < 0.0
        or (np.diff(given) <= 0).any()
    ):
        raise InputError("hazard: distance edges must be two or more finite numbers, rising from zero or more (m)")
    return given


def _along_paths(
    landing: object, criteria: Criteria, sectors: int, distance: float | ArrayLike
) -> tuple[NDArray[np.float64], ...] | None:
    """Landings and tracks by cell from a flight that counted near the ground for this criterion, in such cells."""
    counted = landing.near_ground if isinstance(landing, FlightResult) else None
    if counted is None or np.ndim(distance) or counted.near.criteria != criteria:
        return None
    grid = counted.near.grid
    if grid.sectors != sectors or grid.cell != float(np.asarray(distance)):
        return None
    fields = fields_of(landing)  # type: ignore[arg-type]  # a FlightResult
    whole = grid.holding(fields[0].shape[1])
    wide = (np.pad(one, ((0, 0), (0, whole.shape[1] - one.shape[1]))) for one in fields)
    return tuple(whole.for_tables(one) for one in wide)


def _pile(
    distances: NDArray[np.float64], angle: NDArray[np.float64], sector: NDArray[np.int64], sectors: int,
    edges: NDArray[np.float64], height: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:  # fmt: skip
    """Landings per cell, and path lengths per cell over the height, both (sectors, cells)."""
    cells = len(edges) - 1
    angle = np.maximum(np.radians(angle), SHALLOWEST)
    cell = np.searchsorted(edges, distances, side="right") - 1
    cell[distances == edges[-1]] = cells - 1
    within = (cell >= 0) & (cell < cells)
    flat = sector[within] * cells + cell[within]
    numbers = np.bincount(flat, minlength=sectors * cells).reshape(sectors, cells).astype(np.float64)
    if height <= 0.0:
        weights = 1.0 / np.sin(angle[within])
        return numbers, np.bincount(flat, weights=weights, minlength=sectors * cells).reshape(sectors, cells).astype(
            float
        )
    tracks = np.zeros((sectors, cells))
    # back along the path until it rises above the height; a vertical path stays where it lands
    reach = np.minimum(height / np.tan(np.minimum(angle, math.radians(89.999))), distances)
    whole = height / np.sin(angle)  # path length within the height, shortened where the path starts inside it
    full_reach = height / np.tan(np.minimum(angle, math.radians(89.999)))
    length = whole * np.where(full_reach > 0.0, reach / full_reach, 1.0)
    for j in range(cells):
        overlap = np.minimum(distances, edges[j + 1]) - np.maximum(distances - reach, edges[j])
        here = np.flatnonzero(overlap > 0.0)
        if here.size:
            weights = length[here] * overlap[here] / reach[here] / height
            tracks[:, j] = np.bincount(sector[here], weights=weights, minlength=sectors)
    return numbers, tracks
