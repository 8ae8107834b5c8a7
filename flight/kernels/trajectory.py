"""From launch to its end, fragment by fragment: the loop over steps, crossings and endings."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from flight.kernels.motion import (
    AREA,
    HEIGHT,
    LANES,
    MACH,
    NEW,
    PLACE_ERROR,
    RELATIVE,
    ROWS,
    SLOPE,
    STATE,
    STEP,
    TIME,
    VELOCITY_ERROR,
    accelerate,
    place_points,
    take_step,
    velocity_points,
)
from flight.kernels.roots import STACK_SHAPE
from flight.kernels.surfaces import (
    CYLINDER,
    PIECES_SHAPE,
    cross_cylinder,
    cross_plane,
    dense_state,
    inside_outline,
    misses_box,
)

__all__ = ["HIT_COLUMNS", "OUTCOME_COLUMNS", "PATH_COLUMNS", "Limits", "fly_chunk"]

# time, place (3), velocity (3), steps taken, steps rejected, lowest and highest Mach number
OUTCOME_COLUMNS = 11
# time, place (3), velocity (3), witness, fragment, sense of the crossing
HIT_COLUMNS = 10
# time, place (3), velocity (3), fragment
PATH_COLUMNS = 8
# as in flight.result.Status
_IN_FLIGHT, _LANDED, _TIME_OUT, _LEFT_DOMAIN, _STEP_LIMIT, _NOT_A_NUMBER = 0, 1, 2, 3, 4, 5


class Limits(NamedTuple):
    """Where and when a flight ends, and how it is stepped. Units: m, s."""

    ground: float  # height of flat ground, nan: none
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


SAFETY, SMALLEST_FACTOR, LARGEST_FACTOR = 0.9, 0.2, 6.0
SHORTEST_STEP = 1e-12  # s; an error that shrinks with no step is not an error of the step
FIRST_STEP = 0.15  # times the time in which drag and gravity would undo the velocity
LEAST_SPEED = 1.0  # m/s; below it the tolerance is absolute


@njit(error_model="numpy")
def _prepare(ahead, first, stop, mass, shape_factor, position, velocity, around, limits):
    """Bring the next LANES fragments to their start in the scratch array `ahead`: state, acceleration, first step."""
    for lane in range(LANES):
        fragment = min(first + lane, stop - 1)
        for j in range(3):
            ahead[(STATE + j) * LANES + lane] = position[fragment, j]
            ahead[(STATE + 3 + j) * LANES + lane] = velocity[fragment, j]
            ahead[(RELATIVE + j) * LANES + lane] = velocity[fragment, j]
        ahead[HEIGHT * LANES + lane] = position[fragment, 2]
        m = mass[fragment]
        ahead[AREA * LANES + lane] = 0.5 * (m / shape_factor[fragment]) ** (2.0 / 3.0) / m
    accelerate(ahead, SLOPE, around)
    for lane in range(LANES):
        size = speed = 0.0
        for j in range(3):
            size += ahead[(SLOPE + j) * LANES + lane] ** 2
            speed += ahead[(STATE + 3 + j) * LANES + lane] ** 2
        h = FIRST_STEP * math.sqrt(max(speed, LEAST_SPEED) / size) if size > 0.0 else limits.time_limit
        ahead[STEP * LANES + lane] = h if limits.fixed_step <= 0.0 else limits.fixed_step


@njit(error_model="numpy")
def _load(q, lane, ahead, place):
    """Put the fragment prepared at `place` of `ahead` into a lane; returns its Mach number."""
    for j in range(6):
        q[(STATE + j) * LANES + lane] = ahead[(STATE + j) * LANES + place]
    for j in range(3):
        q[(SLOPE + j) * LANES + lane] = ahead[(SLOPE + j) * LANES + place]
    q[AREA * LANES + lane] = ahead[AREA * LANES + place]
    q[STEP * LANES + lane] = ahead[STEP * LANES + place]
    q[TIME * LANES + lane] = 0.0
    return ahead[MACH * LANES + place]


@njit(error_model="numpy")
def _move_lane(q, source, target):
    """Copy what a lane carries from step to step."""
    for j in range(6):
        q[(STATE + j) * LANES + target] = q[(STATE + j) * LANES + source]
    for j in range(3):
        q[(SLOPE + j) * LANES + target] = q[(SLOPE + j) * LANES + source]
    q[AREA * LANES + target] = q[AREA * LANES + source]
    q[STEP * LANES + target] = q[STEP * LANES + source]
    q[TIME * LANES + target] = q[TIME * LANES + source]


@njit(error_model="numpy")
def _step_factors(q, factors, limits):
    """Factor of the next step of every lane; below zero where this step is rejected, nan where it gave no number.

    The exponent 3/16 stands for the classical 1/5: it needs square roots only, which the processor takes for all lanes together.
    """
    smallest = LEAST_SPEED * LEAST_SPEED
    sharpness = limits.tolerance * limits.tolerance
    for i in range(LANES):
        h = q[STEP * LANES + i]
        u, v, w = q[(STATE + 3) * LANES + i], q[(STATE + 4) * LANES + i], q[(STATE + 5) * LANES + i]
        before = u * u + v * v + w * w
        u, v, w = q[(NEW + 3) * LANES + i], q[(NEW + 4) * LANES + i], q[(NEW + 5) * LANES + i]
        after = u * u + v * v + w * w
        reference = after if after > before else before
        reference = (reference if reference > smallest else smallest) * sharpness
        place, velocity = q[PLACE_ERROR * LANES + i] / (h * h), q[VELOCITY_ERROR * LANES + i]
        error = (velocity if velocity > place else place) / reference + 1e-30
        eighth = math.sqrt(math.sqrt(math.sqrt(error)))
        sixteenth = math.sqrt(eighth)
        factor = SAFETY / (sixteenth * math.sqrt(sixteenth))
        factor = SMALLEST_FACTOR if factor < SMALLEST_FACTOR else factor
        factor = LARGEST_FACTOR if factor > LARGEST_FACTOR else factor
        factors[i] = factor if error <= 1.0 else -factor
        factors[i] = factors[i] + 0.0 * after  # not a number, or infinite, stays so


@njit(error_model="numpy")
def _may_end(q, lane, limits):
    """Tell whether the step's hull leaves the space between ground, ceiling and floor, or there is a radius to check."""
    h = q[STEP * LANES + lane]
    start, end = q[(STATE + 2) * LANES + lane], q[(NEW + 2) * LANES + lane]
    first, last = 0.2 * h * q[(STATE + 5) * LANES + lane], 0.2 * h * q[(NEW + 5) * LANES + lane]
    p1, p4 = start + first, end - last
    p2 = start + 2.0 * first + 0.05 * h * h * q[(SLOPE + 2) * LANES + lane]
    p3 = end - 2.0 * last + 0.05 * h * h * q[(SLOPE + 20) * LANES + lane]
    low = min(min(min(start, end), min(p1, p4)), min(p2, p3))
    high = max(max(max(start, end), max(p1, p4)), max(p2, p3))
    return low < limits.ground or low < limits.floor or high > limits.ceiling or limits.domain_radius < np.inf


