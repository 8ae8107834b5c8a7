"""Shape factors k (kg/m3) in the presented area A = (m/k)^(2/3) of a fragment.

For a convex body that tumbles without preference the mean presented area is a quarter of its surface
(Cauchy 1832), so k = m / (S/4)^(3/2) depends on the shape and the density only.
"""

from __future__ import annotations

import math

__all__ = [
    "BOX_5_2_1_STEEL",
    "DEFAULT_SHAPE_FACTOR",
    "FORGED_STEEL_SHELL",
    "HEAVY_PIECES_OF_STACKS",
    "NATURAL_FRAGMENTS_MEAN",
    "box_shape_factor",
    "sphere_shape_factor",
]

FORGED_STEEL_SHELL = 2600.0  # kg/m3; DDESB Technical Paper 12 (1975)
NATURAL_FRAGMENTS_MEAN = 2370.0  # kg/m3; mean over natural fragments
HEAVY_PIECES_OF_STACKS = 4740.0  # kg/m3; chunky pieces from stacks
BOX_5_2_1_STEEL = 3147.0  # kg/m3; tumbling 5:2:1 box of 7800 kg/m3, A = 8.5 (m/(10 rho))^(2/3)
DEFAULT_SHAPE_FACTOR = FORGED_STEEL_SHELL


def box_shape_factor(density: float, length: float, width: float, height: float) -> float:
    """Shape factor (kg/m3) of a tumbling rectangular box of a density (kg/m3); only the ratios of the edges matter."""
    quarter_surface = 0.5 * (length * width + width * height + height * length)
    return density * length * width * height / quarter_surface**1.5


def sphere_shape_factor(density: float) -> float:
    """Shape factor (kg/m3) of a sphere of a density (kg/m3): A is then pi d^2 / 4 exactly."""
    return density * (math.pi / 6.0) / (math.pi / 4.0) ** 1.5
