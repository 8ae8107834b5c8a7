"""Impacts at the ends of a chunk's flights: which fragments continue, from where, and where the others stay."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from flight.kernels.compiling import inner_kernel, kernel
from flight.kernels.limits import LANDED, STOPPED, TIME_OUT
from flight.kernels.obstacles import FIRST_FACE
from flight.kernels.ricochet import LIFT, MOST_CONTACTS, ricochet
from flight.kernels.terrain import slope_at

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from flight.kernels.limits import Limits
    from flight.kernels.terrain import Terrain

    Array = NDArray[np.float64]
    Integers = NDArray[np.int64]

__all__ = ["GROUND_COLUMNS", "STRUCK_COLUMNS", "apply_impacts"]

# time, position (3), velocity (3) at the impact, obstacle, face, row of the chunk, 1 where it stopped
STRUCK_COLUMNS = 11
# time, position (3), velocity (3) at the impact, speed after it (0: it stays), row of the chunk, ricochets before it
GROUND_COLUMNS = 10


@inner_kernel()
def _normal(state: Array, which: int, face: int, terrain: Terrain, obstacles: Array) -> tuple[float, float, float]:
    """Unit normal of the ground, or of an obstacle's face, outward."""
    if which >= 0:
        column = FIRST_FACE + 6 * face + 3
        return obstacles[which, column], obstacles[which, column + 1], obstacles[which, column + 2]
    if terrain.heights.shape[0] == 0:
        return 0.0, 0.0, 1.0
    slope_x, slope_y = slope_at(terrain, state[1], state[2])
    size = math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    return -slope_x / size, -slope_y / size, 1.0 / size


def _compile() -> Callable[..., tuple[int, int, int]]:
    """Compile the loop."""

    @kernel
    def apply_impacts(
        moving: Integers,
        count: int,
        outcome: Array,
        status: NDArray[np.int8],
        surfaces: Array,
        limits: Limits,
        terrain: Terrain,
        obstacles: Array,
        first: Array,
        first_status: NDArray[np.int8],
        last: Array,
        last_status: NDArray[np.int8],
        stopped_by: Integers,
        ricochets: Integers,
        contacts: Integers,
        struck: Array,
        ground: Array,
    ) -> tuple[int, int, int]:
        """Let the fragments `moving` (rows of the chunk), whose flights have just ended, ricochet or stay.

        `outcome` and `status` count as `moving` does, all others by rows of the chunk: first impact on the ground, or
        the end of a fragment that has none; last state (time, position, velocity), with which those that fly on start;
        which obstacle and face stopped it, (rows, 2); ricochets off the ground; all impacts. Returns how many fly on,
        now first in `moving`, and the rows used of `struck` (impacts on obstacles) and of `ground` (impacts there).
        """
        flying = hits = landings = 0
        for k in range(count):
            row, how = moving[k], int(status[k])
            state = last[row]
            state[:7] = outcome[k, :7]
            which, face = -1, -1
            if how == STOPPED:
                which, face = int(outcome[k, 11]), int(outcome[k, 12])
            if how == LANDED and first_status[row] == 0:
                first[row, :7], first_status[row] = outcome[k, :7], LANDED
            goes_on = False
            if how in (LANDED, STOPPED):
                contacts[row] += 1
                nx, ny, nz = _normal(state, which, face, terrain, obstacles)
                goes_on = contacts[row] < MOST_CONTACTS and ricochet(state, nx, ny, nz, surfaces[1 + which])
            if how == LANDED:
                record = ground[landings]
                record[:7] = outcome[k, :7]
                record[7] = math.sqrt(state[4] * state[4] + state[5] * state[5] + state[6] * state[6])
                record[7] = record[7] if goes_on else 0.0
                record[8], record[9] = row, ricochets[row]
                landings += 1
            elif how == STOPPED:
                record = struck[hits]
                record[:7] = outcome[k, :7]
                record[7], record[8], record[9], record[10] = which, face, row, 0.0 if goes_on else 1.0
                hits += 1
            if goes_on:
                ricochets[row] += which < 0
                state[1], state[2], state[3] = state[1] + LIFT * nx, state[2] + LIFT * ny, state[3] + LIFT * nz
            if goes_on and state[0] >= limits.time_limit:
                goes_on, how, which, face = False, TIME_OUT, -1, -1
            if goes_on:
                moving[flying] = row
                flying += 1
                continue
            if first_status[row] == 0:
                first[row, :7], first_status[row] = outcome[k, :7], how
            last_status[row] = how
            stopped_by[row, 0], stopped_by[row, 1] = which, face
        return flying, hits, landings

    return apply_impacts


apply_impacts = _compile()
