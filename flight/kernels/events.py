"""Events of a flight: its end on a step, crossings of witness surfaces, impacts, and ricochets off them.

The law of the ricochet is that of `flight.scene.ricochet`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from flight.kernels.compiling import inner_kernel
from flight.kernels.faces import (
    CYLINDER,
    FACE,
    GROUP,
    IN_GROUP,
    NOWHERE,
    WITNESS_NUMBER,
    Scratch,
    cross_cylinder,
    cross_plane,
    dense_state,
    enclose,
    enter_obstacles,
    inside_outline,
    misses,
)
from flight.kernels.motion import LANES, STATE
from flight.kernels.terrain import Terrain, cross_terrain, slope_at

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Integers = NDArray[np.int64]

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
    levels: Array  # (4, 6) level faces: ground, ceiling, floor, and the height below which paths are counted
    time_limit: float
    tolerance: float  # relative, of the velocity over one step
    fixed_step: float  # 0: adaptive
    longest_step: float
    most_steps: int
    path_points: int  # recorded per step, 0: none


# time, position (3), velocity (3), then of a crossing: witness, fragment, sense, 1 after an impact on the ground
HIT_COLUMNS = 11
# of an impact on an obstacle: obstacle, face, row of the chunk, 1 where it stopped
STRUCK_COLUMNS = 11
# of one on the ground: speed after it (0: it stays), row of the chunk, ricochets before it
GROUND_COLUMNS = 10
FIRST_COLUMNS = 11  # of `Ends.first`

LIFT = 1e-9  # m off the surface at which a fragment starts again, so that rounding does not put it below
MOST_CONTACTS = 500  # of one fragment; then it stays
SLOWEST_LIFT = 0.1  # m/s off the surface, which rises by 0.5 mm; what is slower stays
EXPONENT = 4.0 / 3.0  # as in flight.scene.ricochet
CRITICAL, LOSS, DEPARTURE, ROUGHNESS = 0, 1, 2, 3  # columns of a surface


@inner_kernel()
def ending(
    limits: Limits, terrain: Terrain | None, obstacles: Array | None, step: Scratch
) -> tuple[float, int, int, int]:
    """Position on the step where the flight ends, and its status; 2.0: it goes on.

    Then come the row of the obstacle and its face, or -1.
    """
    theta, status = NOWHERE, IN_FLIGHT
    for k in range(3):
        if abs(limits.levels[k, 2]) < np.inf:
            found = cross_plane(step.points, limits.levels[k], step.stack, step.roots)
            if found > 0 and step.roots[0] < theta:
                theta, status = step.roots[0], LANDED if k == 0 else LEFT_DOMAIN
    if limits.domain_radius < np.inf:
        found = cross_cylinder(
            step.points, limits.origin_x, limits.origin_y, limits.domain_radius, step.pieces, step.stack, step.roots
        )
        if found > 0 and step.roots[0] < theta:
            theta, status = step.roots[0], LEFT_DOMAIN
    if terrain is not None:
        position = cross_terrain(terrain, theta, step)
        if position <= 1.0 and position <= theta:
            theta, status = position, LANDED
    if obstacles is not None:
        position, obstacle, face = enter_obstacles(obstacles, theta, step)
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
    witnesses: Array, vertices: Array, step: Scratch, until: float, time: float, h: float, fragment: int, after: float,
    hits: Array, count: int,
) -> int:  # fmt: skip
    """Append the crossings of this step up to its position `until`, for all of which there is room; the new count."""
    enclose(step.points, step.hull)
    index = 0
    while index < witnesses.shape[0]:
        row = witnesses[index]
        index += 1
        if misses(step.hull, row):
            index += int(row[IN_GROUP])
            continue
        if int(row[0]) == GROUP:
            continue
        is_cylinder = int(row[0]) == CYLINDER
        if is_cylinder:
            found = cross_cylinder(
                step.points, row[FACE], row[FACE + 1], row[FACE + 3], step.pieces, step.stack, step.roots
            )
        else:
            found = cross_plane(step.points, row[FACE : FACE + 6], step.stack, step.roots)
        for k in range(found):
            theta, out = step.roots[k], step.state
            if theta > until:
                break
            dense_state(step.points, theta, out)
            if not inside_outline(row, vertices, out[0], out[1], out[2]):
                continue
            if is_cylinder:
                sense = (out[0] - row[FACE]) * out[3] + (out[1] - row[FACE + 1]) * out[4]
            else:
                sense = row[FACE + 3] * out[3] + row[FACE + 4] * out[4] + row[FACE + 5] * out[5]
            hits[count, 0] = time + theta * h
            for i in range(6):
                hits[count, 1 + i] = out[i]
            hits[count, 7], hits[count, 8] = row[WITNESS_NUMBER], fragment
            hits[count, 9], hits[count, 10] = 1.0 if sense >= 0.0 else -1.0, after
            count += 1
    return count


@inner_kernel()
def standard_normal(key: np.uint64, number: int) -> float:
    """The `number`-th independent standard normal variate of a key: Box and Muller's of SplitMix64's bits."""
    uniform = 1.0
    angle = 0.0
    for k in range(2):
        z = key + np.uint64(2 * number + k + 1) * np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        z = z ^ (z >> np.uint64(31))
        drawn = (float(z >> np.uint64(11)) + 0.5) * 2.0**-53
        if k == 0:
            uniform = drawn
        else:
            angle = 2.0 * math.pi * drawn
    return math.sqrt(-2.0 * math.log(uniform)) * math.cos(angle)


@inner_kernel()
def after_impact(speed: float, angle: float, surface: Array, variate: float) -> tuple[float, float]:
    """Speed after an impact and the angle of departure (rad) from the mean surface; (0, 0) where the fragment stays.

    `angle` is that between path and mean surface (rad); `surface` holds the critical angle (rad), the logarithm of the
    fraction of speed kept there, the angle of departure over that of impact, and the roughness (rad); NaN where nothing
    ricochets. `variate` is the slope of the facet along the path over the roughness.
    """
    facet = math.hypot(angle, surface[ROUGHNESS] * variate)
    if not facet <= surface[CRITICAL]:
        return 0.0, 0.0
    kept = speed * math.exp(surface[LOSS] * (facet / surface[CRITICAL]) ** EXPONENT)
    departure = surface[DEPARTURE] * facet
    return (kept, departure) if kept * math.sin(departure) > SLOWEST_LIFT else (0.0, 0.0)


@inner_kernel()
def ricochet(state: Array, nx: float, ny: float, nz: float, surface: Array, variate: float) -> bool:
    """Turn the velocity in `state` (time, position, velocity) at a surface of unit normal (nx, ny, nz).

    `surface` and `variate` as of `after_impact`. Returns whether the fragment leaves; where it does not, `state` is
    left as it came.
    """
    speed = math.sqrt(state[4] * state[4] + state[5] * state[5] + state[6] * state[6])
    into = -min(state[4] * nx + state[5] * ny + state[6] * nz, 0.0)
    tx, ty, tz = state[4] + into * nx, state[5] + into * ny, state[6] + into * nz
    along = math.sqrt(tx * tx + ty * ty + tz * tz)
    if along == 0.0:
        return False
    kept, departure = after_impact(speed, math.atan2(into, along), surface, variate)
    if kept == 0.0:
        return False
    off, forward = kept * math.sin(departure), kept * math.cos(departure) / along
    state[4], state[5], state[6] = forward * tx + off * nx, forward * ty + off * ny, forward * tz + off * nz
    return True


@inner_kernel()
def _normal(
    state: Array, which: int, face: int, terrain: Terrain | None, obstacles: Array | None
) -> tuple[float, float, float]:
    """Unit normal of the ground, or of an obstacle's face, outward."""
    if obstacles is not None and which >= 0:
        column = FACE + 6 * face + 3
        return obstacles[which, column], obstacles[which, column + 1], obstacles[which, column + 2]
    if terrain is None:
        return 0.0, 0.0, 1.0
    slope_x, slope_y = slope_at(terrain, state[1], state[2])
    size = math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    return -slope_x / size, -slope_y / size, 1.0 / size


