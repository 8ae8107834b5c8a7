"""Known shape factors k (kg/m3) in the presented area A = (m/k)^(2/3); `flight.shape` has models that draw them."""

from __future__ import annotations

__all__ = [
    "BOX_5_2_1_STEEL",
    "DEFAULT_SHAPE_FACTOR",
    "FORGED_STEEL_SHELL",
    "HEAVY_PIECES_OF_STACKS",
    "NATURAL_FRAGMENTS_MEAN",
]

FORGED_STEEL_SHELL = 2600.0  # kg/m3; DDESB Technical Paper 12 (1975)
NATURAL_FRAGMENTS_MEAN = 2370.0  # kg/m3; mean over natural fragments
HEAVY_PIECES_OF_STACKS = 4740.0  # kg/m3; chunky pieces from stacks
BOX_5_2_1_STEEL = 3147.0  # kg/m3; tumbling 5:2:1 box of 7800 kg/m3, A = 8.5 (m/(10 rho))^(2/3)
DEFAULT_SHAPE_FACTOR = FORGED_STEEL_SHELL
