"""Flights of weighted fragments over flat ground in still air, counted by distance and by weights in all directions.

Without wind a path stays in its vertical plane and is the same at every azimuth, so that one flight serves all
directions, with a weight in each. The equation of motion, its tables and the law of ricochet are those of
`flight.kernels.motion` and `flight.kernels.events`; the steps are Runge and Kutta's of fourth order in the length of
the path, over fixed fractions of the lengths over which drag and gravity act: they are no matter of an error estimate,
so that the result is a smooth function of the launch but for where paths end.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from flight.kernels.compiling import inner_kernel, kernel
from flight.kernels.events import after_impact
from flight.kernels.fluence import PER_METRE, PIECE, add_length
from flight.scene.air import EARTH_RADIUS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.kernels.fluence import FluenceCells
    from flight.kernels.motion import Surroundings

    Array = NDArray[np.float64]

# what is counted by distance: hazardous first impacts and those after a ricochet, paths of hazardous fragments near the
# ground over a person's height before and after it, and where all come to rest
LANDINGS, LANDINGS_AFTER, PATHS, PATHS_AFTER, REST, QUANTITIES = 0, 1, 2, 3, 4, 5
# columns of a launch: mass (kg), A / (2 m) (m2/kg), distance (m), height over the ground (m), speed (m/s), elevation
# (rad), number, polar angle before the scatter (rad), station along the axis and distance from it (m)
LAUNCH_COLUMNS = 10
BY_DRAG, BY_GRAVITY = 0.3, 0.2
MOST_STEPS, MOST_IMPACTS = 20_000, 200
FARTHEST = 7.0  # deviation of a direction over its standard deviation


class Scatter(NamedTuple):
    """Densities of scattered directions about a round's axis, and the azimuths in which they are wanted.

    Without azimuths the axis is vertical and all directions are one.
    """

    density: Array  # (k, k) per solid angle (1/sr) by polar angle before and after the scatter, from 0 to pi
    step: float  # of both (rad)
    up: float  # vertical component of the unit axis
    azimuths: Array  # (a, 2) Gauss's points in the cells (rad)
    level_axis: Array  # (a, 2) component of the unit axis along them
    away: Array  # (a, 2) and of the way from the origin to the axis's station 0 (m)
    width: float  # of a cell (rad)


@inner_kernel()
def _drag_over_mass(z: float, speed: float, area: float, around: Surroundings) -> float:
    """Cd rho A / (2 m) (1/m) at a height (m) and speed (m/s); `area` is A / (2 m)."""
    altitude = z + around.site_altitude
    geopotential = EARTH_RADIUS * altitude / (EARTH_RADIUS + altitude)
    position = min(max(0.0, (geopotential - around.air_bottom) / around.air_step), float(around.air_pieces.shape[0]))
    piece = min(int(position), around.air_pieces.shape[0] - 1)
    c = around.air_pieces[piece]
    rise = (position - piece) * around.air_step
    density = c[0] + rise * (c[1] + rise * (c[2] + rise * c[3]))
    mach = speed * (c[4] + rise * (c[5] + rise * (c[6] + rise * c[7])))
    bins = around.drag_bins
    row = bins[int(min(mach * around.drag_bins_per_mach, bins.shape[0] - 0.5))]
    row = min(row + int(mach >= around.drag_rows[row, 5]), around.drag_rows.shape[0] - 1)
    d = around.drag_rows[row]
    over = mach - d[0]
    return area * density * (d[1] + over * (d[2] + over * (d[3] + over * d[4])))


@inner_kernel()
def _weights(
    launch: Array, sine: float, cosine: float, scatter: Scatter, weights: Array, moments: Array,
    cells: NDArray[np.int64],
) -> int:  # fmt: skip
    """Number of fragments in azimuth cells per elevation (1/rad), and that times their launch's distance (m).

    The density is averaged over a cell by Gauss's two points. Returns how many of `cells` hold any: they and their
    numbers come first.
    """
    k = scatter.density.shape[0]
    before = min(launch[7] / scatter.step, k - 1.000001)
    i = int(before)
    share = before - i
    one, other = scatter.density[i], scatter.density[i + 1]
    scale = 0.5 * launch[6] * cosine * scatter.width
    used = 0
    for a in range(scatter.azimuths.shape[0]):
        number = moment = 0.0
        for side in range(2):
            level_axis = scatter.level_axis[a, side]
            along = min(max(sine * scatter.up + cosine * level_axis, -1.0), 1.0)
            after = min(math.acos(along) / scatter.step, k - 1.000001)
            j = int(after)
            part = after - j
            density = (1.0 - share) * ((1.0 - part) * one[j] + part * one[j + 1])
            density += share * ((1.0 - part) * other[j] + part * other[j + 1])
            if density == 0.0:
                continue
            away = scatter.away[a, side] + launch[8] * level_axis
            across = math.sqrt(1.0 - along * along)
            if across > 0.0:
                away += launch[9] * (cosine - along * level_axis) / across
            number += density
            moment += density * away
        if number > 0.0:
            cells[used], weights[used], moments[used] = a, scale * number, scale * moment
            used += 1
    return used


@inner_kernel()
def _count_step(
    before: Array, after: Array, h: float, until: float, cubic: Array, mass: float, near: FluenceCells,
    lengths: NDArray[np.int64], leg: int,
) -> None:  # fmt: skip
    """Add the part of a step up to `until` (0 to 1) that lies below the height and is fast enough, piece by piece."""
    if min(before[1], after[1]) > near.height:
        return
    limit = 2.0 * near.energy / mass
    first, last = before[2] * before[2] + before[3] * before[3], after[2] * after[2] + after[3] * after[3]
    begin = 0.0
    if first < limit and last < limit:
        return
    if first < limit or last < limit:  # drag slows by the same fraction on equal lengths
        slow = math.log(limit / first) / math.log(last / first)
        if first < limit:
            begin = min(slow, until)
        else:
            until = min(slow, until)
    number = 1 + int((until - begin) * h / max(PIECE * min(before[0], after[0]), near.shortest))
    x0, z0 = _at(before, cubic, begin, 0), _at(before, cubic, begin, 1)
    for k in range(number):
        theta = begin + (until - begin) * (k + 1) / number
        x1, z1 = _at(before, cubic, theta, 0), _at(before, cubic, theta, 1)
        low, high = 0.0, 1.0
        rise = z1 - z0
        if z0 > near.height and z1 > near.height:
            high = 0.0
        elif z0 > near.height:
            low = (near.height - z0) / rise
        elif z1 > near.height:
            high = (near.height - z0) / rise
        if high > low:
            length = (high - low) * math.sqrt((x1 - x0) * (x1 - x0) + rise * rise)
            add_length(lengths, leg, 0, near, x0 + low * (x1 - x0), x0 + high * (x1 - x0), length * PER_METRE)
        x0, z0 = x1, z1


@inner_kernel()
def _at(before: Array, cubic: Array, theta: float, axis: int) -> float:
    """Position on a step; `axis` 0 is the distance, 1 the height."""
    return before[axis] + theta * (cubic[axis, 0] + theta * (cubic[axis, 1] + theta * cubic[axis, 2]))


@inner_kernel()
def _landing(height: float, cubic: Array) -> float:
    """Where on a step (0 to 1) from a height this falls to zero: Newton's steps from its end, within a bracket."""
    low, high, theta = 0.0, 1.0, 1.0
    first, c, d = cubic[1, 0], cubic[1, 1], cubic[1, 2]
    for _ in range(60):
        here = height + theta * (first + theta * (c + theta * d))
        if here > 0.0:
            low = theta
        else:
            high = theta
        slope = first + theta * (2.0 * c + theta * 3.0 * d)
        following = theta - here / slope if slope < 0.0 else low
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - theta) < 1e-12:
            return following
        theta = following
    return theta


