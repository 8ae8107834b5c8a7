"""When a fragment is hazardous, what density of them is acceptable, and the probability of a hit at a density.

A fragment is hazardous with 79 J or more; one hazardous fragment per 55.7 m2 is the acceptable density (DoD 6055.09;
DDESB Technical Paper 12).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np

from flight.arguments import real_array, require_number, require_numbers
from flight.errors import InputError
from flight.fluence import FluenceGrid
from fragfield_base.bounds import Bounds
from fragfield_base.inputs import ArealDensity, Energy, Quantity

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from flight.fluence import PolarGrid


SHALLOWEST = math.radians(0.01)  # paths closer to level than this count as this steep


@dataclass(frozen=True)
class Criteria:
    """What counts as a hazard; in SI. The case's table [hazard] is made from it."""

    energy: Annotated[Energy, Bounds(1e-3, 1e8, "79 J injures; a car at full speed has 1 MJ", usual=(1.0, 1e5))] = 79.0
    """A fragment with this energy or more at impact is hazardous (58 ft lb)."""
    density: Annotated[
        ArealDensity, Bounds(1e-9, 1e4, "acceptable densities lie near one on 56 m^2", usual=(1e-4, 1.0))
    ] = 1.0 / 55.7
    """Acceptable number of hazardous fragments per area (one per 600 ft2)."""
    person_area: Annotated[
        float, Quantity("m^2", "0.58 m^2", above=0.0), Bounds(1e-3, 100.0, "areas of persons", usual=(0.1, 2.0))
    ] = 0.58
    """Area of a person that a fragment may hit."""
    person_height: Annotated[
        float, Quantity("m", "1.8 m", minimum=0.0), Bounds(0.0, 10.0, "heights of persons", usual=(0.0, 2.5))
    ] = 1.8
    """Height of a person: a fragment passing lower may hit."""

    def __post_init__(self) -> None:
        """Refuse criteria that mean nothing."""
        require_numbers("hazard", self, {"density": "1/m2", "person_area": "m2"}, above=0.0)
        require_numbers("hazard", self, {"energy": "J", "person_height": "m"}, low=0.0)

    def fluence_grid(self, grid: PolarGrid) -> FluenceGrid:
        """What `flight.fly` counts for these criteria: paths of hazardous fragments below a person's height."""
        return FluenceGrid(grid, self.energy, self.person_height)


def hit_probability(density: ArrayLike, person_area: float = 0.58) -> NDArray[np.float64]:
    """Probability p = 1 - exp(-q A) of a hit on a person of area A (m2) at a density q normal to the paths (1/m2).

    Raises InputError: a density or an area is below zero or not a number.
    """
    require_number("hazard", "person_area", person_area, "m2", low=0.0)
    values = real_array("hazard", "density", density, "1/m2")
    if not (values >= 0.0).all():
        raise InputError(f"hazard: density is {values[~(values >= 0.0)].flat[0]:g} 1/m2, needed: zero or more")
    return np.asarray(-np.expm1(-person_area * values))
