"""The hazard distance: the distance beyond which the expected density of hazardous fragments stays acceptable.

The acceptable density is about the expected number per area, so the density is the mean over realisations, never the
largest of many small counts. Two densities are estimated, on the ground and normal to the paths; the distance is the
larger of the two: a person is not to be exposed by either.

Density. Over distance it is estimated by local likelihood with a log-linear model and a Gaussian kernel of `RADIAL` in
ln r: with M the number of fragments per ln r, smoothed by the kernel to S, the estimate is S exp(-(h S'/S)^2 / 2)
(Hjort and Jones 1996), which has no bias where the density is a power of the distance. Over azimuth, where directions
differ, it is smoothed by a raised cosine whose half-width is an input. The distance of the smoothed field's worst
direction is what is estimated; symmetric directions are counted together.

Worst direction. The largest of estimates is too large on average. So the direction is also chosen on nine tenths of the
realisations and the density taken from the other tenth, ten times over (cross-fitting): that distance is too small on
average, as the direction chosen need not be the worst. The distance reported is the mean of both, and half of their
difference bounds its bias (`max_bias`).

Certainty. Standard error and one-sided 95 % bound come from the bootstrap over realisations (Efron 1979), or over
groups of neighbouring ones, with Student's factor for their number, in ln r.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flight.arguments import require_number
from flight.errors import InputError
from flight.hazard.density.distance import ExpectedDistance
from flight.hazard.density.estimate import Estimate
from flight.hazard.density.groups import DensityGroups

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["expected_distance"]

DRAWS = 1000


def expected_distance(
    groups: DensityGroups, limit: float, *, draws: int = DRAWS, seed: int = 0, every_direction: bool = True
) -> ExpectedDistance:
    """Estimate the distance at which the expected density falls below `limit` (1/m2) for the last time.

    Parameters
    ----------
    groups : DensityGroups
        Fields of the realisations.
    limit : float
        Acceptable density (1/m2).
    draws : int
        Of the bootstrap.
    seed : int
        Of the bootstrap.
    every_direction : bool
        Bounds of every direction and of the density too, not of the distance alone.

    Raises
    ------
    InputError
        There is no realisation.
    """
    require_number("hazard", "limit", limit, "1/m2")
    if not groups.realisations:
        raise InputError("hazard: no realisation to assess")
    return Estimate(groups, limit, draws, seed).result(every_direction=every_direction)
