"""Numbers of fragments and farthest landings by azimuth sector, for one realisation or many."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.arguments import require_number
from flight.errors import InputError
from flight.result import FlightResult, Status

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["Tally", "sectors_of", "tally"]


@dataclass(frozen=True, eq=False, repr=False)
class Tally:
    """What fell in s azimuth sectors in n realisations.

    Attributes
    ----------
    fragments, hazardous : (n, s) int64
        Landed fragments, and those that were hazardous at their first impact.
    throw : (n, s) float64
        Farthest last landing, after any ricochets (m); 0 where there is none.
    """

    fragments: NDArray[np.int64]
    hazardous: NDArray[np.int64]
    throw: NDArray[np.float64]

    def __repr__(self) -> str:
        number, sectors = self.throw.shape
        landed, hazardous = int(self.fragments.sum()), int(self.hazardous.sum())
        return f"<flight.Tally: {number} x {sectors} sectors, {landed} landed, {hazardous} hazardous>"

    @property
    def realisations(self) -> int:
        """Number of realisations."""
        return int(self.throw.shape[0])

    @property
    def azimuth(self) -> NDArray[np.float64]:
        """Centres of the sectors (s,) in degrees."""
        return np.arange(self.throw.shape[1]) * (360.0 / self.throw.shape[1])

    @classmethod
    def join(cls, parts: Sequence[Tally]) -> Tally:
        """All realisations of several tallies with the same sectors.

        Raises
        ------
        InputError
            There is none, or their sectors differ.
        """
        if not parts:
            raise InputError("hazard: no realisation to assess")
        if len({part.throw.shape[1] for part in parts}) > 1:
            raise InputError("hazard: tallies of different sectors cannot be put together")
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in cls.__dataclass_fields__))


def tally(landing: FlightResult | NDArray[Any], energy: float = 79.0, *, sector_width: float = 5.0) -> Tally:
    """Count the landed fragments of one realisation.

    Parameters
    ----------
    landing : FlightResult or structured array of dtype LANDING
        Only rows that landed count.
    energy : float
        Of a hazardous fragment (J).
    sector_width : float
        Width of a sector (degrees), a whole fraction of 360; the first is centred on azimuth 0.
    """
    rows = landing.landing if isinstance(landing, FlightResult) else landing
    landed = rows["status"] == Status.LANDED  # columns one by one: a table of a million rows has 171 MB
    azimuth, distances = rows["azimuth"][landed], rows["distance"][landed]
    sector, sectors = sectors_of(azimuth, sector_width)
    throw = np.zeros(sectors)
    moved = ((rows["ricochets"] > 0) & (rows["last_status"] == Status.LANDED))[landed]
    ends = sectors_of(np.where(moved, rows["last_azimuth"][landed], azimuth), sector_width)[0]
    np.maximum.at(throw, ends, np.where(moved, rows["last_distance"][landed], distances))
    dangerous = rows["energy"][landed] >= energy
    return Tally(
        np.bincount(sector, minlength=sectors)[None].astype(np.int64),
        np.bincount(sector[dangerous], minlength=sectors)[None].astype(np.int64),
        throw[None],
    )


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
