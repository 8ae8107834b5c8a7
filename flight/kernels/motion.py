"""Acceleration of a fragment and one Dormand-Prince step, on plain numbers.

The equation of motion is x'' = a(z, v): gravity, and drag that depends on height and velocity only (Eqs. 32-33). So the
stages need no horizontal place, and the Runge-Kutta formulas for places are collapsed once, here, into sums over accelerations.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

__all__ = ["EARTH_RADIUS", "Surroundings", "acceleration", "control_points", "take_step", "velocity_points"]

EARTH_RADIUS = 6_356_766.0  # m, as in flight.air


class Surroundings(NamedTuple):
    """Air, wind, drag and gravity as tables; see `table` of flight.air, flight.wind and flight.drag."""

    air_bottom: float
    air_pieces_per_metre: float
    air_pieces: np.ndarray
    site_altitude: float
    drag_rows: np.ndarray
    drag_bins: np.ndarray
    drag_bins_per_mach: float
    wind_rows: np.ndarray
    gravity: float


# Dormand and Prince (1980), RK5(4)7M; dense output of Hairer, Norsett and Wanner (1993), section II.6, program DOPRI5.
_A = np.zeros((7, 7))
_A[1, :1] = 1 / 5
_A[2, :2] = 3 / 40, 9 / 40
_A[3, :3] = 44 / 45, -56 / 15, 32 / 9
_A[4, :4] = 19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729
_A[5, :5] = 9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656
_A[6, :6] = 35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84
_E = np.array([71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
_D = np.array(
    [
        -12715105075 / 11282082432,
        0,
        87487479700 / 32700410799,
        -10690763975 / 1880347072,
        701980252875 / 199316789632,
        -1453857185 / 822651844,
        69997945 / 29380423,
    ]
)
_PLACE = _A @ _A  # second-order sums: place of stage s = x + c_s h v + h^2 sum_k _PLACE[s, k] a_k
_PLACE_E, _PLACE_D = _E @ _A, _D @ _A

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
D1, D3, D4, D5, D6, D7 = _D[0], _D[2], _D[3], _D[4], _D[5], _D[6]
G1, G2, G3, G4, G5, G6 = _PLACE_D[0], _PLACE_D[1], _PLACE_D[2], _PLACE_D[3], _PLACE_D[4], _PLACE_D[5]


@njit(forceinline=True, error_model="numpy")
def acceleration(z, u, v, w, half_area_per_mass, around):
    """Acceleration (m/s2) at height z (m) and velocity (u, v, w) (m/s), and the Mach number.

    a = -Cd(M) rho(z) |v_rel| v_rel A / (2 m) - g e_z, v_rel relative to the wind (Wang et al., Eqs. 32-33);
    `half_area_per_mass` is A / (2 m) (m2/kg).
    """
    rows = around.wind_rows
    if rows.shape[0] > 0:
        row = rows.shape[0] - 1
        while row > 0 and z < rows[row, 0]:
            row -= 1
        rise = z - rows[row, 0]
        u -= rows[row, 1] + rise * (rows[row, 2] + rise * (rows[row, 3] + rise * rows[row, 4]))
        v -= rows[row, 5] + rise * (rows[row, 6] + rise * (rows[row, 7] + rise * rows[row, 8]))

    altitude = z + around.site_altitude
    geopotential = EARTH_RADIUS * altitude / (EARTH_RADIUS + altitude)
    pieces = around.air_pieces
    place = (geopotential - around.air_bottom) * around.air_pieces_per_metre
    place = min(max(place, 0.0), float(pieces.shape[0]))
    piece = min(int(place), pieces.shape[0] - 1)
    rise = (place - piece) / around.air_pieces_per_metre
    density = pieces[piece, 0] + rise * (pieces[piece, 1] + rise * (pieces[piece, 2] + rise * pieces[piece, 3]))
    slowness = pieces[piece, 4] + rise * (pieces[piece, 5] + rise * (pieces[piece, 6] + rise * pieces[piece, 7]))

    speed = math.sqrt(u * u + v * v + w * w)
    mach = speed * slowness
    table = around.drag_rows
    bins = around.drag_bins
    last = table.shape[0] - 1
    row = last
    if mach < table[last, 0]:
        row = bins[min(int(mach * around.drag_bins_per_mach), bins.shape[0] - 1)]
        while row < last and mach >= table[row + 1, 0]:
            row += 1
    rise = mach - table[row, 0]
    coefficient = table[row, 1] + rise * (table[row, 2] + rise * (table[row, 3] + rise * table[row, 4]))

    factor = -half_area_per_mass * density * coefficient * speed
    return factor * u, factor * v, factor * w - around.gravity, mach


@njit(error_model="numpy")
def take_step(state, slopes, new, h, half_area_per_mass, around):
    """One step of size h (s) from `state` (6,) with its acceleration in slopes[0]; fills slopes (7, 3) and new (6,).

    Returns the squared error estimates of place (m2) and velocity (m2/s2), and the Mach number at the end.
    """
    z, u, v, w = state[2], state[3], state[4], state[5]
    hh = h * h
    a1, b1, c1 = slopes[0, 0], slopes[0, 1], slopes[0, 2]
    a2, b2, c2, _ = acceleration(
        z + C2 * h * w, u + h * A21 * a1, v + h * A21 * b1, w + h * A21 * c1, half_area_per_mass, around
    )
    a3, b3, c3, _ = acceleration(
        z + C3 * h * w + hh * P31 * c1,
        u + h * (A31 * a1 + A32 * a2),
        v + h * (A31 * b1 + A32 * b2),
        w + h * (A31 * c1 + A32 * c2),
        half_area_per_mass,
        around,
    )
    a4, b4, c4, _ = acceleration(
        z + C4 * h * w + hh * (P41 * c1 + P42 * c2),
        u + h * (A41 * a1 + A42 * a2 + A43 * a3),
        v + h * (A41 * b1 + A42 * b2 + A43 * b3),
        w + h * (A41 * c1 + A42 * c2 + A43 * c3),
        half_area_per_mass,
        around,
    )
    a5, b5, c5, _ = acceleration(
        z + C5 * h * w + hh * (P51 * c1 + P52 * c2 + P53 * c3),
        u + h * (A51 * a1 + A52 * a2 + A53 * a3 + A54 * a4),
        v + h * (A51 * b1 + A52 * b2 + A53 * b3 + A54 * b4),
        w + h * (A51 * c1 + A52 * c2 + A53 * c3 + A54 * c4),
        half_area_per_mass,
        around,
    )
    a6, b6, c6, _ = acceleration(
        z + h * w + hh * (P61 * c1 + P62 * c2 + P63 * c3 + P64 * c4),
        u + h * (A61 * a1 + A62 * a2 + A63 * a3 + A64 * a4 + A65 * a5),
        v + h * (A61 * b1 + A62 * b2 + A63 * b3 + A64 * b4 + A65 * b5),
        w + h * (A61 * c1 + A62 * c2 + A63 * c3 + A64 * c4 + A65 * c5),
        half_area_per_mass,
        around,
    )
    new_z = z + h * w + hh * (Q1 * c1 + Q2 * c2 + Q3 * c3 + Q4 * c4 + Q5 * c5)
    new_u = u + h * (B1 * a1 + B3 * a3 + B4 * a4 + B5 * a5 + B6 * a6)
    new_v = v + h * (B1 * b1 + B3 * b3 + B4 * b4 + B5 * b5 + B6 * b6)
    new_w = w + h * (B1 * c1 + B3 * c3 + B4 * c4 + B5 * c5 + B6 * c6)
    a7, b7, c7, mach = acceleration(new_z, new_u, new_v, new_w, half_area_per_mass, around)
    new[0] = state[0] + h * u + hh * (Q1 * a1 + Q2 * a2 + Q3 * a3 + Q4 * a4 + Q5 * a5)
    new[1] = state[1] + h * v + hh * (Q1 * b1 + Q2 * b2 + Q3 * b3 + Q4 * b4 + Q5 * b5)
    new[2], new[3], new[4], new[5] = new_z, new_u, new_v, new_w
    slopes[1, 0], slopes[1, 1], slopes[1, 2] = a2, b2, c2
    slopes[2, 0], slopes[2, 1], slopes[2, 2] = a3, b3, c3
    slopes[3, 0], slopes[3, 1], slopes[3, 2] = a4, b4, c4
    slopes[4, 0], slopes[4, 1], slopes[4, 2] = a5, b5, c5
    slopes[5, 0], slopes[5, 1], slopes[5, 2] = a6, b6, c6
    slopes[6, 0], slopes[6, 1], slopes[6, 2] = a7, b7, c7
    ex = F1 * a1 + F2 * a2 + F3 * a3 + F4 * a4 + F5 * a5 + F6 * a6
    ey = F1 * b1 + F2 * b2 + F3 * b3 + F4 * b4 + F5 * b5 + F6 * b6
    ez = F1 * c1 + F2 * c2 + F3 * c3 + F4 * c4 + F5 * c5 + F6 * c6
    eu = E1 * a1 + E3 * a3 + E4 * a4 + E5 * a5 + E6 * a6 + E7 * a7
    ev = E1 * b1 + E3 * b3 + E4 * b4 + E5 * b5 + E6 * b6 + E7 * b7
    ew = E1 * c1 + E3 * c3 + E4 * c4 + E5 * c5 + E6 * c6 + E7 * c7
    return hh * hh * (ex * ex + ey * ey + ez * ez), hh * (eu * eu + ev * ev + ew * ew), mach


@njit(error_model="numpy")
def control_points(state, new, slopes, h, points):
    """Bernstein coefficients (degree 4) of the places along the step, into points[:3]: points[i] are the five of axis i.

    The dense output of DOPRI5 in a basis whose ends are the step's ends exactly and whose hull holds the curve.
    """
    for i in range(3):
        start, end = state[i], new[i]
        first = h * state[3 + i]
        last = h * new[3 + i]
        fifth = (
            h
            * h
            * (
                G1 * slopes[0, i]
                + G2 * slopes[1, i]
                + G3 * slopes[2, i]
                + G4 * slopes[3, i]
                + G5 * slopes[4, i]
                + G6 * slopes[5, i]
            )
        )
        points[i, 0] = start
        points[i, 1] = start + 0.25 * first
        # r2/2 + r3/3 + r4/6 + r5/6 of DOPRI5 with r3 = first - r2, r4 = r2 - last - r3
        points[i, 2] = 0.5 * (start + end) + (first - last + fifth) / 6.0
        points[i, 3] = end - 0.25 * last
        points[i, 4] = end


@njit(error_model="numpy")
def velocity_points(state, new, slopes, h, points):
    """Bernstein coefficients of the velocities along the step, into points[3:6]."""
    for i in range(3):
        start, end = state[3 + i], new[3 + i]
        first, last = h * slopes[0, i], h * slopes[6, i]
        fifth = h * (
            D1 * slopes[0, i]
            + D3 * slopes[2, i]
            + D4 * slopes[3, i]
            + D5 * slopes[4, i]
            + D6 * slopes[5, i]
            + D7 * slopes[6, i]
        )
        points[3 + i, 0] = start
        points[3 + i, 1] = start + 0.25 * first
        points[3 + i, 2] = 0.5 * (start + end) + (first - last + fifth) / 6.0
        points[3 + i, 3] = end - 0.25 * last
        points[3 + i, 4] = end
