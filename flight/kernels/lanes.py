"""Lanes: setting fragments to their start, the size of their next step, and which lanes need a closer look."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from flight.kernels.compiling import inner_kernel
from flight.kernels.motion import (
    AFTER,
    AGAIN,
    AREA,
    EVENT,
    FASTEST,
    FINAL,
    GROUND,
    HEIGHT,
    HIGHEST_MACH,
    HULL,
    LANES,
    LATEST,
    LOWEST_MACH,
    MACH,
    MASS,
    NEW,
    NEXT,
    PLACE_ERROR,
    QUIET,
    REJECTED,
    RELATIVE,
    RISE,
    SLOPE,
    STATE,
    STEP,
    STEPS,
    TIME,
    VELOCITY_ERROR,
    accelerate,
)
from flight.kernels.terrain import height_at

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.kernels.events import Limits
    from flight.kernels.motion import Surroundings
    from flight.kernels.terrain import Terrain

    Array = NDArray[np.float64]

SAFETY, SMALLEST_FACTOR, LARGEST_FACTOR = 0.9, 0.2, 6.0
FIRST_STEP = 0.15  # times the time in which drag and gravity would undo the velocity
MIN_SPEED = 1.0  # m/s; below it the tolerance is absolute
SHORTEST_STEP = 1e-12  # s; an error that shrinks with no step is not an error of the step
# what a step needs a closer look for: the flight may end, off obstacles or on one; a path is to be counted near the
# ground; a witness may be crossed; anything else; the step itself
ENDS, STRIKES, PASSES, MEETS, _OTHER, _LOOK = 1.0, 2.0, 4.0, 8.0, 16.0, 32.0


class Watched(NamedTuple):
    """Where steps need a closer look. Units: m, J."""

    boxes: Array  # (4, 6) around all obstacles, in which none is struck, around all witnesses, in which none is met
    any_box: bool  # whether there is an obstacle or a witness
    counted_below: float  # height below which paths are counted; -inf: none are
    energy: float  # from which they are
    highest: float  # point of a map; -inf: there is none
    always: bool  # whether every step is looked at


@inner_kernel()
def prepare(
    ahead: Array, rows: NDArray[np.int64], number: int, start: int, state: Array, mass: Array, shape_factor: Array,
    around: Surroundings, limits: Limits, terrain: Terrain | None,
) -> None:  # fmt: skip
    """Bring the next fragments to their start in the scratch array `ahead`: state, acceleration, first step.

    The first `number` of `rows` (LANES,) are their rows of `state` (time, position, velocity); fragments count from
    `start`.
    """
    for lane in range(LANES):
        row = rows[min(lane, number - 1)]
        for j in range(6):
            ahead[(STATE + j) * LANES + lane] = state[row, 1 + j]
        for j in range(3):
            ahead[(RELATIVE + j) * LANES + lane] = state[row, 4 + j]
        ahead[HEIGHT * LANES + lane] = state[row, 3]
        ahead[TIME * LANES + lane] = state[row, 0]
        m = mass[start + row]
        ahead[MASS * LANES + lane] = m
        ahead[AREA * LANES + lane] = 0.5 * (m / shape_factor[start + row]) ** (2.0 / 3.0) / m
        ahead[GROUND * LANES + lane] = around.ground
        if terrain is not None and changes_with_height(around):
            ahead[GROUND * LANES + lane] = height_at(terrain, state[row, 1], state[row, 2])
    accelerate(ahead, SLOPE, 0.0, around)
    for lane in range(LANES):
        size = speed = 0.0
        for j in range(3):
            size += ahead[(SLOPE + j) * LANES + lane] ** 2
            speed += ahead[(STATE + 3 + j) * LANES + lane] ** 2
        h = FIRST_STEP * math.sqrt(max(speed, MIN_SPEED) / size) if size > 0.0 else limits.time_limit
        ahead[STEP * LANES + lane] = h if limits.fixed_step <= 0.0 else limits.fixed_step
        ahead[STEPS * LANES + lane] = ahead[REJECTED * LANES + lane] = 0.0
        ahead[LOWEST_MACH * LANES + lane] = ahead[HIGHEST_MACH * LANES + lane] = ahead[MACH * LANES + lane]


@inner_kernel()
def changes_with_height(around: Surroundings) -> bool:
    """Whether the wind is a profile, so that over a map it changes with the height of the ground below."""
    return around.wind_rows.shape[0] > 2


@inner_kernel()
def foresee_ground(q: Array, terrain: Terrain) -> None:
    """Rise of the ground below every lane over its step, to where its velocity and acceleration take it."""
    for i in range(LANES):
        h = q[STEP * LANES + i]
        x = q[STATE * LANES + i] + h * (q[(STATE + 3) * LANES + i] + 0.5 * h * q[SLOPE * LANES + i])
        y = q[(STATE + 1) * LANES + i] + h * (q[(STATE + 4) * LANES + i] + 0.5 * h * q[(SLOPE + 1) * LANES + i])
        q[RISE * LANES + i] = height_at(terrain, x, y) - q[GROUND * LANES + i]


@inner_kernel()
def load(q: Array, lane: int, ahead: Array, place: int) -> None:
    """Put the fragment prepared at `place` of `ahead` into a lane."""
    for j in range(6):
        q[(STATE + j) * LANES + lane] = ahead[(STATE + j) * LANES + place]
    for j in range(3):
        q[(SLOPE + j) * LANES + lane] = ahead[(SLOPE + j) * LANES + place]
    for row in (GROUND, AREA, STEP, TIME, MASS, LATEST, AFTER, STEPS, REJECTED, LOWEST_MACH, HIGHEST_MACH):
        q[row * LANES + lane] = ahead[row * LANES + place]


@inner_kernel(forceinline=True)
def begin_steps(q: Array, limits: Limits) -> None:
    """Size of the step of every lane, and whether it is the last one before the fragment's time is over."""
    for i in range(LANES):
        h = min(q[STEP * LANES + i], limits.longest_step)
        h = limits.fixed_step if limits.fixed_step > 0.0 else h
        time, latest = q[TIME * LANES + i], q[LATEST * LANES + i]
        final = time + h >= latest
        q[FINAL * LANES + i] = 1.0 if final else 0.0
        q[STEP * LANES + i] = latest - time if final else h


