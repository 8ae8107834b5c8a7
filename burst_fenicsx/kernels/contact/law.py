"""The law of every pair of a node and a facet: spring, gas, bond and friction (Eqs. 12-15).

Products press with the pressure with which their cells act on their nodes, that of the vented products, corrected by a
spring for what is left of the gap (Nitsche's method): the gap then stays a small part of what a spring alone would
need. The correction is bounded by a multiple of that pressure, and products never pull. Unreacted explosive is bonded:
tensile strength, cohesion and friction fade as it burns. Surfaces that collide, and planes, have neither gas nor bond.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.constants import BENT, ENTRY, MOST_CORRECTION
from burst_fenicsx.kernels.lanes import lane_function
from burst_fenicsx.kernels.vectors.tensors import Vector


class Law(NamedTuple):
    """What holds for all pairs of one kind in this step."""

    max_squared_frequency: float  # 1/s2: that of all springs together stays below it
    step: float  # s
    friction: float  # tangent of the friction angle
    tensile_strength: float = 0.0  # Pa, of the unreacted charge's bond
    cohesion: float = 0.0  # Pa


@lane_function
def product(u: Vector, v: Vector) -> float:
    """Scalar product u . v, each term rounded."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@lane_function
def add_product(u: Vector, factor: float, v: Vector) -> Vector:
    """Sum u + k v, each term rounded."""
    return u[0] + factor * v[0], u[1] + factor * v[1], u[2] + factor * v[2]


@lane_function
def vector_product(u: Vector, v: Vector) -> Vector:
    """Vector product u x v, each term rounded."""
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


@lane_function
def spring(
    gas: float,
    bond: float,
    cohesion: float,
    friction: float,
    strength: float,
    gap: float,
    stiffness: float,
    normal: Vector,
    moved: Vector,
    slip: Vector,
    old_stiffness: float,
) -> tuple[Vector, float, Vector, float, float, bool]:
    """Force of a pair's spring on its node, and the spring after the step.

    Parameters
    ----------
    gas : force (N) that presses besides the spring. bond : tension (N) at which it opens, -inf for a node that has left
        its surface. cohesion, strength : N, of the tangential force at no pressure, and at most (Eq. 15).
    gap : m, negative behind the facet (Eqs. 13, 16). normal : of the facet. moved : of the node against it (m).
    stiffness : as much as the step bears (N/m). slip, old_stiffness : of the last step (m, N/m).

    Returns
    -------
    The spring's force (N), its stiffness, the tangential displacement that it keeps (m), its energy and friction in
    this step (J), and whether a bond would hold. All are zero where the two are apart (Eq. 15, 1): what the spring held
    tangentially is then heat.
    """
    press = gas - stiffness * gap  # Eq. 12
    apart = press <= -bond
    trial = add_product(slip, 1.0, moved)  # Eq. 13
    trial = add_product(trial, -product(trial, normal), normal)
    length, old = np.sqrt(product(trial, trial)), np.sqrt(product(slip, slip))
    limit = min(max(cohesion + friction * press, 0.0), strength)
    slides = stiffness * length > limit  # Eq. 15, 2
    kept = limit / stiffness if slides else length
    heat = 0.5 * (old_stiffness * old + limit) * (length - kept) if slides else 0.0
    if apart:
        stiffness, kept, heat = 0.0, 0.0, 0.5 * old_stiffness * old * old
    shrink = kept / length if kept < length else 1.0
    slip = (shrink * trial[0], shrink * trial[1], shrink * trial[2])
    force = add_product((-stiffness * slip[0], -stiffness * slip[1], -stiffness * slip[2]), -stiffness * gap, normal)
    return force, stiffness, slip, 0.5 * stiffness * (gap * gap + kept * kept), heat, not (apart or slides)


@lane_function
def bonded_spring(
    law: Law,
    bonded: bool,
    off: bool,
    burnt: float,
    pressure: float,
    strength: float,
    area: float,
    gap: float,
    stiffness: float,
    normal: Vector,
    moved: Vector,
    slip: Vector,
    old_stiffness: float,
) -> tuple[float, Vector, float, Vector, float, float, bool]:
    """The gas's force (N) on a node of a charge, and the rest as of `spring`, whose arguments are the others'.

    Parameters
    ----------
    bonded, off : whether the bond has held until now; whether the node has left its surface.
    burnt : fraction of the explosive around the node. pressure : of the vented products there (Pa).
    strength : shear strength of the unreacted explosive (Pa): where friction would hold more, it is the explosive that
        yields. area : of the charge's surface that belongs to the contact (m2), Eq. 14.
    """
    unreacted = 1.0 - burnt
    whole = bonded and unreacted > 0.0
    gas = burnt * max(pressure, 0.0) * area
    most, size = MOST_CORRECTION * gas, abs(gap)
    if unreacted == 0.0 and stiffness * size > most:
        stiffness = most / size
    bond = law.tensile_strength * unreacted * area if whole else 0.0
    bond = -np.inf if off else bond
    cohesion = unreacted * law.cohesion * area if whole else 0.0
    force, stiffness, slip, stored, heat, holds = spring(
        gas, bond, cohesion, unreacted * law.friction, unreacted * strength * area, gap, stiffness, normal, moved, slip,
        old_stiffness,
    )  # fmt: skip
    return gas if stiffness > 0.0 else 0.0, force, stiffness, slip, stored, heat, whole and holds


@lane_function
def has_left(beyond: float, gap: float, reach: float, moved: float, met: bool) -> bool:
    """Whether a node has left its surface, for good: it may come back behind it, through its rim.

    Parameters
    ----------
    beyond : how far it lies beyond the rim (m). gap : m. reach : largest of both that a node may have (m).
    moved : how far it has come relative to the surface in this step (m). met : whether it touched before: else it is
        met no deeper than it can have come in, and a little more, since the surface bends.
    """
    entered = ENTRY * moved + BENT * reach
    return beyond > reach or gap < -reach or (not met and gap < -entered)
