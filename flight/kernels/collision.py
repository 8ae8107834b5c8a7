"""First contact of two spheres on curved paths, and the impact.

Nothing here allocates, so the compiler is instructed to leave out the counting of references to arrays (`_nrt=False`),
which costs more than the sums.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from flight.kernels.compiling import inner_kernel
from flight.kernels.roots import LARGEST_DEGREE, PRODUCT, STACK_SHAPE, sign_changes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

# rows of LARGEST_DEGREE + 3 numbers: the stack of roots, then the relative path, and a state on it
SCRATCH_ROWS = STACK_SHAPE[0] + 4
TOUCHING = 1e-9  # share of the reach; closer than that counts as touching, not as overlapping


@inner_kernel()
def _restrict(path: Array, theta: float, out: Array) -> None:
    """Bernstein coefficients (3, 6) of the part of a path from its position `theta` to its end (de Casteljau)."""
    for axis in range(3):
        row = out[axis]
        for i in range(6):
            row[i] = path[axis, i]
        for level in range(1, 6):
            for i in range(6 - level):
                row[i] += theta * (row[i + 1] - row[i])


@inner_kernel()
def path_state(path: Array, length: float, theta: float, out: Array) -> None:
    """Place and velocity (6,) at `theta` of a path (3, 6) that takes `length` seconds."""
    s, t = 1.0 - theta, theta
    w0, w1, w2, w3, w4 = s * s * s * s, 4.0 * s * s * s * t, 6.0 * s * s * t * t, 4.0 * s * t * t * t, t * t * t * t
    for axis in range(3):
        p = path[axis]
        low = w0 * p[0] + w1 * p[1] + w2 * p[2] + w3 * p[3] + w4 * p[4]
        high = w0 * p[1] + w1 * p[2] + w2 * p[3] + w3 * p[4] + w4 * p[5]
        out[axis] = s * low + t * high
        out[3 + axis] = 5.0 * (high - low) / length


@inner_kernel()
def first_collision(
    first: Array, first_start: float, second: Array, second_start: float, end: float, reach: float, min_speed: float,
    scratch: Array, roots: Array,
) -> float:  # fmt: skip
    """Time (s) at which the distance of two paths first falls to `reach` (m); infinite where it does not.

    Both paths (3, 6) are quintics in Bernstein form from their start to the common `end` of the window. The squared
    distance is then a polynomial of degree 10 whose every sign change is found (`flight.kernels.roots`), so no pair is
    missed however fast it closes. A pair that overlaps from the start is separated first; one that closes at less than
    `min_speed` (m/s) is not a contact.
    """
    start = max(first_start, second_start)
    length = end - start
    if length <= 0.0:
        return math.inf
    relative, state = scratch[STACK_SHAPE[0] : STACK_SHAPE[0] + 3], scratch[STACK_SHAPE[0] + 3]
    if first_start < start:
        _restrict(first, (start - first_start) / (end - first_start), relative)
        for axis in range(3):
            for i in range(6):
                relative[axis, i] = second[axis, i] - relative[axis, i]
    elif second_start < start:
        _restrict(second, (start - second_start) / (end - second_start), relative)
        for axis in range(3):
            for i in range(6):
                relative[axis, i] -= first[axis, i]
    else:
        for axis in range(3):
            for i in range(6):
                relative[axis, i] = second[axis, i] - first[axis, i]
    if _stays_apart(relative, reach):
        return math.inf
    squared = reach * reach
    coefficients = scratch[0]
    for k in range(LARGEST_DEGREE + 1):
        coefficients[k] = -squared
    farthest = 0.0
    for axis in range(3):
        p = relative[axis]
        largest = 0.0
        for i in range(6):
            largest = max(largest, p[i] * p[i])
            coefficients[2 * i] += PRODUCT[i, i] * p[i] * p[i]
            for j in range(i):
                coefficients[i + j] += 2.0 * PRODUCT[i, j] * p[i] * p[j]
        farthest += largest
    if -TOUCHING * squared < coefficients[0] <= 0.0 and _closing(relative, length, 0.0, min_speed, state):
        return start
    changes = 0
    for k in range(LARGEST_DEGREE):
        changes += (coefficients[k] >= 0.0) != (coefficients[k + 1] >= 0.0)
    if changes == 0 or (changes == 1 and coefficients[0] < 0.0):
        return math.inf  # at no time, or apart for good from an overlap at the start
    found = sign_changes(scratch[: STACK_SHAPE[0]], LARGEST_DEGREE, farthest, roots)
    for k in range(found):
        if _closing(relative, length, roots[k], min_speed, state):
            return start + roots[k] * length
    return math.inf


@inner_kernel()
def _stays_apart(relative: Array, reach: float) -> bool:
    """Return from the control points whether a relative path keeps farther from the origin than `reach`.

    They lie about the chord; so does the path, no farther from it than they do.
    """
    along = square = 0.0
    for axis in range(3):
        p = relative[axis]
        if min(p[0], p[1], p[2], p[3], p[4], p[5]) > reach or max(p[0], p[1], p[2], p[3], p[4], p[5]) < -reach:
            return True
        chord = p[5] - p[0]
        along -= p[0] * chord
        square += chord * chord
    position = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
    nearest = bulge = 0.0
    for axis in range(3):
        p = relative[axis]
        chord = p[5] - p[0]
        nearest += (p[0] + position * chord) ** 2
        off = 0.0
        for k in range(1, 5):
            off = max(off, abs(p[k] - p[0] - 0.2 * k * chord))
        bulge += off * off
    # 1e-9 above what rounding makes of it
    return nearest > (reach + math.sqrt(bulge)) ** 2 * (1.0 + 1e-9)


@inner_kernel()
def _closing(relative: Array, length: float, theta: float, min_speed: float, state: Array) -> bool:
    """Return whether the distance falls faster than `min_speed` at a position of the relative path."""
    path_state(relative, length, theta, state)
    distance = rate = 0.0
    for axis in range(3):
        distance += state[axis] * state[axis]
        rate += state[axis] * state[3 + axis]
    return rate < -min_speed * math.sqrt(distance)


@inner_kernel()
def strike(
    first: Array, second: Array, first_spin: Array, second_spin: Array, first_mass: float, second_mass: float,
    first_radius: float, second_radius: float, restitution: float, friction: float,
) -> float:  # fmt: skip
    """Let two touching spheres strike: velocities in `first[3:]`, `second[3:]` and spins change; gives the energy lost.

    Hard spheres with restitution along the normal and Coulomb friction across it, which at most stops the surfaces'
    sliding (Walton and Braun 1986; Foerster et al. 1994, with no tangential restitution): the limit of a linear
    spring and dashpot with friction for contacts that are short beside the flight between them. The normal impulse is
    (1 + e) m_12 v_n, the tangential one the lesser of mu times it and 2/7 m_12 v_t. Energy in J, spin included.
    """
    nx, ny, nz = second[0] - first[0], second[1] - first[1], second[2] - first[2]
    distance = math.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx / distance, ny / distance, nz / distance
    wx, wy, wz = second[3] - first[3], second[4] - first[4], second[5] - first[5]
    normal = wx * nx + wy * ny + wz * nz
    # velocity of the second surface over the first at the touching point: w - (r1 spin1 + r2 spin2) x n
    sx = first_radius * first_spin[0] + second_radius * second_spin[0]
    sy = first_radius * first_spin[1] + second_radius * second_spin[1]
    sz = first_radius * first_spin[2] + second_radius * second_spin[2]
    tx = wx - normal * nx - (sy * nz - sz * ny)
    ty = wy - normal * ny - (sz * nx - sx * nz)
    tz = wz - normal * nz - (sx * ny - sy * nx)
    sliding = math.sqrt(tx * tx + ty * ty + tz * tz)
    reduced = first_mass * second_mass / (first_mass + second_mass)
    push = -(1.0 + restitution) * reduced * normal
    drag = min(friction * push, 2.0 / 7.0 * reduced * sliding)
    share = drag / sliding if sliding > 0.0 else 0.0
    jx, jy, jz = push * nx - share * tx, push * ny - share * ty, push * nz - share * tz
    # work of the impulse at the mean of the velocities before and after, taken from the parts that it changes
    lost = 0.5 * reduced * normal * normal * (1.0 - restitution * restitution)
    lost += drag * (sliding - 0.5 * drag * 3.5 / reduced)
    first[3] -= jx / first_mass
    first[4] -= jy / first_mass
    first[5] -= jz / first_mass
    second[3] += jx / second_mass
    second[4] += jy / second_mass
    second[5] += jz / second_mass
    # the first feels -J at +r n, the second J at -r n: the same torque -r n x J on both
    ax, ay, az = -(ny * jz - nz * jy), -(nz * jx - nx * jz), -(nx * jy - ny * jx)
    one, other = 2.5 / (first_mass * first_radius), 2.5 / (second_mass * second_radius)
    first_spin[0] += one * ax
    first_spin[1] += one * ay
    first_spin[2] += one * az
    second_spin[0] += other * ax
    second_spin[1] += other * ay
    second_spin[2] += other * az
    return lost
