"""Hourglass control of the one-point quadrilateral: viscous, and for solids elastic as well.

The coefficients are chosen so that an hourglass mode decays and oscillates as in a cube of the same size. They are
bounded by what the step lets a cell bear.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.axisymmetric.quadrilateral import AREA, GAMMA_SQUARE
from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.cells.hourglass import resist_mode
from burst_fenicsx.kernels.constants import MOST_DAMPED
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function
from burst_fenicsx.kernels.vectors.tensors import Matrix, Vector, apply, dot, load_vector, scaled, store_vector

__all__ = [
    "bound",
    "dashpots",
    "may_exceed",
    "set_damping",
    "set_stiffness",
    "springs_and_dashpots",
    "turn_stored",
]


@lane_function
def turn_stored(rotation: Matrix, scratch: np.ndarray, lane: int) -> None:
    """Turn the stored elastic force with the cell."""
    store_vector(apply(rotation, load_vector(scratch, at.HOURGLASS_FORCE, lane)), scratch, at.HOURGLASS_FORCE, lane)


@lane_function
def set_damping(viscous: float, sound: float, scratch: np.ndarray, lane: int) -> float:
    """Set the viscous coefficient of a lane from the dimensionless one."""
    damping = viscous * scratch[at.MASS * LANES + lane] * sound * scratch[at.FREQUENCY * LANES + lane]
    scratch[at.DAMPING * LANES + lane] = damping
    return damping


@lane_function
def set_stiffness(fraction: float, modulus: float, step: float, scratch: np.ndarray, lane: int) -> float:
    """Set the spring's coefficient of a lane for a step (s), `modulus` (Pa) that of a plane wave."""
    stiffness = fraction / 9.0 * modulus * step * scratch[at.VOLUME * LANES + lane] / scratch[AREA * LANES + lane]
    scratch[at.SPRING * LANES + lane] = stiffness
    return stiffness


@lane_function
def may_exceed(coefficient: float, per_step: float, scratch: np.ndarray, lane: int) -> bool:  # noqa: ARG001
    """Yes: the limit costs little."""
    return True


@block_kernel
def bound(step: float, needed: bool, scratch: np.ndarray) -> None:  # noqa: ARG001
    """Find the hourglass coefficient that the step (s) lets each cell bear."""
    per_step = 1.0 / step if step > 0.0 else np.inf
    for lane in range(LANES):
        scratch[at.COEFFICIENT_LIMIT * LANES + lane] = per_step / scratch[GAMMA_SQUARE * LANES + lane]


@lane_function
def dashpots(scratch: np.ndarray, lane: int) -> tuple[Vector, float]:
    """Viscous force (N) against the mode and its power (W)."""
    rate = load_vector(scratch, at.HOURGLASS_RATE, lane)
    damping = min(scratch[at.DAMPING * LANES + lane], MOST_DAMPED * scratch[at.COEFFICIENT_LIMIT * LANES + lane])
    return scaled(damping, rate), damping * dot(rate, rate)


@lane_function
def springs_and_dashpots(scratch: np.ndarray, lane: int) -> tuple[Vector, float]:
    """Elastic and viscous force (N) against the mode and its power (W)."""
    return resist_mode(0, scratch, lane)
