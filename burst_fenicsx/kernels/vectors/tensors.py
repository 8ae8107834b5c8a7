"""Vectors and tensors of one lane as tuples of numbers: inlined, they live in registers when the lanes are vectorised.

A vector is a tuple (x, y, z), a matrix a tuple of its three rows, a symmetric tensor (xx, yy, zz, xy, yz, zx).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

from llvmlite.binding import get_host_cpu_features
from numba import config, types
from numba.extending import intrinsic

from burst_fenicsx.kernels.lanes import LANES, lane_function

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np


Vector: TypeAlias = tuple[float, float, float]
Matrix: TypeAlias = tuple[Vector, Vector, Vector]
Symmetric: TypeAlias = tuple[float, float, float, float, float, float]


# Without the instruction the C library computes it from parts: a step would take a thousand times as long.
_FUSED = config.CPU_NAME != "nehalem" and get_host_cpu_features().get("fma", True)


@intrinsic
def fma(typing_context: Any, a: Any, b: Any, c: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """The sum a b + c, rounded once where the processor can, wherever it is inlined: the compiler does not choose."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        if _FUSED:
            return builder.fma(*arguments)
        return builder.fadd(builder.fmul(arguments[0], arguments[1]), arguments[2])

    return types.float64(types.float64, types.float64, types.float64), generate


@lane_function
def dot(u: Vector, v: Vector) -> float:
    """Scalar product u . v."""
    return fma(u[0], v[0], fma(u[1], v[1], u[2] * v[2]))


@lane_function
def scaled(factor: float, v: Vector) -> Vector:
    """Product k v."""
    return factor * v[0], factor * v[1], factor * v[2]


@lane_function
def add_scaled(u: Vector, factor: float, v: Vector) -> Vector:
    """Sum u + k v."""
    return fma(factor, v[0], u[0]), fma(factor, v[1], u[1]), fma(factor, v[2], u[2])


@lane_function
def cross(u: Vector, v: Vector) -> Vector:
    """Vector product u x v."""
    return (
        fma(u[1], v[2], -(u[2] * v[1])),
        fma(u[2], v[0], -(u[0] * v[2])),
        fma(u[0], v[1], -(u[1] * v[0])),
    )


@lane_function
def add_cross(w: Vector, u: Vector, v: Vector) -> Vector:
    """Sum w + u x v."""
    return (
        fma(u[1], v[2], fma(-u[2], v[1], w[0])),
        fma(u[2], v[0], fma(-u[0], v[2], w[1])),
        fma(u[0], v[1], fma(-u[1], v[0], w[2])),
    )


@lane_function
def outer(u: Vector, v: Vector) -> Matrix:
    """Matrix of the products u_i v_j."""
    return scaled(u[0], v), scaled(u[1], v), scaled(u[2], v)


@lane_function
def add_outer(matrix: Matrix, u: Vector, v: Vector) -> Matrix:
    """Sum of the matrix and the products u_i v_j."""
    return add_scaled(matrix[0], u[0], v), add_scaled(matrix[1], u[1], v), add_scaled(matrix[2], u[2], v)


@lane_function
def apply(matrix: Matrix, v: Vector) -> Vector:
    """Product of a matrix and a vector."""
    return dot(matrix[0], v), dot(matrix[1], v), dot(matrix[2], v)


@lane_function
def subtract_from_product(matrix: Matrix, v: Vector, u: Vector) -> Vector:
    """Difference M v - u."""
    x, y, z = matrix
    return (
        fma(x[0], v[0], fma(x[1], v[1], fma(x[2], v[2], -u[0]))),
        fma(y[0], v[0], fma(y[1], v[1], fma(y[2], v[2], -u[1]))),
        fma(z[0], v[0], fma(z[1], v[1], fma(z[2], v[2], -u[2]))),
    )


@lane_function
def symmetric_square(s: Symmetric) -> float:
    """Half the contraction s : s of a symmetric tensor with itself; J2 of a deviator."""
    return fma(0.5, dot((s[0], s[1], s[2]), (s[0], s[1], s[2])), dot((s[3], s[4], s[5]), (s[3], s[4], s[5])))


@lane_function
def load_vector(scratch: np.ndarray, row: int, lane: int) -> Vector:
    """Vector whose components lie in three rows from `row` on."""
    return (
        scratch[row * LANES + lane],
        scratch[(row + 1) * LANES + lane],
        scratch[(row + 2) * LANES + lane],
    )


@lane_function
def store_vector(v: Vector, scratch: np.ndarray, row: int, lane: int) -> None:
    """Put a vector in three rows from `row` on."""
    scratch[row * LANES + lane] = v[0]
    scratch[(row + 1) * LANES + lane] = v[1]
    scratch[(row + 2) * LANES + lane] = v[2]


@lane_function
def add_vector(v: Vector, scratch: np.ndarray, row: int, lane: int) -> None:
    """Add a vector to three rows."""
    scratch[row * LANES + lane] += v[0]
    scratch[(row + 1) * LANES + lane] += v[1]
    scratch[(row + 2) * LANES + lane] += v[2]


@lane_function
def load_matrix(scratch: np.ndarray, row: int, lane: int) -> Matrix:
    """Matrix whose entries (i, j) lie in the rows 3 i + j from `row` on."""
    return load_vector(scratch, row, lane), load_vector(scratch, row + 3, lane), load_vector(scratch, row + 6, lane)


@lane_function
def store_matrix(matrix: Matrix, scratch: np.ndarray, row: int, lane: int) -> None:
    """Put a matrix in nine rows from `row` on."""
    store_vector(matrix[0], scratch, row, lane)
    store_vector(matrix[1], scratch, row + 3, lane)
    store_vector(matrix[2], scratch, row + 6, lane)


@lane_function
def load_symmetric(scratch: np.ndarray, row: int, lane: int) -> Symmetric:
    """Symmetric tensor whose components lie in six rows from `row` on."""
    xx, yy, zz = load_vector(scratch, row, lane)
    xy, yz, zx = load_vector(scratch, row + 3, lane)
    return xx, yy, zz, xy, yz, zx


@lane_function
def store_symmetric(s: Symmetric, scratch: np.ndarray, row: int, lane: int) -> None:
    """Put a symmetric tensor in six rows from `row` on."""
    store_vector((s[0], s[1], s[2]), scratch, row, lane)
    store_vector((s[3], s[4], s[5]), scratch, row + 3, lane)