@njit(error_model="numpy")
def _ending(points, limits, pieces, stack, roots):
    """Place on the step where the flight ends and its status; 2.0 if it goes on."""
    theta, status = 2.0, _IN_FLIGHT
    if limits.ground == limits.ground and cross_plane(points, 0.0, 0.0, limits.ground, 0.0, 0.0, 1.0, stack, roots) > 0:
        theta, status = roots[0], _LANDED
    if limits.ceiling < np.inf:
        found = cross_plane(points, 0.0, 0.0, limits.ceiling, 0.0, 0.0, -1.0, stack, roots)
        if found > 0 and roots[0] < theta:
            theta, status = roots[0], _LEFT_DOMAIN
    if limits.floor > -np.inf:
        found = cross_plane(points, 0.0, 0.0, limits.floor, 0.0, 0.0, 1.0, stack, roots)
        if found > 0 and roots[0] < theta:
            theta, status = roots[0], _LEFT_DOMAIN
    if limits.domain_radius < np.inf:
        found = cross_cylinder(points, limits.origin_x, limits.origin_y, limits.domain_radius, pieces, stack, roots)
        if found > 0 and roots[0] < theta:
            theta, status = roots[0], _LEFT_DOMAIN
    return theta, status


@njit(error_model="numpy")
def _outside(q, lane, limits):
    """Tell whether a fragment starts outside the domain."""
    dx, dy = q[STATE * LANES + lane] - limits.origin_x, q[(STATE + 1) * LANES + lane] - limits.origin_y
    z = q[(STATE + 2) * LANES + lane]
    return z > limits.ceiling or z < limits.floor or dx * dx + dy * dy >= limits.domain_radius * limits.domain_radius