@inner_kernel(forceinline=True)
def step_factors(q: Array, limits: Limits) -> None:
    """Factor of the next step of every lane; below zero where this step is rejected, nan where it failed.

    The exponent 3/16 stands for the classical 1/5: it needs square roots only, which the processor takes for all
    lanes together.
    """
    smallest = MIN_SPEED * MIN_SPEED
    sharpness = limits.tolerance * limits.tolerance
    for i in range(LANES):
        h = q[STEP * LANES + i]
        u, v, w = q[(STATE + 3) * LANES + i], q[(STATE + 4) * LANES + i], q[(STATE + 5) * LANES + i]
        before = u * u + v * v + w * w
        u, v, w = q[(NEW + 3) * LANES + i], q[(NEW + 4) * LANES + i], q[(NEW + 5) * LANES + i]
        after = u * u + v * v + w * w
        reference = max(before, after)
        q[FASTEST * LANES + i] = reference
        reference = (max(smallest, reference)) * sharpness
        place, velocity = q[PLACE_ERROR * LANES + i] / (h * h), q[VELOCITY_ERROR * LANES + i]
        error = (max(place, velocity)) / reference + 1e-30
        eighth = math.sqrt(math.sqrt(math.sqrt(error)))
        sixteenth = math.sqrt(eighth)
        factor = SAFETY / (sixteenth * math.sqrt(sixteenth))
        factor = max(factor, SMALLEST_FACTOR)
        factor = min(factor, LARGEST_FACTOR)
        factor = factor if error <= 1.0 else -factor
        q[NEXT * LANES + i] = factor + 0.0 * after  # not a number, or infinite, stays so
    if limits.fixed_step > 0.0:
        for i in range(LANES):
            q[NEXT * LANES + i] = 1.0 + 0.0 * q[NEXT * LANES + i]


@inner_kernel(forceinline=True)
def _hull(q: Array, axis: int) -> None:
    """Lowest and highest control point of every lane's step along an axis (`motion.place_points`)."""
    for i in range(LANES):
        h = q[STEP * LANES + i]
        start, end = q[(STATE + axis) * LANES + i], q[(NEW + axis) * LANES + i]
        first, last = 0.2 * h * q[(STATE + 3 + axis) * LANES + i], 0.2 * h * q[(NEW + 3 + axis) * LANES + i]
        p1, p4 = start + first, end - last
        p2 = start + 2.0 * first + 0.05 * h * h * q[(SLOPE + axis) * LANES + i]
        p3 = end - 2.0 * last + 0.05 * h * h * q[(SLOPE + 18 + axis) * LANES + i]
        q[(HULL + 2 * axis) * LANES + i] = min(start, end, p1, p4, p2, p3)
        q[(HULL + 2 * axis + 1) * LANES + i] = max(start, end, p1, p4, p2, p3)


