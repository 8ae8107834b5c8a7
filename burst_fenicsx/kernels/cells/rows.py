"""Rows of the scratch of a block, `LANES` doubles each: what one loop over the lanes leaves to the next.

Since all rows lie at constant distances, the compiler sees that they do not overlap. Rows are reused once what they
hold has been used, so that fewer stay in the cache: the nodal forces take the place of the positions, the material's
own rows that of the velocities.
"""

from __future__ import annotations

__all__ = [
    "COEFFICIENT_LIMIT",
    "DAMPING",
    "DILATATION",
    "DISSIPATION",
    "FORCE",
    "FREQUENCY",
    "GRADIENT",
    "GRADIENT_SQUARES",
    "HOURGLASS_MODES",
    "HOURGLASS_RATE",
    "MASS",
    "MATERIAL",
    "OF_POINTS",
    "POSITION",
    "POWER",
    "RATE",
    "SCRATCH_ROWS",
    "SPRING",
    "STABLE",
    "STORED_FORCE",
    "STRENGTH",
    "STRESS",
    "VELOCITY",
    "VISCOUS",
    "VOLUME",
]

POSITION, VELOCITY = 0, 24  # nodal values, m and m/s
FORCE = 0  # nodal values, N
GRADIENT = 48  # of the volume by the nodes' positions, 18 rows, m2; of a hexahedron as `cell_gradient` gives it
HOURGLASS_MODES = 66  # hourglass modes of the positions, 12 rows, m
RATE = 78  # velocity gradient at the point that the material is asked for, 9 rows, 1/s
HOURGLASS_RATE = 87  # of the modes, 12 rows, m/s
VOLUME = 99  # m3
FREQUENCY = 100  # inverse of the length that governs the stable step, 1/m
GRADIENT_SQUARES = 101  # squares of the norms of the mean gradient over the nodes over the volume, 3 rows, 1/m2
MASS = 104  # kg
VISCOUS, STABLE = 105, 106  # artificial viscous pressure, Pa; stable step, s
DAMPING = 107  # viscous hourglass coefficient, N s/m
COEFFICIENT_LIMIT = 108  # upper limit of it for each mode, 4 rows, N s/m
POWER = 112  # of the hourglass forces, W
DILATATION = 113  # rate of the volume over the volume, mean over the cell, 1/s
OF_POINTS = 114  # first row of a cell with several points, see `eight_points`

MATERIAL = VELOCITY  # first of 24 rows for the material's own, free once the cells have moved
STRESS = MATERIAL  # 6 rows, Pa; of a charge the deviator of its unreacted part
DISSIPATION = MATERIAL + 9  # of a solid in this step, J/m3
SPRING = MATERIAL + 10  # hourglass springs' coefficient times the step, N s/m
STORED_FORCE = MATERIAL + 11  # stored elastic hourglass forces, 12 rows, N
STRENGTH = MATERIAL + 23  # of a solid with several points, the largest shear strength of those done, Pa

SCRATCH_ROWS = 172
"""Rows of `LANES` doubles that a block of any kind needs."""
