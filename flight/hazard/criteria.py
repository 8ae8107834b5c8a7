"""When a fragment is hazardous, what density of them is acceptable, and the probability of a hit at a density.

A fragment is hazardous with 79 J or more; one hazardous fragment per 55.7 m2 is the acceptable density (DoD 6055.09;
DDESB Technical Paper 12).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flight.arguments import real_array, require_number, require_numbers
from flight.fluence import FluenceGrid

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from flight.fluence import PolarGrid


SHALLOWEST = math.radians(0.01)  # paths closer to level than this count as this steep


@dataclass(frozen=True)
class Criteria:
    """What counts as a hazard: energy (J), density (1/m2), and the person's area (m2) and height (m)."""

    energy: float = 79.0  # 58 ft lb
    density: float = 1.0 / 55.7  # 1 per 600 ft2
    person_area: float = 0.58
    person_height: float = 1.8

    def __post_init__(self) -> None:
        """Refuse criteria that mean nothing."""
        require_numbers("hazard", self, {"density": "1/m2", "person_area": "m2"}, above=0.0)
        require_numbers("hazard", self, {"energy": "J", "person_height": "m"}, low=0.0)

    def fluence_grid(self, grid: PolarGrid) -> FluenceGrid:
        """What `flight.fly` counts for these criteria: paths of hazardous fragments below a person's height."""
        return FluenceGrid(grid, self.energy, self.person_height)


def hit_probability(density: ArrayLike, person_area: float = 0.58) -> NDArray[np.float64]:
    """Probability p = 1 - exp(-q A) of a hit on a person of area A (m2) at a density q normal to the paths (1/m2)."""
    require_number("hazard", "person_area", person_area, "m2")
    return np.asarray(-np.expm1(-person_area * real_array("hazard", "density", density, "1/m2")))
