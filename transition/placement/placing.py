"""Placing the fragments: every fragment takes a compact cluster of material points.

All fragments of a segment are placed together, by dividing: the fragments, in random order, into two groups, and the
points by a cut across a random direction near their longest extent into two parts of the groups' masses; then each
part again, until it is one fragment (`kernels.bisection`). Masses are exact, since every cut divides one point by
mass where it meets it. The cuts follow the cloud of points in space; cells and their order play no part, so the
fragments show no grid lines, and any source of points will do.

A fragment moves as the mean of its points and lies at their centre of mass. So momentum is that of the points to
round-off; spin of a fragment is lost here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from transition.kernels.bisection import bisect
from transition.kernels.clusters import chosen_points, cluster_means, collect

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from transition.cells.points import MaterialPoints


_CLOSED = 1e-9  # share of the mass within which fragments and points are taken to have the same


@dataclass(frozen=True, eq=False)
class Clusters:
    """The points of every fragment. A piece is a point, or the part of one that a fragment has."""

    mass: NDArray[np.float64]
    """(n,) float64: mass of the fragments (kg): the sum of their pieces."""
    offset: NDArray[np.int64]
    """(n + 1,) int64: pieces `offset[f]` to `offset[f + 1]` are those of fragment f."""
    point: NDArray[np.int64]
    """(p,) int64: point of every piece."""
    piece: NDArray[np.float64]
    """(p,) float64: mass of every piece (kg)."""
    chosen: NDArray[np.int64]
    """(n,) int64: one point of each fragment, drawn at random by mass."""

    @classmethod
    def concatenate(cls, parts: Sequence[tuple[Clusters, int]]) -> Clusters:
        """Clusters of several segments as one; each with the number of points of its segment."""
        pieces = np.cumsum([0, *(cluster.point.size for cluster, _ in parts)])
        points = np.cumsum([0, *(number for _, number in parts)])
        clusters = [cluster for cluster, _ in parts]
        return cls(
            mass=np.concatenate([c.mass for c in clusters]),
            offset=np.concatenate([[0], *(c.offset[1:] + n for c, n in zip(clusters, pieces, strict=False))]),
            point=np.concatenate([c.point + n for c, n in zip(clusters, points, strict=False)]),
            piece=np.concatenate([c.piece for c in clusters]),
            chosen=np.concatenate([c.chosen + n for c, n in zip(clusters, points, strict=False)]),
        )

    def means(self, points: MaterialPoints) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Centres of mass (n, 3) in m and mean velocities (n, 3) in m/s of the fragments."""
        return cluster_means(self.offset, self.point, self.piece, points.position, points.velocity)


def place(
    fragment_mass: NDArray[np.float64],
    position: NDArray[np.float64],
    point_mass: NDArray[np.float64],
    generator: np.random.Generator,
    axis: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Clusters:
    """Place the fragments of one segment on its points.

    Parameters
    ----------
    fragment_mass : (n,) float64
        Masses (kg), above zero, in any order. Where they do not add up to the points' mass (the paper's grades), the
        rest is cut into parts as heavy as the heaviest fragment, placed like fragments and left out.
    position : (p, 3) float64
        Positions of the points (m).
    point_mass : (p,) float64
        Their masses (kg), above zero.
    generator : numpy.random.Generator
        Source of randomness.
    axis : tuple of float
        Direction of the round's axis: a ring about it is cut into arcs. Zero: there is none.

    Returns
    -------
    Clusters
        In the order of `fragment_mass`; masses equal those asked for to round-off.

    Raises
    ------
    ValueError
        A mass that is not above zero, or fragments heavier than the points together.
    """
    fragment_mass = np.asarray(fragment_mass, dtype=np.float64)
    total, asked = float(point_mass.sum()), float(fragment_mass.sum())
    wanted = fragment_mass.size
    if not (wanted and fragment_mass.min() > 0.0 and point_mass.min() > 0.0):
        raise ValueError("placing: masses of fragments and points must be above zero")
    if asked > total * (1.0 + _CLOSED):
        raise ValueError(f"placing: fragments of {asked:g} kg do not fit on points of {total:g} kg")
    if asked < total * (1.0 - _CLOSED):
        rest = max(1, int((total - asked) / fragment_mass.max()))
        fragment_mass = np.concatenate([fragment_mass, np.full(rest, (total - asked) / rest)])
    number = fragment_mass.size
    size = point_mass.size + number - 1
    row, point = np.empty((size, 4)), np.empty(size, dtype=np.int64)
    for k, column in enumerate((*position.T, point_mass)):  # numpy copies columns faster than rows of three
        row[: point_mass.size, k] = column
    point[: point_mass.size] = np.arange(point_mass.size)
    first, pieces = np.empty((2, number), dtype=np.int64)
    order = generator.permutation(number)
    normal, uniform = generator.standard_normal((number, 3)), generator.random((number, 2))
    bisect(
        row,
        point,
        point_mass.size,
        fragment_mass,
        order,
        normal,
        uniform,
        np.asarray(axis, dtype=np.float64),
        first,
        pieces,
    )
    offset = np.concatenate([[0], np.cumsum(pieces[:wanted])])
    mass, ident, piece = np.empty(wanted), np.empty(offset[-1], dtype=np.int64), np.empty(offset[-1])
    collect(first, offset, row, point, mass, ident, piece)
    return Clusters(mass, offset, ident, piece, chosen_points(offset, ident, piece, generator.random(wanted) * mass))
