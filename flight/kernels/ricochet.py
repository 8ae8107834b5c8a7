"""Ricochet: the velocity of a fragment after a grazing impact; see flight.scene.ricochet."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from flight.kernels.compiling import inner_kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["LIFT", "MOST_CONTACTS", "SLOWEST_LIFT", "ricochet"]

LIFT = 1e-9  # m off the surface at which a fragment starts again, so that rounding does not put it below
MOST_CONTACTS = 500  # of one fragment; then it stays
SLOWEST_LIFT = 0.1  # m/s off the surface, which rises by 0.5 mm; what is slower stays
EXPONENT = 4.0 / 3.0  # as in flight.scene.ricochet
CRITICAL, LOSS, DEPARTURE, ROUGHNESS = 0, 1, 2, 3  # columns of a surface


@inner_kernel()
def ricochet(state: Array, nx: float, ny: float, nz: float, surface: Array) -> bool:
    """Turn the velocity in `state` (time, position, velocity) at a surface of unit normal (nx, ny, nz).

    `surface` holds the critical angle (rad), the logarithm of the share of speed kept there, the angle of departure
    over that of impact, and the roughness (rad); NaN where nothing ricochets. Returns whether the fragment leaves;
    where it does not, `state` is left as it came.
    """
    speed = math.sqrt(state[4] * state[4] + state[5] * state[5] + state[6] * state[6])
    into = -min(state[4] * nx + state[5] * ny + state[6] * nz, 0.0)
    tx, ty, tz = state[4] + into * nx, state[5] + into * ny, state[6] + into * nz
    along = math.sqrt(tx * tx + ty * ty + tz * tz)
    angle = math.hypot(math.atan2(into, along), surface[ROUGHNESS])
    if not angle <= surface[CRITICAL] or along == 0.0:
        return False
    kept = speed * math.exp(surface[LOSS] * (angle / surface[CRITICAL]) ** EXPONENT)
    departure = surface[DEPARTURE] * angle
    off, forward = kept * math.sin(departure), kept * math.cos(departure) / along
    if not off > SLOWEST_LIFT:
        return False
    state[4], state[5], state[6] = forward * tx + off * nx, forward * ty + off * ny, forward * tz + off * nz
    return True
