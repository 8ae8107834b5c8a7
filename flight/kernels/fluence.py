"""Lengths of paths below a person's height, by azimuth and distance, along the dense output of every step.

Lengths are summed as whole multiples of 2^-32 m, so that their sums do not depend on the order of the fragments, nor
on the number of threads.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from flight.kernels.compiling import inner_kernel
from flight.kernels.faces import cross_plane, dense_state
from flight.kernels.motion import LANES, NEW, STATE
from flight.kernels.terrain import height_at

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.kernels.events import Limits
    from flight.kernels.faces import Scratch
    from flight.kernels.terrain import Terrain

    Array = NDArray[np.float64]

PER_METRE = 2.0**32
PIECE = 0.1  # length of a piece of a path over its distance from the origin, at most
MOST_PIECES = 1_000_000


class FluenceCells(NamedTuple):
    """What is counted, and in which cells; see flight.fluence. Units: m, J, rad."""

    height: float  # of a person above the ground
    energy: float  # from which a fragment is hazardous at the position that it passes
    cell: float  # width of the distance cells of the tables
    per_cell: float
    shortest: float  # pieces of paths are no shorter for the sake of their distance
    parts: NDArray[np.int64]  # of every one
    part_width: Array  # of every one
    first: NDArray[np.int64]  # number of the first part of every one
    start: float  # azimuth at which the first cell begins
    per_width: float  # of an azimuth cell


@inner_kernel()
def _cell_of(x: float, y: float, near: FluenceCells, cells: int) -> int:
    """Azimuth cell of a position; the angle to 2e-8 (Abramowitz and Stegun 4.4.49), in half the time of atan2."""
    u, v = abs(x), abs(y)
    t = min(u, v) / max(u, v) if max(u, v) > 0.0 else 0.0
    s = t * t
    angle = 0.0028662257
    for c in (
        -0.0161657367, 0.0429096138, -0.0752896400, 0.1065626393, -0.1420889944, 0.1999355085, -0.3333314528, 1.0,
    ):  # fmt: skip
        angle = angle * s + c
    angle *= t
    if v > u:
        angle = 0.5 * math.pi - angle
    if x < 0.0:
        angle = math.pi - angle
    if y < 0.0:
        angle = -angle
    cell = math.floor((angle - near.start) * near.per_width)
    return cell + cells if cell < 0 else (cell - cells if cell >= cells else cell)


@inner_kernel()
def count_chord(
    q: Array, lane: int, mass: float, weight: float, limits: Limits, near: FluenceCells, lengths: NDArray[np.int64],
    leg: int,
) -> int:  # fmt: skip
    """Add a short step over flat ground as its chord, up to the height; most steps near the ground are such.

    `weight`: fragments that it stands for; `leg` is 0 before the first impact on the ground, and 1 after it. Returns 1
    where it lies within the cells, 0 where it leaves them, and -1 where it needs `count_path`.
    """
    z0, z1 = q[(STATE + 2) * LANES + lane], q[(NEW + 2) * LANES + lane]
    low, high, top = min(z0, z1), max(z0, z1), limits.ground + near.height
    if not low < top:
        return -1
    x0, y0 = q[STATE * LANES + lane] - limits.origin_x, q[(STATE + 1) * LANES + lane] - limits.origin_y
    x1, y1 = q[NEW * LANES + lane] - limits.origin_x, q[(NEW + 1) * LANES + lane] - limits.origin_y
    rise = z1 - z0
    level = (x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0)
    first, last = math.sqrt(x0 * x0 + y0 * y0), math.sqrt(x1 * x1 + y1 * y1)
    piece = max(PIECE * min(first, last), near.shortest)
    if level + rise * rise > piece * piece:
        return -1
    squared = 0.0
    for j in range(3, 6):
        squared += 0.5 * (q[(STATE + j) * LANES + lane] ** 2 + q[(NEW + j) * LANES + lane] ** 2)
    if 0.5 * mass * squared < near.energy:
        return 1
    turn = _cell_of(x0 + x1, y0 + y1, near, lengths.shape[1])
    share = 1.0
    if high > top:  # so short a step is straight
        share = (top - low) / (high - low)
        if z0 < z1:
            last = first + share * (last - first)
        else:
            first = last + share * (first - last)
    amount = weight * share * math.sqrt(level + rise * rise) * PER_METRE
    return 1 if add_length(lengths, leg, turn, near, min(first, last), max(first, last), amount) else 0


@inner_kernel()
def count_path(
    step: Scratch, until: float, h: float, mass: float, weight: float, limits: Limits, terrain: Terrain | None,
    near: FluenceCells, lengths: NDArray[np.int64], leg: int,
) -> bool:  # fmt: skip
    """Add the step's path up to its position `until`; returns whether all of it lies within the cells."""
    if terrain is not None:
        return _count_part(step, 0.0, until, h, mass, weight, limits, terrain, near, lengths, leg)
    found = cross_plane(step.points, limits.levels[3], step.stack, step.roots)
    start, below, inside = 0.0, step.points[2, 0] < limits.levels[3, 2], True
    for k in range(found + 1):
        end = min(step.roots[k], until) if k < found else until
        if below and end > start:
            inside &= _count_part(step, start, end, h, mass, weight, limits, terrain, near, lengths, leg)
        start, below = end, not below
    return inside


