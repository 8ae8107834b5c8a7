"""Sharing points out to fragments by repeated cuts, until every part is one fragment."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from transition.kernels.cuts import choose_cut, key

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["bisect"]

_PIVOTS = 33  # rows at most among which a pivot is chosen
_DOMINANT = 0.5  # share of the mass from which a fragment is separated from all others at once
_ROUND_OFF = 1e-12  # share of a point that is not worth a cut


@njit(cache=True, nogil=True)
def _swap(row: NDArray[np.float64], ident: NDArray[np.int64], i: int, j: int) -> None:
    for k in range(4):
        row[i, k], row[j, k] = row[j, k], row[i, k]
    ident[i], ident[j] = ident[j], ident[i]


@njit(cache=True, nogil=True)
def _pivot(
    row: NDArray[np.float64], begin: int, end: int, q: NDArray[np.float64], share: float, keys: NDArray[np.float64]
) -> int:
    """Row whose key has about the given share of the rows below it; `keys` (_PIVOTS, 2) is scratch."""
    number = end - begin
    taken = min(_PIVOTS, number, 3 + number // 16)
    for k in range(taken):
        i = begin + (k * number) // taken
        value = key(row, i, q)
        j = k
        while j > 0 and keys[j - 1, 0] > value:
            keys[j, 0], keys[j, 1] = keys[j - 1, 0], keys[j - 1, 1]
            j -= 1
        keys[j, 0], keys[j, 1] = value, i
    # One rank past the wanted one, on the side of the larger rest: the next round has little to look through.
    rank = int(share * taken) + (2 if share < 0.5 else -2) * (1 if number > 4 * _PIVOTS else 0)
    return int(keys[min(max(rank, 0), taken - 1), 1])


@njit(cache=True, nogil=True)
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
        pivot = key(row, end - 1, q)
        below, i, j = 0.0, begin, end - 2
        while True:
            while i <= j and key(row, i, q) < pivot:
                below += row[i, 3]
                i += 1
            while i <= j and not key(row, j, q) < pivot:
                j -= 1
            if i >= j:
                break
            _swap(row, ident, i, j)
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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
    random place on the end of the region, for a slice would be thin. Neither cell nor coordinate plays a part.

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
        choose_cut(row, begin, end, need / (one + two), normal[cut], uniform[cut, 1], centre, axis, mean, q)
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
            place = open_parts
            waiting[place, 0] = begin if is_light else target
            waiting[place, 1] = taken if is_light else rest
            if is_light == low_is_light:
                waiting[place, 2], waiting[place, 3] = low, middle
            else:
                waiting[place, 2], waiting[place, 3] = middle, high
            open_parts += 1
