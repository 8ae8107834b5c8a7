"""Values of a block of cells and of its nodes: gathered into rows, a lane a cell, and nodal forces added back."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function
from burst_fenicsx.kernels.vectors.transposition import (
    WIDTH,
    add_run,
    add_triples,
    address,
    addresses,
    load_modes,
    load_modes_of_runs,
    load_run,
    load_singles,
    load_triples,
    prefetch,
    store_run,
    store_singles,
)

__all__ = [
    "add_nodal_forces",
    "cells_of_lanes",
    "gather_mean_modes",
    "gather_modes",
    "load_cells",
    "load_slots",
    "make_gather",
    "prefetch_dofs",
    "prefetch_nodes",
    "prefetch_slots",
    "store_cells",
    "store_slots",
]

Cells: TypeAlias = tuple[np.uint64, np.uint64, np.uint64, np.uint64, np.uint64, np.uint64, np.uint64, np.uint64]

_NODE_BYTES = np.uint64(24)  # of a nodal vector
_BYTES = np.uint64(8)  # of a number


@lane_function
def cells_of_lanes(cells: np.ndarray, first: int) -> Cells:
    """`WIDTH` cells of a block from lane `first` on; unsigned, so that no code counts negative ones from the end."""
    return (
        np.uint64(cells[first]),
        np.uint64(cells[first + 1]),
        np.uint64(cells[first + 2]),
        np.uint64(cells[first + 3]),
        np.uint64(cells[first + 4]),
        np.uint64(cells[first + 5]),
        np.uint64(cells[first + 6]),
        np.uint64(cells[first + 7]),
    )


@block_kernel
def load_slots(block: int, values: np.ndarray, rows: np.ndarray, row: int) -> None:
    """Copy a block's `values` (slots,) to a row."""
    start = address(values) + _BYTES * np.uint64(block * LANES)
    for first in range(0, LANES, WIDTH):
        load_run(start + _BYTES * np.uint64(first), rows, row * LANES + first)


@block_kernel
def store_slots(block: int, rows: np.ndarray, row: int, values: np.ndarray) -> None:
    """Copy a row back to a block's `values` (slots,)."""
    start = address(values) + _BYTES * np.uint64(block * LANES)
    for first in range(0, LANES, WIDTH):
        store_run(rows, row * LANES + first, start + _BYTES * np.uint64(first))


