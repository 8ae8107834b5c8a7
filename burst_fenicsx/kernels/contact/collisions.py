"""Point-face contact: nodes of one surface pushed out of the faces of another (Eqs. 16-18).

First every node finds, of each round near it, the face that it has entered and the force between them, side by side;
then the forces are added in order, see `springs`. Both surfaces take their turn as nodes and as faces.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.contact.springs import CollisionLaw, Collisions, push_node, weigh_corners
from burst_fenicsx.kernels.geometry.bilinear import bound_faces, closest_point
from burst_fenicsx.kernels.lanes import kernel
from burst_fenicsx.kernels.threads import on_threads

__all__ = ["find_contacts"]

_ENTRY = 1.5  # a node newly met lies no deeper than it can have come in this many steps
_DEEPEST = 0.5  # of the face's initial edge: a node that lies deeper has lost its face
_OFF_RIM = 1.5  # of its depth: a node farther from the face than this is not under it
_BESIDE = 0.1  # of its depth: a node off a rim by less still counts as under the face
_LATE = 0.1  # of the face's initial edge: a node that came in beside a face is taken up where it lies no deeper
_OPPOSED = -0.2  # cosine between a node's own normal and that of a face that it may have entered
_TIE = 1e-9  # distances that differ by less, relatively, are one
_ALIKE = 1e-6  # cosines, and places over the face's initial edge, that differ by less are one
_LIKE = 0.5  # cosine above which a face looks like the one that a node touched before


@kernel
def find_contacts(
    law: CollisionLaw, state: Collisions, position: np.ndarray, velocity: np.ndarray, mass: np.ndarray
) -> None:
    """Find each node's face and the force between them (N) into `state`; places and speeds (nodes, 3), `mass` kg."""
    bound_faces(position, velocity, state.faces, state.near, state.ball, state.bound)
    on_threads(state.node.size, _find_some, (law, state, position, velocity, mass))


