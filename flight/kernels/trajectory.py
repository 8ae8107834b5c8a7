"""The loop over fragments and steps, from launch to the last landing, with crossings, impacts and endings."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.kernels.compiling import inner_kernel, kernel
from flight.kernels.events import (
    GROUND_COLUMNS,
    HIT_COLUMNS,
    IN_FLIGHT,
    LANDED,
    LEFT_DOMAIN,
    NOT_A_NUMBER,
    STEP_LIMIT,
    STOPPED,
    STRUCK_COLUMNS,
    TIME_OUT,
    Ends,
    Limits,
    ending,
    impact,
    outside,
    record_hits,
)
from flight.kernels.faces import JOINTS_SHAPE, PIECES_SHAPE, Scratch, dense_state
from flight.kernels.fluence import count_chord, count_path
from flight.kernels.lanes import (
    ENDS,
    MEETS,
    PASSES,
    SHORTEST_STEP,
    SMALLEST_FACTOR,
    STRIKES,
    Watched,
    begin_steps,
    changes_with_height,
    foresee_ground,
    go_on,
    load,
    prepare,
    sift,
    step_factors,
)
from flight.kernels.motion import (
    AFTER,
    EVENT,
    FINAL,
    HIGHEST_MACH,
    LANES,
    LATEST,
    LOWEST_MACH,
    NEXT,
    REJECTED,
    ROWS,
    STATE,
    STEP,
    STEPS,
    TIME,
    place_points,
    take_step,
    velocity_points,
)
from flight.kernels.roots import STACK_SHAPE
from flight.kernels.terrain import TERRAIN_PIECES_SHAPE, height_at

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.kernels.fluence import FluenceCells
    from flight.kernels.motion import Surroundings
    from flight.kernels.terrain import Terrain

    Array = NDArray[np.float64]

# time, place (3), velocity (3), fragment
PATH_COLUMNS = 8
_ENDS, _STRIKES, _PASSES, _MEETS = int(ENDS), int(STRIKES), int(PASSES), int(MEETS)
_ROOTS = 16  # crossings of one surface on a step, at most


@inner_kernel(_nrt=True)
def _with_room(table: Array, used: int, more: int) -> Array:
    """The table, or a longer one with its used rows, where so many more have no room."""
    if used + more <= table.shape[0]:
        return table
    longer = np.empty((2 * (used + more), table.shape[1]))
    for row in range(used):  # a slice that is assigned takes seconds to compile
        for column in range(table.shape[1]):
            longer[row, column] = table[row, column]
    return longer


@inner_kernel()
def _write_state(q: Array, lane: int, record: Array) -> None:
    """Time, position and velocity of a lane into a record."""
    record[0] = q[TIME * LANES + lane]
    for j in range(6):
        record[1 + j] = q[(STATE + j) * LANES + lane]


@inner_kernel()
def _add_flight(q: Array, lane: int, first: Array) -> None:
    """Steps and Mach numbers of a flight that has ended, to those of the fragment's flights before."""
    first[7] += q[STEPS * LANES + lane]
    first[8] += q[REJECTED * LANES + lane]
    first[9] = min(first[9], q[LOWEST_MACH * LANES + lane])
    first[10] = max(first[10], q[HIGHEST_MACH * LANES + lane])


