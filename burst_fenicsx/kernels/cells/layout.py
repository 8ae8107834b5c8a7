"""Rows of the scratch of a block, `LANES` doubles each: what one loop over the lanes leaves to the next.

Each name has rows of its own, at constant distances, so the compiler sees that no two overlap; the nodal forces alone
take the place of the velocities, when these are used no more.
"""

from __future__ import annotations


class _Rows:
    """Hands out rows one after the other."""

    taken = 0

    def __call__(self, number: int = 1) -> int:
        self.taken += number
        return self.taken - number


_rows = _Rows()

# Of all cells.
MASS, VOLUME, OLD_VOLUME = _rows(), _rows(), _rows()  # kg; m3 after and before the step
MIN_VOLUME = _rows()  # smallest volume that a point of the cell stands for, m3
POSITION, VELOCITY = _rows(24), _rows(24)  # of the nodes, m and m/s; of a hexahedron soon their modes
RATE, DILATATION = _rows(9), _rows()  # velocity gradient at the point in hand, and mean rate of the volume, 1/s
STRESS = _rows(6)  # at the point in hand, Pa; of a charge the deviator of its unreacted part
PRESSURE = _rows()  # taken off the stress besides viscosity: the products' after venting, Pa; zero in metal
SOUND, FASTEST = _rows(), _rows()  # sound speed, and the one that the step must allow for, m/s
LENGTH, FREQUENCY = _rows(), _rows()  # that governs the stable step, m, and its inverse, 1/m
DENSITY = _rows()  # kg/m3
VISCOUS, OLD_VISCOUS = _rows(), _rows()  # artificial viscous pressure after and before the step, Pa
STABLE = _rows()  # stable step, s
FORCE = VELOCITY  # nodal forces, N, where the velocities were: the fewer rows, the more of them stay in the cache
HEAT, PLASTIC = _rows(), _rows()  # work of the viscosity and of the plastic strains in the step, J

# Of hourglass control.
HOURGLASS_MODES = tuple(POSITION + 3 * mode for mode in (3, 5, 6, 7))  # of a hexahedron's positions, m
GRADIENT = _rows(18)  # of the volume by the nodes' positions, as `hexahedron.cell_gradient` gives it, m2
GRADIENT_SQUARES = _rows(3)  # squares of the norms of the mean gradient over the nodes over the volume, 1/m2
HOURGLASS_RATE = _rows(12)  # of the modes, m/s
HOURGLASS_STORED = _rows(12)  # elastic forces that a cell stores, or the element's `STORED_ROWS`, N
HOURGLASS_FORCE = _rows(12)  # generalised forces against the modes, N
DAMPING, SPRING = _rows(), _rows()  # coefficients: of the dashpots; of the springs times the step, N s/m
COEFFICIENT_LIMIT = _rows(4)  # upper limit of the coefficients for each mode, N s/m
HOURGLASS_POWER = _rows()  # W

# Of metal.
SHEAR_STRAIN, VOLUME_STRAIN = _rows(), _rows()  # plastic, at the point in hand
SOFTENING = _rows()  # inverse factor on the limit strains
DISSIPATION = _rows()  # in this step, J/m3
STRENGTH = _rows()  # largest shear strength of the points done, Pa

# Of a charge.
OLD_DEVIATOR = _rows(6)  # of the unreacted charge before the step, Pa
OLD_GAS_PRESSURE, GAS_PRESSURE = _rows(), _rows()  # of the whole cell before venting, Pa
BURN = _rows()  # burnt fraction
BY_COMPRESSION = _rows()  # burnt fraction over the compression
GAS_ENERGY = _rows()  # internal energy of the products, J/m3 of initial volume
LEAKAGE = _rows()  # factor on the pressure
GAS_STIFFNESS = _rows()  # -V dP/dV, Pa
DEVIATOR_POWER = _rows()  # W/m3
GAS_WORK, GAS_HEAT = _rows(), _rows()  # of the pressure and of the viscosity in the step, J

# Of a ring.
BR, BZ, HOOP = _rows(4), _rows(4), _rows(4)  # see `axisymmetric.quadrilateral`, m2
INVERSE_SHARE = _rows(4)  # inverse of the cell's share of its nodes' masses, 1/kg
MODE_R, MODE_Z = _rows(), _rows()  # hourglass mode of the positions, m
AREA = _rows()  # of the quadrilateral, m2
GAMMA_SQUARE = _rows()  # sum over the nodes of gamma^2 times the inverse share, 1/kg

# Of a hexahedron with several points.
POINTS_POSITION, POINTS_VELOCITY = _rows(21), _rows(21)  # an eighth of the modes 1 to 7, m and m/s
POINTS_FORCE = _rows(21)  # modes 1 to 7 of the nodal forces, an eighth of a N
POINTS_COFACTOR = _rows(9)  # of the Jacobian at the point, m2
POINTS_DETERMINANT, POINTS_MIDDLE = _rows(), _rows()  # volume of the point, m3; the same half a step ago
POINTS_TENSION, POINTS_PLASTIC = _rows(), _rows()  # sums: mean stress times volume, plastic work, J

ENERGY = _rows()  # not by lanes: five sums, J, see `Totals`; then smallest stable step, smallest volume and its cell
SCRATCH_ROWS = _rows.taken
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
