"""Compiled kernels: positions along a space-filling curve, jittered points in hexahedra and in rings."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numba
import numpy as np

from fragfield_base.kernel_cache import compiled_with, digest_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


_STAMP = digest_of([Path(__file__)])


def kernel(function: Callable[..., Any]) -> Any:  # noqa: ANN401 - numba's dispatcher has no type
    """Compile a function for one thread and without the interpreter's lock."""
    return compiled_with(numba, function, f"transition-{_STAMP}", nogil=True, error_model="numpy")


@kernel
def curve_positions(unit: Array, blocks: int, flat: int, deep: int) -> NDArray[np.int64]:
    """Number (p,) along the curve of the cell that every point lies in.

    The sheet is a row of square `blocks` along its first axis. Each is divided `flat` times into four across its whole
    depth, and what this leaves `deep` times into eight. The curve enters every cell at a corner and leaves it at a
    neighbouring one, where the next begins, so that neighbours along it are neighbours in the sheet (D. Hilbert 1891;
    states of corner and direction as in Hamilton and Rau-Chaplin 2008).

    Parameters
    ----------
    unit : (p, 3) float64
        Coordinates in [0, 1] along the three sides of the sheet.
    blocks, flat, deep : int
        The bits of a number are those of `blocks`, 2 `flat` and 3 `deep`: 63 in all at most.
    """
    key = np.empty(len(unit), dtype=np.int64)
    fine, thin = 1 << (flat + deep), 1 << deep
    for i in range(len(unit)):
        along = unit[i, 0] * blocks
        h = min(int(along), blocks - 1)
        x = min(int((along - h) * fine), fine - 1)
        y, z = min(int(unit[i, 1] * fine), fine - 1), min(int(unit[i, 2] * thin), thin - 1)
        entry, direction = 0, 0
        for level in range(flat + deep - 1, -1, -1):
            corner = ((x >> level) & 1) | (((y >> level) & 1) << 1)
            n = 2
            if level < deep:
                n, corner = 3, corner | (((z >> level) & 1) << 2)
            mask, turn = (1 << n) - 1, direction + 1
            corner ^= entry
            corner = ((corner >> turn) | (corner << (n - turn))) & mask
            w = corner ^ (corner >> 1) ^ (corner >> 2)  # inverse of the Gray code
            h = (h << n) | w
            if w > 0:
                even = (w - 1) & ~1
                gray = even ^ (even >> 1)
                entry ^= ((gray << turn) | (gray >> (n - turn))) & mask
                ones = w if w & 1 else w - 1
                while ones & 1:  # as many as trailing ones
                    direction += 1
                    ones >>= 1
            direction = (direction + 1) % n
        key[i] = h
    return key


_STEP = (0.8191725133961645, 0.6710436067037893, 0.5497004779019703)  # 1/g, 1/g2, 1/g3 with g^4 = g + 1
_FUNCTIONS = 9