@inner_kernel()
def _cell(x: float, near: FluenceCells) -> int:
    """Distance cell of a position, the last one beyond them."""
    x = abs(x)
    big = int(x * near.per_cell)
    if big >= near.parts.size:
        return near.first[-1] - 1
    return near.first[big] + min(int((x - big * near.cell) / near.part_width[big]), near.parts[big] - 1)


@inner_kernel()
def _step(before: Array, after: Array, cubic: Array, area: float, ground: float, around: Surroundings) -> float:
    """One step of distance, height and velocity (4,), and Hermite's cubics (2, 3) of the first two over it.

    Returns its length (m).
    """
    speed = math.sqrt(before[2] * before[2] + before[3] * before[3])
    drag = _drag_over_mass(before[1] + ground, speed, area, around)
    h = 1e9
    if drag > 0.0:
        h = BY_DRAG / drag
    if around.gravity > 0.0:
        h = min(h, BY_GRAVITY * speed * speed / around.gravity + 1e-3)
    z, u, w, inverse = before[1], before[2], before[3], 1.0 / speed
    cubic[0, 0], cubic[1, 0] = h * u * inverse, h * w * inverse
    dx = dz = du = dw = 0.0
    for stage in range(4):
        if stage > 0:
            drag = _drag_over_mass(z + ground, speed, area, around)
        a, b, c, d = u * inverse, w * inverse, -drag * u, -drag * w - around.gravity * inverse
        weight = h / 6.0 if stage in (0, 3) else h / 3.0
        dx, dz, du, dw = dx + weight * a, dz + weight * b, du + weight * c, dw + weight * d
        reach = h if stage == 2 else 0.5 * h
        if stage == 3:
            u, w = before[2] + du, before[3] + dw
        else:
            z, u, w = before[1] + reach * b, before[2] + reach * c, before[3] + reach * d
        speed = math.sqrt(u * u + w * w)
        inverse = 1.0 / speed
    after[0], after[1], after[2], after[3] = before[0] + dx, before[1] + dz, u, w
    for axis in range(2):
        first, last, change = cubic[axis, 0], h * after[2 + axis] * inverse, after[axis] - before[axis]
        cubic[axis, 1], cubic[axis, 2] = 3.0 * change - 2.0 * first - last, first + last - 2.0 * change
    return h


