"""Placing the fragments: a random cell and a random point in it, then a flood over neighbours until covered.

The heaviest fragments are placed first, while the casing is whole, so that each covers a connected patch; the light
ones fill what is between. Every cell's mass is given out exactly once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from transition.kernels.flooding import flood

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Patches", "join", "patch_means", "patch_positions", "place", "point_positions", "trilinear"]

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
    """

    mass: NDArray[np.float64]
    seed: NDArray[np.int64]
    point: NDArray[np.float64]
    contiguous: NDArray[np.bool_]
    offset: NDArray[np.int64]
    cell: NDArray[np.int64]
    piece: NDArray[np.float64]


def place(
    fragment_mass: NDArray[np.float64],
    cell_mass: NDArray[np.float64],
    neighbours: NDArray[np.int64],
    generator: np.random.Generator,
    *,
    take_all: bool,
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
    return Patches(mass, seed[:placed], point[:placed], contiguous[:placed], offset, cell, piece)


def join(parts: list[tuple[Patches, NDArray[np.int64]]]) -> Patches:
    """Patches of several segments as one; each with the numbers of its cells in the whole."""
    ends = np.cumsum([0, *(part.cell.size for part, _ in parts)])
    return Patches(
        mass=np.concatenate([part.mass for part, _ in parts]),
        seed=np.concatenate([cells[part.seed] for part, cells in parts]),
        point=np.concatenate([part.point for part, _ in parts]),
        contiguous=np.concatenate([part.contiguous for part, _ in parts]),
        offset=np.concatenate([[0], *(part.offset[1:] + end for (part, _), end in zip(parts, ends, strict=False))]),
        cell=np.concatenate([cells[part.cell] for part, cells in parts]),
        piece=np.concatenate([part.piece for part, _ in parts]),
    )


def patch_means(patches: Patches, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mass-weighted means (n, 3) over the fragments' pieces of `values` (p, 3), one row a piece."""
    return np.asarray(np.add.reduceat(patches.piece[:, None] * values, patches.offset[:-1]) / patches.mass[:, None])


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


def point_positions(patches: Patches, corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Places (n, 3) of the random points; `corners` (m, 8, 3) are the cells' nodes, all in m."""
    return trilinear(corners[patches.seed], patches.point)


def patch_positions(
    patches: Patches, corners: NDArray[np.float64], cell_mass: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Centres of mass (n, 3) of what the fragments cover (m).

    A wholly covered cell counts at its centre. Of a cell that several fragments share nothing says which part each
    takes; a piece with the share s of its cell is set on the line from the fragment's random point in that cell
    (s = 0) to the centre (s = 1), so that fragments smaller than a cell do not coincide.
    """
    share = np.minimum(patches.piece / cell_mass[patches.cell], 1.0)
    places = corners.mean(axis=1)[patches.cell]
    partly = np.flatnonzero(share < 1.0)
    fragment = np.repeat(np.arange(patches.mass.size), np.diff(patches.offset))[partly]
    inside = trilinear(corners[patches.cell[partly]], patches.point[fragment])
    places[partly] += (1.0 - share[partly])[:, None] * (inside - places[partly])
    return patch_means(patches, places)
