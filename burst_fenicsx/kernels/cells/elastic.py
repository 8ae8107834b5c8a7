"""Linear elasticity of a cell that turns: moduli, energy, and the objective trial stress (Hughes and Winget 1980)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from burst_fenicsx.kernels.lanes import lane_function
from burst_fenicsx.kernels.vectors.tensors import Matrix, Symmetric, apply, dot, fma

if TYPE_CHECKING:
    import numpy as np


@lane_function
def moduli(parameters: np.ndarray) -> tuple[float, float]:
    """Shear modulus and Lame's first parameter (Pa)."""
    shear = 0.5 * parameters[0] / (1.0 + parameters[1])
    return shear, 2.0 * shear * parameters[1] / (1.0 - 2.0 * parameters[1])


@lane_function
def elastic_energy(stress: Symmetric, parameters: np.ndarray) -> float:
    """Elastic energy by volume (J/m3) of a stress (Pa)."""
    xx, yy, zz, xy, yz, zx = stress
    square = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + zx * zx)
    trace = xx + yy + zz
    return 0.5 * (((1.0 + parameters[1]) * square - parameters[1] * trace * trace) / parameters[0])


@lane_function
def spin(rate: Matrix, step: float) -> Matrix:
    """Rotation of the step after Hughes and Winget (1980): Q = (1 - w/2)^-1 (1 + w/2), w = spin times step.

    Exact for a rigid rotation of any size below half a turn, because the velocity gradient `rate` (1/s) is taken on the
    mid-step configuration.
    """
    # Half the rotation vector of w.
    x = 0.25 * step * (rate[2][1] - rate[1][2])
    y = 0.25 * step * (rate[0][2] - rate[2][0])
    z = 0.25 * step * (rate[1][0] - rate[0][1])
    xx, yy, zz = x * x, y * y, z * z
    f = 2.0 / (1.0 + xx + yy + zz)
    fx, fy, fz = f * x, f * y, f * z
    return (
        (1.0 - f * (yy + zz), fx * y - fz, fz * x + fy),
        (fx * y + fz, 1.0 - f * (zz + xx), fy * z - fx),
        (fz * x - fy, fy * z + fx, 1.0 - f * (xx + yy)),
    )


@lane_function
def elastic_trial(
    stress: Symmetric, rotation: Matrix, rate: Matrix, step: float, lame: float, shear: float
) -> Symmetric:
    """Rotate a stress and add the elastic increment: Q sigma Q^T + lambda tr(de) 1 + 2 G de.

    `stress` in Pa; `rate` is the velocity gradient (1/s); `lame` and `shear` moduli (Pa).
    """
    xx, yy, zz, xy, yz, zx = stress
    whole = ((xx, xy, zx), (xy, yy, yz), (zx, yz, zz))
    qx, qy, qz = rotation
    # The stress is symmetric, so its products with the rows of Q are the rows of Q sigma.
    ax, ay, az = apply(whole, qx), apply(whole, qy), apply(whole, qz)
    twice, half = 2.0 * shear * step, shear * step
    pressure = lame * step * (rate[0][0] + rate[1][1] + rate[2][2])
    return (
        dot(ax, qx) + fma(twice, rate[0][0], pressure),
        dot(ay, qy) + fma(twice, rate[1][1], pressure),
        dot(az, qz) + fma(twice, rate[2][2], pressure),
        fma(half, rate[0][1] + rate[1][0], dot(ax, qy)),
        fma(half, rate[1][2] + rate[2][1], dot(ay, qz)),
        fma(half, rate[2][0] + rate[0][2], dot(az, qx)),
    )
