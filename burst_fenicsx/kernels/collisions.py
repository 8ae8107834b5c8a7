"""Point-face contact: nodes of one surface pushed out of the faces of another (Eqs. 16-18).

First every node finds the face that it has entered and the force between them, side by side; then the forces are
added in order. Both surfaces of a pair take their turn as nodes and as faces.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from burst_fenicsx.kernels.bilinear import closest_point
from burst_fenicsx.kernels.bounds import bound_faces
from burst_fenicsx.kernels.exact import quantise
from burst_fenicsx.kernels.lanes import kernel, parallel_kernel

__all__ = ["LET_GO", "CollisionLaw", "Collisions", "add_reactions", "find_contacts", "take_reactions"]

LET_GO = -1
"""Mark of a node whose bond has just let go, in `Collisions.touching`."""

_RUN = 64  # nodes that one call looks after
_ENTRY = 1.5  # a node newly met lies no deeper than it can have come in this many steps
_DEEPEST = 0.5  # of the face's initial edge: a node that lies deeper has lost its face
_OFF_RIM = 1.5  # of its depth: a node farther from the face than this is not under it
_BESIDE = 0.1  # of its depth: a node off a rim by less still counts as under the face
_LATE = 0.1  # of the face's initial edge: a node that came in beside a face is taken up where it lies no deeper
_OPPOSED = -0.2  # cosine between a node's own normal and that of a face that it may have entered
_TIE = 1e-9  # distances that differ by less, relatively, are one
_ALIKE = 1e-6  # cosines, and places over the face's initial edge, that differ by less are one
_LIKE = 0.5  # cosine above which a face looks like the one that a node touched before


class CollisionLaw(NamedTuple):
    """What holds for all contacts in this step."""

    budget: float  # of 4 / dt^2 times the stable share (1/s2): a node's springs over its mass stay below it
    step: float  # s
    friction: float  # tan(phi)


class Collisions(NamedTuple):
    """Nodes that look for faces, and the state of each one's contact; nodes are numbered among the surface nodes."""

    node: np.ndarray  # (slaves,) int32
    first: np.ndarray  # (slaves + 1,) int64 into `candidate`
    candidate: np.ndarray  # int32, faces
    faces: np.ndarray  # (faces, 4) int32
    face_body: np.ndarray  # (faces,) int32
    node_body: np.ndarray  # (nodes,) int32
    edge: np.ndarray  # (faces,) m, square root of the initial area
    near: np.ndarray  # (near faces,) int32, the faces in `candidate`, each once
    ball: np.ndarray  # (faces, 5) of `near`, in this step: the middle (m), radius of a ball around it that holds the
    # face (m), largest speed of a corner (m/s)
    bound: np.ndarray  # (faces, 20) of `near`, in this step, for each corner: the unit normal there and how low and how
    # high the corners lie along it (m, from the middle)
    touching: np.ndarray  # (nodes,) int32: 1 + the body touched, 0 for none, LET_GO for what its bond held till now
    normal: np.ndarray  # (nodes, 3) of the face touched
    outward: np.ndarray  # (nodes, 3) unit normals of the nodes' own surfaces at the last search
    slip: np.ndarray  # (nodes, 3) m, tangential displacement that the spring holds
    depth: np.ndarray  # (nodes,) m, behind the face; where its bond has just let go, what it pressed there
    unloaded: np.ndarray  # (nodes,) m, the part of it that presses nothing
    pressed: np.ndarray  # (nodes,) m, the part that did in the last step
    held: np.ndarray  # (nodes,) N/m, stiffness of the last step
    load: np.ndarray  # (nodes,), sum of reduced masses of a node's contacts in the last step over its own mass
    face: np.ndarray  # (slaves,) int32, the face in contact or -1
    weight: np.ndarray  # (slaves, 4), of the face's nodes (Eq. 17)
    push: np.ndarray  # (slaves, 4): force on the node (N), reduced mass (kg)
    booked: np.ndarray  # (slaves, 3) J: stored, friction in this step, change of stiffness in this step


@kernel
def find_contacts(
    law: CollisionLaw, state: Collisions, position: np.ndarray, velocity: np.ndarray, mass: np.ndarray
) -> None:
    """Find each node's face and the force between them (N) into `state`; places and speeds (nodes, 3), `mass` kg."""
    bound_faces(position, velocity, state.faces, state.near, state.ball, state.bound)
    _find_all(law, state, position, velocity, mass)


@parallel_kernel
def _find_all(
    law: CollisionLaw, state: Collisions, position: np.ndarray, velocity: np.ndarray, mass: np.ndarray
) -> None:
    slaves = state.node.size
    parts = slaves // _RUN + 1
    for part in numba.prange(parts):
        first, last = part * slaves // parts, (part + 1) * slaves // parts
        _find_run(first, last, law, state, position, velocity, mass)


