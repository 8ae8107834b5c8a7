"""Rows of the scratch of cells with 2x2x2 points, behind those of positions and velocities (see `common`)."""

from __future__ import annotations

__all__ = [
    "COFACTOR",
    "DETERMINANT",
    "DILATATION",
    "ELASTIC",
    "FREQUENCY",
    "GRADIENT",
    "MIDDLE",
    "PLACE",
    "PLASTIC",
    "POWER",
    "SHEAR_STRAIN",
    "SMALLEST",
    "SOFTENING",
    "SPEED",
    "STABLE",
    "STRENGTH",
    "STRESS",
    "SUM",
    "TENSION",
    "VISCOUS",
    "VOLUME",
    "VOLUME_STRAIN",
]

PLACE, SPEED = 48, 69  # an eighth of the modes 1 to 7, 21 rows each, m and m/s
GRADIENT = 90  # of `cell_gradient`, 18 rows, m2
SUM = 108  # modes 1 to 7 of the nodal forces, 21 rows, an eighth of a N
STRESS = 129  # at the point, 6 rows, Pa
SHEAR_STRAIN, VOLUME_STRAIN, SOFTENING = 135, 136, 137
COFACTOR = 138  # 9 rows, m2
DETERMINANT = 147  # volume of the point, m3
MIDDLE = 156  # the same half a step ago
VOLUME, FREQUENCY = 148, 149  # m3, 1/m
DILATATION = 150  # mean over the cell, 1/s
TENSION = 151  # sum over the points of the mean stress times the volume, J
PLASTIC = 152  # plastic work of the step, J
SMALLEST = 153  # eight times the smallest volume of a point, m3
VISCOUS, STABLE = 154, 155  # Pa, s
STRENGTH = 157  # largest shear strength of a point, Pa
ELASTIC = 158  # eight times the elastic energy by volume before the step, J/m3
POWER = 159  # of the hourglass forces, W