@kernel
def fly_chunk(
    start: int, stop: int, mass: Array, shape_factor: Array, position: Array, velocity: Array, clock: Array,
    keys: NDArray[np.uint64], weight: Array, slopes: Array, around: Surroundings, limits: Limits,
    terrain: Terrain | None, obstacles: Array | None, surfaces: Array, witnesses: Array, vertices: Array, boxes: Array,
    near: FluenceCells, lengths: NDArray[np.int64], ends: Ends,
) -> tuple[Array, Array, Array, Array, bool]:  # fmt: skip
    """Fly the fragments start..stop-1 to their end, and on from every ricochet; rows of `ends` count from `start`.

    `weight` (n,) is the number of fragments that each stands for, `clock` (n, 2) holds the time of each launch and the
    time at which that flight ends at the latest (s), `slopes` (n, b) are those of the facets that each meets first over
    the roughness, `keys` (n,) draw those beyond, `surfaces` holds how fragments ricochet off the ground and off each
    obstacle, `boxes` is as of `lanes.Watched`. Returns crossings, points of paths, impacts on obstacles and on the
    ground (their rows count from `start`), in no order of fragments but in that of time for each. Lengths of paths near
    the ground are added to `lengths` (before and after the first impact on the ground, azimuth, distance; without
    azimuths: not counted); last comes whether its cells reach far enough.
    """
    many_points = limits.path_points
    counts = lengths.shape[1] > 0
    hits, path = np.empty((256, HIT_COLUMNS)), np.empty((256 if many_points else 1, PATH_COLUMNS))
    struck, ground = np.empty((64, STRUCK_COLUMNS)), np.empty((1024, GROUND_COLUMNS))
    hit_count = path_count = struck_count = ground_count = 0
    inside, adaptive = True, limits.fixed_step <= 0.0
    highest, top = -np.inf, limits.levels[3, 2]
    if terrain is not None:
        highest, top = terrain.highest, near.height + terrain.highest
    watched = Watched(
        boxes, obstacles is not None or witnesses.shape[0] > 0, top if counts else -np.inf, near.energy, highest,
        many_points > 0,
    )  # fmt: skip
    q, ahead, end = np.zeros(ROWS * LANES), np.zeros(ROWS * LANES), np.empty(7)
    step = Scratch(
        np.zeros((6, 6)), np.empty(6), np.empty(6), np.empty(STACK_SHAPE), np.empty(_ROOTS), np.empty(PIECES_SHAPE),
        np.empty(JOINTS_SHAPE), np.empty(TERRAIN_PIECES_SHAPE),
    )  # fmt: skip
    points, out = step.points, step.state
    rows, flying, free = np.zeros(LANES, np.int64), np.zeros(LANES, np.int64), np.zeros(LANES, np.bool_)

    number = stop - start
    waiting = np.empty(number, np.int64)  # a ring of those to be launched: first all, then those that ricochet
    taken, queued = 0, number
    for row in range(number):
        ends.last[row, 0] = clock[start + row, 0]
        for j in range(3):
            ends.last[row, 1 + j], ends.last[row, 4 + j] = position[start + row, j], velocity[start + row, j]
        waiting[row] = row
        ends.first[row, 7] = ends.first[row, 8] = 0.0
        ends.first[row, 9], ends.first[row, 10] = np.inf, -np.inf
    prepared = used = 0
    active = min(LANES, number)
    for lane in range(active):
        free[lane] = True
    while True:
        # fill free lanes with the fragments that wait; add lanes or close the ranks as they are many or few
        lane = 0
        while lane < LANES:
            if lane == active:
                if used == prepared and taken == queued:
                    break
                free[lane] = True
                active += 1
            if not free[lane]:
                lane += 1
                continue
            if used == prepared and taken == queued:
                active -= 1
                load(q, lane, q, active)
                flying[lane], free[lane] = flying[active], free[active]
                continue
            if used == prepared:
                prepared, used = min(LANES, queued - taken), 0
                for k in range(prepared):
                    rows[k] = waiting[(taken + k) % number]
                taken += prepared
                prepare(ahead, rows, prepared, start, ends.last, mass, shape_factor, around, limits, terrain)
            row = rows[used]
            load(q, lane, ahead, used)
            used += 1
            flying[lane], free[lane] = row, False
            latest = clock[start + row, 1] if ends.contacts[row] == 0 else np.inf
            q[LATEST * LANES + lane] = min(limits.time_limit, latest)
            q[AFTER * LANES + lane] = 1.0 if ends.ricochets[row] > 0 else 0.0
            if many_points > 0:
                path = _with_room(path, path_count, 1)
                _write_state(q, lane, path[path_count])
                path[path_count, 7] = start + row
                path_count += 1
            if outside(q, lane, limits):
                _write_state(q, lane, end)
                _add_flight(q, lane, ends.first[row])
                impact(
                    row, LEFT_DOMAIN, -1, -1, end, ends, surfaces, limits, terrain, obstacles, end, end,
                    keys[start + row], slopes[start + row],
                )  # fmt: skip
                free[lane] = True
        if active == 0:
            break

        begin_steps(q, limits)
        if terrain is not None and changes_with_height(around):
            foresee_ground(q, terrain)
        take_step(q, around)
        step_factors(q, limits)
        sift(q, limits, watched)

        for lane in range(active):
            event = int(q[EVENT * LANES + lane])
            if event == 0:
                continue
            row = flying[lane]
            fragment = start + row
            h, time, factor = q[STEP * LANES + lane], q[TIME * LANES + lane], q[NEXT * LANES + lane]
            ended, theta, obstacle, face = IN_FLIGHT, 2.0, -1, -1
            if not factor > 0.0:
                q[REJECTED * LANES + lane] += 1.0
                shorter = h * (-factor if factor < 0.0 else SMALLEST_FACTOR)
                q[STEP * LANES + lane] = shorter
                if q[STEPS * LANES + lane] + q[REJECTED * LANES + lane] >= limits.most_steps:
                    ended = STEP_LIMIT
                elif shorter < SHORTEST_STEP or not adaptive:
                    ended = NOT_A_NUMBER
                else:
                    continue
            else:
                q[STEPS * LANES + lane] += 1.0
                near_end, passing = event & (_ENDS | _STRIKES) > 0, event & _PASSES > 0
                meets, after = event & _MEETS > 0, int(q[AFTER * LANES + lane])
                if obstacles is None and passing and not near_end:
                    counted = count_chord(q, lane, mass[fragment], weight[fragment], limits, near, lengths, after)
                    passing = counted < 0
                    inside &= counted != 0
                if near_end or passing or meets or many_points > 0:
                    place_points(q, lane, points)
                    if near_end:
                        theta, ended, obstacle, face = ending(limits, terrain, obstacles, step)
                    until = min(theta, 1.0)
                    if ended != IN_FLIGHT or meets or passing or many_points > 0:
                        velocity_points(q, lane, points)
                    if passing:
                        inside &= count_path(
                            step, until, h, mass[fragment], weight[fragment], limits, terrain, near, lengths, after
                        )
                    if meets:
                        if hit_count + _ROOTS * witnesses.shape[0] > hits.shape[0]:
                            hits = _with_room(hits, hit_count, _ROOTS * witnesses.shape[0])
                        hit_count = record_hits(
                            witnesses, vertices, step, until, time, h, fragment, float(after), hits, hit_count
                        )
                    if many_points > 0:
                        path = _with_room(path, path_count, many_points)
                    for k in range(1, many_points + 1):
                        share = until * k / many_points
                        dense_state(points, share, out)
                        path[path_count, 0] = time + share * h
                        for j in range(6):
                            path[path_count, 1 + j] = out[j]
                        path[path_count, 7] = fragment
                        path_count += 1
                if ended == IN_FLIGHT:
                    go_on(q, lane, factor)
                    if q[FINAL * LANES + lane] > 0.0:
                        q[TIME * LANES + lane] = q[LATEST * LANES + lane]
                        ended = TIME_OUT
                    elif q[STEPS * LANES + lane] + q[REJECTED * LANES + lane] >= limits.most_steps:
                        ended = STEP_LIMIT
                    if ended == IN_FLIGHT:
                        continue
            # the flight has ended: at the lane's state, or at `theta` of this step
            _write_state(q, lane, end)
            if ended in (LANDED, LEFT_DOMAIN, STOPPED):
                dense_state(points, theta, out)
                end[0] += theta * h
                for j in range(6):
                    end[1 + j] = out[j]
                if ended == LANDED:
                    end[3] = limits.ground
                    if terrain is not None:
                        end[3] = height_at(terrain, end[1], end[2])
            _add_flight(q, lane, ends.first[row])
            struck, ground = _with_room(struck, struck_count, 1), _with_room(ground, ground_count, 1)
            if impact(
                row, ended, obstacle, face, end, ends, surfaces, limits, terrain, obstacles, struck[struck_count],
                ground[ground_count], keys[fragment], slopes[fragment],
            ):  # fmt: skip
                waiting[queued % number] = row
                queued += 1
            struck_count += ended == STOPPED
            ground_count += ended == LANDED
            free[lane] = True
    return hits[:hit_count], path[:path_count], struck[:struck_count], ground[:ground_count], inside


@kernel
def row_angles(opposite: NDArray[Any], adjacent: NDArray[Any], result: NDArray[Any]) -> None:
    """Angle of (adjacent, opposite), (rows,), from -180 to 180 degrees; numpy rounds by a row's place."""
    for row in range(opposite.size):
        result[row] = math.degrees(math.atan2(opposite[row], adjacent[row]))


@kernel
def row_lengths(first: NDArray[Any], second: NDArray[Any], result: NDArray[Any]) -> None:
    """Length of (first, second), (rows,)."""
    for row in range(first.size):
        result[row] = math.hypot(first[row], second[row])
