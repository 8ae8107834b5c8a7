"""The springs of point-face contact: force and friction of one node on its face, and the sums over all (Eqs. 16-18)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.constants import EVEN_SHARING
from burst_fenicsx.kernels.contact.coulomb import pressed_spring
from burst_fenicsx.kernels.lanes import kernel
from burst_fenicsx.kernels.threads import on_threads
from burst_fenicsx.kernels.vectors.exact import quantise
from burst_fenicsx.kernels.vectors.transposition import address, prefetch

__all__ = [
    "CollisionLaw",
    "Collisions",
    "add_reactions",
    "push_node",
    "take_reactions",
    "weigh_corners",
]


_AHEAD, _NODE_BYTES = 16, np.uint64(24)  # nodes lie scattered: the one that comes so many later is fetched now


class CollisionLaw(NamedTuple):
    """What holds for all contacts in this step."""

    max_squared_frequency: float  # 1/s2, stable share of 4 / dt^2: a node's springs over its mass stay below it
    step: float  # s
    friction: float  # tan(phi)


class Collisions(NamedTuple):
    """Pairs of a node and a round whose faces it may meet, and the state of each pair's contact.

    A node between several rounds has a pair with each, and is pushed by each. Nodes are those of the surfaces.
    """

    node: np.ndarray  # (pairs,) int32
    other: np.ndarray  # (pairs,) int32, the round
    first: np.ndarray  # (pairs + 1,) int64 into `candidate`
    candidate: np.ndarray  # int32, faces
    faces: np.ndarray  # (faces, 4) int32
    node_round: np.ndarray  # (nodes,) int32
    edge: np.ndarray  # (faces,) m, square root of the initial area
    near: np.ndarray  # (near faces,) int32, the faces in `candidate`, each once
    ball: np.ndarray  # (faces, 5) of `near`, in this step: the centre (m), radius of a ball around it that holds the
    # face (m), largest speed of a corner (m/s)
    bound: np.ndarray  # (faces, 20) of `near`, in this step, for each corner: the unit normal there and how low and how
    # high the corners lie along it (m, from the centre)
    outward: np.ndarray  # (nodes, 3) unit normals of the nodes' own surfaces at the last search
    sharing: np.ndarray  # (nodes,), sum of reduced masses of a node's contacts in the last step over its own mass
    touching: np.ndarray  # (pairs,) bool
    normal: np.ndarray  # (pairs, 3) of the face touched
    slip: np.ndarray  # (pairs, 3) m, tangential displacement that the spring holds
    penetration: np.ndarray  # (pairs,) m, behind the face
    unloaded: np.ndarray  # (pairs,) m, the part of it that presses nothing
    stiffness: np.ndarray  # (pairs,) N/m, of the last step
    face: np.ndarray  # (pairs,) int32, the face in contact or -1
    weight: np.ndarray  # (pairs, 4), of the face's nodes (Eq. 17)
    push: np.ndarray  # (pairs, 4): force on the node (N), reduced mass (kg)
    energies: np.ndarray  # (pairs, 2) J: stored, friction in this step


@kernel
def weigh_corners(xi: float, eta: float, weight: np.ndarray) -> None:
    """Weights of a face's nodes at a point (Eq. 17)."""
    weight[0] = 0.25 * (1.0 - xi) * (1.0 - eta)
    weight[1] = 0.25 * (1.0 + xi) * (1.0 - eta)
    weight[2] = 0.25 * (1.0 + xi) * (1.0 + eta)
    weight[3] = 0.25 * (1.0 - xi) * (1.0 + eta)


@kernel
def push_node(
    k: int,
    face: int,
    depth: float,
    normal: np.ndarray,
    relative: np.ndarray,
    law: CollisionLaw,
    state: Collisions,
    mass: np.ndarray,
) -> None:
    """Spring and friction of the k-th pair's node against the face that it has entered, and their energies.

    `depth` (m) is what presses behind the face, `normal` the face's, `relative` (m/s) the node's velocity against it.
    """
    node = state.node[k]
    inverse = 1.0 / mass[node]
    sharing = state.sharing[node]
    for corner in range(4):
        other = state.faces[face, corner]
        inverse += state.weight[k, corner] ** 2 / mass[other]
        sharing = max(sharing, state.sharing[other])
    reduced = 1.0 / inverse
    # Where several nodes share one face its springs are softened, so that the step stays stable. By Jensen's inequality
    # the springs' highest frequency is at most twice the largest load.
    stiffness = 0.5 * law.max_squared_frequency * reduced / max(sharing, EVEN_SHARING)
    old_slip = (state.slip[k, 0], state.slip[k, 1], state.slip[k, 2])
    velocity, n = (relative[0], relative[1], relative[2]), (normal[0], normal[1], normal[2])
    force, slip, state.energies[k, 0], state.energies[k, 1] = pressed_spring(
        depth, n, velocity, law.step, law.friction, stiffness, old_slip, state.stiffness[k]
    )
    for i in range(3):
        state.slip[k, i], state.push[k, i], state.normal[k, i] = slip[i], force[i], n[i]
    state.push[k, 3] = reduced
    state.stiffness[k], state.touching[k] = stiffness, True
    state.face[k] = face


@kernel
def add_reactions(state: Collisions, mass: np.ndarray, rounding: float, load_rounding: float, sums: np.ndarray) -> None:
    """Add the contacts' forces and loads to `sums` (nodes, 4), exactly: the order of nodes does not matter.

    Each term is rounded to a multiple of a power of two, so that the sums are exact and those of several ranks agree.
    """
    for k in range(state.node.size):
        face = state.face[k]
        if face < 0:
            continue
        node = state.node[k]
        for corner in range(4):
            other = state.faces[face, corner]
            for i in range(3):
                # The node gets what the face's nodes give, to the last bit.
                push = quantise(state.weight[k, corner] * state.push[k, i], rounding)
                sums[other, i] -= push
                sums[node, i] += push
            load = state.weight[k, corner] * state.push[k, 3] / mass[other]
            sums[other, 3] += quantise(load, load_rounding)
        sums[node, 3] += quantise(state.push[k, 3] / mass[node], load_rounding)


@kernel
def take_reactions(sums: np.ndarray, rows: np.ndarray, local: np.ndarray, load: np.ndarray, force: np.ndarray) -> None:
    """Give the sums (nodes, 4) of the surface nodes `rows` to `load` (nodes,) and to the rows `local` of `force`."""
    on_threads(rows.size, _take_some, (sums, rows, local, load, force))


@kernel
def _take_some(
    first: int,
    last: int,
    sums: np.ndarray,
    rows: np.ndarray,
    local: np.ndarray,
    load: np.ndarray,
    force: np.ndarray,
) -> None:
    start = address(force)
    for k in range(first, last):
        prefetch(start + _NODE_BYTES * np.uint64(local[min(k + _AHEAD, local.size - 1)]))
        load[rows[k]] = sums[rows[k], 3]
        for i in range(3):
            force[local[k], i] += sums[rows[k], i]