@kernel
def _find_some(
    start: int,
    stop: int,
    law: CollisionLaw,
    state: Collisions,
    position: np.ndarray,
    velocity: np.ndarray,
    mass: np.ndarray,
) -> None:
    """Find the contacts of the nodes from `start` to `stop`; a call for every node would cost more than most nodes."""
    corner, trial = np.empty((4, 3)), np.empty(8)
    weight, relative, point = np.empty(4), np.empty(3), np.empty(8)
    faces, edge, candidate = state.faces, state.edge, state.candidate
    ball, bound = state.ball, state.bound
    first, nodes, node_round, others = state.first, state.node, state.node_round, state.other
    energies, push, found, depths = state.energies, state.push, state.face, state.penetration
    for k in range(start, stop):
        node = nodes[k]
        energies[k, 0], energies[k, 1] = 0.0, 0.0
        push[k, 0], push[k, 1], push[k, 2], push[k, 3] = 0.0, 0.0, 0.0, 0.0
        found[k] = -1
        x, y, z = position[node, 0], position[node, 1], position[node, 2]
        speed = np.sqrt(velocity[node, 0] ** 2 + velocity[node, 1] ** 2 + velocity[node, 2] ** 2)
        touching, depth_before, own_round = state.touching[k], depths[k], node_round[node] == others[k]
        best, nearest, unloaded = -1, np.inf, 0.0
        for c in range(first[k], first[k + 1]):
            face = candidate[c]
            # Most candidates are rejected here, without a call: too far from the face's ball, in front, or too deep to
            # have come in by this face. A node above all corners along all four normals is in front of whatever lies
            # between them.
            dx, dy, dz = x - ball[face, 0], y - ball[face, 1], z - ball[face, 2]
            square, reach = dx**2 + dy**2 + dz**2, _DEEPEST * edge[face]
            if square > (ball[face, 3] + reach) ** 2:
                continue
            deepest = _ENTRY * law.step * (speed + ball[face, 4])
            if touching:
                deepest += depth_before + _LATE * edge[face]
            elif not own_round:
                deepest += _LATE * edge[face]
            within = (1.0 + _TIE) * min(_OFF_RIM * min(deepest, reach), nearest)
            if square > (ball[face, 3] + within) ** 2:
                continue
            in_front, too_deep = True, True
            for n in range(0, 20, 5):
                along = dx * bound[face, n] + dy * bound[face, n + 1] + dz * bound[face, n + 2]
                in_front &= along > bound[face, n + 4]
                too_deep &= along < bound[face, n + 3] - deepest
            if in_front or too_deep:
                continue
            for n in range(4):
                for i in range(3):
                    corner[n, i] = position[faces[face, n], i]
            if _lies_beyond(within, dx, dy, dz, square, corner, ball[face]):
                continue
            distance, height = _locate(node, position, corner, trial)
            # Off the face's rim by more than it lies behind it: not under this face at all.
            depth = -height
            if depth <= 0.0 or depth > reach or distance > _OFF_RIM * depth or distance > (1.0 + _TIE) * nearest:
                continue
            if distance >= (1.0 - _TIE) * nearest and not _comes_first(node, face, best, trial, point, edge, state):
                continue
            weigh_corners(trial[0], trial[1], weight)
            _relative_velocity(node, faces[face], weight, velocity, relative)
            free = _unloaded_depth(k, face, depth, trial, relative, law, state)
            if free < np.inf:
                best, nearest, unloaded = face, distance, free
                point[:] = trial
        if best >= 0 and not _outside_beside(k, nearest, state, position, corner, trial, point):
            weigh_corners(point[0], point[1], state.weight[k])
            _relative_velocity(node, state.faces[best], state.weight[k], velocity, relative)
            depth = 0.0
            for i in range(3):
                depth -= (position[node, i] - point[2 + i]) * point[5 + i]
            state.unloaded[k] = unloaded
            push_node(k, best, depth - unloaded, point[5:8], relative, law, state, mass)
            state.penetration[k] = depth
        elif touching:
            state.touching[k], state.penetration[k], state.unloaded[k], state.stiffness[k] = False, 0.0, 0.0, 0.0
            state.slip[k, :] = 0.0


@kernel
def _lies_beyond(
    distance: float, dx: float, dy: float, dz: float, square: float, corner: np.ndarray, ball: np.ndarray
) -> bool:
    """Whether a node is farther than `distance` (m) from a face, as far as its corners (4, 3) show.

    `dx`, `dy`, `dz` lead from the face's centre to the node, `square` is the square of their length: no point of the
    face lies farther along them than some corner.
    """
    farthest = -np.inf
    for n in range(4):
        along = dx * (corner[n, 0] - ball[0]) + dy * (corner[n, 1] - ball[1]) + dz * (corner[n, 2] - ball[2])
        farthest = max(farthest, along)
    apart = square - farthest
    return apart > 0.0 and apart**2 > distance**2 * square


@kernel
def _locate(node: int, position: np.ndarray, corner: np.ndarray, point: np.ndarray) -> tuple[float, float]:
    """Distance from a face and height above it (m); `point` as from `closest_point`."""
    closest_point(position[node, 0], position[node, 1], position[node, 2], corner, point)
    square, height = 0.0, 0.0
    for i in range(3):
        away = position[node, i] - point[2 + i]
        square += away * away
        height += away * point[5 + i]
    return np.sqrt(square), height


@kernel
def _relative_velocity(
    node: int, nodes: np.ndarray, weight: np.ndarray, velocity: np.ndarray, relative: np.ndarray
) -> None:
    """Velocity of a node relative to the point of a face (m/s)."""
    for i in range(3):
        relative[i] = velocity[node, i]
        for n in range(4):
            relative[i] -= weight[n] * velocity[nodes[n], i]


