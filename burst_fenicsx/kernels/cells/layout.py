"""Rows of the scratch of a block, `LANES` doubles each: what one loop over the lanes leaves to the next.

Since all rows lie at constant distances, the compiler sees that they do not overlap. Rows are reused once what they
hold has been used, so that fewer stay in the cache: the nodal forces take the place of the positions, the material's
own rows that of the velocities. Rows of one material or element alone begin with its name.
"""

from __future__ import annotations

POSITION, VELOCITY = 0, 24  # of a hexahedron the modes 1, 2, 4, 3, 5, 6, 7 of its nodes', m and m/s; else nodal values
HOURGLASS_MODES = POSITION + 9  # those of the positions, 12 rows, m
FORCE = 0  # nodal values, N
GRADIENT = 48  # of the volume by the nodes' positions, 18 rows, m2; of a hexahedron as `cell_gradient` gives it
RING = 66  # of a ring's own, 4 rows
OLD_VOLUME, OLD_VISCOUS, HEAT = 70, 71, 72  # before the step, m3 and Pa; work of the viscosity, J
PLASTIC, PRODUCTS_WORK, PRODUCTS_HEAT = 73, 74, 75  # work of the step, J
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

STRESS = VELOCITY  # 6 rows, Pa; of a charge the deviator of its unreacted part

SOLID_SHEAR_STRAIN, SOLID_VOLUME_STRAIN = VELOCITY + 6, VELOCITY + 7  # plastic
SOLID_SOFTENING = VELOCITY + 8  # inverse factor on the limit strains
SOLID_DISSIPATION = VELOCITY + 9  # in this step, J/m3
SPRING = VELOCITY + 10  # hourglass springs' coefficient times the step, N s/m
HOURGLASS_FORCE = VELOCITY + 11  # stored elastic hourglass forces, 12 rows or the element's `STORED_ROWS`, N
SOLID_STRENGTH = VELOCITY + 23  # with several points, the largest shear strength of those done, Pa

CHARGE_OLD_DEVIATOR = VELOCITY + 6  # of the unreacted charge before the step, 6 rows, Pa
CHARGE_OLD_PRESSURE, CHARGE_PRESSURE = VELOCITY + 13, VELOCITY + 14  # of the whole cell before leakage, Pa
CHARGE_BURN = VELOCITY + 15  # burnt fraction
CHARGE_BY_COMPRESSION = VELOCITY + 16  # burnt fraction over the compression
CHARGE_ENERGY = VELOCITY + 17  # internal energy of the products, J/m3 of initial volume
CHARGE_LEAKAGE = VELOCITY + 18  # factor on the pressure
CHARGE_STIFFNESS = VELOCITY + 19  # -V dP/dV, Pa
CHARGE_POWER = VELOCITY + 20  # of the deviator, W/m3

POINTS_SUM = 170  # modes 1 to 7 of the nodal forces, 21 rows, an eighth of a N
POINTS_POSITION, POINTS_VELOCITY = 114, 135  # an eighth of the modes 1 to 7, 21 rows each, m and m/s
POINTS_COFACTOR = 156  # of the Jacobian at the point, 9 rows, m2
POINTS_DETERMINANT, POINTS_MIDDLE = 165, 166  # volume of the point, m3; the same half a step ago
POINTS_TENSION = 167  # sum over the points of the mean stress times the volume, J
POINTS_PLASTIC = 168  # plastic work of the step, J
POINTS_MIN_VOLUME = 169  # eight times the smallest volume of a point, m3

SCRATCH_ROWS = 192
"""Rows of `LANES` doubles that a block of any kind needs."""

SOLID_PARAMETERS = (
    "modulus",
    "poisson",
    "density",
    "linear_viscosity",
    "quadratic_viscosity",
    "hourglass_viscous",
    "hourglass_stiffness",
    "law",
)
"""Columns of the table of solid materials (SI) before those of the law itself; `law` is its number, see `materials`."""

CHARGE_PARAMETERS = (
    "density",
    "unreacted_bulk_modulus",
    "unreacted_shear_modulus",
    "unreacted_strength",
    "linear_viscosity",
    "quadratic_viscosity",
    "hourglass_viscous",
    "detonation_velocity",
    "burn_by_compression",
    "hugoniot_slope",
    "hugoniot_limit",
    "model",
)
"""Columns of the table of explosives (SI) before those of the products; `model` is their number, see `materials`.
`burn_by_compression` is 1/(1 - V_CJ/V0), or 0 for burning by time alone. `hugoniot_limit` is the largest rho/rho0 - 1
up to which the unreacted explosive follows its Hugoniot."""

SOLID_OWN, CHARGE_OWN = len(SOLID_PARAMETERS), len(CHARGE_PARAMETERS)
"""First column of the law's, and of the products' own constants."""
