"""Nodal values of a block of cells: gathered into rows, a lane a cell, and nodal forces added back to their nodes."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function
from burst_fenicsx.kernels.vectors.transposition import WIDTH, add_triples, address, addresses, load_triples

__all__ = ["add_nodal_forces", "cells_of_lanes", "make_gather"]

Cells: TypeAlias = tuple[np.uint64, np.uint64, np.uint64, np.uint64, np.uint64, np.uint64, np.uint64, np.uint64]

_NODE_BYTES = np.uint64(24)  # of a nodal vector


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
                load_triples(
                    addresses(start, _NODE_BYTES, _nodes_of_cells(own, dofmap, n)), rows, 3 * n * LANES + first
                )

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
                a, b, c, d, e, f, g, h = _nodes_of_cells(own, dofmap, n)
                chosen = (
                    (other if finest[a] > level else start) + _NODE_BYTES * a,
                    (other if finest[b] > level else start) + _NODE_BYTES * b,
                    (other if finest[c] > level else start) + _NODE_BYTES * c,
                    (other if finest[d] > level else start) + _NODE_BYTES * d,
                    (other if finest[e] > level else start) + _NODE_BYTES * e,
                    (other if finest[f] > level else start) + _NODE_BYTES * f,
                    (other if finest[g] > level else start) + _NODE_BYTES * g,
                    (other if finest[h] > level else start) + _NODE_BYTES * h,
                )
                load_triples(chosen, rows, 3 * n * LANES + first)

    return gather, gather_means


@block_kernel
def add_nodal_forces(count: int, cells: np.ndarray, dofmap: np.ndarray, rows: np.ndarray, force: np.ndarray) -> None:
    """Add the rounded nodal forces in 24 rows to the nodes of the first `count` cells.

    The sums do not depend on the order of the cells (see `exact`).
    """
    if count == LANES:
        start = address(force)
        for first in range(0, LANES, WIDTH):
            own = cells_of_lanes(cells, first)
            for n in range(8):
                add_triples(rows, 3 * n * LANES + first, addresses(start, _NODE_BYTES, _nodes_of_cells(own, dofmap, n)))
        return
    for lane in range(count):
        cell = np.uint64(cells[lane])
        for n in range(8):
            node = np.uint64(dofmap[cell, n])
            for i in range(3):
                force[node, i] += rows[(3 * n + i) * LANES + lane]
