"""Face-face contact: springs between the twin nodes of charge and casing (Eqs. 12-15).

Each pair of twins has one spring for every smooth surface that meets in it: one on a wall, two in an edge. A pair
touches no node but its own two, so pairs run side by side, and every rank that holds both computes the same.

The loops are given plain arrays: each use of a named tuple's array there would count references to it.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from burst_fenicsx.kernels.lanes import kernel, parallel_kernel

__all__ = ["BOOKED", "BondLaw", "Bonds", "face_vectors", "group_faces", "join_twins"]

BOOKED = ("spring", "friction", "stiffness_work", "deepest")
"""Columns of `Bonds.booked`: J stored, J of friction in this step, J by change of stiffness in this step, m."""


class BondLaw(NamedTuple):
    """What holds for all pairs in this step."""

    stiffness: float  # f / dt^2 (1/s2): a spring's stiffness over the reduced mass of its twins
    step: float  # s
    tensile_strength: float  # T (Pa)
    cohesion: float  # c (Pa)
    friction: float  # tan(phi)
    release: float  # a broken pair may be released once it has slid by this fraction of its edge; infinite: never


class Bonds(NamedTuple):
    """Pairs of twins, their springs, and the state of each."""

    charge: np.ndarray  # (pairs,) int32 local node of the charge
    solid: np.ndarray  # (pairs,) int32 local node of casing or fuze
    reduced: np.ndarray  # (pairs,) kg, reduced mass of the two
    first: np.ndarray  # (pairs + 1,) int32 into the springs
    first_face: np.ndarray  # (springs + 1,) int32 into `face`
    face: np.ndarray  # int32, faces of each spring
    normal: np.ndarray  # (springs, 4), in this step: unit normal, outward from the casing, and area of its faces (m2)
    bonded: np.ndarray  # (springs,) int8, 1 until broken
    slip: np.ndarray  # (springs, 3) m, tangential displacement that the spring holds
    gap: np.ndarray  # (springs,) m, negative where the charge lies inside the casing
    held: np.ndarray  # (springs,) N/m, stiffness of the last step, 0 where nothing was held
    released: np.ndarray  # (pairs,) int8, 1 where the pair has slid far, 2 once it is left to the colliding surfaces
    booked: np.ndarray  # (pairs, 4), see BOOKED


@kernel
def group_faces(
    faces: np.ndarray, normal: np.ndarray, row: np.ndarray, pairs: int, smooth: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Group the faces around each node by direction, a spring for each group.

    Parameters
    ----------
    faces : (faces, 4) nodes. normal : (faces, 3) unit vectors.
    row : (nodes,) pair of a node, -1 where it has none. pairs : their number.
    smooth : cosine above which a face belongs to the group of an earlier one.

    Returns
    -------
    `Bonds.first`, `Bonds.first_face` and `Bonds.face`.
    """
    offset = np.zeros(pairs + 1, dtype=np.int64)
    for face in range(faces.shape[0]):
        for corner in range(4):
            if row[faces[face, corner]] >= 0:
                offset[row[faces[face, corner]] + 1] += 1
    for pair in range(pairs):
        offset[pair + 1] += offset[pair]
    around, place = np.empty(offset[pairs], dtype=np.int32), offset.copy()
    for face in range(faces.shape[0]):
        for corner in range(4):
            pair = row[faces[face, corner]]
            if pair >= 0:
                around[place[pair]] = face
                place[pair] += 1

    first, face_of = np.zeros(pairs + 1, dtype=np.int32), np.empty(around.size, dtype=np.int32)
    first_face = np.zeros(around.size + 1, dtype=np.int32)
    group = np.empty(around.size, dtype=np.int32)
    springs, entered = 0, 0
    for pair in range(pairs):
        groups = 0
        for k in range(offset[pair], offset[pair + 1]):
            group[k] = groups
            known = 0
            for earlier in range(offset[pair], k):
                if group[earlier] != known:
                    continue
                known += 1  # the first face of a group
                a, b = around[earlier], around[k]
                cosine = normal[a, 0] * normal[b, 0] + normal[a, 1] * normal[b, 1] + normal[a, 2] * normal[b, 2]
                if cosine > smooth:
                    group[k] = group[earlier]
                    break
            if group[k] == groups:
                groups += 1
        for number in range(groups):
            for k in range(offset[pair], offset[pair + 1]):
                if group[k] == number:
                    face_of[entered] = around[k]
                    entered += 1
            springs += 1
            first_face[springs] = entered
        first[pair + 1] = springs
    return first, first_face[: springs + 1].copy(), face_of


