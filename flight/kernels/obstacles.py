"""Entry of a step into a wall, a barricade or a building: convex bodies, each the points behind all of its faces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flight.kernels.compiling import inner_kernel
from flight.kernels.roots import sign_changes
from flight.kernels.surfaces import highest_of, lowest_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["EVENTS_SHAPE", "FACES", "FIRST_FACE", "OBSTACLE_COLUMNS", "enter_obstacles"]

FACES = 6
# a row: number of the obstacle; box (6), as a witness's; from this column on a point (3) and the outward normal (3) of
# each face
FIRST_FACE = 7
OBSTACLE_COLUMNS = FIRST_FACE + 6 * FACES
EVENTS_SHAPE = (2, 5 * FACES + 1)
NOWHERE = 2.0


@inner_kernel()
def enter_obstacles(
    points: Array, obstacles: Array, until: float, events: Array, stack: Array, roots: Array
) -> tuple[float, int, int]:
    """Find the first position on the step, before `until`, where it enters an obstacle (2.0: none), and the face."""
    theta, which, face = NOWHERE, -1, -1
    x_low, x_high = lowest_of(points[0], 0), highest_of(points[0], 0)
    y_low, y_high = lowest_of(points[1], 0), highest_of(points[1], 0)
    z_low, z_high = lowest_of(points[2], 0), highest_of(points[2], 0)
    for index in range(obstacles.shape[0]):
        row = obstacles[index]
        if x_high < row[1] or x_low > row[2] or y_high < row[3] or y_low > row[4] or z_high < row[5] or z_low > row[6]:
            continue
        position, on = _enter(points, row, events, stack, roots)
        if position <= until and position < theta:
            theta, which, face = position, index, on
    return theta, which, face


@inner_kernel()
def _enter(points: Array, row: Array, events: Array, stack: Array, roots: Array) -> tuple[float, int]:
    """Place where the step enters one body, and the face.

    The step is behind a face or before it, and changes over at the sign changes of its distance; it is inside once it
    is behind all. No computed position is tested, so no path slips in between two faces or through a thin body.
    """
    count = before = outside = 0  # `outside`: one bit a face that the step is before
    nearest, nearest_face = -np.inf, 0
    for face in range(FACES):
        column = FIRST_FACE + 6 * face
        px, py, pz = row[column], row[column + 1], row[column + 2]
        nx, ny, nz = row[column + 3], row[column + 4], row[column + 5]
        scale, above, below = 0.0, False, False
        for i in range(6):
            x, y, z = points[0, i], points[1, i], points[2, i]
            value = nx * (x - px) + ny * (y - py) + nz * (z - pz)
            stack[0, i] = value
            scale = max(
                scale, abs(nx) * (abs(x) + abs(px)) + abs(ny) * (abs(y) + abs(py)) + abs(nz) * (abs(z) + abs(pz))
            )
            above, below = above or value >= 0.0, below or value < 0.0
        if not below:
            return NOWHERE, -1
        if stack[0, 0] >= 0.0:
            before += 1
            outside |= 1 << face
        elif stack[0, 0] > nearest:
            nearest, nearest_face = stack[0, 0], face
        if above:
            for k in range(sign_changes(stack, 5, scale, roots)):
                position = count  # kept in order
                while position > 0 and events[0, position - 1] > roots[k]:
                    events[0, position], events[1, position] = events[0, position - 1], events[1, position - 1]
                    position -= 1
                events[0, position], events[1, position] = roots[k], face
                count += 1
    if before == 0:
        return 0.0, nearest_face
    for k in range(count):
        bit = 1 << int(events[1, k])
        outside ^= bit
        before += 1 if outside & bit else -1
        if before == 0:
            return events[0, k], int(events[1, k])
    return NOWHERE, -1
