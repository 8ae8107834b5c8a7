"""Work on some rows of nodal vectors: contact touches surfaces, and whole arrays would cost more than its forces."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.lanes import kernel
from burst_fenicsx.kernels.threads import on_threads
from burst_fenicsx.kernels.vectors.exact import quantise
from burst_fenicsx.kernels.vectors.transposition import address, prefetch

__all__ = [
    "acting_rows",
    "clear_rows",
    "copy_motion",
    "hold_rows",
    "largest_speed",
    "place_rows",
    "take_means",
    "work_on_rows",
]

# Rows lie scattered: the one that comes so many later is fetched now.
_AHEAD, _ROW_BYTES = 16, np.uint64(24)
_RUN = 256  # rows of which one sum, or one largest value, is made at a time


@kernel
def clear_rows(values: np.ndarray, rows: np.ndarray) -> None:
    """Set the rows of `values` (n, m) to zero."""
    on_threads(rows.size, _clear_some, (values, rows))


@kernel
def _clear_some(first: int, last: int, values: np.ndarray, rows: np.ndarray) -> None:
    start, size = address(values), np.uint64(8 * values.shape[1])
    for k in range(first, last):
        prefetch(start + size * np.uint64(rows[min(k + _AHEAD, rows.size - 1)]))
        for i in range(values.shape[1]):
            values[rows[k], i] = 0.0


@kernel
def copy_motion(
    position: np.ndarray,
    velocity: np.ndarray,
    at: np.ndarray,
    to: np.ndarray,
    positions: np.ndarray,
    velocities: np.ndarray,
) -> None:
    """Copy the rows `at` of `position` and `velocity` (n, 3) to the rows `to` of `positions` and `velocities`."""
    on_threads(at.size, _copy_some, (position, velocity, at, to, positions, velocities))


@kernel
def _copy_some(
    first: int,
    last: int,
    position: np.ndarray,
    velocity: np.ndarray,
    at: np.ndarray,
    to: np.ndarray,
    positions: np.ndarray,
    velocities: np.ndarray,
) -> None:
    position_start, velocity_start = address(position), address(velocity)
    for k in range(first, last):
        later = _ROW_BYTES * np.uint64(at[min(k + _AHEAD, at.size - 1)])
        prefetch(position_start + later)
        prefetch(velocity_start + later)
        row, target = np.uint64(at[k]), np.uint64(to[k])
        for i in range(3):
            positions[target, i] = position[row, i]
            velocities[target, i] = velocity[row, i]


@kernel
def place_rows(source: np.ndarray, rows: np.ndarray, target: np.ndarray) -> None:
    """Copy `source` (n, m) to the given rows of `target` (k, m)."""
    start, size = address(target), np.uint64(8 * target.shape[1])
    for k in range(rows.size):
        prefetch(start + size * np.uint64(rows[min(k + _AHEAD, rows.size - 1)]))
        row = np.uint64(rows[k])
        for i in range(source.shape[1]):
            target[row, i] = source[k, i]


@kernel
def take_means(
    rows: np.ndarray, position: np.ndarray, step: float, last: np.ndarray, own: np.ndarray, velocity: np.ndarray
) -> None:
    """Put mean velocities over a step (s), in which the `rows` moved from `last` (k, 3), in place of `velocity` (n, 3).

    The rows' velocities are kept in `own` (k, 3), and `last` becomes their present `position` (n, 3).
    """
    position_start, velocity_start = address(position), address(velocity)
    for k in range(rows.size):
        later = _ROW_BYTES * np.uint64(rows[min(k + _AHEAD, rows.size - 1)])
        prefetch(position_start + later)
        prefetch(velocity_start + later)
        row = np.uint64(rows[k])
        for i in range(3):
            own[k, i] = velocity[row, i]
            velocity[row, i] = (position[row, i] - last[k, i]) / step
            last[k, i] = position[row, i]


@kernel
def acting_rows(force: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Those of the `rows` (k,) int32 of `force` (n, 3) that are not zero."""
    acting, count = np.empty(rows.size, dtype=np.int32), 0
    start = address(force)
    for k in range(rows.size):
        prefetch(start + _ROW_BYTES * np.uint64(rows[min(k + _AHEAD, rows.size - 1)]))
        row = np.uint64(rows[k])
        acting[count] = rows[k]
        count += (force[row, 0] != 0.0) | (force[row, 1] != 0.0) | (force[row, 2] != 0.0)
    return acting[:count].copy()


