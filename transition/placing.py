"""Placing the fragments: a random cell and a random point in it, then a flood over neighbours until covered.

The heaviest fragments are placed first, while the casing is whole, so that each covers a connected patch; the light
ones fill what is between. Every cell's mass is given out exactly once.

A cell that several fragments share is cut into one box for each, by mass, and a piece moves and lies as the middle of
its box. The boxes fill the reference cell, and the mean of a trilinear function over a box is its value in the middle;
so the pieces of a cell have together exactly the mean of its nodes, in velocity and in place, and none of them has to
be corrected for the others.

What stays of the mesh: a flood takes whole cells but for the last, so the centres of fragments of one to a few cells
still prefer the middles and the faces of cells. In sectors of 5 degrees that adds up to a quarter of what chance does
to the variance of their numbers (cells of 0.4 to 1.2 mean fragments), by how columns and sectors happen to meet.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from transition.kernels.flooding import flood
from transition.kernels.parting import part

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Patches", "cell_middles", "cell_sides", "join", "patch_means", "place", "point_positions", "trilinear"]

_EDGES = np.array(
    [[[0, 1], [3, 2], [4, 5], [7, 6]], [[0, 3], [1, 2], [4, 7], [5, 6]], [[0, 4], [1, 5], [2, 6], [3, 7]]]
)
_ABSORBS = 1e-6  # share of the segment's mass from which a fragment takes up round-off without a trace


@dataclass(frozen=True, eq=False)
class Patches:
    """What every fragment covers.

    Attributes
    ----------
    mass : (n,) float64
        Mass of the fragments (kg): the sum of their pieces.
    seed : (n,) int64
        The cell in which each was placed.
    point : (n, 3) float64
        Random point in it, coordinates 0 to 1 of the reference cell.
    contiguous : (n,) bool
        Whether the pieces hang together.
    offset : (n + 1,) int64
        Pieces `offset[f]` to `offset[f + 1]` are those of fragment f.
    cell : (p,) int64
        Cell of every piece.
    piece : (p,) float64
        Mass of every piece (kg).
    centre : (p, 3) float64
        Middle of every piece, coordinates 0 to 1 of the reference cell. The pieces' mass-weighted mean is the
        middle of the cell, and a piece that is a whole cell lies there.
    """

    mass: NDArray[np.float64]
    seed: NDArray[np.int64]
    point: NDArray[np.float64]
    contiguous: NDArray[np.bool_]
    offset: NDArray[np.int64]
    cell: NDArray[np.int64]
    piece: NDArray[np.float64]
    centre: NDArray[np.float64]


def place(
    fragment_mass: NDArray[np.float64],
    cell_mass: NDArray[np.float64],
    neighbours: NDArray[np.int64],
    generator: np.random.Generator,
    *,
    take_all: bool,
    sides: NDArray[np.float64] | None = None,
) -> Patches:
    """Place the fragments of one segment on its cells.

    Parameters
    ----------
    fragment_mass : (n,) float64
        Masses (kg), falling.
    cell_mass : (m,) float64
        Masses of the segment's cells (kg).
    neighbours : (m, 6) int64
        Face neighbours within the segment, -1 for none.
    generator : numpy.random.Generator
        Source of chance.
    take_all : bool
        The fragments are to carry the cells' whole mass: what round-off leaves goes to the fragment placed last, the
        lightest that does not feel it.
    sides : (m, 3) float64 or None
        Lengths of the cells along their three coordinates (m): shared cells are cut across the longest. None: cubes.

    Returns
    -------
    Patches
        In the order of placing; masses equal those asked for to round-off.
    """
    number = fragment_mass.size
    # A cell's place in the order falls with -ln(u)/m: each next cell comes with odds by its mass.
    order = np.argsort(generator.exponential(size=cell_mass.size) / cell_mass, kind="stable")
    point = generator.random((number, 3))
    heavy = fragment_mass >= _ABSORBS * cell_mass.sum()
    last = int(np.flatnonzero(heavy)[-1]) if heavy.any() else 0
    placing = np.concatenate([fragment_mass[:last], fragment_mass[last + 1 :], fragment_mass[last : last + 1]])
    seed = np.zeros(number, dtype=np.int64)
    contiguous = np.zeros(number, dtype=np.bool_)
    offset = np.zeros(number + 1, dtype=np.int64)
    cell = np.empty(cell_mass.size + number, dtype=np.int64)
    piece = np.empty(cell_mass.size + number)
    placed = flood(cell_mass.copy(), neighbours, order, placing, take_all, seed, contiguous, offset, cell, piece)
    used = offset[placed]
    offset, cell, piece = offset[: placed + 1], cell[:used], piece[:used]
    mass = np.add.reduceat(piece, offset[:-1]) if placed else np.empty(0)
    ends = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=cell_mass.size))])
    centre = np.empty((used, 3))
    owners_point = np.repeat(point[:placed], np.diff(offset), axis=0)
    lengths = np.ones((cell_mass.size, 3)) if sides is None else sides
    part(ends, np.argsort(cell, kind="stable"), piece, owners_point, lengths, centre)
    return Patches(mass, seed[:placed], point[:placed], contiguous[:placed], offset, cell, piece, centre)


def join(parts: list[tuple[Patches, NDArray[np.int64]]]) -> Patches:
    """Patches of several segments as one; each with the numbers of its cells in the whole."""
    ends = np.cumsum([0, *(patch.cell.size for patch, _ in parts)])
    return Patches(
        mass=np.concatenate([patch.mass for patch, _ in parts]),
        seed=np.concatenate([cells[patch.seed] for patch, cells in parts]),
        point=np.concatenate([patch.point for patch, _ in parts]),
        contiguous=np.concatenate([patch.contiguous for patch, _ in parts]),
        offset=np.concatenate([[0], *(patch.offset[1:] + end for (patch, _), end in zip(parts, ends, strict=False))]),
        cell=np.concatenate([cells[patch.cell] for patch, cells in parts]),
        piece=np.concatenate([patch.piece for patch, _ in parts]),
        centre=np.concatenate([patch.centre for patch, _ in parts]),
    )


def cell_sides(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean lengths (m, 3) of the cells along their three coordinates; `corners` (m, 8, 3) are their nodes, all in m."""
    edges = corners[:, _EDGES]
    return np.asarray(np.linalg.norm(edges[:, :, :, 1] - edges[:, :, :, 0], axis=-1).mean(axis=-1))


