"""One time window of the flight of colliding fragments: paths, first collisions, impacts by time.

A fragment stands in every cell that the box about its path touches, so a fast or a large one is found from all of
them. A pair shares several cells; it is looked at in one only, the lowest that both touch. Cells are kept in buckets by
a hash of their place, so a cloud of any extent takes memory in proportion to its fragments.
"""

from __future__ import annotations

import heapq
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from flight.kernels.collision import SCRATCH_ROWS, first_collision, path_state, strike
from flight.kernels.compiling import inner_kernel, kernel
from flight.kernels.motion import (
    AREA,
    GROUND,
    HEIGHT,
    LANES,
    NEW,
    RELATIVE,
    ROWS,
    SLOPE,
    STATE,
    STEP,
    accelerate,
    place_points,
    take_step,
)
from flight.kernels.roots import LARGEST_DEGREE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.kernels.motion import Surroundings

    Array = NDArray[np.float64]
    Whole = NDArray[np.int64]

PARTNERS = 8  # the last ones that a fragment struck
# time; the two fragments; places (3, 3); velocities before (3, 3) and after (3, 3); speed of closing; energy lost (J)
LOG_COLUMNS = 23


class Spheres(NamedTuple):
    """Fragments as spheres under way, (n, ...) each."""

    mass: Array
    radius: Array
    group: Whole  # (n,) fragments of one group do not meet
    drag_area: Array  # A / (2 m) (m2/kg)
    state: Array  # (n, 6) place and velocity at `since`
    end: Array  # (n, 6) the same at the end of the window, if nothing is met
    path: Array  # (n, 3, 6) the way there, in Bernstein form
    since: Array  # (n,) time (s) of `state`
    spin: Array  # (n, 3) rad/s
    boxes: Array  # (n, 6) lowest and highest corner that the sphere reaches on its path
    cells: Whole  # (n, 6) lowest and highest cell that the box touches
    entered: Whole  # (n, 6) lowest and highest of the cells in whose lists it stands
    changes: Whole  # (n,) impacts so far
    partners: Whole  # (n, PARTNERS) whom it struck lately
    struck: Array  # (n, PARTNERS) when (s)


class Touch(NamedTuple):
    """What an impact obeys."""

    restitution: float
    friction: float  # coefficient
    min_speed: float  # m/s
    duration: float  # s; within it a pair strikes once
    ground: float  # height (m) below which nothing is met; minus infinity: none


@inner_kernel()
def bucket_of(x: int, y: int, z: int, buckets: int) -> int:
    """Bucket of a cell, by a hash of its block of 4 x 4 x 4 cells (Teschner et al. 2003); `buckets` is a power of two.

    The cells of a block have buckets side by side, so the neighbours of a fragment are near it in memory.
    """
    block = ((x >> 2) * 73856093) ^ ((y >> 2) * 19349663) ^ ((z >> 2) * 83492791)
    return ((block << 6) | ((x & 3) << 4) | ((y & 3) << 2) | (z & 3)) & (buckets - 1)


@inner_kernel()
def cells_of(box: Array, size: float, cells: Whole) -> int:
    """Lowest and highest cell (6,) that a box (low, high) touches; returns how many it touches."""
    count = 1
    for axis in range(3):
        cells[axis] = np.int64(math.floor(box[axis] / size))
        cells[3 + axis] = np.int64(math.floor(box[3 + axis] / size))
        count *= cells[3 + axis] - cells[axis] + 1
    return count


@inner_kernel()
def home(first: Whole, second: Whole, x: int, y: int, z: int) -> bool:
    """Whether this cell is the lowest that both of two ranges of cells (6,) touch: there the pair is tested."""
    return (
        x == max(first[0], second[0])
        and y == max(first[1], second[1])
        and z == max(first[2], second[2])
        and x <= min(first[3], second[3])
        and y <= min(first[4], second[4])
        and z <= min(first[5], second[5])
    )


