"""Coarser copies of structured quadrilateral meshes, for display: grid lines removed, parts and outline kept."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Grid", "coarsened", "grid_of"]

_SIDES = np.array([[0, -1], [1, 0], [0, 1], [-1, 0]])  # below, right, above, left: as the corners run


@dataclass(frozen=True, eq=False)
class Grid:
    """Places of quadrilaterals in a grid of columns and rows.

    Attributes
    ----------
    place : (m, 2) int64
        Column and row of each cell; each connected piece of the mesh has a range of columns of its own.
    turn : (m,) int64
        Local edge e (from node e to e + 1) of a cell lies on the side (e + turn) % 4 of below, right, above and left.
    across : (m, 4) int64
        Cell beyond the sides below, right, above and left, or -1.
    """

    place: NDArray[np.int64]
    turn: NDArray[np.int64]
    across: NDArray[np.int64]


def _neighbours(cells: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cell beyond each local edge (m, 4), or -1, and the number of that edge there."""
    edges = np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2)
    ends = np.sort(edges, axis=1)
    order = np.lexsort(ends.T)
    same = (ends[order[1:]] == ends[order[:-1]]).all(axis=1)
    beyond = np.full(len(edges), -1)
    one, other = order[:-1][same], order[1:][same]
    beyond[one], beyond[other] = other, one
    cell, edge = np.where(beyond >= 0, beyond // 4, -1), beyond % 4
    return cell.reshape(-1, 4), edge.reshape(-1, 4)


def grid_of(cells: NDArray[np.int64]) -> Grid | None:
    """Find columns and rows of quadrilaterals (m, 4), counter-clockwise; None where the mesh is not a grid."""
    cell, edge = _neighbours(cells)
    place, turn = np.zeros((len(cells), 2), dtype=np.int64), np.full(len(cells), -1)
    sides = np.arange(4)
    column = 0
    for seed in range(len(cells)):
        if turn[seed] >= 0:
            continue
        turn[seed] = 0
        piece = [front := np.array([seed])]
        while front.size:
            side = (sides + turn[front][:, None]) % 4
            found, at = cell[front].ravel(), edge[front].ravel()
            target = (place[front][:, None] + _SIDES[side]).reshape(-1, 2)
            turned = ((side + 2).ravel() - at) % 4
            fresh = (found >= 0) & (turn[np.maximum(found, 0)] < 0)
            front, first = np.unique(found[fresh], return_index=True)
            place[front], turn[front] = target[fresh][first], turned[fresh][first]
            piece.append(front)
        own = np.concatenate(piece)
        place[own, 0] += column - place[own, 0].min()
        column = place[own, 0].max() + 2  # no piece is beside another
    across = np.empty_like(cell)
    np.put_along_axis(across, (sides + turn[:, None]) % 4, cell, axis=1)
    for side in range(4):
        inner = across[:, side] >= 0
        if not np.array_equal(place[across[inner, side]], place[inner] + _SIDES[side]):
            return None
    if len(np.unique(place, axis=0)) < len(cells):
        return None
    return Grid(place, turn, across)


def coarsened(cells: NDArray[np.int64], label: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Merge quadrilaterals by removing about every other grid line; none that bounds a label or the mesh.

    Parameters
    ----------
    cells : (m, 4)
        Nodes, counter-clockwise.
    label : (m,)
        Cells of different labels are not merged.

    Returns
    -------
    coarse : (k, 4) int64
        Nodes of the merged cells, counter-clockwise; the mesh is as conforming as before.
    of : (m,) int64
        Merged cell of each cell.
    None where the mesh is not a grid, or no line can be removed.
    """
    grid = grid_of(np.asarray(cells, dtype=np.int64))
    if grid is None:
        return None
    bound = np.empty((len(cells), 4), dtype=bool)
    for side in range(4):
        beyond = grid.across[:, side]
        bound[:, side] = (beyond < 0) | (label[np.maximum(beyond, 0)] != label)
    block = np.empty_like(grid.place)
    for direction, before, behind in ((0, 3, 1), (1, 0, 2)):
        at = grid.place[:, direction] - grid.place[:, direction].min()
        lines = np.zeros(at.max() + 2, dtype=bool)
        lines[at[bound[:, before]]] = True
        lines[at[bound[:, behind]] + 1] = True
        block[:, direction] = _blocks(lines)[at]
    _, of = np.unique(block, axis=0, return_inverse=True)
    of = of.ravel()
    number = int(of.max()) + 1
    if number == len(cells):
        return None
    coarse = np.empty((number, 4), dtype=np.int64)
    for corner, (column, row) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        # The cell of a block that lies in this corner is the last that this order brings.
        order = np.lexsort((-row * grid.place[:, 1], -column * grid.place[:, 0]))
        node = cells[order, (corner - grid.turn[order]) % 4]
        coarse[of[order], corner] = node
    return coarse, of


def _blocks(kept: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Block of each strip between neighbouring lines, at most two strips to a block and none across a kept line."""
    block, number, strips = np.zeros(len(kept) - 1, dtype=np.int64), 0, 0
    for strip in range(len(block)):
        if strip and (kept[strip] or strips == 2):
            number, strips = number + 1, 0
        block[strip] = number
        strips += 1
    return block
