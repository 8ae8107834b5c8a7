"""Pressure of a charge's cells: the unreacted explosive's Hugoniot, mixed with the products of `materials.products`."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function, widest_vectors

_BULK, _SHEAR, _STRENGTH, _SLOPE, _LIMIT = (
    at.CHARGE_PARAMETERS.index(name)
    for name in (
        "unreacted_bulk_modulus",
        "unreacted_shear_modulus",
        "unreacted_strength",
        "hugoniot_slope",
        "hugoniot_limit",
    )
)


@block_kernel
def burn_by_compression(parameters: np.ndarray, scratch: np.ndarray) -> None:
    """Burn the cells as far as their compression burns them."""
    widest_vectors()
    for lane in range(LANES):
        relative = scratch[at.VOLUME * LANES + lane] * parameters[0] / scratch[at.MASS * LANES + lane]
        compressed = scratch[at.BY_COMPRESSION * LANES + lane] * (1.0 - relative)
        scratch[at.BURN * LANES + lane] = max(scratch[at.BURN * LANES + lane], min(compressed, 1.0))


@lane_function
def mix(
    relative: float, products: float, stiffness: float, parameters: np.ndarray, scratch: np.ndarray, lane: int
) -> None:
    """Pressure and stiffness (Pa) of a cell at V/V0 from those of its products and of its unreacted part."""
    xi = scratch[at.BURN * LANES + lane]
    pressure, slope = unreacted(relative, parameters)
    unreacted_stiffness = slope / relative + 4.0 / 3.0 * parameters[_SHEAR]
    scratch[at.GAS_PRESSURE * LANES + lane] = xi * products + (1.0 - xi) * pressure
    scratch[at.GAS_STIFFNESS * LANES + lane] = xi * stiffness + (1.0 - xi) * unreacted_stiffness


@lane_function
def unreacted(relative: float, parameters: np.ndarray) -> tuple[float, float]:
    """Pressure of the unreacted explosive at V/V0 and its slope over rho/rho0 - 1 (Pa).

    On the Hugoniot of shocks of speed U = c0 + s u, with mu = rho/rho0 - 1: P = K mu (1 + mu) / (1 - (s - 1) mu)^2,
    beyond the limit, before its pole, on its tangent. Pressed explosive parts in tension at about its strength.
    """
    mu = 1.0 / relative - 1.0
    on_curve = min(max(mu, 0.0), parameters[_LIMIT])
    inverse = 1.0 / (1.0 - (parameters[_SLOPE] - 1.0) * on_curve)
    squared = parameters[_BULK] * (inverse * inverse)
    slope = squared * inverse * (1.0 + (parameters[_SLOPE] + 1.0) * on_curve)
    pressure = squared * (on_curve * (1.0 + on_curve)) + slope * (mu - on_curve)
    return max(pressure, -parameters[_STRENGTH]), slope