class Ends(NamedTuple):
    """What becomes of n fragments.

    `first`: time, position, velocity at the first impact on the ground, or at the end of those that have none; steps
    taken, steps rejected, lowest and highest Mach number of all flights. `last`: time, position, velocity at the start
    of the flight under way, and at the very end. `stopped_by`: obstacle and face, or -1. `ricochets`: off the ground.
    `contacts`: all impacts.
    """

    first: Array  # (n, FIRST_COLUMNS)
    first_status: NDArray[np.int8]
    last: Array  # (n, 7)
    last_status: NDArray[np.int8]
    stopped_by: Integers  # (n, 2)
    ricochets: Integers
    contacts: Integers


@inner_kernel()
def impact(
    row: int, how: int, which: int, face: int, end: Array, ends: Ends, surfaces: Array, limits: Limits,
    terrain: Terrain | None, obstacles: Array | None, struck: Array, ground: Array, key: np.uint64, slopes: Array,
) -> bool:  # fmt: skip
    """Let a fragment whose flight has just ended in the state `end` ricochet or stay; returns whether it flies on.

    `which` is a row of `obstacles`, -1 for the ground; an obstacle may have several, whose number comes first in each.

    `struck` and `ground` are the rows for an impact on an obstacle, or on the ground; `slopes` are those of
    the facets at the first impacts over the roughness, and `key` draws those beyond.
    """
    state = ends.last[row]
    for k in range(7):
        state[k] = end[k]
    if how == LANDED and ends.first_status[row] == 0:
        for k in range(7):
            ends.first[row, k] = end[k]
        ends.first_status[row] = LANDED
    goes_on = False
    number = -1
    if obstacles is not None and which >= 0:
        number = int(obstacles[which, 0])
    nx, ny, nz = 0.0, 0.0, 1.0
    if how in (LANDED, STOPPED):
        ends.contacts[row] += 1
        nx, ny, nz = _normal(state, which, face, terrain, obstacles)
        met = ends.contacts[row]
        slope = slopes[met - 1] if met <= slopes.size else standard_normal(key, met)
        goes_on = ends.contacts[row] < MOST_CONTACTS and ricochet(state, nx, ny, nz, surfaces[1 + number], slope)
        record = ground if how == LANDED else struck
        for k in range(7):
            record[k] = end[k]
        if how == LANDED:
            leaving = math.sqrt(state[4] * state[4] + state[5] * state[5] + state[6] * state[6])
            record[7], record[8], record[9] = leaving if goes_on else 0.0, row, ends.ricochets[row]
        else:
            record[7], record[8], record[9], record[10] = number, face, row, 0.0 if goes_on else 1.0
    if goes_on:
        ends.ricochets[row] += which < 0
        state[1], state[2], state[3] = state[1] + LIFT * nx, state[2] + LIFT * ny, state[3] + LIFT * nz
        if state[0] < limits.time_limit:
            return True
        how, number, face = TIME_OUT, -1, -1
    if ends.first_status[row] == 0:
        for k in range(7):
            ends.first[row, k] = end[k]
        ends.first_status[row] = how
    ends.last_status[row] = how
    ends.stopped_by[row, 0], ends.stopped_by[row, 1] = number, face
    return False
