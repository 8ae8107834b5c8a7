"""Events within a step: the end of the flight, and crossings of witness surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from flight.kernels.compiling import inner_kernel
from flight.kernels.motion import (
    LANES,
    STATE,
)
from flight.kernels.obstacles import enter_obstacles
from flight.kernels.surfaces import (
    CYLINDER,
    GROUP,
    IN_GROUP,
    WITNESS_NUMBER,
    cross_cylinder,
    cross_plane,
    dense_state,
    inside_outline,
    misses_box,
)
from flight.kernels.terrain import cross_terrain

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.kernels.terrain import Terrain

    Array = NDArray[np.float64]

__all__ = [
    "HIT_COLUMNS", "IN_FLIGHT", "LANDED", "LEFT_DOMAIN", "NOT_A_NUMBER", "STEP_LIMIT", "STOPPED", "TIME_OUT", "Limits",
    "ending", "ending_in_scene", "outside", "record_hits",
]  # fmt: skip

# as in flight.rows.Status
IN_FLIGHT, LANDED, TIME_OUT, LEFT_DOMAIN, STEP_LIMIT, NOT_A_NUMBER, STOPPED = 0, 1, 2, 3, 4, 5, 6


class Limits(NamedTuple):
    """Where and when a flight ends, and how it is stepped. Units: m, s."""

    ground: float  # height of flat ground, nan: none, or a map
    origin_x: float
    origin_y: float
    domain_radius: float  # inf: none
    ceiling: float  # inf: none
    floor: float  # -inf: none
    time_limit: float
    tolerance: float  # relative, of the velocity over one step
    fixed_step: float  # 0: adaptive
    longest_step: float
    most_steps: int
    path_points: int  # recorded per step, 0: none


# time, position (3), velocity (3), witness, fragment, sense of the crossing, 1 after an impact on the ground
HIT_COLUMNS = 11


@inner_kernel()
def ending(points: Array, limits: Limits, pieces: Array, stack: Array, roots: Array) -> tuple[float, int]:
    """Place on the step where the flight ends at flat ground or the domain's edge, and its status; 2.0: it goes on."""
    theta, status = 2.0, IN_FLIGHT
    if limits.ground == limits.ground and cross_plane(points, 0.0, 0.0, limits.ground, 0.0, 0.0, 1.0, stack, roots) > 0:
        theta, status = roots[0], LANDED
    if limits.ceiling < np.inf:
        found = cross_plane(points, 0.0, 0.0, limits.ceiling, 0.0, 0.0, -1.0, stack, roots)
        if found > 0 and roots[0] < theta:
            theta, status = roots[0], LEFT_DOMAIN
    if limits.floor > -np.inf:
        found = cross_plane(points, 0.0, 0.0, limits.floor, 0.0, 0.0, 1.0, stack, roots)
        if found > 0 and roots[0] < theta:
            theta, status = roots[0], LEFT_DOMAIN
    if limits.domain_radius < np.inf:
        found = cross_cylinder(points, limits.origin_x, limits.origin_y, limits.domain_radius, pieces, stack, roots)
        if found > 0 and roots[0] < theta:
            theta, status = roots[0], LEFT_DOMAIN
    return theta, status


@inner_kernel()
def ending_in_scene(
    points: Array, theta: float, status: int, terrain: Terrain | None, obstacles: Array | None, terrain_pieces: Array,
    events: Array, stack: Array, roots: Array,
) -> tuple[float, int, int, int]:  # fmt: skip
    """As `ending`, whose answer is given, on a height map and among obstacles; with obstacle and face, or -1."""
    if terrain is not None:
        position = cross_terrain(points, terrain, theta, terrain_pieces, events, stack, roots)
        if position <= 1.0 and position <= theta:
            theta, status = position, LANDED
    if obstacles is not None:
        position, obstacle, face = enter_obstacles(points, obstacles, theta, events, stack, roots)
        if position <= 1.0:
            return position, STOPPED, obstacle, face
    return theta, status, -1, -1


@inner_kernel()
def outside(q: Array, lane: int, limits: Limits) -> bool:
    """Return whether a fragment starts outside the domain."""
    dx, dy = q[STATE * LANES + lane] - limits.origin_x, q[(STATE + 1) * LANES + lane] - limits.origin_y
    z = q[(STATE + 2) * LANES + lane]
    return z > limits.ceiling or z < limits.floor or dx * dx + dy * dy >= limits.domain_radius * limits.domain_radius


@inner_kernel()
def record_hits(
    witnesses: Array,
    vertices: Array,
    points: Array,
    until: float,
    time: float,
    h: float,
    fragment: int,
    after: float,
    pieces: Array,
    stack: Array,
    roots: Array,
    out: Array,
    hits: Array,
    count: int,
) -> int:
    """Append the crossings of this step up to its position `until`, for all of which there is room; the new count."""
    index = 0
    while index < witnesses.shape[0]:
        row = witnesses[index]
        index += 1
        if misses_box(points, row):
            index += int(row[IN_GROUP])
            continue
        if int(row[0]) == GROUP:
            continue
        is_cylinder = int(row[0]) == CYLINDER
        if is_cylinder:
            found = cross_cylinder(points, row[7], row[8], row[10], pieces, stack, roots)
        else:
            found = cross_plane(points, row[7], row[8], row[9], row[10], row[11], row[12], stack, roots)
        for k in range(found):
            theta = roots[k]
            if theta > until:
                break
            dense_state(points, theta, out)
            if not inside_outline(row, vertices, out[0], out[1], out[2]):
                continue
            if is_cylinder:
                sense = (out[0] - row[7]) * out[3] + (out[1] - row[8]) * out[4]
            else:
                sense = row[10] * out[3] + row[11] * out[4] + row[12] * out[5]
            hits[count, 0] = time + theta * h
            for i in range(6):
                hits[count, 1 + i] = out[i]
            hits[count, 7] = row[WITNESS_NUMBER]
            hits[count, 8] = fragment
            hits[count, 9] = 1.0 if sense >= 0.0 else -1.0
            hits[count, 10] = after
            count += 1
    return count