@inner_kernel(forceinline=True)
def _mark_box(q: Array, box: Array, inner: Array, mark: float) -> None:
    """Mark the lanes whose hull touches a box, and is not wholly within an inner one."""
    x0, x1, y0, y1, z0, z1 = box[0], box[1], box[2], box[3], box[4], box[5]
    u0, u1, v0, v1, w0, w1 = inner[0], inner[1], inner[2], inner[3], inner[4], inner[5]
    for i in range(LANES):
        left, right = q[HULL * LANES + i], q[(HULL + 1) * LANES + i]
        front, back = q[(HULL + 2) * LANES + i], q[(HULL + 3) * LANES + i]
        low, high = q[(HULL + 4) * LANES + i], q[(HULL + 5) * LANES + i]
        misses = (right < x0) | (left > x1) | (back < y0) | (front > y1) | (high < z0) | (low > z1)
        within = (left > u0) & (right < u1) & (front > v0) & (back < v1) & (low > w0) & (high < w1)
        q[EVENT * LANES + i] += 0.0 if misses | within else mark


@inner_kernel(forceinline=True)
def sift(q: Array, limits: Limits, watched: Watched) -> None:
    """Take to their next step the lanes on whose step nothing can happen; EVENT is 0 for these, else what may."""
    _hull(q, 2)
    ground, floor, ceiling, top = limits.ground, limits.floor, limits.ceiling, watched.highest
    everywhere = ENDS if limits.domain_radius < np.inf else 0.0
    below, energy, always = watched.counted_below, watched.energy, _OTHER if watched.always else 0.0
    for i in range(LANES):
        low, high = q[(HULL + 4) * LANES + i], q[(HULL + 5) * LANES + i]
        ends = (low < ground) | (low < floor) | (high > ceiling) | (low <= top)
        passes = (low < below) & (0.5 * q[MASS * LANES + i] * q[FASTEST * LANES + i] >= energy)
        event = (ENDS if ends else everywhere) + (PASSES if passes else 0.0)
        q[EVENT * LANES + i] = event + (always + _OTHER * q[FINAL * LANES + i])
    if watched.any_box:
        _hull(q, 0)
        _hull(q, 1)
        _mark_box(q, watched.boxes[0], watched.boxes[1], STRIKES)
        _mark_box(q, watched.boxes[2], watched.boxes[3], MEETS)
    most = float(limits.most_steps)
    for i in range(LANES):
        h, factor = q[STEP * LANES + i], q[NEXT * LANES + i]
        more = q[STEPS * LANES + i] + q[REJECTED * LANES + i] + 1.0 < most
        again = (factor < 0.0) & (-factor * h >= SHORTEST_STEP) & more
        quiet = (factor > 0.0) & (q[EVENT * LANES + i] == 0.0) & more
        event = q[EVENT * LANES + i] if factor > 0.0 else 0.0
        q[EVENT * LANES + i] = 0.0 if again | quiet else event + _LOOK
        q[AGAIN * LANES + i] = 1.0 if again else 0.0
        q[QUIET * LANES + i] = 1.0 if quiet else 0.0
    for i in range(LANES):
        h, mach = q[STEP * LANES + i], q[MACH * LANES + i]
        again, quiet = q[AGAIN * LANES + i], q[QUIET * LANES + i]
        following = h * (abs(q[NEXT * LANES + i]))
        q[STEP * LANES + i] = following if again + quiet > 0.0 else h
        q[TIME * LANES + i] += h if quiet > 0.0 else 0.0
        q[GROUND * LANES + i] += q[RISE * LANES + i] if quiet > 0.0 else 0.0
        q[STEPS * LANES + i] += quiet
        q[REJECTED * LANES + i] += again
        lowest, highest = q[LOWEST_MACH * LANES + i], q[HIGHEST_MACH * LANES + i]
        q[LOWEST_MACH * LANES + i] = min(lowest, mach) if quiet > 0.0 else lowest
        q[HIGHEST_MACH * LANES + i] = max(highest, mach) if quiet > 0.0 else highest
    for j in range(9):
        old, new = (STATE + j, NEW + j) if j < 6 else (SLOPE + j - 6, SLOPE + 12 + j)
        for i in range(LANES):
            before, after = q[old * LANES + i], q[new * LANES + i]
            q[old * LANES + i] = after if q[QUIET * LANES + i] > 0.0 else before


@inner_kernel()
def go_on(q: Array, lane: int, factor: float) -> None:
    """Take one lane to its next step."""
    mach = q[MACH * LANES + lane]
    q[LOWEST_MACH * LANES + lane] = min(q[LOWEST_MACH * LANES + lane], mach)
    q[HIGHEST_MACH * LANES + lane] = max(q[HIGHEST_MACH * LANES + lane], mach)
    for j in range(6):
        q[(STATE + j) * LANES + lane] = q[(NEW + j) * LANES + lane]
    for j in range(3):
        q[(SLOPE + j) * LANES + lane] = q[(SLOPE + 18 + j) * LANES + lane]
    h = q[STEP * LANES + lane]
    q[TIME * LANES + lane] += h
    q[GROUND * LANES + lane] += q[RISE * LANES + lane]
    q[STEP * LANES + lane] = h * factor
