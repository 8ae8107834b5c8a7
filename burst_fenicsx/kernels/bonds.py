"""Face-face contact: springs between the twin nodes of charge and casing (Eqs. 12-15).

Each pair of twins has one spring for every smooth surface that meets in it: one on a wall, two in an edge. A pair
touches no node but its own two, so pairs run side by side, and every rank that holds both computes the same.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from burst_fenicsx.kernels.lanes import kernel, parallel_kernel

__all__ = ["BOOKED", "BondLaw", "Bonds", "face_vectors", "join_twins"]

BOOKED = ("spring", "friction", "stiffness_work", "deepest")
"""Columns of `Bonds.booked`: J stored, J of friction in this step, J by change of stiffness in this step, m."""


_RUN = 128  # pairs that one call joins


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
    first: np.ndarray  # (pairs + 1,) int32 into the springs
    first_face: np.ndarray  # (springs + 1,) int32 into `face`
    face: np.ndarray  # int32, faces of each spring
    bonded: np.ndarray  # (springs,) int8, 1 until broken
    slip: np.ndarray  # (springs, 3) m, tangential displacement that the spring holds
    gap: np.ndarray  # (springs,) m, negative where the charge lies inside the casing
    held: np.ndarray  # (springs,) N/m, stiffness of the last step, 0 where nothing was held
    released: np.ndarray  # (pairs,) int8, 1 where the pair has slid far, 2 once it is left to the colliding surfaces
    booked: np.ndarray  # (pairs, 4), see BOOKED


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


@parallel_kernel
def join_twins(
    law: BondLaw,
    bonds: Bonds,
    vectors: np.ndarray,
    mass: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    force: np.ndarray,
) -> None:
    """Add the springs' forces (N) to `force` (nodes, 3) and advance their state.

    `vectors` (faces, 3) m2, outward from the casing; `mass` (nodes,) kg; `position` (m) and `velocity` (m/s), of the
    step that led to the positions, (nodes, 3).
    """
    pairs = bonds.charge.size
    parts = pairs // _RUN + 1
    for part in numba.prange(parts):
        first, last = part * pairs // parts, (part + 1) * pairs // parts
        _join_run(first, last, law, bonds, vectors, mass, position, velocity, force)


@kernel
def _join_run(
    start: int,
    stop: int,
    law: BondLaw,
    bonds: Bonds,
    vectors: np.ndarray,
    mass: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    force: np.ndarray,
) -> None:
    """Join the pairs from `start` to `stop`; a call for every pair would cost more than the pair."""
    for pair in range(start, stop):
        bonds.booked[pair, :] = 0.0
        if bonds.released[pair] == 2:
            continue
        a, b = bonds.charge[pair], bonds.solid[pair]
        first_face, face = bonds.first_face, bonds.face
        whole_area = 0.0
        for spring in range(bonds.first[pair], bonds.first[pair + 1]):
            whole_area += _area(_normal(first_face[spring], first_face[spring + 1], face, vectors))
        whole = law.stiffness * mass[a] * mass[b] / (mass[a] + mass[b])
        furthest = 0.0
        for spring in range(bonds.first[pair], bonds.first[pair + 1]):
            nx, ny, nz = _normal(first_face[spring], first_face[spring + 1], face, vectors)
            size = _area((nx, ny, nz))
            nx, ny, nz = nx / size, ny / size, nz / size
            stiffness = whole * size / whole_area
            area = 0.25 * size  # Eq. 14: each of a face's four nodes has a quarter of it
            dx, dy, dz = (
                position[a, 0] - position[b, 0],
                position[a, 1] - position[b, 1],
                position[a, 2] - position[b, 2],
            )
            gap = dx * nx + dy * ny + dz * nz
            off = np.sqrt(max(dx * dx + dy * dy + dz * dz - gap * gap, 0.0))
            furthest = max(furthest, off / (law.release * np.sqrt(4.0 * area)))

            # Tangential displacement of the spring, turned into today's plane and moved on by this step (Eq. 13).
            vx, vy, vz = (
                velocity[a, 0] - velocity[b, 0],
                velocity[a, 1] - velocity[b, 1],
                velocity[a, 2] - velocity[b, 2],
            )
            sx, sy, sz = bonds.slip[spring, 0], bonds.slip[spring, 1], bonds.slip[spring, 2]
            tx, ty, tz = sx + law.step * vx, sy + law.step * vy, sz + law.step * vz
            normal_part = tx * nx + ty * ny + tz * nz
            tx, ty, tz = tx - normal_part * nx, ty - normal_part * ny, tz - normal_part * nz

            old_gap, old = bonds.gap[spring], bonds.held[spring]
            old_slip = np.sqrt(sx * sx + sy * sy + sz * sz)
            stored_before = 0.5 * old * (old_gap * old_gap + old_slip * old_slip)
            tension = stiffness * gap
            apart = gap >= 0.0 if bonds.bonded[spring] == 0 else tension >= law.tensile_strength * area  # Eq. 15 (1)
            if apart:
                # What the spring held is lost where a bond breaks; an open gap held nothing but the last step's bit.
                if bonds.bonded[spring]:
                    bonds.booked[pair, 1] += stored_before
                bonds.bonded[spring] = 0
                bonds.slip[spring, :] = 0.0
                bonds.gap[spring] = gap
                bonds.held[spring] = 0.0
                continue
            length = np.sqrt(tx * tx + ty * ty + tz * tz)
            cohesion = law.cohesion * area if bonds.bonded[spring] else 0.0
            limit = max(-tension * law.friction + cohesion, 0.0)
            if stiffness * length > limit:  # Eq. 15 (2)
                bonds.bonded[spring] = 0
                kept = limit / stiffness
                bonds.booked[pair, 1] += 0.5 * (old * old_slip + limit) * (length - kept)
                shrink = kept / length if length > 0.0 else 0.0
                tx, ty, tz, length = shrink * tx, shrink * ty, shrink * tz, kept
            if old > 0.0:
                bonds.booked[pair, 2] += 0.5 * (stiffness - old) * (gap * old_gap + length * old_slip)
            bonds.booked[pair, 0] += 0.5 * stiffness * (gap * gap + length * length)
            bonds.booked[pair, 3] = max(bonds.booked[pair, 3], -gap)
            bonds.slip[spring, 0], bonds.slip[spring, 1], bonds.slip[spring, 2] = tx, ty, tz
            bonds.gap[spring] = gap
            bonds.held[spring] = stiffness
            fx = -stiffness * (gap * nx + tx)
            fy = -stiffness * (gap * ny + ty)
            fz = -stiffness * (gap * nz + tz)
            force[a, 0] += fx
            force[a, 1] += fy
            force[a, 2] += fz
            force[b, 0] -= fx
            force[b, 1] -= fy
            force[b, 2] -= fz
        if furthest > 1.0:
            holds = 0
            for spring in range(bonds.first[pair], bonds.first[pair + 1]):
                holds += bonds.bonded[spring]
            if holds == 0:
                bonds.released[pair] = 1


@kernel
def _normal(first: int, last: int, face: np.ndarray, vectors: np.ndarray) -> tuple[float, float, float]:
    """Sum of the area vectors of a spring's faces (m2), outward from the casing."""
    x, y, z = 0.0, 0.0, 0.0
    for k in range(first, last):
        x += vectors[face[k], 0]
        y += vectors[face[k], 1]
        z += vectors[face[k], 2]
    return x, y, z


@kernel
def _area(vector: tuple[float, float, float]) -> float:
    return np.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])
