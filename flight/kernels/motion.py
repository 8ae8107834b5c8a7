"""Acceleration of fragments and one Dormand-Prince step, for a block of fragments side by side.

The equation of motion is x'' = a(z, v): gravity, and drag that depends on height and velocity only (Eqs. 32-33); where
the wind changes with the height over a map, the ground below rises evenly over a step. So the stages need no horizontal
position, and the Runge-Kutta formulas for positions are collapsed once, here, into sums over
accelerations.

A stage waits for the one before it, and within it the drag for the air: one fragment alone leaves the processor idle.
So `LANES` fragments are stepped together, each with its own step size; the scratch array `q` holds one row of `LANES`
numbers a quantity, at offsets known to the compiler, which turns the plain loops into vector instructions.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from flight.kernels.compiling import inner_kernel
from flight.scene.air import EARTH_RADIUS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

LANES = 32

# rows of the scratch array; position and velocity at the start and at the end of the step, accelerations of the stages
STATE, NEW, SLOPE = 0, 6, 12
# velocity relative to the air, then its size; position in the air table and drag factor
RELATIVE, SPEED, HEIGHT, FACTOR = 33, 36, 37, 38
# step size (s); A / (2 m) (m2/kg); squared errors of position and velocity; Mach number
STEP, AREA, PLACE_ERROR, VELOCITY_ERROR, MACH = 39, 40, 41, 42, 43
# time since the launch (s)
TIME = 44
# the pieces of the tables that a lane looked up last: of the air its number plus one and eight coefficients, of the
# drag the Mach numbers from and to which it holds, the one that it counts from and four coefficients
PIECE, AIR, FROM, TO, ORIGIN, LAW = 45, 46, 54, 55, 56, 57
# mass (kg); end of the flight at the latest (s); 1 after an impact on the ground; steps taken and rejected; lowest and
# highest Mach number of the flight; 1 on its last step in time; lowest and highest control point of the step by axis
MASS, LATEST, AFTER, STEPS, REJECTED, LOWEST_MACH, HIGHEST_MACH, FINAL, HULL = 61, 62, 63, 64, 65, 66, 67, 68, 69
# of the step: factor of the next one, larger of the squared speeds at its ends, what may happen on it, and whether it
# is to be taken again, or is taken with nothing happening
NEXT, FASTEST, EVENT, AGAIN, QUIET = 75, 76, 77, 78, 79
LEFT = 80  # piece of the air table plus one that a lane needs, then whether it has left its piece of the drag table
GROUND, RISE = 81, 82  # height of the ground below the lane at the start of the step, its rise over the step (m)
ROWS = 83


class Surroundings(NamedTuple):
    """Air, wind, drag and gravity as tables; see `table` of flight.scene.air, flight.scene.wind and flight.drag."""

    air_bottom: float
    air_step: float
    air_pieces: Array
    site_altitude: float
    drag_rows: Array
    drag_bins: NDArray[np.int64]
    drag_bins_per_mach: float
    wind_rows: Array
    ground: float  # over which the heights of the wind count: flat ground, or that of a map at the origin
    gravity: float


# Dormand and Prince (1980), RK5(4)7M
_A = np.zeros((7, 7))
_A[1, :1] = 1 / 5
_A[2, :2] = 3 / 40, 9 / 40
_A[3, :3] = 44 / 45, -56 / 15, 32 / 9
_A[4, :4] = 19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729
_A[5, :5] = 9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656
_A[6, :6] = 35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84
_E = np.array([71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
_PLACE = _A @ _A  # second-order sums: position of stage s = x + c_s h v + h^2 sum_k _PLACE[s, k] a_k
_PLACE_E = _E @ _A

C2, C3, C4, C5 = 1 / 5, 3 / 10, 4 / 5, 8 / 9
A21 = _A[1, 0]
A31, A32 = _A[2, 0], _A[2, 1]
A41, A42, A43 = _A[3, 0], _A[3, 1], _A[3, 2]
A51, A52, A53, A54 = _A[4, 0], _A[4, 1], _A[4, 2], _A[4, 3]
A61, A62, A63, A64, A65 = _A[5, 0], _A[5, 1], _A[5, 2], _A[5, 3], _A[5, 4]
B1, B3, B4, B5, B6 = _A[6, 0], _A[6, 2], _A[6, 3], _A[6, 4], _A[6, 5]
P31 = _PLACE[2, 0]
P41, P42 = _PLACE[3, 0], _PLACE[3, 1]
P51, P52, P53 = _PLACE[4, 0], _PLACE[4, 1], _PLACE[4, 2]
P61, P62, P63, P64 = _PLACE[5, 0], _PLACE[5, 1], _PLACE[5, 2], _PLACE[5, 3]
Q1, Q2, Q3, Q4, Q5 = _PLACE[6, 0], _PLACE[6, 1], _PLACE[6, 2], _PLACE[6, 3], _PLACE[6, 4]
E1, E3, E4, E5, E6, E7 = _E[0], _E[2], _E[3], _E[4], _E[5], _E[6]
F1, F2, F3, F4, F5, F6 = _PLACE_E[0], _PLACE_E[1], _PLACE_E[2], _PLACE_E[3], _PLACE_E[4], _PLACE_E[5]


@inner_kernel(forceinline=True)
def _subtract_wind(q: Array, at: float, wind_rows: Array) -> None:
    """Turn the velocities in RELATIVE into velocities relative to the wind at HEIGHT, over the ground there."""
    for lane in range(LANES):
        z = q[HEIGHT * LANES + lane] - (q[GROUND * LANES + lane] + at * q[RISE * LANES + lane])
        row = wind_rows.shape[0] - 1
        while row > 0 and z < wind_rows[row, 0]:
            row -= 1
        c = wind_rows[row]
        rise = z - c[0]
        q[RELATIVE * LANES + lane] -= c[1] + rise * (c[2] + rise * (c[3] + rise * c[4]))
        q[(RELATIVE + 1) * LANES + lane] -= c[5] + rise * (c[6] + rise * (c[7] + rise * c[8]))


@inner_kernel()
def accelerate(q: Array, slope: int, at: float, around: Surroundings) -> None:
    """Accelerations (m/s2) of all lanes into the three rows from `slope`, and the Mach number.

    `at` is the position on the step, from 0 to 1, for the ground below the lanes.

    Reads heights z (m) from HEIGHT and velocities (m/s) from RELATIVE; both are overwritten.
    a = -Cd(M) rho(z) |v_rel| v_rel A / (2 m) - g e_z (Wang et al., Eqs. 32-33).
    """
    if around.wind_rows.shape[0] > 0:
        _subtract_wind(q, at, around.wind_rows)
    pieces = around.air_pieces
    top = float(pieces.shape[0])
    pieces_per_metre = 1.0 / around.air_step
    for i in range(LANES):
        u, v, w = q[RELATIVE * LANES + i], q[(RELATIVE + 1) * LANES + i], q[(RELATIVE + 2) * LANES + i]
        q[SPEED * LANES + i] = math.sqrt(u * u + v * v + w * w)
        altitude = q[HEIGHT * LANES + i] + around.site_altitude
        geopotential = EARTH_RADIUS * altitude / (EARTH_RADIUS + altitude)
        position = (geopotential - around.air_bottom) * pieces_per_metre
        position = max(0.0, position)  # also where it is not a number
        q[HEIGHT * LANES + i] = min(top, position)
    table, bins = around.drag_rows, around.drag_bins
    last_piece, last_bin = np.int64(pieces.shape[0] - 1), np.int64(bins.shape[0] - 1)
    last_row = np.int64(table.shape[0] - 1)
    top_mach = (last_bin + 0.5) / around.drag_bins_per_mach
    left = np.int64(0)
    for i in range(LANES):  # looked up again only where a lane has left its piece
        q[LEFT * LANES + i] = min(np.floor(q[HEIGHT * LANES + i]), float(last_piece)) + 1.0
        left += np.int64(q[PIECE * LANES + i] != q[LEFT * LANES + i])
    if left > 0:
        for i in range(LANES):
            if q[PIECE * LANES + i] != q[LEFT * LANES + i]:
                q[PIECE * LANES + i] = q[LEFT * LANES + i]
                piece = np.int64(q[LEFT * LANES + i]) - 1
                for k in range(8):
                    q[(AIR + k) * LANES + i] = pieces[piece, k]
    for i in range(LANES):
        rise = (q[HEIGHT * LANES + i] - (q[PIECE * LANES + i] - 1.0)) * around.air_step
        c0, c1, c2, c3 = (
            q[AIR * LANES + i], q[(AIR + 1) * LANES + i], q[(AIR + 2) * LANES + i], q[(AIR + 3) * LANES + i],
        )  # fmt: skip
        q[FACTOR * LANES + i] = c0 + rise * (c1 + rise * (c2 + rise * c3))
        c0, c1, c2, c3 = (
            q[(AIR + 4) * LANES + i], q[(AIR + 5) * LANES + i], q[(AIR + 6) * LANES + i], q[(AIR + 7) * LANES + i],
        )  # fmt: skip
        q[MACH * LANES + i] = q[SPEED * LANES + i] * (c0 + rise * (c1 + rise * (c2 + rise * c3)))
    for i in range(LANES):
        mach = q[MACH * LANES + i]
        q[LEFT * LANES + i] = 0.0 if (q[FROM * LANES + i] <= mach) & (mach < q[TO * LANES + i]) else 1.0
    for first in range(LEFT * LANES, (LEFT + 1) * LANES, 8):
        some = (q[first] + q[first + 1]) + (q[first + 2] + q[first + 3])
        others = (q[first + 4] + q[first + 5]) + (q[first + 6] + q[first + 7])
        if some + others == 0.0:
            continue
        for i in range(first - LEFT * LANES, first - LEFT * LANES + 8):
            if q[LEFT * LANES + i] == 0.0:
                continue
            mach = q[MACH * LANES + i]
            row = bins[np.int64((min(top_mach, mach)) * around.drag_bins_per_mach)]
            row = min(row + np.int64(mach >= table[row, 5]), last_row)  # an infinite one is at the end of the last row
            q[FROM * LANES + i] = table[row, 0] if row > 0 else 0.0
            q[TO * LANES + i] = table[row, 5]
            q[ORIGIN * LANES + i] = table[row, 0]
            for k in range(4):
                q[(LAW + k) * LANES + i] = table[row, 1 + k]
    for i in range(LANES):
        rise = q[MACH * LANES + i] - q[ORIGIN * LANES + i]
        d1, d2, d3, d4 = (
            q[LAW * LANES + i], q[(LAW + 1) * LANES + i], q[(LAW + 2) * LANES + i], q[(LAW + 3) * LANES + i],
        )  # fmt: skip
        coefficient = d1 + rise * (d2 + rise * (d3 + rise * d4))
        q[FACTOR * LANES + i] = q[FACTOR * LANES + i] * coefficient * q[SPEED * LANES + i]
    for i in range(LANES):
        factor = -q[AREA * LANES + i] * q[FACTOR * LANES + i]
        q[slope * LANES + i] = factor * q[RELATIVE * LANES + i]
        q[(slope + 1) * LANES + i] = factor * q[(RELATIVE + 1) * LANES + i]
        q[(slope + 2) * LANES + i] = factor * q[(RELATIVE + 2) * LANES + i] - around.gravity


@inner_kernel()
def take_step(q: Array, around: Surroundings) -> None:
    """One step of every lane, of its own size STEP, from STATE with the acceleration in the first rows of SLOPE.

    Fills NEW, SLOPE (7 x 3 rows), MACH at the end, and the squared error estimates PLACE_ERROR (m2) and
    VELOCITY_ERROR (m2/s2).
    """
    for j in range(3):
        for i in range(LANES):
            h = q[STEP * LANES + i]
            a = q[(SLOPE + j) * LANES + i]
            q[(RELATIVE + j) * LANES + i] = q[(STATE + 3 + j) * LANES + i] + h * A21 * a
    for i in range(LANES):
        h = q[STEP * LANES + i]
        q[HEIGHT * LANES + i] = q[(STATE + 2) * LANES + i] + C2 * h * q[(STATE + 5) * LANES + i]
    accelerate(q, SLOPE + 3, C2, around)
    for j in range(3):
        for i in range(LANES):
            h = q[STEP * LANES + i]
            a, b = q[(SLOPE + j) * LANES + i], q[(SLOPE + 3 + j) * LANES + i]
            q[(RELATIVE + j) * LANES + i] = q[(STATE + 3 + j) * LANES + i] + h * (A31 * a + A32 * b)
    for i in range(LANES):
        h = q[STEP * LANES + i]
        a = q[(SLOPE + 2) * LANES + i]
        q[HEIGHT * LANES + i] = q[(STATE + 2) * LANES + i] + h * (C3 * q[(STATE + 5) * LANES + i] + h * (P31 * a))
    accelerate(q, SLOPE + 6, C3, around)
    for j in range(3):
        for i in range(LANES):
            h = q[STEP * LANES + i]
            a, b, c = q[(SLOPE + j) * LANES + i], q[(SLOPE + 3 + j) * LANES + i], q[(SLOPE + 6 + j) * LANES + i]
            q[(RELATIVE + j) * LANES + i] = q[(STATE + 3 + j) * LANES + i] + h * (A41 * a + A42 * b + A43 * c)
    for i in range(LANES):
        h = q[STEP * LANES + i]
        a, b = q[(SLOPE + 2) * LANES + i], q[(SLOPE + 5) * LANES + i]
        q[HEIGHT * LANES + i] = q[(STATE + 2) * LANES + i] + h * (
            C4 * q[(STATE + 5) * LANES + i] + h * (P41 * a + P42 * b)
        )
    accelerate(q, SLOPE + 9, C4, around)
    for j in range(3):
        for i in range(LANES):
            h = q[STEP * LANES + i]
            a, b = q[(SLOPE + j) * LANES + i], q[(SLOPE + 3 + j) * LANES + i]
            c, d = q[(SLOPE + 6 + j) * LANES + i], q[(SLOPE + 9 + j) * LANES + i]
            q[(RELATIVE + j) * LANES + i] = q[(STATE + 3 + j) * LANES + i] + h * (A51 * a + A52 * b + A53 * c + A54 * d)
    for i in range(LANES):
        h = q[STEP * LANES + i]
        a, b, c = q[(SLOPE + 2) * LANES + i], q[(SLOPE + 5) * LANES + i], q[(SLOPE + 8) * LANES + i]
        q[HEIGHT * LANES + i] = q[(STATE + 2) * LANES + i] + h * (
            C5 * q[(STATE + 5) * LANES + i] + h * (P51 * a + P52 * b + P53 * c)
        )
    accelerate(q, SLOPE + 12, C5, around)
    for j in range(3):
        for i in range(LANES):
            h = q[STEP * LANES + i]
            a, b, c = q[(SLOPE + j) * LANES + i], q[(SLOPE + 3 + j) * LANES + i], q[(SLOPE + 6 + j) * LANES + i]
            d, e = q[(SLOPE + 9 + j) * LANES + i], q[(SLOPE + 12 + j) * LANES + i]
            q[(RELATIVE + j) * LANES + i] = q[(STATE + 3 + j) * LANES + i] + h * (
                A61 * a + A62 * b + A63 * c + A64 * d + A65 * e
            )
    for i in range(LANES):
        h = q[STEP * LANES + i]
        a, b = q[(SLOPE + 2) * LANES + i], q[(SLOPE + 5) * LANES + i]
        c, d = q[(SLOPE + 8) * LANES + i], q[(SLOPE + 11) * LANES + i]
        q[HEIGHT * LANES + i] = q[(STATE + 2) * LANES + i] + h * (
            q[(STATE + 5) * LANES + i] + h * (P61 * a + P62 * b + P63 * c + P64 * d)
        )
    accelerate(q, SLOPE + 15, 1.0, around)
    for j in range(3):
        for i in range(LANES):
            h = q[STEP * LANES + i]
            a, b, c = q[(SLOPE + j) * LANES + i], q[(SLOPE + 3 + j) * LANES + i], q[(SLOPE + 6 + j) * LANES + i]
            d, e = q[(SLOPE + 9 + j) * LANES + i], q[(SLOPE + 12 + j) * LANES + i]
            f = q[(SLOPE + 15 + j) * LANES + i]
            speed = q[(STATE + 3 + j) * LANES + i]
            new_speed = speed + h * (B1 * a + B3 * c + B4 * d + B5 * e + B6 * f)
            q[(NEW + 3 + j) * LANES + i] = new_speed
            q[(RELATIVE + j) * LANES + i] = new_speed
            q[(NEW + j) * LANES + i] = q[(STATE + j) * LANES + i] + h * (
                speed + h * (Q1 * a + Q2 * b + Q3 * c + Q4 * d + Q5 * e)
            )
    for i in range(LANES):
        q[HEIGHT * LANES + i] = q[(NEW + 2) * LANES + i]
        q[PLACE_ERROR * LANES + i] = 0.0
        q[VELOCITY_ERROR * LANES + i] = 0.0
    accelerate(q, SLOPE + 18, 1.0, around)
    for j in range(3):
        for i in range(LANES):
            h = q[STEP * LANES + i]
            a, b, c = q[(SLOPE + j) * LANES + i], q[(SLOPE + 3 + j) * LANES + i], q[(SLOPE + 6 + j) * LANES + i]
            d, e = q[(SLOPE + 9 + j) * LANES + i], q[(SLOPE + 12 + j) * LANES + i]
            f, g = q[(SLOPE + 15 + j) * LANES + i], q[(SLOPE + 18 + j) * LANES + i]
            position = h * h * (F1 * a + F2 * b + F3 * c + F4 * d + F5 * e + F6 * f)
            speed = h * (E1 * a + E3 * c + E4 * d + E5 * e + E6 * f + E7 * g)
            q[PLACE_ERROR * LANES + i] += position * position
            q[VELOCITY_ERROR * LANES + i] += speed * speed


@inner_kernel()
def place_points(q: Array, lane: int, points: Array) -> None:
    """Bernstein coefficients (degree 5) of one lane's positions along the step, into points[:3].

    The quintic through position, velocity and acceleration at both ends of the step: its error is of the sixth order,
    like that of the step, its ends are the step's ends exactly, and the hull of its coefficients holds the curve.
    """
    h = q[STEP * LANES + lane]
    for j in range(3):
        start, end = q[(STATE + j) * LANES + lane], q[(NEW + j) * LANES + lane]
        first, last = 0.2 * h * q[(STATE + 3 + j) * LANES + lane], 0.2 * h * q[(NEW + 3 + j) * LANES + lane]
        points[j, 0] = start
        points[j, 1] = start + first
        points[j, 2] = start + 2.0 * first + 0.05 * h * h * q[(SLOPE + j) * LANES + lane]
        points[j, 3] = end - 2.0 * last + 0.05 * h * h * q[(SLOPE + 18 + j) * LANES + lane]
        points[j, 4] = end - last
        points[j, 5] = end


@inner_kernel()
def velocity_points(q: Array, lane: int, points: Array) -> None:
    """Bernstein coefficients (degree 4) of one lane's velocities, the derivative of its positions, into points[3:]."""
    h = q[STEP * LANES + lane]
    for j in range(3):
        start, end = q[(STATE + 3 + j) * LANES + lane], q[(NEW + 3 + j) * LANES + lane]
        first, last = 0.25 * h * q[(SLOPE + j) * LANES + lane], 0.25 * h * q[(SLOPE + 18 + j) * LANES + lane]
        way = q[(NEW + j) * LANES + lane] - q[(STATE + j) * LANES + lane]
        points[3 + j, 0] = start
        points[3 + j, 1] = start + first
        points[3 + j, 2] = 5.0 * way / h - 2.0 * (start + end) + last - first
        points[3 + j, 3] = end - last
        points[3 + j, 4] = end