@block_kernel
def load_cells(
    cells: np.ndarray, in_rows: np.ndarray, start: np.uint64, points: int, rows: np.ndarray, row: int
) -> None:
    """Copy a number of each of a block's cells to a row.

    Parameters
    ----------
    cells, in_rows : as of `gather_modes`.
    start : address of the first cell's number; a cell has so many `points`, with a number each.
    rows, row : the row of the scratch.
    """
    for first in range(0, LANES, WIDTH):
        own = cells_of_lanes(cells, first)
        if points == 1 and in_rows[first // WIDTH]:
            load_run(start + _BYTES * own[0], rows, row * LANES + first)
        else:
            load_singles(addresses(start, _BYTES * np.uint64(points), own), rows, row * LANES + first)


@block_kernel
def store_cells(
    cells: np.ndarray, in_rows: np.ndarray, start: np.uint64, points: int, rows: np.ndarray, row: int
) -> None:
    """Copy a row back to the cells, the reverse of `load_cells`; of padded lanes as well, see `Grid`."""
    for first in range(0, LANES, WIDTH):
        own = cells_of_lanes(cells, first)
        if points == 1 and in_rows[first // WIDTH]:
            store_run(rows, row * LANES + first, start + _BYTES * own[0])
        else:
            store_singles(rows, row * LANES + first, addresses(start, _BYTES * np.uint64(points), own))


@lane_function
def _nodes_of_cells(cells: Cells, dofmap: np.ndarray, n: int) -> Cells:
    """Node n of each of the cells."""
    return (
        np.uint64(dofmap[cells[0], n]),
        np.uint64(dofmap[cells[1], n]),
        np.uint64(dofmap[cells[2], n]),
        np.uint64(dofmap[cells[3], n]),
        np.uint64(dofmap[cells[4], n]),
        np.uint64(dofmap[cells[5], n]),
        np.uint64(dofmap[cells[6], n]),
        np.uint64(dofmap[cells[7], n]),
    )


@lane_function
def _corners(cell: np.uint64, dofmap: np.ndarray) -> Cells:
    """Nodes of a hexahedron."""
    return (
        np.uint64(dofmap[cell, 0]),
        np.uint64(dofmap[cell, 1]),
        np.uint64(dofmap[cell, 2]),
        np.uint64(dofmap[cell, 3]),
        np.uint64(dofmap[cell, 4]),
        np.uint64(dofmap[cell, 5]),
        np.uint64(dofmap[cell, 6]),
        np.uint64(dofmap[cell, 7]),
    )


@lane_function
def _places(start: np.uint64, cells: Cells, dofmap: np.ndarray, n: int) -> Cells:
    """Addresses of a nodal field, which begins at `start`, at node n of each of the cells."""
    return addresses(start, _NODE_BYTES, _nodes_of_cells(cells, dofmap, n))


@lane_function
def _mean_places(
    start: np.uint64, means: np.uint64, finest: np.ndarray, level: int, cells: Cells, dofmap: np.ndarray, n: int
) -> Cells:
    """As `_places`, but among the `means` where the level of the node is higher than that of the cells."""
    a, b, c, d, e, f, g, h = _nodes_of_cells(cells, dofmap, n)
    return (
        (means if finest[a] > level else start) + _NODE_BYTES * a,
        (means if finest[b] > level else start) + _NODE_BYTES * b,
        (means if finest[c] > level else start) + _NODE_BYTES * c,
        (means if finest[d] > level else start) + _NODE_BYTES * d,
        (means if finest[e] > level else start) + _NODE_BYTES * e,
        (means if finest[f] > level else start) + _NODE_BYTES * f,
        (means if finest[g] > level else start) + _NODE_BYTES * g,
        (means if finest[h] > level else start) + _NODE_BYTES * h,
    )


@block_kernel
def gather_modes(
    cells: np.ndarray, dofmap: np.ndarray, in_rows: np.ndarray, field: np.ndarray, rows: np.ndarray
) -> None:
    """Modes of a nodal vector field of a block's hexahedra in 21 rows, as `load_modes` puts them.

    Parameters
    ----------
    cells : (LANES,) int32, the block's cells (padded with its last one).
    dofmap : (cells, 8) int32 nodes.
    in_rows : (LANES / WIDTH,) int8, whether the nodes of so many lanes follow one another, at each corner.
    field : (nodes, 3).
    rows : (21 LANES or more,), overwritten.
    """
    start = address(field)
    for first in range(0, LANES, WIDTH):
        own = cells_of_lanes(cells, first)
        if in_rows[first // WIDTH]:
            load_modes_of_runs(addresses(start, _NODE_BYTES, _corners(own[0], dofmap)), rows, first)
        else:
            load_modes(
                (
                    _places(start, own, dofmap, 0),
                    _places(start, own, dofmap, 1),
                    _places(start, own, dofmap, 2),
                    _places(start, own, dofmap, 3),
                    _places(start, own, dofmap, 4),
                    _places(start, own, dofmap, 5),
                    _places(start, own, dofmap, 6),
                    _places(start, own, dofmap, 7),
                ),
                rows,
                first,
            )


@lane_function
def prefetch_slots(block: int, values: np.ndarray) -> None:
    """Bring a block's `values` (slots,) near."""
    start = address(values) + _BYTES * np.uint64(block * LANES)
    for first in range(0, LANES, WIDTH):
        prefetch(start + _BYTES * np.uint64(first))


@block_kernel
def prefetch_dofs(cells: np.ndarray, dofmap: np.ndarray) -> None:
    """Bring the rows of `dofmap` (all cells, corners) int32 of a block near, two of which fill a line."""
    for lane in range(0, LANES, 2):
        prefetch(address(dofmap) + np.uint64(4 * dofmap.shape[1]) * np.uint64(cells[lane]))


@block_kernel
def prefetch_nodes(
    cells: np.ndarray, dofmap: np.ndarray, position: np.ndarray, velocity: np.ndarray, force: np.ndarray
) -> None:
    """Bring the nodes of a block of hexahedra near: of every third cell, at four corners, where rows share nodes."""
    for lane in range(0, LANES, 3):
        cell = np.uint64(cells[lane])
        for n in (0, 3, 4, 7):
            later_by = _NODE_BYTES * np.uint64(dofmap[cell, n])
            prefetch(address(position) + later_by)
            prefetch(address(velocity) + later_by)
            prefetch(address(force) + later_by)


@block_kernel
def gather_mean_modes(
    cells: np.ndarray,
    dofmap: np.ndarray,
    level: int,
    finest: np.ndarray,
    field: np.ndarray,
    means: np.ndarray,
    rows: np.ndarray,
) -> None:
    """As `gather_modes` of a level's cells, but take nodes whose level in `finest` (nodes,) is higher from `means`."""
    start, other = address(field), address(means)
    for first in range(0, LANES, WIDTH):
        own = cells_of_lanes(cells, first)
        load_modes(
            (
                _mean_places(start, other, finest, level, own, dofmap, 0),
                _mean_places(start, other, finest, level, own, dofmap, 1),
                _mean_places(start, other, finest, level, own, dofmap, 2),
                _mean_places(start, other, finest, level, own, dofmap, 3),
                _mean_places(start, other, finest, level, own, dofmap, 4),
                _mean_places(start, other, finest, level, own, dofmap, 5),
                _mean_places(start, other, finest, level, own, dofmap, 6),
                _mean_places(start, other, finest, level, own, dofmap, 7),
            ),
            rows,
            first,
        )


def make_gather(corners: int) -> tuple[Any, Any]:
    """Kernels that gather nodal vectors, and mean ones where nodes take shorter steps, of cells of so many corners."""

    @block_kernel
    def gather(cells: np.ndarray, dofmap: np.ndarray, field: np.ndarray, rows: np.ndarray) -> None:
        """Copy a nodal vector field of a block's cells to rows, 3 n + i for node n.

        Parameters
        ----------
        cells : (LANES,) int32, the block's cells (padded with its last one).
        dofmap : (cells, corners) int32 nodes.
        field : (nodes, 3).
        rows : (3 corners LANES or more,), overwritten.
        """
        start = address(field)
        for first in range(0, LANES, WIDTH):
            own = cells_of_lanes(cells, first)
            for n in range(corners):
                load_triples(_places(start, own, dofmap, n), rows, 3 * n * LANES + first)

    @block_kernel
    def gather_means(
        cells: np.ndarray,
        dofmap: np.ndarray,
        level: int,
        finest: np.ndarray,
        field: np.ndarray,
        means: np.ndarray,
        rows: np.ndarray,
    ) -> None:
        """As `gather` for cells of a level, but take nodes whose level in `finest` (nodes,) is higher from `means`."""
        start, other = address(field), address(means)
        for first in range(0, LANES, WIDTH):
            own = cells_of_lanes(cells, first)
            for n in range(corners):
                load_triples(_mean_places(start, other, finest, level, own, dofmap, n), rows, 3 * n * LANES + first)

    return gather, gather_means


@block_kernel
def add_nodal_forces(
    count: int, cells: np.ndarray, dofmap: np.ndarray, in_rows: np.ndarray, rows: np.ndarray, force: np.ndarray
) -> None:
    """Add the rounded nodal forces in 24 rows to the nodes of the first `count` cells.

    The sums do not depend on the order of the cells (see `exact`).
    """
    if count == LANES:
        start = address(force)
        for first in range(0, LANES, WIDTH):
            own = cells_of_lanes(cells, first)
            if in_rows[first // WIDTH]:
                # Corners that share nodes come late after each other: one's must be stored when the other's are loaded.
                for n in (0, 3, 4, 7, 1, 2, 5, 6):
                    add_run(rows, 3 * n * LANES + first, start + _NODE_BYTES * np.uint64(dofmap[own[0], n]))
                continue
            for n in range(8):
                add_triples(rows, 3 * n * LANES + first, addresses(start, _NODE_BYTES, _nodes_of_cells(own, dofmap, n)))
        return
    for lane in range(count):
        cell = np.uint64(cells[lane])
        for n in range(8):
            node = np.uint64(dofmap[cell, n])
            for i in range(3):
                force[node, i] += rows[(3 * n + i) * LANES + lane]