@inner_kernel()
def _count_part(
    step: Scratch, begin: float, end: float, h: float, mass: float, weight: float, limits: Limits,
    terrain: Terrain | None, near: FluenceCells, lengths: NDArray[np.int64], leg: int,
) -> bool:  # fmt: skip
    """`count_path` between two positions on the step; on a map of heights only what lies below the height there."""
    points, out = step.points, step.state
    dense_state(points, end, out)
    x1, y1 = out[0] - limits.origin_x, out[1] - limits.origin_y
    dense_state(points, begin, out)
    x0, y0 = out[0] - limits.origin_x, out[1] - limits.origin_y
    piece = max(PIECE * _nearest(x0, y0, x1, y1), near.shortest)
    if terrain is not None:
        piece = min(piece, 0.5 * min(terrain.step_x, terrain.step_y))
    number = 1 + int(min(math.hypot(x1 - x0, y1 - y0) / piece, MOST_PIECES))
    share = (end - begin) / number
    inside = True
    before = -1.0
    if terrain is not None:
        before = out[2] - height_at(terrain, out[0], out[1]) - near.height
    for k in range(number):
        position, part = begin + (k + 0.5) * share, share
        if terrain is not None:
            dense_state(points, begin + (k + 1) * share, out)
            after = out[2] - height_at(terrain, out[0], out[1]) - near.height
            low, high = 0.0, 1.0  # of the piece, below the height: the clearance is linear over a piece
            if before >= 0.0 and after >= 0.0:
                high = 0.0
            elif before >= 0.0:
                low = before / (before - after)
            elif after >= 0.0:
                high = before / (before - after)
            before = after
            if high <= low:
                continue
            position, part = begin + (k + 0.5 * (low + high)) * share, (high - low) * share
        dense_state(points, position, out)
        squared = out[3] * out[3] + out[4] * out[4] + out[5] * out[5]
        if 0.5 * mass * squared < near.energy:
            continue
        x, y = out[0] - limits.origin_x, out[1] - limits.origin_y
        radius = math.hypot(x, y)
        outward = 0.5 * part * h * (x * out[3] + y * out[4]) / radius if radius > 0.0 else 0.0
        turn = _cell_of(x, y, near, lengths.shape[1])
        amount = weight * math.sqrt(squared) * part * h * PER_METRE
        inside &= add_length(lengths, leg, turn, near, radius - abs(outward), radius + abs(outward), amount)
    return inside


@inner_kernel()
def _nearest(x0: float, y0: float, x1: float, y1: float) -> float:
    """Distance of a chord from the origin."""
    u, v = x1 - x0, y1 - y0
    squared = u * u + v * v
    share = min(max(-(x0 * u + y0 * v) / squared, 0.0), 1.0) if squared > 0.0 else 0.0
    return math.hypot(x0 + share * u, y0 + share * v)


@inner_kernel()
def add_length(
    lengths: NDArray[np.int64], leg: int, turn: int, near: FluenceCells, low: float, high: float, amount: float
) -> bool:  # fmt: skip
    """Spread an amount evenly over the distances from low to high; returns whether the cells reach that far."""
    low = max(low, 0.0)
    big = int(low * near.per_cell)
    if big >= near.parts.size:
        return False
    parts, width = near.parts[big], near.part_width[big]
    small = min(int((low - big * near.cell) * (near.per_cell * parts)), parts - 1)
    edge = big * near.cell + (small + 1) * width
    if high <= edge:
        lengths[leg, turn, near.first[big] + small] += np.int64(amount + 0.5)
        return True
    rate = amount / (high - low)
    while high > edge:
        lengths[leg, turn, near.first[big] + small] += np.int64(rate * max(edge - low, 0.0) + 0.5)
        low = edge
        small += 1
        if small == parts:
            big, small = big + 1, 0
            if big == near.parts.size:
                return False
            parts, width = near.parts[big], near.part_width[big]
        edge = big * near.cell + (small + 1) * width
    lengths[leg, turn, near.first[big] + small] += np.int64(rate * (high - low) + 0.5)
    return True