@kernel
def _comes_first(
    node: int, face: int, best: int, trial: np.ndarray, point: np.ndarray, edge: np.ndarray, state: Collisions
) -> bool:
    """Whether of two equally near faces `face`, at `trial`, is taken and not `best`, at `point`: by geometry alone.

    The one that looks more towards the node's own surface; then the one whose centre comes first by x, y, z.
    """
    facing = 0.0
    for i in range(3):
        facing += state.outward[node, i] * (trial[5 + i] - point[5 + i])
    if abs(facing) > _ALIKE:
        return facing < 0.0
    for i in range(3):
        apart = state.ball[face, i] - state.ball[best, i]
        if abs(apart) > _ALIKE * edge[face]:
            return apart < 0.0
    return False


@kernel
def _unloaded_depth(
    k: int, face: int, depth: float, point: np.ndarray, relative: np.ndarray, law: CollisionLaw, state: Collisions
) -> float:
    """The part of a node's depth (m) behind a face that presses nothing; infinite where it does not touch this face.

    A spring may take up only what the node has sunk in since it touched. What it lies deeper, because it came in beside
    the face or has passed to another one, is left unloaded until it comes back.

    An inner node has no normal of its own (`outward` is zero): it may enter any face of another round from the
    front, and is taken up late only while it moves deeper.
    """
    node = state.node[k]
    approach, speed, along, facing, normals = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        approach -= relative[i] * point[5 + i]
        speed += relative[i] * relative[i]
        along += state.normal[k, i] * point[5 + i]
        facing += state.outward[node, i] * point[5 + i]
        normals += abs(state.outward[node, i])
    same_round = state.node_round[node] == state.other[k]
    if state.touching[k] and along > _LIKE:
        sunk = state.penetration[k] + _ENTRY * law.step * np.sqrt(speed)
        if depth <= sunk + _LATE * state.edge[face]:
            return max(min(state.unloaded[k], depth), depth - sunk)
    entered = _ENTRY * law.step * max(approach, 0.0)
    if same_round:
        # Within a round the far side of a thin wall looks the same: the node must have been in front a step ago.
        return 0.0 if depth <= entered else np.inf
    inner = normals == 0.0
    late = (facing < _OPPOSED or (inner and approach > 0.0)) and depth <= _LATE * state.edge[face]
    opposed = facing < 0.0 or inner
    return 0.0 if depth <= entered and opposed else (max(depth - entered, 0.0) if late else np.inf)


@kernel
def _outside_beside(
    k: int,
    nearest: float,
    state: Collisions,
    position: np.ndarray,
    corner: np.ndarray,
    trial: np.ndarray,
    point: np.ndarray,
) -> bool:
    """Whether a node that lies behind a face but off its rim stands in front of a nearer face of the same round."""
    if abs(point[0]) < 1.0 and abs(point[1]) < 1.0:
        return False
    node = state.node[k]
    faces, ball, bound = state.faces, state.ball, state.bound
    x, y, z = position[node, 0], position[node, 1], position[node, 2]
    for c in range(state.first[k], state.first[k + 1]):
        face = state.candidate[c]
        dx, dy, dz = x - ball[face, 0], y - ball[face, 1], z - ball[face, 2]
        square = dx**2 + dy**2 + dz**2
        if square > (ball[face, 3] + (1.0 + _TIE) * nearest) ** 2:
            continue
        behind = True
        for n in range(0, 20, 5):
            behind &= dx * bound[face, n] + dy * bound[face, n + 1] + dz * bound[face, n + 2] < bound[face, n + 3]
        if behind:
            continue
        for n in range(4):
            for i in range(3):
                corner[n, i] = position[faces[face, n], i]
        if _lies_beyond((1.0 + _TIE) * nearest, dx, dy, dz, square, corner, ball[face]):
            continue
        distance, height = _locate(node, position, corner, trial)
        if height > _BESIDE * nearest and distance < nearest:
            return True
    return False
