"""Rigid planes: nodes pushed back to the side on which the rounds stand, with friction."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from burst_fenicsx.kernels.contact.coulomb import coulomb_slip
from burst_fenicsx.kernels.lanes import kernel, parallel_kernel
from burst_fenicsx.kernels.vectors.exact import quantise
from burst_fenicsx.kernels.vectors.transposition import address, prefetch

__all__ = ["PLANE_SUMS", "PlaneLaw", "PlaneState", "near_plane", "plane_sums", "push_from_plane"]

_RUN = 256  # nodes that one call looks after
_AHEAD, _NODE_BYTES = 16, np.uint64(24)  # nodes lie scattered: what comes later is fetched now
PLANE_SUMS = 10
"""Numbers that `plane_sums` gives."""


class PlaneLaw(NamedTuple):
    """One plane and what holds in this step."""

    normal: np.ndarray  # (3,) unit vector towards the rounds
    level: float  # m, normal times a point of the plane
    stiffness: float  # over a node's mass (1/s2)
    step: float  # s
    friction: float  # tan(phi)


class PlaneState(NamedTuple):
    """The nodes that may meet the plane, and the state of each one's contact."""

    node: np.ndarray  # (nodes,) int32, local
    slip: np.ndarray  # (nodes, 3) m
    penetration: np.ndarray  # (nodes,) m
    stiffness: np.ndarray  # (nodes,) N/m, of the last step
    energies: np.ndarray  # (nodes, 2) J: stored, friction in this step


@kernel
def near_plane(
    normal: np.ndarray, level: float, reach: float, among: np.ndarray, state: PlaneState, position: np.ndarray
) -> tuple[np.ndarray, int]:
    """Nodes `among` (k,) those of the state that lie less than `reach` (m) before the plane or are pushed, in order.

    They are the first of the array (k,) int32; their number goes with it.
    """
    found, count = np.empty(among.size, dtype=np.int32), 0
    start = address(position)
    for place in range(among.size):
        k = among[place]
        node = state.node[k]
        prefetch(start + _NODE_BYTES * np.uint64(state.node[among[min(place + _AHEAD, among.size - 1)]]))
        depth = level - position[node, 0] * normal[0] - position[node, 1] * normal[1] - position[node, 2] * normal[2]
        if depth > -reach or state.stiffness[k] > 0.0:
            found[count] = k
            count += 1
    return found, count


@parallel_kernel
def push_from_plane(
    law: PlaneLaw,
    near: np.ndarray,
    state: PlaneState,
    mass: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    force: np.ndarray,
) -> None:
    """Add the plane's forces (N) on the state's nodes `near` (k,) it to `force` (nodes, 3)."""
    nodes, stiffness = state.node, state.stiffness
    nx, ny, nz = law.normal[0], law.normal[1], law.normal[2]
    parts = near.size // _RUN + 1
    start = address(position)
    for part in numba.prange(parts):
        for place in range(part * near.size // parts, (part + 1) * near.size // parts):
            k = near[place]
            node = nodes[k]
            prefetch(start + _NODE_BYTES * np.uint64(nodes[near[min(place + _AHEAD, near.size - 1)]]))
            depth = law.level - position[node, 0] * nx - position[node, 1] * ny - position[node, 2] * nz
            if depth > 0.0:
                _push_node(k, depth, law, state, mass, velocity, force)
            elif stiffness[k] > 0.0:
                _release(k, state)


@kernel
def plane_sums(
    normal: np.ndarray,
    on_surface: int,
    near: np.ndarray,
    state: PlaneState,
    rounding: float,
    coarse: float,
    fine: float,
) -> np.ndarray:
    """What the plane does to the nodes `near` (k,) it, node by node; the others have nothing.

    Returns (10,): sums of the energies (J), rounded by `quantise` with the constant `rounding`; largest penetration (m)
    of all and of those of the state from `on_surface` on; the force (N) that it gives now in two exact bins (2, 3),
    whose sum it is, with the constants `coarse` and `fine` of `exact.two_constants`.
    """
    sums = np.zeros(PLANE_SUMS)
    for k in near:
        stiffness = state.stiffness[k]
        if not stiffness > 0.0:
            continue
        depth = state.penetration[k]
        for i in range(2):
            sums[i] += quantise(state.energies[k, i], rounding)
        for i in range(3):
            value = stiffness * (depth * normal[i] - state.slip[k, i])
            rounded = quantise(value, coarse)
            sums[4 + i] += rounded
            sums[7 + i] += quantise(value - rounded, fine)
        sums[2] = max(sums[2], depth)
        if k >= on_surface:
            sums[3] = max(sums[3], depth)
    return sums


@kernel
def _release(k: int, state: PlaneState) -> None:
    state.energies[k, :] = 0.0
    state.slip[k, :] = 0.0
    state.penetration[k] = 0.0
    state.stiffness[k] = 0.0


@kernel
def _push_node(
    k: int,
    depth: float,
    law: PlaneLaw,
    state: PlaneState,
    mass: np.ndarray,
    velocity: np.ndarray,
    force: np.ndarray,
) -> None:
    node = state.node[k]
    nx, ny, nz = law.normal[0], law.normal[1], law.normal[2]
    state.energies[k, :] = 0.0
    stiffness = law.stiffness * mass[node]
    vx, vy, vz = velocity[node, 0], velocity[node, 1], velocity[node, 2]
    normal_speed = vx * nx + vy * ny + vz * nz
    sx, sy, sz = state.slip[k, 0], state.slip[k, 1], state.slip[k, 2]
    old, old_slip = state.stiffness[k], np.sqrt(sx * sx + sy * sy + sz * sz)
    tx = sx + law.step * (vx - normal_speed * nx)
    ty = sy + law.step * (vy - normal_speed * ny)
    tz = sz + law.step * (vz - normal_speed * nz)
    length = np.sqrt(tx * tx + ty * ty + tz * tz)
    kept, state.energies[k, 1] = coulomb_slip(length, law.friction * stiffness * depth, stiffness, old, old_slip)
    if kept < length:
        shrink = kept / length
        tx, ty, tz, length = shrink * tx, shrink * ty, shrink * tz, kept
    state.energies[k, 0] = 0.5 * stiffness * (depth * depth + length * length)
    state.slip[k, 0], state.slip[k, 1], state.slip[k, 2] = tx, ty, tz
    state.penetration[k] = depth
    state.stiffness[k] = stiffness
    force[node, 0] += stiffness * (depth * nx - tx)
    force[node, 1] += stiffness * (depth * ny - ty)
    force[node, 2] += stiffness * (depth * nz - tz)