@kernel
def work_on_rows(
    half_step: float,
    force: np.ndarray,
    rows: np.ndarray,
    velocity: np.ndarray,
    rounding: float,
    fraction: float,
    target: np.ndarray | None,
) -> float:
    """Work (J) in half a step (s) of the rows of `force` (n, 3) in N at the `velocity` (n, 3) in m/s of the same rows.

    No row may be named twice. Each row's work is rounded by `quantise`: the sum is exact, in whatever order. On the
    way `fraction` of the forces is added to the same rows of `target`; where there is none, the forces are cleared.
    """
    work = np.empty(rows.size // _RUN + 1)
    on_threads(work.size, _work_on_some, (half_step, force, rows, velocity, rounding, fraction, target, work))
    return work.sum()


@kernel
def _work_on_some(
    first: int,
    last: int,
    half_step: float,
    force: np.ndarray,
    rows: np.ndarray,
    velocity: np.ndarray,
    rounding: float,
    fraction: float,
    target: np.ndarray | None,
    work: np.ndarray,
) -> None:
    force_start, velocity_start = address(force), address(velocity)
    for run in range(first, last):
        total = 0.0
        for k in range(run * _RUN, min((run + 1) * _RUN, rows.size)):
            later = _ROW_BYTES * np.uint64(rows[min(k + _AHEAD, rows.size - 1)])
            prefetch(force_start + later)
            prefetch(velocity_start + later)
            row = np.uint64(rows[k])
            power = 0.0
            for i in range(3):
                power += force[row, i] * velocity[row, i]
                if target is None:
                    force[row, i] = 0.0
                else:
                    target[row, i] += fraction * force[row, i]
            total += quantise(half_step * power, rounding)
        work[run] = total


@kernel
def hold_rows(values: np.ndarray, directions: np.ndarray, first: np.ndarray, rows: np.ndarray) -> None:
    """Take what rows of `values` (n, 3) have along unit vectors (k, 3) away, one direction after the other.

    Those of direction i are `rows`[first[i]:first[i + 1]], each of them once.
    """
    for i in range(directions.shape[0]):
        x, y, z = directions[i, 0], directions[i, 1], directions[i, 2]
        for k in range(first[i], first[i + 1]):
            row = rows[k]
            along = x * values[row, 0] + y * values[row, 1] + z * values[row, 2]
            values[row, 0] -= along * x
            values[row, 1] -= along * y
            values[row, 2] -= along * z


@kernel
def largest_speed(velocity: np.ndarray, nodes: np.ndarray) -> float:
    """Largest speed (m/s) among the given nodes."""
    squares = np.empty(nodes.size // _RUN + 1)
    on_threads(squares.size, _largest_squares, (velocity, nodes, squares))
    return np.sqrt(squares.max())


@kernel
def _largest_squares(first: int, last: int, velocity: np.ndarray, nodes: np.ndarray, squares: np.ndarray) -> None:
    start = address(velocity)
    for run in range(first, last):
        largest = 0.0
        for k in range(run * _RUN, min((run + 1) * _RUN, nodes.size)):
            prefetch(start + _ROW_BYTES * np.uint64(nodes[min(k + _AHEAD, nodes.size - 1)]))
            node = nodes[k]
            largest = max(largest, velocity[node, 0] ** 2 + velocity[node, 1] ** 2 + velocity[node, 2] ** 2)
        squares[run] = largest