@kernel
def fill_cells(active: Whole, boxes: Array, size: float, cells: Whole) -> tuple[Whole, Whole, Whole]:
    """Sort the active fragments into the cells that their boxes touch.

    Parameters
    ----------
    active : (m,) numbers of the fragments that take part.
    boxes : (n, 6) lowest and highest corner of what each sweeps (m).
    size : length of a cell (m); infinite: one cell for all.
    cells : (n, 6) filled with the lowest and highest cell of each.

    Returns
    -------
    starts : (buckets + 1,) first entry of each bucket.
    member : (entries,) fragment of each entry; in a bucket in the order of `active`.
    place : (entries, 3) cell of each entry, since buckets may hold several.
    """
    entries = 0
    for i in active:
        entries += cells_of(boxes[i], size, cells[i])
    buckets = 1
    while buckets < entries:
        buckets *= 2
    starts = np.zeros(buckets + 1, np.int64)
    for i in active:
        c = cells[i]
        for x in range(c[0], c[3] + 1):
            for y in range(c[1], c[4] + 1):
                for z in range(c[2], c[5] + 1):
                    starts[bucket_of(x, y, z, buckets) + 1] += 1
    for b in range(buckets):
        starts[b + 1] += starts[b]
    following = starts[:-1].copy()
    member, place = np.empty(entries, np.int64), np.empty((entries, 3), np.int64)
    for i in active:
        c = cells[i]
        for x in range(c[0], c[3] + 1):
            for y in range(c[1], c[4] + 1):
                for z in range(c[2], c[5] + 1):
                    b = bucket_of(x, y, z, buckets)
                    entry = following[b]
                    following[b] += 1
                    member[entry] = i
                    place[entry, 0], place[entry, 1], place[entry, 2] = x, y, z
    return starts, member, place


@kernel
def advance(chosen: Whole, spheres: Spheres, around: Surroundings, until: float) -> float:
    """Paths of the chosen fragments from their own `since` to `until`, with their boxes.

    Returns the largest of |a| / |v| (1/s), which bounds the next window.
    """
    q, points = np.zeros(ROWS * LANES), np.zeros((6, 6))
    quickest = 0.0
    for first in range(0, chosen.size, LANES):
        for lane in range(LANES):
            i = chosen[min(first + lane, chosen.size - 1)]
            for j in range(6):
                q[(STATE + j) * LANES + lane] = spheres.state[i, j]
            for j in range(3):
                q[(RELATIVE + j) * LANES + lane] = spheres.state[i, 3 + j]
            q[HEIGHT * LANES + lane] = spheres.state[i, 2]
            q[GROUND * LANES + lane] = around.ground
            q[AREA * LANES + lane] = spheres.drag_area[i]
            q[STEP * LANES + lane] = until - spheres.since[i]
        accelerate(q, SLOPE, 0.0, around)
        take_step(q, around)
        for lane in range(min(LANES, chosen.size - first)):
            i = chosen[first + lane]
            slope = speed = 0.0
            for j in range(3):
                slope += q[(SLOPE + j) * LANES + lane] ** 2
                speed += q[(STATE + 3 + j) * LANES + lane] ** 2
            quickest = max(quickest, slope / max(speed, 1.0))
            place_points(q, lane, points)
            radius = spheres.radius[i]
            for j in range(3):
                low = high = points[j, 0]
                for k in range(6):
                    spheres.path[i, j, k] = points[j, k]
                    low, high = min(low, points[j, k]), max(high, points[j, k])
                spheres.boxes[i, j], spheres.boxes[i, 3 + j] = low - radius, high + radius
            for j in range(6):
                spheres.end[i, j] = q[(NEW + j) * LANES + lane]
    return math.sqrt(quickest)


@inner_kernel()
def _boxes_overlap(boxes: Array, i: int, j: int) -> bool:
    """Whether the boxes about the paths of two fragments overlap. One test without branches for all six faces."""
    return (
        (boxes[i, 0] <= boxes[j, 3])
        & (boxes[j, 0] <= boxes[i, 3])
        & (boxes[i, 1] <= boxes[j, 4])
        & (boxes[j, 1] <= boxes[i, 4])
        & (boxes[i, 2] <= boxes[j, 5])
        & (boxes[j, 2] <= boxes[i, 5])
    )


@inner_kernel()
def _pair(i: int, j: int, spheres: Spheres, until: float, touch: Touch, scratch: Array, roots: Array) -> float:
    """Time at which two fragments whose boxes overlap meet; infinite where they do not, or only below the ground."""
    reach = spheres.radius[i] + spheres.radius[j]
    return first_collision(
        spheres.path[i], spheres.since[i], spheres.path[j], spheres.since[j], until, reach, touch.min_speed,
        scratch, roots,
    )  # fmt: skip


