"""After an impact: the rebound, and the slide to rest once it has died out.

The rebound takes a share of the velocity along the normal and another one along the surface. The slide is that of a
point held to the surface, with gravity along it and Coulomb friction by the normal force; the air's drag is left out.
The path is one of short parts, each in the plane that touches the surface at its middle. From one to the next the
surface turns the velocity, and the normal force that this takes, the centripetal one, rubs too: a turn by an angle
leaves the share exp(-friction angle) of the speed, on smooth ground and at a kink alike. Over a crest it relieves the
friction of the weight, at most all of it: what would leave the ground there stays on it. What has come to a stop in a
kink from which the ground rises on both sides rests.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from flight.kernels.compiling import inner_kernel
from flight.kernels.limits import LANDED, LEFT_DOMAIN, STEP_LIMIT, STOPPED, TIME_OUT
from flight.kernels.obstacles import enter_on_chord
from flight.kernels.terrain import ON_A_LINE, cell_ahead, height_at, slope_at, slope_in

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.kernels.limits import Limits
    from flight.kernels.terrain import Terrain

    Array = NDArray[np.float64]

__all__ = ["LIFT", "MOST_CONTACTS", "rebound", "slide"]

LIFT = 1e-9  # m off the surface at which a fragment starts again, so that rounding does not put it below
MOST_CONTACTS = 500  # of one fragment; then it bounces no more
MOST_PARTS = 1_000_000  # of one slide
STILL = 1e-3  # m/s
LARGEST_SHARE, LARGEST_TURN = 0.25, 0.02  # of a cell, and of the velocity sideways, in one part of a slide on a map
MEMORY = 4.0  # cells over which friction is kept that a crest may relieve: a map turns a path once a cell


@inner_kernel()
def rebound(state: Array, nx: float, ny: float, nz: float, normal: float, tangential: float) -> float:
    """Turn the velocity in `state` (time, position, velocity) at a surface of unit normal (nx, ny, nz).

    Returns the speed off the surface after it (m/s).
    """
    into = min(state[4] * nx + state[5] * ny + state[6] * nz, 0.0)
    off = -normal * into
    state[4] = tangential * (state[4] - into * nx) + off * nx
    state[5] = tangential * (state[5] - into * ny) + off * ny
    state[6] = tangential * (state[6] - into * nz) + off * nz
    return off


@inner_kernel()
def slide(
    state: Array, friction: float, gravity: float, limits: Limits, terrain: Terrain, obstacles: Array, chord: Array
) -> tuple[int, int, int]:
    """Slide from `state` (time, position, velocity) to rest, an obstacle, the domain's edge or the time limit.

    Returns how it ended (LANDED: at rest), and the obstacle and its face that stopped it, or -1. Parts of a slide are
    of constant acceleration; along a straight way on a plane the first one is exact.
    """
    hilly = terrain.heights.shape[0] > 0
    cell = min(terrain.step_x, terrain.step_y) if hilly else np.inf
    start, end = chord[0], chord[1]
    before_x, before_y = slope_at(terrain, state[1], state[2]) if hilly else (0.0, 0.0)
    relief = 0.0  # J/kg of friction that a crest may give back, at first that of half a cell
    if hilly:
        relief = 0.5 * cell * friction * gravity / math.sqrt(1.0 + before_x * before_x + before_y * before_y)
    for _ in range(MOST_PARTS):
        row = column = 0
        slope_x = slope_y = 0.0
        if hilly:
            row, column = cell_ahead(terrain, state[1], state[2], state[4], state[5])
            slope_x, slope_y = slope_in(terrain, state[1], state[2], row, column)
            state[3] = height_at(terrain, state[1], state[2])
        middle = not hilly
        while True:  # with the slope at the start of the part, then with that at its middle
            u, v, speed, regained = _turned(state, before_x, before_y, slope_x, slope_y, friction, relief)
            steepness = math.hypot(slope_x, slope_y)
            cosine = 1.0 / math.sqrt(1.0 + steepness * steepness)
            if speed > STILL:
                brake_x, brake_y = u / speed, v / speed
            else:
                state[4] = state[5] = state[6] = u = v = speed = regained = 0.0
                if steepness <= friction or gravity * steepness == 0.0:
                    return LANDED, -1, -1
                down_x, down_y = -slope_x, -slope_y
                row, column = cell_ahead(terrain, state[1], state[2], down_x, down_y)
                slope_x, slope_y = slope_in(terrain, state[1], state[2], row, column)
                steepness = math.hypot(slope_x, slope_y)
                if down_x * slope_x + down_y * slope_y >= 0.0 or steepness <= friction:  # it rises there too
                    return LANDED, -1, -1
                cosine = 1.0 / math.sqrt(1.0 + steepness * steepness)
                brake_x, brake_y = -slope_x / steepness * cosine, -slope_y / steepness * cosine
                middle = True
            hold = friction * gravity * cosine
            a = -gravity * cosine * cosine * slope_x - hold * brake_x
            b = -gravity * cosine * cosine * slope_y - hold * brake_y
            slowing = 0.0
            if speed > 0.0:
                slowing = -(a * u + b * v + (slope_x * a + slope_y * b) * (slope_x * u + slope_y * v)) / speed
            dt, stops, times_out = limits.time_limit - state[0], False, True
            if slowing > 0.0 and speed <= slowing * dt:
                dt, stops, times_out = speed / slowing, True, False
            if hilly:
                level_speed, pull, reach = math.hypot(u, v), math.hypot(a, b), LARGEST_SHARE * cell
                longest = 2.0 * reach / (level_speed + math.sqrt(level_speed * level_speed + 2.0 * pull * reach))
                sideways = abs(a * v - b * u)
                if sideways > 0.0:
                    longest = min(longest, LARGEST_TURN * level_speed * level_speed / sideways)
                west, south = terrain.west + column * terrain.step_x, terrain.south + row * terrain.step_y
                longest = min(longest, _time_to_line(state[1], west, terrain.step_x, u, a))
                longest = min(longest, _time_to_line(state[2], south, terrain.step_y, v, b))
                if longest < dt:
                    dt, stops, times_out = longest, False, False
            if middle:
                break
            half = 0.5 * dt
            x, y = state[1] + half * (u + 0.5 * half * a), state[2] + half * (v + 0.5 * half * b)
            slope_x, slope_y = slope_in(terrain, x, y, row, column)
            middle = True
        for j in range(3):
            start[j] = state[1 + j]
        end[0], end[1] = state[1] + dt * (u + 0.5 * dt * a), state[2] + dt * (v + 0.5 * dt * b)
        end[2] = height_at(terrain, end[0], end[1]) if hilly else start[2]
        share, status = _leave_on_chord(start, end, limits, terrain), LEFT_DOMAIN
        position, which, face = enter_on_chord(start, end, obstacles)
        if position <= 1.0 and position <= share:
            share, status = position, STOPPED
        else:
            which, face = -1, -1
        if share <= 1.0:
            way = 0.0
            for j in range(3):
                way += (end[j] - start[j]) ** 2
                state[1 + j] = start[j] + share * (end[j] - start[j])
            way = share * math.sqrt(way)
            left = math.sqrt(max(speed * speed - 2.0 * slowing * way, 0.0))
            state[0] += 2.0 * way / (speed + left) if speed + left > 0.0 else 0.0
            factor = left / speed if speed > 0.0 else 0.0
            state[4], state[5] = factor * u, factor * v
            state[6] = slope_x * state[4] + slope_y * state[5]
            return status, which, face
        if hilly:
            way = math.sqrt((end[0] - start[0]) ** 2 + (end[1] - start[1]) ** 2 + (end[2] - start[2]) ** 2)
            kept = math.exp(-way / (MEMORY * cell))
            relief = (relief - regained) * kept + hold * MEMORY * cell * (1.0 - kept)
            before_x, before_y = slope_x, slope_y
        for j in range(3):
            state[1 + j] = end[j]
        state[0] += dt
        state[4], state[5] = (0.0, 0.0) if stops else (u + dt * a, v + dt * b)
        state[6] = slope_x * state[4] + slope_y * state[5]
        if times_out:
            state[0] = limits.time_limit
            return TIME_OUT, -1, -1
    return STEP_LIMIT, -1, -1


@inner_kernel()
def _turned(
    state: Array, before_x: float, before_y: float, slope_x: float, slope_y: float, friction: float, relief: float
) -> tuple[float, float, float, float]:
    """Velocity in `state`, along a plane of slopes `before`, turned into the plane of the others, less what rubs off.

    The surface presses along the mean of both normals, which alone keeps the speed; a crest (the plane falls away)
    gives speed back, at most the energy `relief` (J/kg). Returns the velocity along x and y, the speed, and the energy
    given back.
    """
    u, v, w = state[4], state[5], state[6]
    speed = math.sqrt(u * u + v * v + w * w)
    if speed == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    before = 1.0 / math.sqrt(1.0 + before_x * before_x + before_y * before_y)
    after = 1.0 / math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    x, y, z = -before * before_x - after * slope_x, -before * before_y - after * slope_y, before + after
    size = x * x + y * y + z * z
    push = -2.0 * after * (w - slope_x * u - slope_y * v) / size
    angle = 2.0 * math.asin(min(0.5 * abs(push) * math.sqrt(size) / speed, 1.0))
    left, regained = speed * math.exp(-math.copysign(friction * angle, push)), 0.0
    if left > speed:
        regained = min(0.5 * (left * left - speed * speed), relief)
        left = math.sqrt(speed * speed + 2.0 * regained)
    return (u + push * x) * left / speed, (v + push * y) * left / speed, left, regained


@inner_kernel()
def _time_to_line(position: float, line: float, step: float, speed: float, acceleration: float) -> float:
    """Time until a cell's lower or upper line is passed along one axis; infinite if neither is."""
    earliest = np.inf
    for k in range(2):
        way = line + k * step - position
        if abs(way) < ON_A_LINE * step:
            way = 0.0
        root = speed * speed + 2.0 * acceleration * way
        if root < 0.0:
            continue
        root = math.copysign(math.sqrt(root), speed)
        # the roots of way = speed t + acceleration t^2 / 2, each without cancellation
        for time in (2.0 * way / (speed + root), -(speed + root) / acceleration):
            if 0.0 < time < earliest:
                earliest = time
    return earliest