@kernel
def fly_weighted(
    launches: Array, slopes: Array, ground: float, around: Surroundings, surface: Array, near: FluenceCells,
    scatter: Scatter, counts: Array, moments: Array, to_rest: bool,
) -> float:  # fmt: skip
    """Fly fragments (n, LAUNCH_COLUMNS) to rest; returns the number that came to no end.

    Not `to_rest`: no farther than where neither speed nor height can make them hazardous again; none is at rest then.

    `slopes` (n, b): facets' slopes at the first impacts over the roughness, taken again in turn beyond; `surface` as of
    `impacts.after_impact`. Adds to `counts` (QUANTITIES, distance, directions) the numbers of fragments, and to
    `moments`, alike, the numbers times the distance of the launch (m) from which paths are counted; with one direction
    that distance is in the launch.
    """
    cells, directions = counts.shape[1], counts.shape[2]
    lengths = np.zeros((2, 1, cells), np.int64)
    profile = np.zeros((QUANTITIES, cells))
    weights, shifts, where = np.zeros(directions), np.zeros(directions), np.zeros(directions, np.int64)
    before, after, cubic = np.zeros(4), np.zeros(4), np.zeros((2, 3))
    lost = 0.0
    for row in range(launches.shape[0]):
        launch = launches[row]
        if launch[6] == 0.0:
            continue
        mass, area = launch[0], launch[1]
        sine, cosine = math.sin(launch[5]), math.cos(launch[5])
        before[0], before[1] = launch[2], launch[3]
        before[2], before[3] = launch[4] * cosine, launch[4] * sine
        impacts = steps = farthest = 0
        ended = False
        while not ended and steps < MOST_STEPS:
            if not to_rest:
                left = 0.5 * (before[2] ** 2 + before[3] ** 2) + around.gravity * before[1]
                if mass * left < near.energy:
                    ended = True
                    break
            steps += 1
            h = _step(before, after, cubic, area, ground, around)
            until = 1.0
            landed = after[1] <= 0.0
            if landed:
                until = _landing(before[1], cubic)
            if near.height > 0.0:
                _count_step(before, after, h, until, cubic, mass, near, lengths, min(impacts, 1))
            if landed:
                x = _at(before, cubic, until, 0)
                one, other = math.hypot(before[2], before[3]), math.hypot(after[2], after[3])
                speed = one * (other / one) ** until
                slope = (1.0 - until) * before[3] / one + until * after[3] / other
                angle = math.asin(min(max(-slope, 0.0), 1.0))
                cell = _cell(x, near)
                if 0.5 * mass * speed * speed >= near.energy:
                    profile[LANDINGS + min(impacts, 1), cell] += 1.0
                    if near.height == 0.0:
                        steepness = math.sin(max(angle, 1.7453292519943296e-4))
                        profile[PATHS + min(impacts, 1), cell] += 1.0 / steepness
                kept, departure = after_impact(speed, angle, surface, slopes[row, impacts % slopes.shape[1]])
                impacts += 1
                if kept == 0.0 or impacts == MOST_IMPACTS:
                    profile[REST, cell] = 1.0
                    ended = True
                after[0], after[1] = x, 0.0
                after[2], after[3] = kept * math.cos(departure), kept * math.sin(departure)
            before[0], before[1], before[2], before[3] = after[0], after[1], after[2], after[3]
        farthest = _cell(before[0], near) + 1
        if not ended:
            lost += launch[6]
        if scatter.azimuths.shape[0] == 0:
            weights[0], used = launch[6], 1
        else:
            used = _weights(launch, sine, cosine, scatter, weights, shifts, where)
        if near.height > 0.0:
            for leg in range(min(impacts, 1) + 1):
                for j in range(farthest):
                    if lengths[leg, 0, j] > 0:
                        profile[PATHS + leg, j] = lengths[leg, 0, j] / (PER_METRE * near.height)
                        lengths[leg, 0, j] = 0
        for quantity in range(QUANTITIES):
            if impacts < 2 and quantity == LANDINGS_AFTER:
                continue
            if impacts == 0 and quantity in (LANDINGS, PATHS_AFTER, REST):
                continue
            for j in range(farthest):
                amount = profile[quantity, j]
                if amount == 0.0:
                    continue
                profile[quantity, j] = 0.0
                for n in range(used):
                    counts[quantity, j, where[n]] += amount * weights[n]
                    moments[quantity, j, where[n]] += amount * shifts[n]
    return lost


