"""Coulomb's friction of a tangential spring, for all contacts: the spring holds up to the limit, beyond it slips."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.lanes import lane_function
from burst_fenicsx.kernels.vectors.tensors import Vector

__all__ = ["add_product", "coulomb_slip", "product", "trial_slip"]


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
