"""Sharing points out to fragments by repeated cuts, until every part is one fragment."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from transition.kernels.compiling import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["bisect"]

_SAMPLE = 64  # rows at least that settle the direction of a cut
_SLICE = 0.25  # share of the mass below which a part is taken from around a position, not cut off by a plane
_BINS = 48  # of the angle, in which the gap of an arc is looked for
_HOLLOW = 0.1  # square of the smallest distance from the centre over the mean square, from which a region is hollow
_PIVOTS = 33  # rows at most among which a pivot is chosen
_DOMINANT = 0.5  # share of the mass from which a fragment is separated from all others at once
_ROUND_OFF = 1e-12  # share of a point that is not worth a cut


@kernel
def _angle(along: float, across: float) -> float:
    """A number from 0 to 4 that rises with the angle of (along, across), as an arc tangent does."""
    part = across / (abs(along) + abs(across) + 1e-300)
    ahead = part if part >= 0.0 else 4.0 + part
    return ahead if along >= 0.0 else 2.0 - part


@kernel
def _key(row: NDArray[np.float64], i: int, q: NDArray[np.float64]) -> float:
    """By what a cut orders the rows: a height, a distance, or an angle about an axis (`q[4]` is 1)."""
    x, y, z = row[i, 0], row[i, 1], row[i, 2]
    if q[4] == 0.0:
        return q[0] * x + q[1] * y + q[2] * z + q[3] * (x * x + y * y + z * z)
    return _angle(q[0] * x + q[1] * y + q[2] * z + q[3], q[5] * x + q[6] * y + q[7] * z + q[8])


@kernel
def _direction(
    row: NDArray[np.float64], begin: int, end: int, normal: NDArray[np.float64], mean: NDArray[np.float64]
) -> tuple[float, float, float]:
    """Random unit vector, most likely along the longest extent of the rows; writes their mean position."""
    step = max(1, (end - begin) // _SAMPLE)
    number = 0
    mean[:] = 0.0
    for i in range(begin, end, step):
        for k in range(3):
            mean[k] += row[i, k]
        number += 1
    mean /= number
    xx = yy = zz = xy = xz = yz = 0.0
    for i in range(begin, end, step):
        x, y, z = row[i, 0] - mean[0], row[i, 1] - mean[1], row[i, 2] - mean[2]
        xx += x * x
        yy += y * y
        zz += z * z
        xy += x * y
        xz += x * z
        yz += y * z
    a, b, c = normal[0], normal[1], normal[2]
    for _ in range(2):
        x = xx * a + xy * b + xz * c
        y = xy * a + yy * b + yz * c
        z = xz * a + yz * b + zz * c
        length = np.sqrt(x * x + y * y + z * z)
        if length > 0.0:
            a, b, c = x / length, y / length, z / length
    length = np.sqrt(a * a + b * b + c * c)
    return a / length, b / length, c / length


@kernel
def _angular(
    row: NDArray[np.float64],
    begin: int,
    end: int,
    normal: NDArray[np.float64],
    uniform: float,
    centre: NDArray[np.float64],
    axis: NDArray[np.float64],
    q: NDArray[np.float64],
) -> None:
    """Order by the angle about the axis through `centre`, from the gap of an arc, or from anywhere in a ring."""
    smallest = 0
    for k in range(3):
        if abs(axis[k]) < abs(axis[smallest]):
            smallest = k
    one = np.zeros(3)
    one[smallest] = 1.0
    one = one - axis * (axis @ one) / (axis @ axis)
    one /= np.sqrt(one @ one)
    two = np.array([axis[1] * one[2] - axis[2] * one[1], axis[2] * one[0] - axis[0] * one[2],
                    axis[0] * one[1] - axis[1] * one[0]]) / np.sqrt(axis @ axis)  # fmt: skip
    bins = np.zeros(_BINS, dtype=np.int64)
    for i in range(begin, end, max(1, (end - begin) // (8 * _SAMPLE))):
        x, y, z = row[i, 0] - centre[0], row[i, 1] - centre[1], row[i, 2] - centre[2]
        angle = np.arctan2(x * two[0] + y * two[1] + z * two[2], x * one[0] + y * one[1] + z * one[2])
        bins[int((angle / (2.0 * np.pi) + 0.5) * _BINS) % _BINS] += 1
    longest, last, run = 0, 0, 0
    for k in range(2 * _BINS):
        run = run + 1 if bins[k % _BINS] == 0 else 0
        if run > longest and run <= _BINS:
            longest, last = run, k
    share = (last + 1 - 0.5 * longest) / _BINS if longest > 1 else uniform
    start = 2.0 * np.pi * (share - 0.5)
    sense = 1.0 if normal[0] > 0.0 else -1.0
    q[3] = q[8] = 0.0
    for k in range(3):
        q[k] = np.cos(start) * one[k] + np.sin(start) * two[k]
        q[5 + k] = sense * (np.cos(start) * two[k] - np.sin(start) * one[k])
        q[3] -= q[k] * centre[k]
        q[8] -= q[5 + k] * centre[k]
    q[4] = 1.0


@kernel
def _cut(
    row: NDArray[np.float64],
    begin: int,
    end: int,
    share: float,
    normal: NDArray[np.float64],
    uniform: float,
    centre: NDArray[np.float64],
    axis: NDArray[np.float64],
    mean: NDArray[np.float64],
    q: NDArray[np.float64],
) -> None:
    """Choose the surface of a cut.

    A plane across the longest extent; a sphere about a random position for a part so light that a slice would be thin,
    so that light fragments come at all depths of a wall alike; a half plane from the axis for a ring or a long arc,
    of which a plane would cut off two ends at once.
    """
    a, b, c = _direction(row, begin, end, normal, mean)
    step = max(1, (end - begin) // _SAMPLE)
    nearest, spread, number = np.inf, 0.0, 0
    for i in range(begin, end, step):
        x, y, z = row[i, 0] - mean[0], row[i, 1] - mean[1], row[i, 2] - mean[2]
        square = x * x + y * y + z * z
        nearest, spread, number = min(nearest, square), spread + square, number + 1
    q[:] = 0.0
    if nearest * number > _HOLLOW * spread and (axis[0] != 0.0 or axis[1] != 0.0 or axis[2] != 0.0):
        _angular(row, begin, end, normal, uniform, centre, axis, q)
    elif share < _SLICE:
        i = begin + int(uniform * (end - begin))
        q[0], q[1], q[2], q[3] = -2.0 * row[i, 0], -2.0 * row[i, 1], -2.0 * row[i, 2], 1.0
    else:
        q[0], q[1], q[2] = -a, -b, -c


@kernel
def _swap(row: NDArray[np.float64], ident: NDArray[np.int64], i: int, j: int) -> None:
    for k in range(4):
        row[i, k], row[j, k] = row[j, k], row[i, k]
    ident[i], ident[j] = ident[j], ident[i]


@kernel
def _pivot(
    row: NDArray[np.float64], begin: int, end: int, q: NDArray[np.float64], share: float, keys: NDArray[np.float64]
) -> int:
    """Row whose key has about the given share of the rows below it; `keys` (_PIVOTS, 2) is scratch."""
    number = end - begin
    taken = min(_PIVOTS, number, 3 + number // 16)
    for k in range(taken):
        i = begin + (k * number) // taken
        value = _key(row, i, q)
        j = k
        while j > 0 and keys[j - 1, 0] > value:
            keys[j, 0], keys[j, 1] = keys[j - 1, 0], keys[j - 1, 1]
            j -= 1
        keys[j, 0], keys[j, 1] = value, i
    # One rank past the wanted one, on the side of the larger rest: the next round has little to look through.
    rank = int(share * taken) + (2 if share < 0.5 else -2) * (1 if number > 4 * _PIVOTS else 0)
    return int(keys[min(max(rank, 0), taken - 1), 1])


@kernel
def _partition(
    row: NDArray[np.float64], ident: NDArray[np.int64], begin: int, end: int, q: NDArray[np.float64], pivot: float
) -> tuple[float, Any]:
    """Put the rows whose keys are below the pivot first; their mass (kg), and the row behind them.

    Rows are moved, needed or not, without a branch that no processor could foresee: of angles each to where it stands,
    of other keys each that is not below to where the last of these stood (Lomuto's scheme). Indices without a sign are
    not looked at for counting from the end.
    """
    below, behind, one, none = 0.0, np.uint64(begin), np.uint64(1), np.uint64(0)
    a, b, c, d, e, f, g, h = q[0], q[1], q[2], q[3], q[5], q[6], q[7], q[8]
    angular = q[4] != 0.0
    for j in range(np.uint64(begin), np.uint64(end)):
        x, y, z, mass, number = row[j, 0], row[j, 1], row[j, 2], row[j, 3], ident[j]
        if angular:
            is_below = _angle(a * x + b * y + c * z + d, e * x + f * y + g * z + h) < pivot
            goal = behind if is_below else j
        else:
            is_below = a * x + b * y + c * z + d * (x * x + y * y + z * z) < pivot
            goal = behind
        x0, y0, z0, mass0, number0 = row[goal, 0], row[goal, 1], row[goal, 2], row[goal, 3], ident[goal]
        row[j, 0], row[j, 1], row[j, 2], row[j, 3], ident[j] = x0, y0, z0, mass0, number0
        row[goal, 0], row[goal, 1], row[goal, 2], row[goal, 3], ident[goal] = x, y, z, mass, number
        below += mass if is_below else 0.0
        behind += one if is_below else none
    return below, np.int64(behind)


@kernel
def _select(
    row: NDArray[np.float64],
    ident: NDArray[np.int64],
    begin: int,
    end: int,
    q: NDArray[np.float64],
    need: float,
    total: float,
    keys: NDArray[np.float64],
) -> tuple[int, float]:
    """Order the rows so that those with the smallest keys come first, up to the mass `need` (kg).

    Returns the row in which the mass is reached, and how much of it is still needed. `total` (kg) is the rows' mass.
    """
    before, within = 0.0, total
    while end - begin > 1:
        share = min(max((need - before) / within, 0.0), 1.0) if within > 0.0 else 0.5
        _swap(row, ident, _pivot(row, begin, end, q, share, keys), end - 1)
        below, i = _partition(row, ident, begin, end - 1, q, _key(row, end - 1, q))
        _swap(row, ident, i, end - 1)
        if before + below >= need:
            end, within = i, below
        elif before + below + row[i, 3] >= need:
            return i, need - before - below
        else:
            within -= below + row[i, 3]
            before += below + row[i, 3]
            begin = i + 1
        if begin >= end:  # round-off: the last row before
            return max(begin - 1, 0), row[max(begin - 1, 0), 3]
    return begin, need - before


@kernel
def _divide(fragment: NDArray[np.int64], mass: NDArray[np.float64], begin: int, end: int, uniform: float) -> int:
    """Divide the fragments `begin` to `end` into two groups; returns where the second begins.

    A fragment heavier than the others together stands alone. Otherwise the first group is as near as can be to the
    share 0.3 + 0.4 `uniform` of the mass.
    """
    total, heaviest = 0.0, begin
    for f in range(begin, end):
        total += mass[fragment[f]]
        if mass[fragment[f]] > mass[fragment[heaviest]]:
            heaviest = f
    if mass[fragment[heaviest]] > _DOMINANT * total:
        fragment[heaviest], fragment[end - 1] = fragment[end - 1], fragment[heaviest]
        return end - 1
    wanted = (0.3 + 0.4 * uniform) * total
    below = 0.0
    for f in range(begin, end - 1):
        below += mass[fragment[f]]
        if below + 0.5 * mass[fragment[f + 1]] >= wanted:
            return f + 1
    return end - 1


@kernel
def bisect(
    row: NDArray[np.float64],
    ident: NDArray[np.int64],
    points: int,
    mass: NDArray[np.float64],
    order: NDArray[np.int64],
    normal: NDArray[np.float64],
    uniform: NDArray[np.float64],
    axis: NDArray[np.float64],
    first: NDArray[np.int64],
    number: NDArray[np.int64],
) -> None:
    """Share points out to fragments: cut points and fragments in two, and each half again.

    The fragments stand in random order and are divided into two groups of about equal mass. The points are divided by
    a plane across a random direction near their longest extent, so that each side has the mass of its group; one
    point is cut by mass where the plane meets it. A group much lighter than the other takes what is nearest to a
    random point of the part, for a slice would be thin. Neither cell nor coordinate plays a part.

    Parameters
    ----------
    row : (p + n - 1, 4) float64
        Positions (m) and masses (kg) of the points in the first `points` rows; written: those of the pieces.
    ident : (p + n - 1,) int64
        Numbers of the points; written: point of every piece.
    points : int
        p, one at least.
    mass : (n,) float64
        Masses of the fragments (kg), which add up to those of the points.
    order : (n,) int64
        The fragments in random order; sorted here.
    normal : (n, 3) float64
        Standard normal random numbers: one row for each cut.
    uniform : (n, 2) float64
        Uniform random numbers in [0, 1).
    axis : (3,) float64
        Direction of the axis about which the points may form a ring; zero for none.
    first, number : (n,) int64
        Written: pieces `first[f]` to `first[f] + number[f]` are those of fragment f; unused rows lie between them.
    """
    fragments = mass.size
    keys, mean, q = np.empty((_PIVOTS, 2)), np.empty(3), np.empty(9)
    centre = np.zeros(3)
    for i in range(points):
        for k in range(3):
            centre[k] += row[i, k] / points
    waiting = np.empty((fragments + 1, 4), dtype=np.int64)  # first row, rows, first and last fragment
    waiting[0, 0], waiting[0, 1], waiting[0, 2], waiting[0, 3] = 0, points, 0, fragments
    open_parts, cut = 1, 0
    while open_parts > 0:
        open_parts -= 1
        begin, rows, low, high = waiting[open_parts]
        if high - low == 1:
            first[order[low]], number[order[low]] = begin, rows
            continue
        middle = _divide(order, mass, low, high, uniform[cut, 0])
        one = two = 0.0
        for f in range(low, middle):
            one += mass[order[f]]
        for f in range(middle, high):
            two += mass[order[f]]
        # The lighter group is counted out, so that round-off is small beside its own mass.
        low_is_light = one <= two
        need = min(one, two)
        end = begin + rows
        _cut(row, begin, end, need / (one + two), normal[cut], uniform[cut, 1], centre, axis, mean, q)
        cut += 1
        at, part = _select(row, ident, begin, end, q, need, one + two, keys)
        whole = row[at, 3]
        taken = at - begin  # rows of the lighter group
        if part >= whole * (1.0 - _ROUND_OFF) and at + 1 < end:
            taken += 1
        elif part > whole * _ROUND_OFF or taken == 0:
            part = min(max(part, 0.0), whole)
            for k in range(3):
                row[end, k] = row[at, k]
            row[end, 3] = whole - part  # the next free row: every part has one for each of its cuts
            ident[end] = ident[at]
            row[at, 3] = part
            taken += 1
            end += 1
        light = middle - low if low_is_light else high - middle
        rest = end - begin - taken
        target = begin + taken + light - 1  # leaves the lighter group a free row for each of its cuts
        moved = min(light - 1, rest)
        for k in range(moved):
            source, goal = begin + taken + k, begin + taken + max(light - 1, rest) + k
            for column in range(4):
                row[goal, column] = row[source, column]
            ident[goal] = ident[source]
        for side in range(2):
            is_light = side == 0
            position = open_parts
            waiting[position, 0] = begin if is_light else target
            waiting[position, 1] = taken if is_light else rest
            if is_light == low_is_light:
                waiting[position, 2], waiting[position, 3] = low, middle
            else:
                waiting[position, 2], waiting[position, 3] = middle, high
            open_parts += 1