@kernel
def scattered_density(before: Array, after: Array, scatter: float, points: Array, weights: Array, out: Array) -> None:
    """Densities (1/sr) of directions at polar angles `after` of what was scattered from `before`, all (n,) in rad.

    The density of a deviation g is g / sin(g) exp(-g^2 / (2 s^2)) / (2 pi s^2): a rotation vector across the direction
    with two normal components of standard deviation s. It is averaged over the azimuth of the direction before, by
    Gauss's rule with `points` and `weights` on (0, 1).
    """
    farthest = min(FARTHEST * scatter, math.pi)
    least = math.cos(farthest)
    for i in range(out.shape[0]):
        out[i] = 0.0
        if abs(before[i] - after[i]) >= farthest:
            continue
        level = math.sin(before[i]) * math.sin(after[i])
        along = math.cos(before[i]) * math.cos(after[i])
        end = math.pi
        if level > 0.0 and least - along > -level:
            end = math.acos(min((least - along) / level, 1.0))
        total = 0.0
        for k in range(points.shape[0]):
            cosine = min(max(along + level * math.cos(end * points[k]), -1.0), 1.0)
            turn = math.acos(cosine)
            ratio = turn / math.sin(turn) if turn > 1e-6 else 1.0
            total += weights[k] * ratio * math.exp(-0.5 * (turn / scatter) ** 2)
        out[i] = total * end / (2.0 * math.pi**2 * scatter**2)
