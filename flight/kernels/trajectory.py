"""From launch to its end, fragment by fragment: the loop over steps, crossings and endings."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from flight.kernels.motion import acceleration, control_points, take_step, velocity_points
from flight.kernels.roots import STACK_SHAPE
from flight.kernels.surfaces import (
    CYLINDER,
    cross_cylinder,
    cross_plane,
    dense_state,
    inside_outline,
    misses_box,
    refine,
)

__all__ = ["HIT_COLUMNS", "OUTCOME_COLUMNS", "PATH_COLUMNS", "Limits", "fly_chunk"]

# time, place (3), velocity (3), steps taken, steps rejected, lowest and highest Mach number
OUTCOME_COLUMNS = 11
# time, place (3), velocity (3), witness, fragment, sense of the crossing
HIT_COLUMNS = 10
# time, place (3), velocity (3), fragment
PATH_COLUMNS = 8
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
FIRST_STEP = 0.15  # times the time in which drag and gravity would undo the velocity
LEAST_SPEED = 1.0  # m/s; below it the tolerance is absolute


@njit(error_model="numpy")
def _first_ending(points, limits, stack, roots, plane):
    """Place on the step where the flight ends, its status, and the surface in `plane`; 2.0 if it goes on."""
    theta, status = 2.0, _IN_FLIGHT
    p = points[2]
    low = min(min(p[1], p[2]), min(p[3], p[4]))
    # numbers that are not (no ground) compare false
    if low < limits.ground and cross_plane(points, 0.0, 0.0, limits.ground, 0.0, 0.0, 1.0, stack, roots) > 0:
        theta, status = roots[0], _LANDED
    if max(max(p[0], p[1]), max(p[2], max(p[3], p[4]))) > limits.ceiling:
        found = cross_plane(points, 0.0, 0.0, limits.ceiling, 0.0, 0.0, -1.0, stack, roots)
        if found > 0 and roots[0] < theta:
            theta, status = roots[0], _LEFT_DOMAIN
    if min(p[0], low) < limits.floor:
        found = cross_plane(points, 0.0, 0.0, limits.floor, 0.0, 0.0, 1.0, stack, roots)
        if found > 0 and roots[0] < theta:
            theta, status = roots[0], _LEFT_DOMAIN
    if limits.domain_radius < np.inf:
        found = cross_cylinder(points, limits.origin_x, limits.origin_y, limits.domain_radius, stack, roots)
        if found > 0 and roots[0] < theta:
            theta, status = roots[0], _LEFT_DOMAIN
    return theta, status


@njit(error_model="numpy")
def _outside(limits, state):
    """Tell whether a fragment starts outside the domain."""
    dx, dy = state[0] - limits.origin_x, state[1] - limits.origin_y
    return (
        state[2] > limits.ceiling
        or state[2] < limits.floor
        or dx * dx + dy * dy >= limits.domain_radius * limits.domain_radius
    )


@njit(error_model="numpy")
def _order_by_time(hits, first, last):
    """Sort the rows first..last-1 by time, in place (they are few and nearly sorted)."""
    for i in range(first + 1, last):
        j = i
        while j > first and hits[j, 0] < hits[j - 1, 0]:
            for column in range(HIT_COLUMNS):
                hits[j, column], hits[j - 1, column] = hits[j - 1, column], hits[j, column]
            j -= 1


@njit(error_model="numpy")
def _record_hits(
    witnesses, vertices, everything, state, new, slopes, h, until, time, fragment, half_area_per_mass, around,
    points, stack, roots, plane, trial, out, hits, count,
):  # fmt: skip
    """Append the crossings of this step up to its place `until`; returns the new count, -1 if `hits` is full."""
    if misses_box(points, everything):
        return count
    ready = False
    for index in range(witnesses.shape[0]):
        row = witnesses[index]
        if misses_box(points, row):
            continue
        if int(row[0]) == CYLINDER:
            radius = row[10]
            found = cross_cylinder(points, row[7], row[8], radius, stack, roots)
        else:
            radius = 0.0
            found = cross_plane(points, row[7], row[8], row[9], row[10], row[11], row[12], stack, roots)
        for k in range(found):
            theta = roots[k]
            if theta > until:
                break
            if not ready:
                velocity_points(state, new, slopes, h, points)
                ready = True
            for i in range(6):
                plane[i] = row[7 + i]
            moment = refine(state, slopes, h, theta, plane, radius, half_area_per_mass, around, trial, points, out)
            if not inside_outline(row, vertices, out[0], out[1], out[2]):
                continue
            if count == hits.shape[0]:
                return -1
            if radius > 0.0:
                sense = (out[0] - row[7]) * out[3] + (out[1] - row[8]) * out[4]
            else:
                sense = row[10] * out[3] + row[11] * out[4] + row[12] * out[5]
            hits[count, 0] = time + moment
            for i in range(6):
                hits[count, 1 + i] = out[i]
            hits[count, 7] = index
            hits[count, 8] = fragment
            hits[count, 9] = 1.0 if sense >= 0.0 else -1.0
            count += 1
    return count


def _fly_chunk(source_stamp: str) -> Any:
    """Compile the loop; the stamp enters the key of numba's cache, which by itself looks at one source file only."""

    @njit(nogil=True, cache=True, error_model="numpy")
    def fly_chunk(
        start, stop, mass, shape_factor, position, velocity, around, limits, witnesses, vertices, everything,
        outcome, status, hits, path,
    ):  # fmt: skip
        """Fly the fragments start..stop-1; rows of `outcome` and `status` count from `start`.

        Returns the fragment reached (stop, or the one for which `hits` or `path` had no room: fly on from there with more), and the
        rows used of `hits` and `path`.
        """
        if len(source_stamp) == 0:
            return start, 0, 0
        state, new, out = np.empty(6), np.empty(6), np.empty(6)
        slopes, trial = np.empty((7, 3)), np.empty((7, 3))
        points, stack, roots = np.empty((6, 5)), np.empty(STACK_SHAPE), np.empty(16)
        plane = np.empty(12)
        tolerance_squared = limits.tolerance * limits.tolerance
        adaptive = limits.fixed_step <= 0.0
        hit_count = path_count = 0
        for fragment in range(start, stop):
            hits_before, path_before = hit_count, path_count
            for i in range(3):
                state[i] = position[fragment, i]
                state[3 + i] = velocity[fragment, i]
            half_area_per_mass = 0.5 * (mass[fragment] / shape_factor[fragment]) ** (2.0 / 3.0) / mass[fragment]
            a, b, c, mach = acceleration(state[2], state[3], state[4], state[5], half_area_per_mass, around)
            slopes[0, 0], slopes[0, 1], slopes[0, 2] = a, b, c
            lowest_mach = highest_mach = mach
            speed_squared = state[3] ** 2 + state[4] ** 2 + state[5] ** 2
            size = math.sqrt(a * a + b * b + c * c)
            h = FIRST_STEP * max(math.sqrt(speed_squared), LEAST_SPEED) / size if size > 0.0 else limits.time_limit
            time, steps, rejected, ending = 0.0, 0, 0, _IN_FLIGHT
            if _outside(limits, state):
                ending = _LEFT_DOMAIN
            if limits.path_points > 0:
                if path_count == path.shape[0]:
                    return fragment, hits_before, path_before
                path[path_count, 0] = 0.0
                path[path_count, 1:7] = state
                path[path_count, 7] = fragment
                path_count += 1
            while ending == _IN_FLIGHT:
                if steps + rejected >= limits.most_steps:
                    ending = _STEP_LIMIT
                    break
                if not adaptive:
                    h = limits.fixed_step
                h = min(h, limits.longest_step)
                final = time + h >= limits.time_limit
                if final:
                    h = limits.time_limit - time
                place_error, velocity_error, mach = take_step(state, slopes, new, h, half_area_per_mass, around)
                new_speed_squared = new[3] ** 2 + new[4] ** 2 + new[5] ** 2
                factor = 1.0
                if adaptive:
                    reference = max(max(speed_squared, new_speed_squared), LEAST_SPEED * LEAST_SPEED) * tolerance_squared
                    error = max(velocity_error, place_error / (h * h)) / reference
                    if not error <= 1.0:
                        rejected += 1
                        if not error < np.inf:
                            h *= SMALLEST_FACTOR
                            if h < 1e-12:
                                ending = _NOT_A_NUMBER
                        else:
                            h *= max(SMALLEST_FACTOR, SAFETY * error ** (-0.1))
                        continue
                    factor = min(LARGEST_FACTOR, SAFETY * error ** (-0.1)) if error > 0.0 else LARGEST_FACTOR
                elif not new_speed_squared < np.inf:
                    ending = _NOT_A_NUMBER
                    break
                steps += 1
                lowest_mach, highest_mach = min(lowest_mach, mach), max(highest_mach, mach)
                control_points(state, new, slopes, h, points)
                theta, ending = _first_ending(points, limits, stack, roots, plane)
                until = min(theta, 1.0)
                if witnesses.shape[0] > 0:
                    hit_count = _record_hits(
                        witnesses, vertices, everything, state, new, slopes, h, until, time, fragment, half_area_per_mass,
                        around, points, stack, roots, plane, trial, out, hits, hit_count,
                    )  # fmt: skip
                    if hit_count < 0:
                        return fragment, hits_before, path_before
                if limits.path_points > 0:
                    if path_count + limits.path_points > path.shape[0]:
                        return fragment, hits_before, path_before
                    velocity_points(state, new, slopes, h, points)
                    for k in range(1, limits.path_points + 1):
                        share = until * k / limits.path_points
                        dense_state(points, share, out)
                        path[path_count, 0] = time + share * h
                        path[path_count, 1:7] = out
                        path[path_count, 7] = fragment
                        path_count += 1
                if ending == _IN_FLIGHT:
                    time += h
                    for i in range(6):
                        state[i] = new[i]
                    for i in range(3):
                        slopes[0, i] = slopes[6, i]
                    speed_squared = new_speed_squared
                    h *= factor
                    if final:
                        time = limits.time_limit
                        ending = _TIME_OUT
                elif ending == _LANDED:
                    velocity_points(state, new, slopes, h, points)
                    plane[0], plane[1], plane[2] = 0.0, 0.0, limits.ground
                    plane[3], plane[4], plane[5] = 0.0, 0.0, 1.0
                    time += refine(
                        state, slopes, h, theta, plane, 0.0, half_area_per_mass, around, trial, points, out
                    )
                    for i in range(6):
                        state[i] = out[i]
                    state[2] = limits.ground
                else:
                    velocity_points(state, new, slopes, h, points)
                    dense_state(points, theta, out)
                    time += theta * h
                    for i in range(6):
                        state[i] = out[i]
            _order_by_time(hits, hits_before, hit_count)
            row = outcome[fragment - start]
            row[0] = time
            for i in range(6):
                row[1 + i] = state[i]
            row[7], row[8], row[9], row[10] = steps, rejected, lowest_mach, highest_mach
            status[fragment - start] = ending
        return stop, hit_count, path_count

    return fly_chunk


_SOURCES = sorted(Path(__file__).parent.glob("*.py"))
fly_chunk = _fly_chunk(hashlib.sha256(b"".join(path.read_bytes() for path in _SOURCES)).hexdigest())
