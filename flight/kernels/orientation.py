"""Areas of boxes and random shape factors, one by one: numpy rounds vectorised functions differently by index."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from flight.kernels.compiling import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["projected_areas", "standard_normals"]


@kernel
def projected_areas(uniform: NDArray[Any], direction: NDArray[Any], sides: NDArray[Any], result: NDArray[Any]) -> None:
    """Area that a box with these sides (3,), turned at random, shows in a direction of flight (rows, 3).

    Each row's orientation is a uniform rotation from three numbers in [0, 1) (Shoemake 1992); the area is the sum over
    the faces of area times cosine. A fragment at rest is looked at from above.
    """
    a, b, c = sides[1] * sides[2], sides[2] * sides[0], sides[0] * sides[1]
    for row in range(uniform.shape[0]):
        u, v, w = direction[row]
        size = math.sqrt(u * u + v * v + w * w)
        if size > 0.0:
            u, v, w = u / size, v / size, w / size
        else:
            u, v, w = 0.0, 0.0, 1.0
        near, far = math.sqrt(1.0 - uniform[row, 0]), math.sqrt(uniform[row, 0])
        one, other = 2.0 * math.pi * uniform[row, 1], 2.0 * math.pi * uniform[row, 2]
        x, y, z, s = near * math.sin(one), near * math.cos(one), far * math.sin(other), far * math.cos(other)
        # rows of the rotation (x, y, z, s) on the direction: cosines to the box's axes
        first = (1.0 - 2.0 * (y * y + z * z)) * u + 2.0 * (x * y - z * s) * v + 2.0 * (x * z + y * s) * w
        second = 2.0 * (x * y + z * s) * u + (1.0 - 2.0 * (x * x + z * z)) * v + 2.0 * (y * z - x * s) * w
        third = 2.0 * (x * z - y * s) * u + 2.0 * (y * z + x * s) * v + (1.0 - 2.0 * (x * x + y * y)) * w
        result[row] = a * abs(first) + b * abs(second) + c * abs(third)


@kernel
def standard_normals(uniform: NDArray[Any], result: NDArray[Any]) -> None:
    """A standard normal number for each row from two numbers in [0, 1) (Box and Muller 1958)."""
    for row in range(uniform.shape[0]):
        radius = math.sqrt(-2.0 * math.log(1.0 - uniform[row, 0]))
        result[row] = radius * math.cos(2.0 * math.pi * uniform[row, 1])