@parallel_kernel
def face_vectors(position: np.ndarray, faces: np.ndarray, vectors: np.ndarray) -> None:
    """Areas times outward normals of quadrilaterals (faces, 3) in m2; `faces` (faces, 4) int32."""
    for face in numba.prange(faces.shape[0]):
        a, b, c, d = faces[face, 0], faces[face, 1], faces[face, 2], faces[face, 3]
        x1, x2 = position[c, 0] - position[a, 0], position[d, 0] - position[b, 0]
        y1, y2 = position[c, 1] - position[a, 1], position[d, 1] - position[b, 1]
        z1, z2 = position[c, 2] - position[a, 2], position[d, 2] - position[b, 2]
        vectors[face, 0] = 0.5 * (y1 * z2 - z1 * y2)
        vectors[face, 1] = 0.5 * (z1 * x2 - x1 * z2)
        vectors[face, 2] = 0.5 * (x1 * y2 - y1 * x2)


@kernel
def join_twins(
    law: BondLaw, bonds: Bonds, vectors: np.ndarray, position: np.ndarray, velocity: np.ndarray, force: np.ndarray
) -> None:
    """Add the springs' forces (N) to `force` (nodes, 3) and advance their state.

    `vectors` (faces, 3) m2, outward from the casing; `position` (m) and `velocity` (m/s), of the step that led to the
    positions, (nodes, 3).
    """
    _sum_faces(bonds.first_face, bonds.face, vectors, bonds.normal)
    _join_runs(
        law,
        bonds.charge,
        bonds.solid,
        bonds.reduced,
        bonds.first,
        bonds.normal,
        bonds.bonded,
        bonds.slip,
        bonds.gap,
        bonds.held,
        bonds.released,
        bonds.booked,
        position,
        velocity,
        force,
    )


@parallel_kernel
def _sum_faces(first_face: np.ndarray, face: np.ndarray, vectors: np.ndarray, normal: np.ndarray) -> None:
    """Unit normal and area (springs, 4) of each spring's faces together."""
    for spring in numba.prange(normal.shape[0]):
        x, y, z = 0.0, 0.0, 0.0
        for k in range(first_face[spring], first_face[spring + 1]):
            x += vectors[face[k], 0]
            y += vectors[face[k], 1]
            z += vectors[face[k], 2]
        size = np.sqrt(x * x + y * y + z * z)
        inverse = 1.0 / size
        normal[spring, 0], normal[spring, 1], normal[spring, 2] = inverse * x, inverse * y, inverse * z
        normal[spring, 3] = size