def trilinear(corners: NDArray[np.float64], point: NDArray[np.float64]) -> NDArray[np.float64]:
    """Trilinear interpolation in hexahedra (Eq. 31 with the hexahedron's shape functions).

    Parameters
    ----------
    corners : (k, 8, 3) float64
        Values at the nodes in VTK's order.
    point : (k, 3) float64
        Coordinates 0 to 1 in the reference cell.
    """
    x, y, z = (np.stack([1.0 - point[:, i], point[:, i]]) for i in range(3))
    along_x, along_y = (0, 1, 1, 0) * 2, (0, 0, 1, 1) * 2
    weights = np.stack([x[along_x[i]] * y[along_y[i]] * z[i // 4] for i in range(8)], axis=1)
    return np.asarray(np.einsum("ki,kij->kj", weights, corners))


def cell_middles(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values (m, 3) in the middles of the cells; `corners` (m, 8, 3) are those at their nodes."""
    return trilinear(corners, np.full((len(corners), 3), 0.5))


def patch_means(
    patches: Patches, corners: NDArray[np.float64], middles: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Mass-weighted means (n, 3) over what the fragments cover.

    Parameters
    ----------
    patches : Patches
        What every fragment covers.
    corners : (m, 8, 3) float64
        Values at the cells' nodes: of their velocities (m/s), or of their places (m) for the centres of mass. The
        sum over fragments of mass times mean is the sum over cells of mass times the mean of the nodes.
    middles : (m, 3) float64 or None
        `cell_middles(corners)`, where they are at hand: most pieces are whole cells.
    """
    if middles is None:
        values = trilinear(corners[patches.cell], patches.centre)
    else:
        values = middles[patches.cell]
        cut = np.flatnonzero((patches.centre != 0.5).any(axis=1))
        values[cut] = trilinear(corners[patches.cell[cut]], patches.centre[cut])
    return np.asarray(np.add.reduceat(patches.piece[:, None] * values, patches.offset[:-1]) / patches.mass[:, None])


def point_positions(patches: Patches, corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Places (n, 3) of the random points; `corners` (m, 8, 3) are the cells' nodes, all in m."""
    return trilinear(corners[patches.seed], patches.point)
