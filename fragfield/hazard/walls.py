"""Whether a wall is shown to stop a fragment: published relations for steel missiles on concrete and on steel.

For protection alone: a fragment counts as stopped only where the relation, within its range and with the margin that
its source asks of a design, says so. Everything else counts as not stopped. The impact is taken as normal to the wall,
the fragment as a cylinder as long as thick, with the sharpest nose of the relation: each makes the wall look weaker.
Masonry is not among the materials: no relation with a range was found at a public source.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from flight.arguments import require_numbers
from flight.errors import InputError
from fragfield_base.inputs import PositiveLength, Quantity

Array = NDArray[np.float64]


FRAGMENT_DENSITY = 7850.0  # kg/m3
SHARPEST = 1.14  # nose factor N of the modified NDRC relation
CONCRETE_MARGIN, STEEL_MARGIN = 1.2, 1.25  # thickness over the limit (BC-TOP-9A, Rev. 2)
DEEPEST = 13.5  # x / d up to which the relation for perforation is given
_INCH, _FOOT_POUND = 0.0254, 1.3558179483

MATERIALS = {
    "concrete": (
        "modified NDRC relation for penetration and its perforation limit (Kennedy, Nucl. Eng. Design 37, 1976; "
        "Bechtel BC-TOP-9A Rev. 2, 1974), thickness 1.2 times the limit; penetration up to 13.5 diameters; fitted to "
        "missiles mostly thicker than fragments; limit and margin quoted at second hand, not checked in the originals"
    ),
    "steel": (
        "Ballistic Research Laboratory's relation for steel plates (Bechtel BC-TOP-9A Rev. 2, 1974), thickness 1.25 "
        "times the limit; mild steel plates and solid steel missiles; at second hand, not checked in the original"
    ),
}


def concrete_limit(mass: Array, speed: Array, diameter: Array, strength: float, nose: float = SHARPEST) -> Array:
    """Thickness of concrete (m) that a steel missile just perforates; infinite beyond the relation's range.

    Parameters
    ----------
    mass, speed, diameter : (n,) float64
        Of the missile (kg, m/s, m).
    strength : float
        Cylinder strength of the concrete (Pa).
    nose : float
        0.72 flat, 0.84 blunt, 1.0 average bullet, 1.14 very sharp.

    Notes
    -----
    G = 3.8e-5 N m v^1.8 / (d^2.8 sqrt(f)); depth x = 2 d sqrt(G) for G <= 1, else d (G + 1); limit over d is
    3.19 x/d - 0.718 (x/d)^2 up to x/d = 1.35, then 1.32 + 1.24 x/d up to 13.5 (Kennedy 1976, in SI).
    """
    g = 3.8e-5 * nose * mass * speed**1.8 / (diameter**2.8 * math.sqrt(strength))
    depth = np.where(g <= 1.0, 2.0 * np.sqrt(g), g + 1.0)
    limit = np.where(depth <= 1.35, 3.19 * depth - 0.718 * depth**2, 1.32 + 1.24 * depth)
    return np.where(depth <= DEEPEST, limit * diameter, np.inf)


def steel_limit(mass: Array, speed: Array, diameter: Array) -> Array:
    """Thickness of a mild steel plate (m) that a steel missile just perforates.

    Notes
    -----
    T = E^(2/3) / (672 D), T and D in inches, E in ft lb (BC-TOP-9A, after the Ballistic Research Laboratory).
    """
    energy = 0.5 * mass * speed**2 / _FOOT_POUND
    return np.asarray(_INCH * energy ** (2.0 / 3.0) / (672.0 * diameter / _INCH))


@dataclass(frozen=True)
class StoppingWall:
    """A wall or roof by which fragments may be shown to be stopped; in SI. The case's tables are made from it."""

    material: Literal["concrete", "steel"]
    """Concrete, by the modified NDRC relation, or mild steel plate, by that of BRL; see the theory of the hazard."""
    thickness: PositiveLength
    """Thickness."""
    strength: Annotated[float, Quantity("Pa", "30 MPa", above=0.0)] = 30e6
    """Cylinder strength of concrete."""

    def __post_init__(self) -> None:
        if self.material not in MATERIALS:
            raise InputError(f"wall: material is {self.material!r}, allowed: {' or '.join(MATERIALS)}")
        require_numbers("wall", self, {"thickness": "m", "strength": "Pa"}, above=0.0)

    def __call__(self, mass: Array, speed: Array) -> NDArray[np.bool_]:
        """Whether fragments of these masses (kg) and speeds (m/s) are shown to be stopped."""
        diameter = np.asarray((4.0 * mass / (math.pi * FRAGMENT_DENSITY)) ** (1.0 / 3.0))  # as long as thick
        if self.material == "concrete":
            needed = CONCRETE_MARGIN * concrete_limit(mass, speed, diameter, self.strength)
        else:
            needed = STEEL_MARGIN * steel_limit(mass, speed, diameter)
        return np.asarray(needed <= self.thickness)

    @property
    def source(self) -> str:
        """Relation, source and range."""
        return MATERIALS[self.material]
