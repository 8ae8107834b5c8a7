"""The loop over fragments and steps, from launch to the end, with crossings and endings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flight.kernels.compiling import inner_kernel, kernel
from flight.kernels.events import (
    HIT_COLUMNS,
    IN_FLIGHT,
    LANDED,
    LEFT_DOMAIN,
    NOT_A_NUMBER,
    STEP_LIMIT,
    STOPPED,
    TIME_OUT,
    Limits,
    ending,
    ending_in_scene,
    heights_of,
    may_end,
    outside,
    record_hits,
)
from flight.kernels.fluence import count_chord, count_path, highest_counted
from flight.kernels.lanes import SMALLEST_FACTOR, load, move_lane, prepare, step_factors
from flight.kernels.motion import (
    LANES,
    MACH,
    NEW,
    ROWS,
    SLOPE,
    STATE,
    STEP,
    TIME,
    place_points,
    take_step,
    velocity_points,
)
from flight.kernels.obstacles import EVENTS_SHAPE
from flight.kernels.roots import STACK_SHAPE
from flight.kernels.surfaces import (
    PIECES_SHAPE,
    dense_state,
    misses_box,
)
from flight.kernels.terrain import TERRAIN_PIECES_SHAPE, height_at

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.kernels.fluence import FluenceCells
    from flight.kernels.motion import Surroundings
    from flight.kernels.terrain import Terrain

    Array = NDArray[np.float64]

__all__ = ["HIT_COLUMNS", "OUTCOME_COLUMNS", "PATH_COLUMNS", "Limits", "fly_chunk"]

# time, place (3), velocity (3), steps taken, steps rejected, lowest and highest Mach number, obstacle, face
OUTCOME_COLUMNS = 13
# time, place (3), velocity (3), fragment
PATH_COLUMNS = 8
SHORTEST_STEP = 1e-12  # s; an error that shrinks with no step is not an error of the step


@inner_kernel(_nrt=False)
def _fastest(q: Array, lane: int) -> float:
    """Larger of the squared speeds at both ends of a step."""
    before = after = 0.0
    for j in range(3):
        before += q[(STATE + 3 + j) * LANES + lane] ** 2
        after += q[(NEW + 3 + j) * LANES + lane] ** 2
    return max(before, after)


@kernel
def fly_chunk(
    start: int,
    stop: int,
    mass: Array,
    shape_factor: Array,
    position: Array,
    velocity: Array,
    clock: Array,
    around: Surroundings,
    limits: Limits,
    terrain: Terrain,
    obstacles: Array,
    witnesses: Array,
    vertices: Array,
    everything: Array,
    outcome: Array,
    status: NDArray[np.int8],
    hits: Array,
    path: Array,
    near: FluenceCells,
    lengths: NDArray[np.int64],
) -> tuple[int, int, bool]:
    """Fly the fragments start..stop-1; rows of `outcome` and `status` count from `start`.

    `clock` (n, 3) holds the time of each launch, the time at which that flight ends at the latest (s), and whether
    it follows an impact on the ground (1) or not (0). Returns the rows used of `hits` and `path`, in no order of
    fragments; -1 where one of them had no room for all: fly again with more. Lengths of paths near the ground are
    added to `lengths` (before and after the first impact on the ground, azimuth, distance; without azimuths: not
    counted); last comes whether its cells reach far enough.
    """
    if stop <= start:
        return 0, 0, True
    inside = True
    counted_below = highest_counted(limits, terrain, near) if lengths.shape[1] > 0 else -np.inf
    q, ahead, factors = np.zeros(ROWS * LANES), np.zeros(ROWS * LANES), np.zeros(LANES)
    out, points, stack, roots = np.empty(6), np.zeros((6, 6)), np.empty(STACK_SHAPE), np.empty(16)
    pieces, events = np.empty(PIECES_SHAPE), np.empty(EVENTS_SHAPE)
    terrain_pieces = np.empty(TERRAIN_PIECES_SHAPE)
    built_up = terrain.heights.shape[0] > 0 or obstacles.shape[0] > 0
    flying, fresh = np.zeros(LANES, np.int64), np.zeros(LANES, np.bool_)
    final = np.zeros(LANES, np.bool_)
    adaptive = limits.fixed_step <= 0.0
    many_points = limits.path_points
    hit_count = path_count = 0
    following = start
    active = 0
    for lane in range(min(LANES, stop - start)):
        fresh[lane] = True
        active += 1
    while active > 0:
        # fill free lanes with the fragments that follow; close the ranks when there are none
        lane = 0
        while lane < active:
            if not fresh[lane]:
                lane += 1
                continue
            if following == stop:
                active -= 1
                move_lane(q, active, lane)
                flying[lane], fresh[lane] = flying[active], fresh[active]
                continue
            place = (following - start) % LANES
            if place == 0:
                prepare(ahead, following, stop, mass, shape_factor, position, velocity, clock, around, limits)
            mach = load(q, lane, ahead, place)
            flying[lane] = following
            row = outcome[following - start]
            row[7] = row[8] = 0.0
            row[9] = row[10] = mach
            row[11] = row[12] = -1.0
            fresh[lane] = False
            if many_points > 0:
                if path_count == path.shape[0]:
                    return 0, -1, inside
                path[path_count, 0] = clock[following, 0]
                for j in range(6):
                    path[path_count, 1 + j] = q[(STATE + j) * LANES + lane]
                path[path_count, 7] = following
                path_count += 1
            if outside(q, lane, limits):
                status[following - start] = LEFT_DOMAIN
                row[0] = clock[following, 0]
                for j in range(6):
                    row[1 + j] = q[(STATE + j) * LANES + lane]
                fresh[lane] = True
            following += 1
        if active == 0:
            break

        for lane in range(active):
            h = limits.fixed_step if not adaptive else min(q[STEP * LANES + lane], limits.longest_step)
            time = q[TIME * LANES + lane]
            latest = min(limits.time_limit, clock[flying[lane], 1])
            final[lane] = time + h >= latest
            q[STEP * LANES + lane] = latest - time if final[lane] else h
        take_step(q, around)
        step_factors(q, factors, limits)

        for lane in range(active):
            fragment = flying[lane]
            row = outcome[fragment - start]
            h, time, factor = q[STEP * LANES + lane], q[TIME * LANES + lane], factors[lane]
            ended, theta, obstacle, face = IN_FLIGHT, 2.0, -1, -1
            if not adaptive:
                factor = 1.0 if factor == factor else factor
            if not factor > 0.0:
                row[8] += 1.0
                shorter = h * (-factor if factor < 0.0 else SMALLEST_FACTOR)
                q[STEP * LANES + lane] = shorter
                if row[7] + row[8] >= limits.most_steps:
                    ended = STEP_LIMIT
                elif shorter < SHORTEST_STEP or not adaptive:
                    ended = NOT_A_NUMBER
                else:
                    continue
                theta = 0.0
            else:
                row[7] += 1.0
                low, high = heights_of(q, lane)
                near_end = built_up or may_end(low, high, limits)
                passing = low < counted_below and 0.5 * mass[fragment] * _fastest(q, lane) >= near.energy
                if passing and not near_end:
                    counted = count_chord(q, lane, mass[fragment], limits, near, lengths[int(clock[fragment, 2])])
                    passing = counted < 0
                    inside &= counted != 0
                if near_end or passing or witnesses.shape[0] > 0 or many_points > 0:
                    place_points(q, lane, points)
                    if near_end:
                        theta, ended = ending(points, limits, pieces, stack, roots)
                        if built_up:
                            theta, ended, obstacle, face = ending_in_scene(
                                points, theta, ended, terrain, obstacles, terrain_pieces, events, stack, roots
                            )
                    until = min(theta, 1.0)
                    meets = witnesses.shape[0] > 0 and not misses_box(points, everything)
                    if ended != IN_FLIGHT or meets or passing or many_points > 0:
                        velocity_points(q, lane, points)
                    if passing:
                        inside &= count_path(
                            points,
                            until,
                            h,
                            mass[fragment],
                            limits,
                            terrain,
                            near,
                            lengths[int(clock[fragment, 2])],
                            stack,
                            roots,
                            out,
                        )
                    if meets:
                        hit_count = record_hits(
                            witnesses,
                            vertices,
                            points,
                            until,
                            time,
                            h,
                            fragment,
                            pieces,
                            stack,
                            roots,
                            out,
                            hits,
                            hit_count,
                        )
                        if hit_count < 0:
                            return -1, 0, inside
                    for k in range(1, many_points + 1):
                        if path_count == path.shape[0]:
                            return 0, -1, inside
                        share = until * k / many_points
                        dense_state(points, share, out)
                        path[path_count, 0] = time + share * h
                        for j in range(6):
                            path[path_count, 1 + j] = out[j]
                        path[path_count, 7] = fragment
                        path_count += 1
                if ended == IN_FLIGHT:
                    mach = q[MACH * LANES + lane]
                    row[9], row[10] = min(row[9], mach), max(row[10], mach)
                    for j in range(6):
                        q[(STATE + j) * LANES + lane] = q[(NEW + j) * LANES + lane]
                    for j in range(3):
                        q[(SLOPE + j) * LANES + lane] = q[(SLOPE + 18 + j) * LANES + lane]
                    q[TIME * LANES + lane] = time + h
                    q[STEP * LANES + lane] = h * factor
                    if final[lane]:
                        q[TIME * LANES + lane] = min(limits.time_limit, clock[fragment, 1])
                        ended = TIME_OUT
                    elif row[7] + row[8] >= limits.most_steps:
                        ended = STEP_LIMIT
                    if ended == IN_FLIGHT:
                        continue
                    theta = 0.0
            # the flight has ended: at the lane's state, or at `theta` of this step
            row[0] = q[TIME * LANES + lane]
            for j in range(6):
                row[1 + j] = q[(STATE + j) * LANES + lane]
            if ended in (LANDED, LEFT_DOMAIN, STOPPED):
                dense_state(points, theta, out)
                row[0] += theta * h
                for j in range(6):
                    row[1 + j] = out[j]
                if ended == LANDED:
                    row[3] = limits.ground
                    if terrain.heights.shape[0] > 0:
                        row[3] = height_at(terrain, row[1], row[2])
                row[11], row[12] = obstacle, face
            status[fragment - start] = ended
            fresh[lane] = True
    return hit_count, path_count, inside
