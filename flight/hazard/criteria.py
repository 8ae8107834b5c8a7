"""When a fragment is hazardous, and what density of hazardous fragments is acceptable."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flight.arguments import require_numbers
from flight.errors import InputError

__all__ = ["SHALLOWEST", "Criteria"]

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
        units = {"energy": "J", "density": "1/m2", "person_area": "m2", "person_height": "m"}
        require_numbers("hazard", self, units)
        for name in ("density", "person_area"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise InputError(f"hazard: {name} is {getattr(self, name)}, needed: above zero")
        for name in ("energy", "person_height"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise InputError(f"hazard: {name} is {getattr(self, name)}, needed: zero or more")
