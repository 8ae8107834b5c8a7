"""All sign changes of a polynomial on a step, none missed and none counted twice.

Polynomials are in Bernstein form on [0, 1]. The number of sign changes among the coefficients bounds the number of
roots (Descartes' rule) and is exact for 0 and 1, so intervals are halved until each holds at most one (Lane and
Riesenfeld 1981). A zero counts as positive at both ends of a step, hence a crossing that falls on the joint of two
steps is found once.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from flight.kernels.compiling import inner_kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

LARGEST_DEGREE = 10
STACK_SHAPE = (72, LARGEST_DEGREE + 3)  # coefficients, then lower and upper end; one row an open interval
NOISE = 64.0 * np.finfo(np.float64).eps
NARROWEST = 2.0**-60
# binomials C(5,i) C(5,j) / C(10,i+j): the product of two polynomials of degree 5 in Bernstein form
PRODUCT = np.array([[math.comb(5, i) * math.comb(5, j) / math.comb(10, i + j) for j in range(6)] for i in range(6)])


@inner_kernel()
def _variations(row: Array, degree: int) -> int:
    """Sign changes in the sequence of coefficients, zeros as positive."""
    count = 0
    before = row[0] >= 0.0
    for i in range(1, degree + 1):
        after = row[i] >= 0.0
        if after != before:
            count += 1
            before = after
    return count


@inner_kernel()
def _at(row: Array, degree: int, t: float, work: Array) -> tuple[float, float]:
    """Value and slope of a polynomial (de Casteljau); of the fifth degree without going through memory."""
    if degree == 5:
        a, b, c, d, e, f = row[0], row[1], row[2], row[3], row[4], row[5]
        a, b, c, d, e = a + t * (b - a), b + t * (c - b), c + t * (d - c), d + t * (e - d), e + t * (f - e)
        a, b, c, d = a + t * (b - a), b + t * (c - b), c + t * (d - c), d + t * (e - d)
        a, b, c = a + t * (b - a), b + t * (c - b), c + t * (d - c)
        a, b = a + t * (b - a), b + t * (c - b)
        return a + t * (b - a), 5.0 * (b - a)
    for i in range(degree + 1):
        work[i] = row[i]
    for level in range(degree, 1, -1):
        for i in range(level):
            work[i] += t * (work[i + 1] - work[i])
    return work[0] + t * (work[1] - work[0]), degree * (work[1] - work[0])


@inner_kernel()
def _single_root(row: Array, degree: int, work: Array) -> float:
    """Place in [0, 1] of the only sign change: Newton's method kept inside a bracket by bisection."""
    low, high = 0.0, 1.0
    low_positive = row[0] >= 0.0
    denominator = row[0] - row[degree]
    t = row[0] / denominator if denominator != 0.0 else 0.5
    if row[0] == 0.0:  # a zero at the start is the change only where what follows is below zero
        first = 1
        while first < degree and row[first] == 0.0:
            first += 1
        if row[first] < 0.0:
            return 0.0
        t = 0.5
    for _ in range(100):
        if not low <= t <= high:
            t = 0.5 * (low + high)
        value, slope = _at(row, degree, t, work)
        if (value >= 0.0) == low_positive:
            low = t
        else:
            high = t
        if value == 0.0 or high - low < 1e-16:
            break
        following = t - value / slope if slope != 0.0 else -1.0
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - t) <= 1e-16:
            break
        t = following
    return t


@inner_kernel()
def sign_changes(stack: Array, degree: int, scale: float, roots: Array) -> int:
    """Find all sign changes on [0, 1] of the polynomial whose coefficients stand in stack[0, :degree + 1].

    `scale` is the size of the numbers whose difference the coefficients are: below 64 ulp of it a sign is noise, and an
    interval of noise counts by the signs of its ends. Fills `roots` (LARGEST_DEGREE,) rising; returns how many.
    """
    low_column, high_column = LARGEST_DEGREE + 1, LARGEST_DEGREE + 2
    stack[0, low_column], stack[0, high_column] = 0.0, 1.0
    depth, found = 1, 0
    work = stack[STACK_SHAPE[0] - 1]
    while depth > 0 and found < roots.size:
        depth -= 1
        row = stack[depth]
        changes = _variations(row, degree)
        if changes == 0:
            continue
        low, high = row[low_column], row[high_column]
        if changes == 1:
            roots[found] = low + (high - low) * _single_root(row, degree, work)
            found += 1
            continue
        largest = 0.0
        for i in range(degree + 1):
            largest = max(largest, abs(row[i]))
        if largest <= NOISE * scale or high - low < NARROWEST:
            if (row[0] >= 0.0) != (row[degree] >= 0.0):
                roots[found] = 0.5 * (low + high)
                found += 1
            continue
        # halve (de Casteljau): the right half stays in this row, the left half goes on top and is looked at first
        left = stack[depth + 1]
        middle = 0.5 * (low + high)
        left[0] = row[0]
        for level in range(1, degree + 1):
            for i in range(degree + 1 - level):
                row[i] = 0.5 * (row[i] + row[i + 1])
            left[level] = row[0]
        left[low_column], left[high_column] = low, middle
        row[low_column], row[high_column] = middle, high
        depth += 2
    return found
