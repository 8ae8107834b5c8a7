"""Hits on a witness ring by azimuth, one row for each realisation: numbers and speeds in small arrays.

The bins begin at azimuth 0: bin i of n holds the azimuths from i to i + 1 n-ths of the circle. With bins of one
degree a sector of any whole half-width about a whole degree is made of whole bins.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["RingCounts", "count_by_azimuth"]


@dataclass(frozen=True, eq=False)
class RingCounts:
    """Hits of r realisations in b bins of azimuth.

    Attributes
    ----------
    hits : (r, b) int64
        Number of hits.
    initial_speed, speed : (r, b) float64
        Sums over the hits of the speed at launch and at the ring (m/s).
    largest_initial_speed, largest_speed : (r, b) float64
        The largest of them (m/s); 0 where nothing hit.
    """

    hits: NDArray[np.int64]
    initial_speed: NDArray[np.float64]
    speed: NDArray[np.float64]
    largest_initial_speed: NDArray[np.float64]
    largest_speed: NDArray[np.float64]

    @property
    def realisations(self) -> int:
        """Number of realisations."""
        return int(self.hits.shape[0])

    @property
    def width(self) -> float:
        """Width of a bin (degrees)."""
        return 360.0 / self.hits.shape[1]

    @property
    def azimuth(self) -> NDArray[np.float64]:
        """Middles of the bins (b,) in degrees."""
        return self.width * (np.arange(self.hits.shape[1]) + 0.5)

    def in_bins_of(self, width: float) -> RingCounts:
        """The same hits in wider bins.

        Raises
        ------
        InputError
            The width (degrees) is not a whole number of bins, or not a whole fraction of the circle.
        """
        bins = round(360.0 / width) if width > 0.0 else 0
        if bins < 1 or abs(bins * width - 360.0) > 1e-9 or self.hits.shape[1] % bins:
            raise InputError(
                f"bins of {width:g} degrees: they must divide the circle and hold whole bins of {self.width:g} degrees"
            )
        grouped = {f.name: getattr(self, f.name).reshape(self.realisations, bins, -1) for f in fields(self)}
        return RingCounts(
            **{name: a.max(axis=2) if name.startswith("largest") else a.sum(axis=2) for name, a in grouped.items()}
        )

    @classmethod
    def join(cls, parts: Sequence[RingCounts]) -> RingCounts:
        """All realisations of several tables."""
        return cls(**{f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls)})


def count_by_azimuth(
    hits: NDArray[Any], realisation: NDArray[np.int64], realisations: int, *, width: float = 1.0
) -> RingCounts:
    """Count the hits on one ring.

    Parameters
    ----------
    hits : structured array of dtype HITS
        Crossings of one witness surface; those inwards do not count.
    realisation : (n,) int64
        Which realisation each of the hits belongs to, from 0.
    realisations : int
        How many there are.
    width : float
        Width of a bin (degrees), a whole fraction of 360.
    """
    bins = round(360.0 / width) if width > 0.0 else 0
    if bins < 1 or abs(bins * width - 360.0) > 1e-9:
        raise InputError(f"bins of {width} degrees, needed: a whole fraction of 360, such as 1")
    outward = hits["direction"] > 0
    hits, row = hits[outward], realisation[outward]
    bins_of = row * bins + np.minimum((hits["azimuth"] / 360.0 * bins).astype(np.int64), bins - 1)
    shape = (realisations, bins)
    number = np.bincount(bins_of, minlength=realisations * bins)

    def total(name: str) -> NDArray[np.float64]:
        sums = np.bincount(bins_of, weights=hits[name], minlength=realisations * bins)
        return np.asarray(sums.reshape(shape), dtype=np.float64)

    def largest(name: str) -> NDArray[np.float64]:
        found = np.zeros(realisations * bins)
        np.maximum.at(found, bins_of, hits[name])
        return found.reshape(shape)

    return RingCounts(
        hits=number.reshape(shape).astype(np.int64),
        initial_speed=total("initial_speed"),
        speed=total("speed"),
        largest_initial_speed=largest("initial_speed"),
        largest_speed=largest("speed"),
    )