@parallel_kernel
def _join_runs(
    law: BondLaw,
    charge: np.ndarray,
    solid: np.ndarray,
    reduced: np.ndarray,
    first: np.ndarray,
    normal: np.ndarray,
    bonded: np.ndarray,
    slip: np.ndarray,
    gap: np.ndarray,
    held: np.ndarray,
    released: np.ndarray,
    booked: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    force: np.ndarray,
) -> None:
    for pair in numba.prange(charge.size):
        if released[pair] == 2:
            booked[pair, 0], booked[pair, 1], booked[pair, 2], booked[pair, 3] = 0.0, 0.0, 0.0, 0.0
            continue
        a, b = charge[pair], solid[pair]
        dx, dy, dz = position[a, 0] - position[b, 0], position[a, 1] - position[b, 1], position[a, 2] - position[b, 2]
        vx, vy, vz = velocity[a, 0] - velocity[b, 0], velocity[a, 1] - velocity[b, 1], velocity[a, 2] - velocity[b, 2]
        distance = dx * dx + dy * dy + dz * dz
        whole_area = 0.0
        for spring in range(first[pair], first[pair + 1]):
            whole_area += normal[spring, 3]
        of_pair = law.stiffness * reduced[pair]
        slid, holds = False, False
        stored, heat, work, deepest = 0.0, 0.0, 0.0, 0.0
        for spring in range(first[pair], first[pair + 1]):
            nx, ny, nz, size = normal[spring, 0], normal[spring, 1], normal[spring, 2], normal[spring, 3]
            stiffness = of_pair * size / whole_area
            area = 0.25 * size  # Eq. 14: each of a face's four nodes has a quarter of it
            now = dx * nx + dy * ny + dz * nz
            slid |= distance - now * now > law.release * law.release * size

            # Tangential displacement of the spring, turned into today's plane and moved on by this step (Eq. 13).
            sx, sy, sz = slip[spring, 0], slip[spring, 1], slip[spring, 2]
            tx, ty, tz = sx + law.step * vx, sy + law.step * vy, sz + law.step * vz
            normal_part = tx * nx + ty * ny + tz * nz
            tx, ty, tz = tx - normal_part * nx, ty - normal_part * ny, tz - normal_part * nz

            # Selections rather than branches from here on: broken springs open, slide and hold in no order.
            old_gap, old, old_slip = gap[spring], held[spring], np.sqrt(sx * sx + sy * sy + sz * sz)
            whole = bonded[spring] != 0
            tension = stiffness * now
            apart = tension >= (law.tensile_strength * area if whole else 0.0)  # Eq. 15 (1)
            length = np.sqrt(tx * tx + ty * ty + tz * tz)
            limit = max((law.cohesion * area if whole else 0.0) - tension * law.friction, 0.0)
            slides = (not apart) & (stiffness * length > limit)  # Eq. 15 (2)
            kept, shrink = limit / stiffness, limit / (stiffness * length)
            kept, shrink = kept if slides else length, shrink if slides else 1.0
            heat += 0.5 * (old * old_slip + limit) * (length - kept)
            # What the spring held is lost where a bond breaks; an open gap held nothing but the last step's bit.
            lost = 0.5 * old * (old_gap * old_gap + old_slip * old_slip)
            heat += lost if apart & whole else 0.0
            stiffness, shrink, kept = 0.0 if apart else stiffness, 0.0 if apart else shrink, 0.0 if apart else kept
            tx, ty, tz = shrink * tx, shrink * ty, shrink * tz
            change = 0.5 * (stiffness - old) * (now * old_gap + kept * old_slip)
            work += change if (not apart) & (old > 0.0) else 0.0
            stored += 0.5 * stiffness * (now * now + kept * kept)
            deepest = max(deepest, 0.0 if apart else -now)
            whole &= not (apart | slides)
            holds |= whole
            bonded[spring] = whole
            slip[spring, 0], slip[spring, 1], slip[spring, 2] = tx, ty, tz
            gap[spring], held[spring] = now, stiffness
            fx, fy, fz = -stiffness * (now * nx + tx), -stiffness * (now * ny + ty), -stiffness * (now * nz + tz)
            force[a, 0] += fx
            force[a, 1] += fy
            force[a, 2] += fz
            force[b, 0] -= fx
            force[b, 1] -= fy
            force[b, 2] -= fz
        booked[pair, 0], booked[pair, 1], booked[pair, 2], booked[pair, 3] = stored, heat, work, deepest
        if slid and not holds:
            released[pair] = 1
