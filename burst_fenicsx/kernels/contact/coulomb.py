"""Coulomb's friction of a tangential spring, for all contacts: the spring holds up to the limit, beyond it slips."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.lanes import lane_function
from burst_fenicsx.kernels.vectors.tensors import Vector

__all__ = ["add_product", "coulomb_slip", "pressed_spring", "product", "trial_slip"]


@lane_function
def product(u: Vector, v: Vector) -> float:
    """Scalar product u . v, each term rounded."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@lane_function
def add_product(u: Vector, factor: float, v: Vector) -> Vector:
    """Sum u + k v, each term rounded."""
    return u[0] + factor * v[0], u[1] + factor * v[1], u[2] + factor * v[2]


@lane_function
def trial_slip(slip: Vector, step: float, velocity: Vector, normal: Vector) -> tuple[Vector, float]:
    """Tangential displacement of a spring if nothing slips, and its size (m), Eq. 13.

    Parameters
    ----------
    slip : displacement of the last step (m), turned into today's plane. step : s.
    velocity : of the node against the surface (m/s). normal : unit vector of the surface now.
    """
    trial = add_product(slip, step, velocity)
    trial = add_product(trial, -product(trial, normal), normal)
    return trial, np.sqrt(product(trial, trial))


@lane_function
def coulomb_slip(trial: float, limit: float, stiffness: float, old_stiffness: float, old: float) -> tuple[float, float]:
    """Displacement that a tangential spring keeps (m), and the heat of what slips (J), Eqs. 13-14.

    Parameters
    ----------
    trial : size of the displacement if nothing slipped (m). limit : largest force (N). stiffness : N/m, now.
    old_stiffness, old : those of the last step (N/m, m): the slip's force is the mean of both ends.
    """
    kept = limit / stiffness if stiffness * trial > limit else trial
    heat = 0.5 * (old_stiffness * old + limit) * (trial - kept) if stiffness * trial > limit else 0.0
    return kept, heat


@lane_function
def pressed_spring(
    depth: float,
    normal: Vector,
    velocity: Vector,
    step: float,
    friction: float,
    stiffness: float,
    slip: Vector,
    old_stiffness: float,
) -> tuple[Vector, Vector, float, float]:
    """Force (N) on a node behind a surface, its new slip (m), the spring's energy and friction's heat (J), Eqs. 13-14.

    Parameters
    ----------
    depth : behind the surface (m). normal, velocity, step : as in `trial_slip`. friction : tangent of its angle.
    stiffness : N/m, now. slip, old_stiffness : of the last step (m, N/m).
    """
    trial, length = trial_slip(slip, step, velocity, normal)
    old = np.sqrt(product(slip, slip))
    kept, heat = coulomb_slip(length, friction * stiffness * depth, stiffness, old_stiffness, old)
    shrink = kept / length if kept < length else 1.0
    slip = (shrink * trial[0], shrink * trial[1], shrink * trial[2])
    force = (
        stiffness * (depth * normal[0] - slip[0]),
        stiffness * (depth * normal[1] - slip[1]),
        stiffness * (depth * normal[2] - slip[2]),
    )
    return force, slip, 0.5 * stiffness * (depth * depth + kept * kept), heat