@kernel
def _find_run(
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
    faces, face_body, edge, candidate = state.faces, state.face_body, state.edge, state.candidate
    ball, bound = state.ball, state.bound
    first, nodes, node_body, before = state.first, state.node, state.node_body, state.touching
    booked, push, found, depths = state.booked, state.push, state.face, state.depth
    for k in range(start, stop):
        node = nodes[k]
        booked[k, 0], booked[k, 1], booked[k, 2] = 0.0, 0.0, 0.0
        push[k, 0], push[k, 1], push[k, 2], push[k, 3] = 0.0, 0.0, 0.0, 0.0
        found[k] = -1
        x, y, z = position[node, 0], position[node, 1], position[node, 2]
        speed = np.sqrt(velocity[node, 0] ** 2 + velocity[node, 1] ** 2 + velocity[node, 2] ** 2)
        touching, depth_before, own_round = before[node], depths[node], node_body[node] // 2
        best, nearest, unloaded = -1, np.inf, 0.0
        for c in range(first[k], first[k + 1]):
            face = candidate[c]
            # Most candidates are told off here, without a call: too far from the face's ball, in front, or too deep to
            # have come in by this face. A node above all corners along all four normals is in front of whatever lies
            # between them.
            dx, dy, dz = x - ball[face, 0], y - ball[face, 1], z - ball[face, 2]
            square, reach = dx**2 + dy**2 + dz**2, _DEEPEST * edge[face]
            if square > (ball[face, 3] + reach) ** 2:
                continue
            deepest = _ENTRY * law.step * (speed + ball[face, 4])
            if touching == 1 + face_body[face]:
                deepest += depth_before + _LATE * edge[face]
            elif face_body[face] // 2 != own_round:
                deepest += _LATE * edge[face]
            elif touching == LET_GO:
                deepest = np.inf
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
            _weigh(trial[0], trial[1], weight)
            _relative_velocity(node, faces[face], weight, velocity, relative)
            free = _unloaded_depth(node, face, depth, trial, relative, law, state)
            if free < np.inf:
                best, nearest, unloaded = face, distance, free
                point[:] = trial
        if best >= 0 and not _outside_beside(k, best, nearest, state, position, corner, trial, point):
            _weigh(point[0], point[1], state.weight[k])
            _relative_velocity(node, state.faces[best], state.weight[k], velocity, relative)
            depth = 0.0
            for i in range(3):
                depth -= (position[node, i] - point[2 + i]) * point[5 + i]
            state.unloaded[node] = unloaded
            _push(k, best, depth - unloaded, point[5:8], relative, law, state, mass)
            state.depth[node] = depth
            continue
        if touching != 0:
            state.touching[node] = 0
            state.depth[node] = 0.0
            state.unloaded[node] = 0.0
            _begin(node, state)


@kernel
def _begin(node: int, state: Collisions) -> None:
    """Slacken a node's springs: what held it to one body does not hold it to the next."""
    state.slip[node, :] = 0.0
    state.pressed[node] = 0.0
    state.held[node] = 0.0


@kernel
def _lies_beyond(
    distance: float, dx: float, dy: float, dz: float, square: float, corner: np.ndarray, ball: np.ndarray
) -> bool:
    """Whether a node is farther than `distance` (m) from a face, as far as its corners (4, 3) tell.

    `dx`, `dy`, `dz` lead from the face's middle to the node, `square` is the square of their length: no point of the
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

    The one that looks more towards the node's own surface; then the one whose middle comes first by x, y, z.
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
    node: int, face: int, depth: float, point: np.ndarray, relative: np.ndarray, law: CollisionLaw, state: Collisions
) -> float:
    """The part of a node's depth (m) behind a face that presses nothing; infinite where it does not touch this face.

    A spring may take up only what the node has sunk in since it touched. What it lies deeper, because it came in beside
    the face or has passed to another one, is left unloaded until it comes back.
    """
    approach, speed, along, facing = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        approach -= relative[i] * point[5 + i]
        speed += relative[i] * relative[i]
        along += state.normal[node, i] * point[5 + i]
        facing += state.outward[node, i] * point[5 + i]
    own, body = state.node_body[node], state.face_body[face]
    same_round = own // 2 == body // 2
    if state.touching[node] == LET_GO and same_round and own != body and facing < 0.0:
        # What pressed in the bond presses on. It may have slid to where it lies far deeper than the bond had it.
        return max(depth - state.depth[node] - _ENTRY * law.step * np.sqrt(speed), 0.0)
    if state.touching[node] == 1 + body and along > _LIKE:
        sunk = state.depth[node] + _ENTRY * law.step * np.sqrt(speed)
        if depth <= sunk + _LATE * state.edge[face]:
            return max(min(state.unloaded[node], depth), depth - sunk)
    entered = _ENTRY * law.step * max(approach, 0.0)
    if same_round:
        # Within a round the far side of a thin wall looks the same: the node must have been in front a step ago.
        return 0.0 if depth <= entered else np.inf
    late = facing < _OPPOSED and depth <= _LATE * state.edge[face]
    return 0.0 if depth <= entered and facing < 0.0 else (max(depth - entered, 0.0) if late else np.inf)


@kernel
def _outside_beside(
    k: int,
    best: int,
    nearest: float,
    state: Collisions,
    position: np.ndarray,
    corner: np.ndarray,
    trial: np.ndarray,
    point: np.ndarray,
) -> bool:
    """Whether a node that lies behind a face but off its rim stands in front of a nearer face of the same body."""
    if abs(point[0]) < 1.0 and abs(point[1]) < 1.0:
        return False
    node, body = state.node[k], state.face_body[best]
    faces, ball, bound = state.faces, state.ball, state.bound
    x, y, z = position[node, 0], position[node, 1], position[node, 2]
    for c in range(state.first[k], state.first[k + 1]):
        face = state.candidate[c]
        dx, dy, dz = x - ball[face, 0], y - ball[face, 1], z - ball[face, 2]
        square = dx**2 + dy**2 + dz**2
        if square > (ball[face, 3] + (1.0 + _TIE) * nearest) ** 2 or state.face_body[face] != body:
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


@kernel
def _weigh(xi: float, eta: float, weight: np.ndarray) -> None:
    """Weights of a face's nodes at a point (Eq. 17)."""
    weight[0] = 0.25 * (1.0 - xi) * (1.0 - eta)
    weight[1] = 0.25 * (1.0 + xi) * (1.0 - eta)
    weight[2] = 0.25 * (1.0 + xi) * (1.0 + eta)
    weight[3] = 0.25 * (1.0 - xi) * (1.0 + eta)


@kernel
def _push(
    k: int,
    face: int,
    depth: float,
    normal: np.ndarray,
    relative: np.ndarray,
    law: CollisionLaw,
    state: Collisions,
    mass: np.ndarray,
) -> None:
    """Spring and friction of one contact, and what they book."""
    node = state.node[k]
    if state.touching[node] != 1 + state.face_body[face]:
        _begin(node, state)
    inverse = 1.0 / mass[node]
    crowd = state.load[node]
    for corner in range(4):
        other = state.faces[face, corner]
        inverse += state.weight[k, corner] ** 2 / mass[other]
        crowd = max(crowd, state.load[other])
    reduced = 1.0 / inverse
    # Where nodes crowd on one face its springs are softened, so that the step stays stable. By Jensen's inequality the
    # springs' highest frequency is at most twice the largest load; 1.6 is that of two equal grids that meet.
    stiffness = 0.5 * law.budget * reduced / max(crowd, 1.6)
    trial = np.empty(3)
    along = 0.0
    for i in range(3):
        trial[i] = state.slip[node, i] + law.step * relative[i]
        along += trial[i] * normal[i]
    length = 0.0
    for i in range(3):
        trial[i] -= along * normal[i]
        length += trial[i] ** 2
    length = np.sqrt(length)
    old, old_depth = state.held[node], state.pressed[node]
    old_slip = np.sqrt(state.slip[node, 0] ** 2 + state.slip[node, 1] ** 2 + state.slip[node, 2] ** 2)
    limit = law.friction * stiffness * depth
    if stiffness * length > limit:
        kept = limit / stiffness
        state.booked[k, 1] = 0.5 * (old * old_slip + limit) * (length - kept)
        for i in range(3):
            trial[i] *= kept / length
        length = kept
    if old > 0.0:
        state.booked[k, 2] = 0.5 * (stiffness - old) * (depth * old_depth + length * old_slip)
    state.booked[k, 0] = 0.5 * stiffness * (depth * depth + length * length)
    for i in range(3):
        state.push[k, i] = stiffness * (depth * normal[i] - trial[i])
        state.slip[node, i] = trial[i]
        state.normal[node, i] = normal[i]
    state.push[k, 3] = reduced
    state.pressed[node] = depth
    state.held[node] = stiffness
    state.touching[node] = 1 + state.face_body[face]
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
                part = quantise(state.weight[k, corner] * state.push[k, i], rounding)
                sums[other, i] -= part
                sums[node, i] += part
            share = state.weight[k, corner] * state.push[k, 3] / mass[other]
            sums[other, 3] += quantise(share, load_rounding)
        sums[node, 3] += quantise(state.push[k, 3] / mass[node], load_rounding)


@parallel_kernel
def take_reactions(sums: np.ndarray, rows: np.ndarray, local: np.ndarray, load: np.ndarray, force: np.ndarray) -> None:
    """Give the sums (nodes, 4) of the surface nodes `rows` to `load` (nodes,) and to the rows `local` of `force`."""
    for k in numba.prange(rows.size):
        load[rows[k]] = sums[rows[k], 3]
        for i in range(3):
            force[local[k], i] += sums[rows[k], i]