@inner_kernel()
def _struck_lately(i: int, j: int, since: float, spheres: Spheres) -> bool:
    """Whether the first fragment has struck the second after a time, as far as its partners are kept."""
    found = False
    for k in range(PARTNERS):
        found = found or (spheres.partners[i, k] == j and spheres.struck[i, k] > since)
    return found


@inner_kernel()
def _state_at(i: int, time: float, spheres: Spheres, until: float, out: Array) -> None:
    """Place and velocity (6,) of a fragment at a time of its path."""
    length = until - spheres.since[i]
    path_state(spheres.path[i], length, (time - spheres.since[i]) / length, out)


@inner_kernel(_nrt=True)
def _enter(
    k: int, spheres: Spheres, cell: float, buckets: int, chain: Whole, links: list[tuple[int, int, int, int, int]]
) -> None:
    """Put a fragment on its new path into the lists of the cells that it did not stand in yet."""
    now, before = spheres.cells[k], spheres.entered[k]
    cells_of(spheres.boxes[k], cell, now)
    for x in range(min(now[0], before[0]), max(now[3], before[3]) + 1):
        for y in range(min(now[1], before[1]), max(now[4], before[4]) + 1):
            for z in range(min(now[2], before[2]), max(now[5], before[5]) + 1):
                inside = before[0] <= x <= before[3] and before[1] <= y <= before[4] and before[2] <= z <= before[5]
                if not inside:
                    b = bucket_of(x, y, z, buckets)
                    links.append((k, chain[b], x, y, z))
                    chain[b] = len(links) - 1
    for axis in range(3):
        before[axis], before[3 + axis] = min(now[axis], before[axis]), max(now[3 + axis], before[3 + axis])


@inner_kernel()
def _search(
    first: int, last: int, starts: Whole, member: Whole, place: Whole, spheres: Spheres, until: float, touch: Touch,
    scratch: Array, roots: Array, times: Array, pairs: Whole,
) -> tuple[int, int]:  # fmt: skip
    """Compare the pairs that share a cell of the buckets first..last-1.

    Times and numbers of those that meet go into `times` and `pairs`. Returns how many were compared and how many
    meet, -1 where there is no room for all.
    """
    compared = found = 0
    for b in range(first, last):
        for p in range(starts[b], starts[b + 1]):
            i = member[p]
            x, y, z = place[p, 0], place[p, 1], place[p, 2]
            for other in range(p + 1, starts[b + 1]):
                if place[other, 0] != x or place[other, 1] != y or place[other, 2] != z:
                    continue
                j = member[other]
                if spheres.group[i] == spheres.group[j]:
                    continue
                compared += 1
                if not _boxes_overlap(spheres.boxes, i, j) or not home(spheres.cells[i], spheres.cells[j], x, y, z):
                    continue
                time = _pair(min(i, j), max(i, j), spheres, until, touch, scratch, roots)
                if time < math.inf:
                    if found == times.size:
                        return compared, -1
                    times[found] = time
                    pairs[found, 0], pairs[found, 1] = min(i, j), max(i, j)
                    found += 1
    return compared, found


@kernel
def first_collisions(
    first: int, last: int, starts: Whole, member: Whole, place: Whole, spheres: Spheres, until: float, touch: Touch
) -> tuple[int, Array, Whole]:
    """When the pairs that share a cell of the buckets first..last-1 (see `fill_cells`) meet within the window.

    Returns how many were compared, and times and numbers (k, 2), the lower first, of those that meet.
    """
    scratch, roots = np.empty((SCRATCH_ROWS, LARGEST_DEGREE + 3)), np.empty(16)
    times, pairs = np.empty(1024), np.empty((1024, 2), np.int64)
    while True:
        compared, found = _search(
            first, last, starts, member, place, spheres, until, touch, scratch, roots, times, pairs
        )
        if found >= 0:
            return compared, times[:found], pairs[:found]
        times, pairs = np.empty(4 * times.size), np.empty((4 * times.size, 2), np.int64)


