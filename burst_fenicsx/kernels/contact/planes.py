"""Rigid planes: nodes pushed back to the side on which the rounds stand, with friction."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.contact.coulomb import pressed_spring
from burst_fenicsx.kernels.lanes import kernel
from burst_fenicsx.kernels.threads import on_threads
from burst_fenicsx.kernels.vectors.exact import quantise
from burst_fenicsx.kernels.vectors.transposition import address, prefetch

__all__ = ["PlaneLaw", "PlaneState", "nodes_near", "plane_sums", "push_from_plane"]

_AHEAD, _NODE_BYTES = 16, np.uint64(24)  # nodes lie scattered: what comes later is fetched now


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
def nodes_near(normal: np.ndarray, level: float, state: PlaneState, position: np.ndarray) -> np.ndarray:
    """The state's nodes (k,) int32 that lie below a `level` (m) along the plane's normal, or touch the plane."""
    near, count = np.empty(state.node.size, dtype=np.int32), 0
    start = address(position)
    for k in range(state.node.size):
        node = state.node[k]
        prefetch(start + _NODE_BYTES * np.uint64(state.node[min(k + _AHEAD, state.node.size - 1)]))
        height = position[node, 0] * normal[0] + position[node, 1] * normal[1] + position[node, 2] * normal[2]
        if height < level or state.stiffness[k] > 0.0:
            near[count] = k
            count += 1
    return near[:count].copy()


@kernel
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
    on_threads(near.size, _push_some, (law, near, state, mass, position, velocity, force))


@kernel
def _push_some(
    first: int,
    last: int,
    law: PlaneLaw,
    near: np.ndarray,
    state: PlaneState,
    mass: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    force: np.ndarray,
) -> None:
    nodes, stiffness = state.node, state.stiffness
    nx, ny, nz = law.normal[0], law.normal[1], law.normal[2]
    start = address(position)
    for index in range(first, last):
        k = near[index]
        node = nodes[k]
        prefetch(start + _NODE_BYTES * np.uint64(nodes[near[min(index + _AHEAD, near.size - 1)]]))
        depth = law.level - position[node, 0] * nx - position[node, 1] * ny - position[node, 2] * nz
        if depth > 0.0:
            _push_node(k, depth, law, state, mass, velocity, force)
        elif stiffness[k] > 0.0:
            _release(k, state)


@kernel
def plane_sums(
    normal: np.ndarray, interior: int, near: np.ndarray, state: PlaneState, work_rounding: float, force_rounding: float
) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Energies (2,) in J, force (3,) in N, largest penetration (m) of all `near` nodes and of the `interior` ones.

    The latter are those of the state from there on; energies and forces are rounded by `quantise`, so that the sums are
    exact.
    """
    energies, force, deepest, within = np.zeros(2), np.zeros(3), 0.0, 0.0
    for k in near:
        if state.stiffness[k] > 0.0:
            depth = state.penetration[k]
            for i in range(2):
                energies[i] += quantise(state.energies[k, i], work_rounding)
            for i in range(3):
                force[i] += quantise(state.stiffness[k] * (depth * normal[i] - state.slip[k, i]), force_rounding)
            deepest = max(deepest, depth)
            within = max(within, depth) if k >= interior else within
    return energies, force, deepest, within


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
    normal = (law.normal[0], law.normal[1], law.normal[2])
    stiffness = law.stiffness * mass[node]
    old_slip = (state.slip[k, 0], state.slip[k, 1], state.slip[k, 2])
    v = (velocity[node, 0], velocity[node, 1], velocity[node, 2])
    push, slip, state.energies[k, 0], state.energies[k, 1] = pressed_spring(
        depth, normal, v, law.step, law.friction, stiffness, old_slip, state.stiffness[k]
    )
    state.penetration[k] = depth
    state.stiffness[k] = stiffness
    for i in range(3):
        state.slip[k, i] = slip[i]
        force[node, i] += push[i]