@njit(error_model="numpy")
def _record_hits(witnesses, vertices, points, until, time, h, fragment, pieces, stack, roots, out, hits, count):
    """Append the crossings of this step up to its place `until`; returns the new count, -1 if `hits` is full."""
    for index in range(witnesses.shape[0]):
        row = witnesses[index]
        if misses_box(points, row):
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
            if count == hits.shape[0]:
                return -1
            if is_cylinder:
                sense = (out[0] - row[7]) * out[3] + (out[1] - row[8]) * out[4]
            else:
                sense = row[10] * out[3] + row[11] * out[4] + row[12] * out[5]
            hits[count, 0] = time + theta * h
            for i in range(6):
                hits[count, 1 + i] = out[i]
            hits[count, 7] = index
            hits[count, 8] = fragment
            hits[count, 9] = 1.0 if sense >= 0.0 else -1.0
            count += 1
    return count


def _compile(source_stamp: str) -> Any:
    """Compile the loop; the stamp enters the key of numba's cache, which by itself looks at one source file only."""

    @njit(nogil=True, cache=True, error_model="numpy")
    def fly_chunk(
        start, stop, mass, shape_factor, position, velocity, around, limits, witnesses, vertices, everything,
        outcome, status, hits, path,
    ):  # fmt: skip
        """Fly the fragments start..stop-1; rows of `outcome` and `status` count from `start`.

        Returns the rows used of `hits` and `path`, in no order of fragments; -1 where one of them had no room for all: fly
        again with more.
        """
        if len(source_stamp) == 0 or stop <= start:
            return 0, 0
        q, ahead, factors = np.zeros(ROWS * LANES), np.zeros(ROWS * LANES), np.zeros(LANES)
        out, points, stack, roots = np.empty(6), np.zeros((6, 6)), np.empty(STACK_SHAPE), np.empty(16)
        pieces = np.empty(PIECES_SHAPE)
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
                    _move_lane(q, active, lane)
                    flying[lane], fresh[lane] = flying[active], fresh[active]
                    continue
                place = (following - start) % LANES
                if place == 0:
                    _prepare(ahead, following, stop, mass, shape_factor, position, velocity, around, limits)
                mach = _load(q, lane, ahead, place)
                flying[lane] = following
                row = outcome[following - start]
                row[7] = row[8] = 0.0
                row[9] = row[10] = mach
                fresh[lane] = False
                if many_points > 0:
                    if path_count == path.shape[0]:
                        return 0, -1
                    path[path_count, 0] = 0.0
                    for j in range(6):
                        path[path_count, 1 + j] = q[(STATE + j) * LANES + lane]
                    path[path_count, 7] = following
                    path_count += 1
                if _outside(q, lane, limits):
                    status[following - start] = _LEFT_DOMAIN
                    row[0] = 0.0
                    for j in range(6):
                        row[1 + j] = q[(STATE + j) * LANES + lane]
                    fresh[lane] = True
                following += 1
            if active == 0:
                break

            for lane in range(active):
                h = limits.fixed_step if not adaptive else min(q[STEP * LANES + lane], limits.longest_step)
                time = q[TIME * LANES + lane]
                final[lane] = time + h >= limits.time_limit
                q[STEP * LANES + lane] = limits.time_limit - time if final[lane] else h
            take_step(q, around)
            _step_factors(q, factors, limits)

            for lane in range(active):
                fragment = flying[lane]
                row = outcome[fragment - start]
                h, time, factor = q[STEP * LANES + lane], q[TIME * LANES + lane], factors[lane]
                ending, theta = _IN_FLIGHT, 2.0
                if not adaptive:
                    factor = 1.0 if factor == factor else factor
                if not factor > 0.0:
                    row[8] += 1.0
                    shorter = h * (-factor if factor < 0.0 else SMALLEST_FACTOR)
                    q[STEP * LANES + lane] = shorter
                    if row[7] + row[8] >= limits.most_steps:
                        ending = _STEP_LIMIT
                    elif shorter < SHORTEST_STEP or not adaptive:
                        ending = _NOT_A_NUMBER
                    else:
                        continue
                    theta = 0.0
                else:
                    row[7] += 1.0
                    may_end = _may_end(q, lane, limits)
                    if may_end or witnesses.shape[0] > 0 or many_points > 0:
                        place_points(q, lane, points)
                        if may_end:
                            theta, ending = _ending(points, limits, pieces, stack, roots)
                        until = min(theta, 1.0)
                        near = witnesses.shape[0] > 0 and not misses_box(points, everything)
                        if ending != _IN_FLIGHT or near or many_points > 0:
                            velocity_points(q, lane, points)
                        if near:
                            hit_count = _record_hits(
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
                                return -1, 0
                        for k in range(1, many_points + 1):
                            if path_count == path.shape[0]:
                                return 0, -1
                            share = until * k / many_points
                            dense_state(points, share, out)
                            path[path_count, 0] = time + share * h
                            for j in range(6):
                                path[path_count, 1 + j] = out[j]
                            path[path_count, 7] = fragment
                            path_count += 1
                    if ending == _IN_FLIGHT:
                        mach = q[MACH * LANES + lane]
                        row[9], row[10] = min(row[9], mach), max(row[10], mach)
                        for j in range(6):
                            q[(STATE + j) * LANES + lane] = q[(NEW + j) * LANES + lane]
                        for j in range(3):
                            q[(SLOPE + j) * LANES + lane] = q[(SLOPE + 18 + j) * LANES + lane]
                        q[TIME * LANES + lane] = time + h
                        q[STEP * LANES + lane] = h * factor
                        if final[lane]:
                            q[TIME * LANES + lane] = limits.time_limit
                            ending = _TIME_OUT
                        elif row[7] + row[8] >= limits.most_steps:
                            ending = _STEP_LIMIT
                        if ending == _IN_FLIGHT:
                            continue
                        theta = 0.0
                # the flight has ended: at the lane's state, or at `theta` of this step
                row[0] = q[TIME * LANES + lane]
                for j in range(6):
                    row[1 + j] = q[(STATE + j) * LANES + lane]
                if ending == _LANDED or ending == _LEFT_DOMAIN:
                    dense_state(points, theta, out)
                    row[0] += theta * h
                    for j in range(6):
                        row[1 + j] = out[j]
                    if ending == _LANDED:
                        row[3] = limits.ground
                status[fragment - start] = ending
                fresh[lane] = True
        return hit_count, path_count

    return fly_chunk


_SOURCES = sorted(Path(__file__).parent.glob("*.py"))
fly_chunk = _compile(hashlib.sha256(b"".join(path.read_bytes() for path in _SOURCES)).hexdigest())