@kernel
def strike_in_turn(
    active: Whole, starts: Whole, member: Whole, place: Whole, times: Array, pairs: Whole, spheres: Spheres,
    around: Surroundings, touch: Touch, until: float, cell: float, log: Array,
) -> tuple[int, Array]:  # fmt: skip
    """Bring the active fragments to the end `until` of the window through all their impacts, in order of time.

    `cell` is the length of a cell (m), `times` and `pairs` what `first_collisions` found. Returns the rows used of
    `log` and the log itself, which grows where it is full. A fragment that was struck goes on along a new path, for
    which its neighbours are looked up again.
    """
    buckets = starts.size - 1
    scratch, roots = np.empty((SCRATCH_ROWS, LARGEST_DEGREE + 3)), np.empty(16)
    rows = 0
    heap = [(math.inf, np.int64(0), np.int64(0), np.int64(0), np.int64(0))]
    for k in range(times.size):
        i, j = pairs[k]
        heap.append((times[k], i, j, spheres.changes[i], spheres.changes[j]))
    heapq.heapify(heap)
    # fragments that enter cells on their new paths: chains beside the sorted entries, by bucket
    chain = np.full(buckets, -1, np.int64) if len(heap) > 1 else np.zeros(0, np.int64)
    links = [(np.int64(0), np.int64(0), np.int64(0), np.int64(0), np.int64(0))]
    spheres.entered[active] = spheres.cells[active]
    first, second, struck = np.empty(6), np.empty(6), np.empty(2, np.int64)
    while len(heap) > 1:
        time, i, j, before_i, before_j = heapq.heappop(heap)
        if before_i != spheres.changes[i] or before_j != spheres.changes[j]:
            continue
        if _struck_lately(i, j, time - touch.duration, spheres) or _struck_lately(j, i, time - touch.duration, spheres):
            continue
        _state_at(i, time, spheres, until, first)
        _state_at(j, time, spheres, until, second)
        if min(first[2], second[2]) < touch.ground:
            continue
        closing = 0.0
        for axis in range(3):
            closing -= (second[axis] - first[axis]) * (second[3 + axis] - first[3 + axis])
        closing /= spheres.radius[i] + spheres.radius[j]
        if rows == log.shape[0]:
            longer = np.empty((2 * rows + 64, LOG_COLUMNS))
            longer[:rows] = log
            log = longer
        row = log[rows]
        rows += 1
        row[0], row[1], row[2] = time, i, j
        for axis in range(3):
            row[3 + axis], row[6 + axis] = first[axis], second[axis]
            row[9 + axis], row[12 + axis] = first[3 + axis], second[3 + axis]
        lost = strike(
            first, second, spheres.spin[i], spheres.spin[j], spheres.mass[i], spheres.mass[j],
            spheres.radius[i], spheres.radius[j], touch.restitution, touch.friction,
        )  # fmt: skip
        for axis in range(3):
            row[15 + axis], row[18 + axis] = first[3 + axis], second[3 + axis]
        row[21], row[22] = closing, lost
        struck[0], struck[1] = i, j
        for k in struck:
            latest = spheres.changes[k] % PARTNERS
            spheres.partners[k, latest], spheres.struck[k, latest] = i + j - k, time
            spheres.changes[k] += 1
            spheres.since[k] = time
            for axis in range(6):
                spheres.state[k, axis] = first[axis] if k == i else second[axis]
        advance(struck, spheres, around, until)
        if time >= until:
            continue
        for k in struck:
            _enter(k, spheres, cell, buckets, chain, links)
        for k in struck:
            c = spheres.cells[k]
            for x in range(c[0], c[3] + 1):
                for y in range(c[1], c[4] + 1):
                    for z in range(c[2], c[5] + 1):
                        b = bucket_of(x, y, z, buckets)
                        entry, link = starts[b], chain[b]
                        while entry < starts[b + 1] or link >= 0:
                            if entry < starts[b + 1]:
                                other = member[entry]
                                here = place[entry, 0] == x and place[entry, 1] == y and place[entry, 2] == z
                                entry += 1
                            else:
                                other, following, at_x, at_y, at_z = links[link]
                                here = at_x == x and at_y == y and at_z == z
                                link = following
                            if not here or spheres.group[other] == spheres.group[k]:
                                continue
                            if not _boxes_overlap(spheres.boxes, k, other):
                                continue
                            if not home(spheres.cells[k], spheres.cells[other], x, y, z):
                                continue
                            low, high = min(k, other), max(k, other)
                            impact_time = _pair(low, high, spheres, until, touch, scratch, roots)
                            if impact_time < math.inf:
                                changes = spheres.changes
                                heapq.heappush(heap, (impact_time, low, high, changes[low], changes[high]))
    return rows, log
