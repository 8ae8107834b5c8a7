"""Lanes: setting fragments to their start, and the size of their next step."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from flight.kernels.compiling import inner_kernel
from flight.kernels.motion import (
    AREA,
    HEIGHT,
    LANES,
    MACH,
    NEW,
    PLACE_ERROR,
    RELATIVE,
    SLOPE,
    STATE,
    STEP,
    TIME,
    VELOCITY_ERROR,
    accelerate,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.kernels.events import Limits
    from flight.kernels.motion import Surroundings

    Array = NDArray[np.float64]

__all__ = ["SMALLEST_FACTOR", "load", "move_lane", "prepare", "step_factors"]

SAFETY, SMALLEST_FACTOR, LARGEST_FACTOR = 0.9, 0.2, 6.0
FIRST_STEP = 0.15  # times the time in which drag and gravity would undo the velocity
MIN_SPEED = 1.0  # m/s; below it the tolerance is absolute


@inner_kernel()
def prepare(
    ahead: Array,
    first: int,
    stop: int,
    mass: Array,
    shape_factor: Array,
    position: Array,
    velocity: Array,
    clock: Array,
    around: Surroundings,
    limits: Limits,
) -> None:
    """Bring the next LANES fragments to their start in the scratch array `ahead`: state, acceleration, first step."""
    for lane in range(LANES):
        fragment = min(first + lane, stop - 1)
        for j in range(3):
            ahead[(STATE + j) * LANES + lane] = position[fragment, j]
            ahead[(STATE + 3 + j) * LANES + lane] = velocity[fragment, j]
            ahead[(RELATIVE + j) * LANES + lane] = velocity[fragment, j]
        ahead[HEIGHT * LANES + lane] = position[fragment, 2]
        ahead[TIME * LANES + lane] = clock[fragment, 0]
        m = mass[fragment]
        ahead[AREA * LANES + lane] = 0.5 * (m / shape_factor[fragment]) ** (2.0 / 3.0) / m
    accelerate(ahead, SLOPE, around)
    for lane in range(LANES):
        size = speed = 0.0
        for j in range(3):
            size += ahead[(SLOPE + j) * LANES + lane] ** 2
            speed += ahead[(STATE + 3 + j) * LANES + lane] ** 2
        h = FIRST_STEP * math.sqrt(max(speed, MIN_SPEED) / size) if size > 0.0 else limits.time_limit
        ahead[STEP * LANES + lane] = h if limits.fixed_step <= 0.0 else limits.fixed_step


@inner_kernel()
def load(q: Array, lane: int, ahead: Array, place: int) -> float:
    """Put the fragment prepared at `place` of `ahead` into a lane; returns its Mach number."""
    for j in range(6):
        q[(STATE + j) * LANES + lane] = ahead[(STATE + j) * LANES + place]
    for j in range(3):
        q[(SLOPE + j) * LANES + lane] = ahead[(SLOPE + j) * LANES + place]
    q[AREA * LANES + lane] = ahead[AREA * LANES + place]
    q[STEP * LANES + lane] = ahead[STEP * LANES + place]
    q[TIME * LANES + lane] = ahead[TIME * LANES + place]
    return ahead[MACH * LANES + place]


@inner_kernel()
def move_lane(q: Array, source: int, target: int) -> None:
    """Copy what a lane carries from step to step."""
    load(q, target, q, source)


@inner_kernel()
def step_factors(q: Array, factors: Array, limits: Limits) -> None:
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
        reference = (max(smallest, reference)) * sharpness
        place, velocity = q[PLACE_ERROR * LANES + i] / (h * h), q[VELOCITY_ERROR * LANES + i]
        error = (max(place, velocity)) / reference + 1e-30
        eighth = math.sqrt(math.sqrt(math.sqrt(error)))
        sixteenth = math.sqrt(eighth)
        factor = SAFETY / (sixteenth * math.sqrt(sixteenth))
        factor = max(factor, SMALLEST_FACTOR)
        factor = min(factor, LARGEST_FACTOR)
        factors[i] = factor if error <= 1.0 else -factor
        factors[i] = factors[i] + 0.0 * after  # not a number, or infinite, stays so
