"""Pressure of a charge's cells: products by Landau and Stanyukovich or by JWL, and the unreacted explosive's Hugoniot.

Also the columns of the table of explosives, and the rows of scratch that cells of a charge have of their own.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.cells.rows import MASS, MATERIAL, VOLUME
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function, widest_vectors

__all__ = [
    "BURN",
    "BY_COMPRESSION",
    "CONTENT",
    "HELD",
    "LEAKAGE",
    "OLD_DEVIATOR",
    "OLD_PRESSURE",
    "OLD_VOLUME",
    "PARAMETERS",
    "PRESSURE",
    "STIFFNESS",
    "burn_by_compression",
    "press_by_jwl",
    "press_by_landau",
]

PARAMETERS = (
    "density",
    "unreacted_bulk_modulus",
    "unreacted_shear_modulus",
    "unreacted_strength",
    "linear_viscosity",
    "quadratic_viscosity",
    "hourglass_viscous",
    "detonation_velocity",
    "burn_by_compression",
    "model",
    "P0",
    "Pk",
    "Vk",
    "A",
    "B",
    "R1",
    "R2",
    "omega",
    "hugoniot_slope",
    "hugoniot_limit",
)
"""Columns of the table of explosives (SI). `model` is 0 for an isentrope of Landau and Stanyukovich (P0, Pk, Vk), 1 for
Jones-Wilkins-Lee (A to omega). `burn_by_compression` is 1/(1 - V_CJ/V0), or 0 for burning by time alone.
`hugoniot_limit` is the largest rho/rho0 - 1 up to which the unreacted explosive follows its Hugoniot."""

OLD_DEVIATOR = MATERIAL + 6  # of the unreacted charge before the step, 6 rows, Pa
OLD_VOLUME = MATERIAL + 12  # m3
OLD_PRESSURE, PRESSURE = MATERIAL + 13, MATERIAL + 14  # of the whole cell before leakage, Pa
BURN = MATERIAL + 15  # burnt fraction
BY_COMPRESSION = MATERIAL + 16  # burnt fraction over the compression
CONTENT = MATERIAL + 17  # internal energy of the products, J/m3 of initial volume
LEAKAGE = MATERIAL + 18
STIFFNESS = MATERIAL + 19  # -V dP/dV, Pa
HELD = MATERIAL + 20  # power of the deviator, W/m3


@lane_function
def _inverse_cube_root(x: float) -> np.float64:
    """x^(-1/3) by Newton's iteration from a guess made on the exponent; vectorises where a power does not."""
    bits = np.float64(x).view(np.int64)
    third = (bits >> 2) + (bits >> 4) + (bits >> 6) + (bits >> 8) + (bits >> 10) + (bits >> 12) + (bits >> 14)
    y = np.int64(6142909891733356544 - third).view(np.float64)
    for _ in range(5):
        y *= (4.0 - x * y * y * y) * (1.0 / 3.0)
    return y


@block_kernel
def burn_by_compression(material: np.ndarray, scratch: np.ndarray) -> None:
    """Burn the cells as far as their compression burns them."""
    widest_vectors()
    for lane in range(LANES):
        relative = scratch[VOLUME * LANES + lane] * material[0] / scratch[MASS * LANES + lane]
        compressed = scratch[BY_COMPRESSION * LANES + lane] * (1.0 - relative)
        scratch[BURN * LANES + lane] = max(scratch[BURN * LANES + lane], min(compressed, 1.0))


@lane_function
def _mix(
    relative: float, products: float, stiffness: float, material: np.ndarray, scratch: np.ndarray, lane: int
) -> None:
    """Pressure and stiffness (Pa) of a cell at V/V0 from those of its products and of its unreacted part."""
    xi = scratch[BURN * LANES + lane]
    pressure, slope = _unreacted(relative, material)
    unreacted_stiffness = slope / relative + 4.0 / 3.0 * material[2]
    scratch[PRESSURE * LANES + lane] = xi * products + (1.0 - xi) * pressure
    scratch[STIFFNESS * LANES + lane] = xi * stiffness + (1.0 - xi) * unreacted_stiffness


@lane_function
def _unreacted(relative: float, material: np.ndarray) -> tuple[float, float]:
    """Pressure of the unreacted explosive at V/V0 and its slope over rho/rho0 - 1 (Pa).

    On the Hugoniot of shocks of speed U = c0 + s u, with mu = rho/rho0 - 1: P = K mu (1 + mu) / (1 - (s - 1) mu)^2,
    beyond the limit, before its pole, on its tangent. Pressed explosive parts in tension at about its strength.
    """
    mu = 1.0 / relative - 1.0
    on_curve = min(max(mu, 0.0), material[19])
    inverse = 1.0 / (1.0 - (material[18] - 1.0) * on_curve)
    squared = material[1] * (inverse * inverse)
    slope = squared * inverse * (1.0 + (material[18] + 1.0) * on_curve)
    pressure = squared * (on_curve * (1.0 + on_curve)) + slope * (mu - on_curve)
    return max(pressure, -material[3]), slope


@block_kernel
def press_by_landau(material: np.ndarray, scratch: np.ndarray) -> None:
    """Pressure of the products on the isentrope of Landau and Stanyukovich, mixed with that of the unreacted part."""
    widest_vectors()
    p0, pk, inverse_knee = material[10], material[11], 1.0 / material[12]
    for lane in range(LANES):
        v = scratch[VOLUME * LANES + lane] * material[0] / scratch[MASS * LANES + lane]
        root = _inverse_cube_root(v * inverse_knee)
        squared = root * root
        inverse = 1.0 / v
        dense = v < material[12]
        p = p0 * (inverse * inverse * inverse) if dense else pk * (squared * squared)
        _mix(v, p, 3.0 * p if dense else 4.0 / 3.0 * p, material, scratch, lane)


@block_kernel
def press_by_jwl(material: np.ndarray, scratch: np.ndarray) -> None:
    """Pressure of Jones, Wilkins and Lee with its own internal energy, mixed with that of the unreacted part.

    dE = -P dV per initial volume, P the mean over the step of what the whole cell exerts (products and unreacted part);
    P is linear in E, so the implicit step is solved directly.
    """
    widest_vectors()
    a, b, r1, r2, omega = material[13], material[14], material[15], material[16], material[17]
    for lane in range(LANES):
        per_volume = material[0] / scratch[MASS * LANES + lane]
        v = scratch[VOLUME * LANES + lane] * per_volume
        xi = scratch[BURN * LANES + lane]
        change = v - scratch[OLD_VOLUME * LANES + lane] * per_volume
        e1, e2 = a * np.exp(-r1 * v), b * np.exp(-r2 * v)
        cold = (1.0 - omega / (r1 * v)) * e1 + (1.0 - omega / (r2 * v)) * e2
        others = scratch[OLD_PRESSURE * LANES + lane] + (1.0 - xi) * _unreacted(v, material)[0]
        rest = scratch[CONTENT * LANES + lane] - 0.5 * others * change
        p = max((cold + omega * rest / v) / (1.0 + 0.5 * xi * omega * change / v), 0.0)
        e = rest - 0.5 * xi * p * change
        scratch[CONTENT * LANES + lane] = e
        slope = e1 * (r1 * v - omega - omega / (r1 * v)) + e2 * (r2 * v - omega - omega / (r2 * v))
        # On the isentrope.
        _mix(v, p, max(slope + omega * (e / v + p), p), material, scratch, lane)