@inner_kernel()
def _leave_on_chord(start: Array, end: Array, limits: Limits, terrain: Terrain) -> float:
    """Share of the straight way at which it leaves the domain; 2.0 if it stays."""
    share = 2.0
    if limits.domain_radius < np.inf:
        x, y = start[0] - limits.origin_x, start[1] - limits.origin_y
        u, v = end[0] - start[0], end[1] - start[1]
        beyond = (x + u) ** 2 + (y + v) ** 2 - limits.domain_radius**2
        if beyond >= 0.0 and u * u + v * v > 0.0:
            half, inside = x * u + y * v, x * x + y * y - limits.domain_radius**2
            root = math.sqrt(max(half * half - (u * u + v * v) * inside, 0.0))
            share = min(1.0, max(0.0, (root - half) / (u * u + v * v)))
    if terrain.heights.shape[0] > 0:
        east = terrain.west + (terrain.heights.shape[1] - 1) * terrain.step_x
        north = terrain.south + (terrain.heights.shape[0] - 1) * terrain.step_y
        if end[0] < terrain.west:
            share = min(share, (terrain.west - start[0]) / (end[0] - start[0]))
        if end[0] > east:
            share = min(share, (east - start[0]) / (end[0] - start[0]))
        if end[1] < terrain.south:
            share = min(share, (terrain.south - start[1]) / (end[1] - start[1]))
        if end[1] > north:
            share = min(share, (north - start[1]) / (end[1] - start[1]))
    return share
