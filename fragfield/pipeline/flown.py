"""What flights begin with, and what those of all realisations give."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from flight import FlightResult, Fragments, HeightMap
    from flight.hazard.ensemble import EnsembleHazard
    from flight.hazard.pool import Completeness
    from fragfield.case.conversion.turned import Turned
    from fragfield.results.hazard import FlownAttitude
    from fragfield.results.site import ExposedSite


_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class FlownEnsemble:
    """What the flights of all realisations gave."""

    first: FlightResult | None
    """The first realisation's flight, row by row; None where none was flown."""
    hazard: EnsembleHazard
    """Over all."""
    witnesses: dict[str, NDArray[Any]]
    """dict from a surface's name to (n, s) arrays of flight.hazard.density.sectors.SECTOR_HITS: hits by realisation and
    sector, of the realisations that are kept."""
    completeness: Completeness
    """How the flights of all fragments ended."""
    more: bool
    """Whether more realisations could be made."""
    exposed: Sequence[ExposedSite]
    """What the exposed sites of the case meet."""
    flights: int
    """Realisations flown, in all attitudes."""
    attitude: Turned | None = None
    """The worst one of mixed attitudes, to which all else belongs."""
    curve: Sequence[FlownAttitude] = ()
    """Distances over mixed attitudes."""
    not_integrated_because: str = ""
    """Why the distance is no integral over a table of points; empty where it is."""


def above_ground(fragments: Fragments, ground: float | HeightMap, *, warn: bool = True) -> Fragments:
    """Fragments on or above the ground: a burst without a plane there may have driven a casing into it."""
    x, y, z = fragments.position.T
    height = np.full(len(z), ground) if isinstance(ground, float) else ground.at(x, y)
    below = z < height
    if not below.any():
        return fragments
    if warn:
        _log.warning(
            "%d fragments (%.3g kg) were up to %.3g m below the ground at the end of the burst; they start on "
            "its surface",
            int(below.sum()), float(fragments.mass[below].sum()), float((height - z).max()),
            extra={"code": "below_ground"},
        )  # fmt: skip
    position = fragments.position.copy()
    position[:, 2] = np.maximum(z, height)
    return replace(fragments, position=position)