@kernel
def sample_cells(
    modes: Array, offset: NDArray[np.int64], cell_mass: Array, label: NDArray[np.int64], shift: Array, values: Array,
    mass: Array, owner: NDArray[np.int64],
) -> None:  # fmt: skip
    """Values of trilinear functions at random points of every cell, with each cell's mean kept.

    Points come in pairs, one the reflection of the other through the cell's centre, so that the linear modes have
    the mean of zero. That of the bilinear modes is taken from all points of the cell alike. (Eight reflections at the
    middle planes would leave nothing to take, but they put pairs of neighbours on these planes, and fragments of few
    points show them.) The pairs of a cell follow the additive recurrence of R. Roberts (2018), which fills it evenly.

    Parameters
    ----------
    modes : (m, 8, 9) float64
        Coefficients of nine functions: position, velocity and position before the burst (`cells.modes`).
    offset : (m + 1,) int64
        Points `offset[c]` to `offset[c + 1]` lie in cell c: an even number.
    cell_mass : (m,) float64
        Masses of the cells (kg).
    label : (m,) int64
        A number for each cell.
    shift : (m, 3) float64
        Uniform random numbers in [0, 1): where the recurrence of every cell begins.
    values : (p, 9) float64
        Written: the functions at the points.
    mass, owner : (p,)
        Written: an equal share of the cell's mass (kg) for each of its points, and the cell's number.
    """
    odd, even, mean = np.empty(_FUNCTIONS), np.empty(_FUNCTIONS), np.empty(_FUNCTIONS)
    for cell in range(offset.size - 1):
        begin, number = offset[cell], offset[cell + 1] - offset[cell]
        share = cell_mass[cell] / number
        for j in range(_FUNCTIONS):
            mean[j] = 0.0
        for pair in range(number // 2):
            u = 2.0 * ((shift[cell, 0] + pair * _STEP[0]) % 1.0) - 1.0
            v = 2.0 * ((shift[cell, 1] + pair * _STEP[1]) % 1.0) - 1.0
            w = 2.0 * ((shift[cell, 2] + pair * _STEP[2]) % 1.0) - 1.0
            one = begin + 2 * pair
            for j in range(_FUNCTIONS):
                odd[j] = modes[cell, 1, j] * u + modes[cell, 2, j] * v + modes[cell, 3, j] * w
                odd[j] += modes[cell, 7, j] * (u * v * w)
                even[j] = modes[cell, 4, j] * (u * v) + modes[cell, 5, j] * (u * w) + modes[cell, 6, j] * (v * w)
                values[one, j] = modes[cell, 0, j] + even[j] + odd[j]
                values[one + 1, j] = modes[cell, 0, j] + even[j] - odd[j]
                mean[j] += even[j]
            mass[one], mass[one + 1] = share, share
            owner[one], owner[one + 1] = label[cell], label[cell]
        for j in range(_FUNCTIONS):
            mean[j] *= 2.0 / number
        for point in range(begin, begin + number):
            for j in range(_FUNCTIONS):
                values[point, j] -= mean[j]


_RING_FUNCTIONS = 6
_KEPT = 4  # of them, those whose means are kept
_ITERATIONS = 60  # bisection alone needs 53; Newton's steps mostly need 5


@kernel
def _fraction(x: float) -> float:
    """What a number of zero or above has behind its point."""
    return x - math.floor(x)


# rows of the scratch array of a tile of pairs: coefficients of the density, share; bracket; position; 1 once found; ...
_A, _B, _C, _SHARE, _LOW, _HIGH, _X, _FOUND, _U, _T, _COSINE, _SINE = range(12)
_TILE = 64  # pairs that are placed together: a multiple of two


@kernel
def _quantiles(w: Array) -> None:
    """Where in [-1, 1] the integrals of a + b x + c x2 from -1 reach their shares of the wholes; densities are >= 0.

    For the pairs of a tile side by side: Newton's method, each kept inside its bracket by bisection.
    """
    for i in range(_TILE):
        w[_LOW * _TILE + i], w[_HIGH * _TILE + i], w[_FOUND * _TILE + i] = -1.0, 1.0, 0.0
        w[_X * _TILE + i] = 2.0 * w[_SHARE * _TILE + i] - 1.0
    for _ in range(_ITERATIONS):
        left = np.int64(0)
        for i in range(_TILE):
            a, b, c = w[_A * _TILE + i], w[_B * _TILE + i], w[_C * _TILE + i]
            x, low, high = w[_X * _TILE + i], w[_LOW * _TILE + i], w[_HIGH * _TILE + i]
            found = w[_FOUND * _TILE + i]
            wanted = w[_SHARE * _TILE + i] * (2.0 * a + 2.0 / 3.0 * c)
            excess = a * (x + 1.0) + 0.5 * b * (x * x - 1.0) + c / 3.0 * (x * x * x + 1.0) - wanted
            high = x if excess > 0.0 else high
            low = low if excess > 0.0 else x
            density = a + b * x + c * x * x
            newton = x - excess / (density if density > 0.0 else 1.0)
            following = newton if density > 0.0 else low - 1.0
            middle = 0.5 * (low + high)
            following = following if (low < following) & (following < high) else middle
            near = abs(following - x) < 1e-5  # the next step would be about the square of it
            w[_X * _TILE + i] = following if found == 0.0 else x
            w[_LOW * _TILE + i], w[_HIGH * _TILE + i] = low, high
            found = 1.0 if near else found
            w[_FOUND * _TILE + i] = found
            left += np.int64(found == 0.0)
        if left == 0:
            return


@kernel
def sample_rings(
    modes: Array, mean: Array, density: Array, origin: Array, frame: Array, offset: NDArray[np.int64], cell_mass: Array,
    label: NDArray[np.int64], shift: Array, values: Array, mass: Array, owner: NDArray[np.int64],
) -> None:  # fmt: skip
    """Positions and velocities at random points of every ring, with each ring's mean by mass kept.

    Points come in blocks of four. Two opposite points share a random place (xi, eta) of the quadrilateral, so that
    transverse momentum vanishes to round-off; the other two, a quarter of a turn on, have its antithetic place (the
    quantiles one less those of the first). Places follow the element of mass r dA of the reference quadrilateral, by
    the quantiles of xi and of eta given xi. The blocks of a ring follow the additive recurrence of R. Roberts (2018) in
    the quantiles and the azimuth. What the places leave between the mean of the points and that of the ring is taken
    from all its points.

    Parameters
    ----------
    modes : (m, 4, 6) float64
        Coefficients of 1, xi, eta, xi eta of radius and height (m), of radial and axial velocity (m/s), and of radius
        and height before the burst.
    mean : (m, 4) float64
        Means by mass of the first four functions.
    density : (m, 3, 3) float64
        Mass by area of the reference square, in any unit: coefficients of xi^i eta^j.
    origin, frame : (3,), (3, 3) float64
        Centre of the base (m); rows outward, across and axis.
    offset, cell_mass, label, shift, mass, owner
        As of `sample_cells`, of rings; the points of a ring are a multiple of four.
    values : (p, 9) float64
        Written: position (m), velocity (m/s) and position before the burst (m, from `origin` along `frame`).
    """
    pairs, w = mass.size // 2, np.zeros(12 * _TILE)
    owner_of = np.empty(_TILE, np.int64)
    cell = 0
    for tile in range(0, pairs, _TILE):
        filled = min(_TILE, pairs - tile)
        for k in range(0, filled, 2):
            while 2 * (tile + k) >= offset[cell + 1]:
                cell += 1
            four, c = (2 * (tile + k) - offset[cell]) // 4, density[cell]
            first = _fraction(shift[cell, 0] + four * _STEP[0])
            second = _fraction(shift[cell, 1] + four * _STEP[1])
            turn = _fraction(shift[cell, 2] + four * _STEP[2])  # of the whole circle: strides see all of it
            cosine, sine = math.cos(2.0 * math.pi * turn), math.sin(2.0 * math.pi * turn)
            w[_COSINE * _TILE + k], w[_SINE * _TILE + k] = cosine, sine
            w[_COSINE * _TILE + k + 1], w[_SINE * _TILE + k + 1] = -sine, cosine
            w[_SHARE * _TILE + k], w[_SHARE * _TILE + k + 1] = first, 1.0 - first
            w[_T * _TILE + k], w[_T * _TILE + k + 1] = second, 1.0 - second
            for i in range(k, k + 2):
                w[_A * _TILE + i] = 2.0 * c[0, 0] + 2.0 / 3.0 * c[0, 2]
                w[_B * _TILE + i] = 2.0 * c[1, 0] + 2.0 / 3.0 * c[1, 2]
                w[_C * _TILE + i] = 2.0 * c[2, 0]
                owner_of[i] = cell
        _quantiles(w)
        for i in range(filled):
            c, u = density[owner_of[i]], w[_X * _TILE + i]
            w[_U * _TILE + i], w[_SHARE * _TILE + i] = u, w[_T * _TILE + i]
            w[_A * _TILE + i] = c[0, 0] + (c[1, 0] + c[2, 0] * u) * u
            w[_B * _TILE + i] = c[0, 1] + (c[1, 1] + c[2, 1] * u) * u
            w[_C * _TILE + i] = c[0, 2] + c[1, 2] * u
        _quantiles(w)
        for i in range(filled):
            at, u, v = owner_of[i], w[_U * _TILE + i], w[_X * _TILE + i]
            share = cell_mass[at] / (offset[at + 1] - offset[at])
            point = 2 * (tile + i)
            for j in range(_RING_FUNCTIONS):
                f = modes[at, 0, j] + modes[at, 1, j] * u + (modes[at, 2, j] + modes[at, 3, j] * u) * v
                values[point, j] = values[point + 1, j] = f
            # Opposite points get exactly opposite directions.
            values[point, 6], values[point, 7] = w[_COSINE * _TILE + i], w[_SINE * _TILE + i]
            values[point + 1, 6], values[point + 1, 7] = -w[_COSINE * _TILE + i], -w[_SINE * _TILE + i]
            for side in range(2):
                mass[point + side], owner[point + side] = share, label[at]
    excess = np.empty(_KEPT)
    for cell in range(offset.size - 1):
        begin, number = offset[cell], offset[cell + 1] - offset[cell]
        e0 = e1 = e2 = e3 = 0.0
        for point in range(begin, begin + number):
            e0, e1, e2, e3 = e0 + values[point, 0], e1 + values[point, 1], e2 + values[point, 2], e3 + values[point, 3]
        excess[0], excess[1], excess[2], excess[3] = e0, e1, e2, e3
        for j in range(_KEPT):
            excess[j] = excess[j] / number - mean[cell, j]
        for point in range(begin, begin + number):
            r, z = values[point, 0] - excess[0], values[point, 1] - excess[1]
            radial, axial = values[point, 2] - excess[2], values[point, 3] - excess[3]
            cosine, sine, before, height = values[point, 6], values[point, 7], values[point, 4], values[point, 5]
            values[point, 6], values[point, 7], values[point, 8] = before * cosine, before * sine, height
            for i in range(3):
                outward = cosine * frame[0, i] + sine * frame[1, i]
                values[point, i] = origin[i] + r * outward + z * frame[2, i]
                values[point, 3 + i] = radial * outward + axial * frame[2, i]
