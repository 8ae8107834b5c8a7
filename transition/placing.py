"""Placing the fragments: every fragment takes a compact cluster of material points.

A segment's casing is a sheet: (axis, angle, depth), or two axes across and one along for a disc. A space-filling curve
runs over it as it was before the burst, with its sides as long as they are at rupture; it is turned, mirrored and
stretched at random. The fragments, in random order, take runs of the points along the curve. So masses are
exact, the fragments show no grid lines, and small changes of the burst move no point to another fragment.

A fragment moves as the mean of its points and lies at their centre of mass. So momentum is that of the points to
round-off; spin of a fragment is lost here.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from transition.kernels import curve_positions

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from transition.draws import Draws
    from transition.points import MaterialPoints

    Array = NDArray[np.float64]


_CLOSED = 1e-9  # share of the mass within which fragments and points are taken to have the same
_SOLID = 0.2  # smallest over largest radius below which a segment is a disc
_DEGREE = 3  # of the polynomial of the middle of a wall
_SPLITS = 31  # of a stretched side: five halvings
_SPREAD = 0.5, 0.2  # widths of the range of the first split, and of the others
_CELLS_PER_POINT = 8  # logarithm to base 2


@dataclass(frozen=True, eq=False)
class Sheet:
    """The casing of a segment as a box of three sides, the longest first."""

    sides: tuple[int, ...]
    """Which of turn (or x), height (or y), depth (or z) each is."""
    lengths: Array
    """(3,) float64: lengths of the sides at rupture (m)."""
    low: Array
    high: Array
    """(3,) float64: coordinates at which they begin and end."""
    middle: Array | None
    """Coefficients of the radius of the middle of the wall by height (m); None for a disc."""

    @classmethod
    def of(cls, reference: Array, stretch: float) -> Sheet:
        """The sheet that points (p, 3) before the burst fill, in m across and along the round's axis.

        `stretch`: circumference at rupture over that before the burst.
        """
        radius, height = np.hypot(reference[:, 0], reference[:, 1]), reference[:, 2]
        if radius.min() < _SOLID * radius.max():
            middle, factors = None, np.array([stretch, stretch, 1.0 / stretch**2])
        else:
            middle = np.polyfit(height, radius, min(_DEGREE, len(np.unique(height.round(6))) - 1))
            factors = np.array([2.0 * np.pi * radius.mean() * stretch, 1.0, 1.0 / stretch])
        coordinates = _coordinates(reference, middle)
        low, high = coordinates.min(axis=0), coordinates.max(axis=0)
        if middle is not None:
            low[0], high[0] = 0.0, 1.0
        high = np.maximum(high, low + 1e-9)
        lengths = factors * (high - low)
        sides = np.argsort(-lengths)
        return cls(tuple(sides), lengths[sides], low[sides], high[sides], middle)

    @property
    def _blocks(self) -> tuple[int, int]:
        """Cubes of the curve along the longest side, and halvings of their depth."""
        blocks = max(1, round(self.lengths[0] / self.lengths[1]))
        return blocks, min(max(0, round(np.log2(self.lengths[1] / self.lengths[2]))), 8)

    def order(self, reference: Array, uniform: Array) -> NDArray[np.int64]:
        """Order (p,) of points along a random curve; `uniform` (`CURVE_DRAWS`,): the numbers that settle it."""
        cosine, sine = np.cos(2.0 * np.pi * uniform[0]), np.sin(2.0 * np.pi * uniform[0])
        turned = reference @ np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        unit = np.clip((_coordinates(turned, self.middle)[:, self.sides] - self.low) / (self.high - self.low), 0.0, 1.0)
        for side, (mirror, *splits) in enumerate(uniform[1:].reshape(3, -1)):
            unit[:, side] = np.interp(unit[:, side], _stretched(splits), np.linspace(0.0, 1.0, _SPLITS + 2))
            if mirror < 0.5:
                unit[:, side] = 1.0 - unit[:, side]
        blocks, flat = self._blocks
        row = len(reference).bit_length()
        deep = max(1, (row + _CELLS_PER_POINT - blocks.bit_length() - 2 * flat) // 3)
        # Numbers that hold the point's own differ, so that every way of sorting gives the same order.
        numbered = curve_positions(unit, blocks, flat, deep) << row | np.arange(len(reference))
        return np.sort(numbered) & ((1 << row) - 1)

    def kept_order(self, reference: Array, uniform: Array) -> NDArray[np.int64]:
        """The same, kept for other bursts of the same casing."""
        middle = None if self.middle is None else tuple(self.middle)
        sheet = (self.sides, tuple(self.lengths), tuple(self.low), tuple(self.high), middle)
        return _kept_order(sheet, reference.tobytes(), uniform.tobytes())


@lru_cache(maxsize=24)
def _kept_order(sheet: tuple[Any, ...], reference: bytes, uniform: bytes) -> NDArray[np.int64]:
    sides, lengths, low, high, middle = sheet
    middle = None if middle is None else np.array(middle)
    made = Sheet(sides, np.array(lengths), np.array(low), np.array(high), middle)
    return made.order(np.frombuffer(reference).reshape(-1, 3), np.frombuffer(uniform))


CURVE_DRAWS = 1 + 3 * (1 + _SPLITS)


def _coordinates(reference: Array, middle: Array | None) -> Array:
    if middle is None:
        return reference
    x, y, height = reference.T
    turn = np.arctan2(y, x) / (2.0 * np.pi) % 1.0
    return np.column_stack([turn, height, np.hypot(x, y) - np.polyval(middle, height)])


def _stretched(splits: Sequence[float]) -> Array:
    """Edges of 32 parts of [0, 1], each half of a part divided where a random number says."""
    edges, used = np.array([0.0, 1.0]), 0
    while used < len(splits):
        number = len(edges) - 1
        share = 0.5 + _SPREAD[used > 0] * (np.array(splits[used : used + number]) - 0.5)
        edges = np.insert(edges, np.arange(1, number + 1), edges[:-1] + share * np.diff(edges))
        used += number
    return edges


@dataclass(frozen=True, eq=False)
class Clusters:
    """The points of every fragment. A piece is a point, or the part of one that a fragment has."""

    mass: Array
    """(n,) float64: mass of the fragments (kg)."""
    fragment: NDArray[np.int64]
    """(q,) int64: fragment of every piece."""
    point: NDArray[np.int64]
    """(q,) int64: point of every piece."""
    piece: Array
    """(q,) float64: mass of every piece (kg)."""
    chosen: NDArray[np.int64]
    """(n,) int64: one point of each fragment, drawn at random by mass."""

    def means(self, points: MaterialPoints) -> tuple[Array, Array]:
        """Centres of mass (n, 3) in m and mean velocities (n, 3) in m/s of the fragments."""
        weight = np.bincount(self.fragment, self.piece)
        columns = [
            np.bincount(self.fragment, self.piece * column[self.point]) / weight
            for column in (*points.position.T, *points.velocity.T)
        ]
        return np.stack(columns[:3], axis=1), np.stack(columns[3:], axis=1)


def place(fragment_mass: Array, along: NDArray[np.int64], point_mass: Array, draws: Draws) -> Clusters:
    """Give the fragments of one segment runs of its points.

    `fragment_mass` (n,): masses (kg), above zero. Where they do not add up to the points' mass (the paper's grades),
    the rest is cut into parts as heavy as the heaviest fragment, placed like fragments and left out; `along` (p,): the
    points in the order of a curve; `point_mass` (p,): their masses (kg), above zero; `draws`: what orders the fragments
    along the curve, and chooses a point of each. Raises ValueError: a mass that is not above zero, or fragments heavier
    than the points together.
    """
    fragment_mass = np.asarray(fragment_mass, dtype=np.float64)
    total, asked, wanted = float(point_mass.sum()), float(fragment_mass.sum()), fragment_mass.size
    if not (wanted and fragment_mass.min() > 0.0 and point_mass.min() > 0.0):
        raise ValueError("placing: masses of fragments and points must be above zero")
    if asked > total * (1.0 + _CLOSED):
        raise ValueError(f"placing: fragments of {asked:g} kg do not fit on points of {total:g} kg")
    if asked < total * (1.0 - _CLOSED):
        rest = max(1, int((total - asked) / fragment_mass.max()))
        fragment_mass = np.concatenate([fragment_mass, np.full(rest, (total - asked) / rest)])
    # Of equal numbers the earlier fragment comes first; one more is inserted and leaves the others in their order.
    order = np.argsort(draws.uniform("order", fragment_mass.size), kind="stable")
    point_end = np.cumsum(point_mass[along])
    end = np.cumsum(fragment_mass[order])
    end *= point_end[-1] / end[-1]
    begin = np.concatenate([[0.0], end[:-1]])
    last = along.size - 1
    first = np.minimum(np.searchsorted(point_end, begin, side="right"), last)
    number = np.clip(np.searchsorted(point_end, end), first, last) - first + 1
    owner = np.repeat(np.arange(order.size), number)
    at = np.arange(owner.size) - np.repeat(np.cumsum(number) - number, number) + first[owner]
    # A point whole within a run has its own mass, others what lies between the ends: round-off is that of the sums.
    piece = np.minimum(point_mass[along[at]], point_end[at] - begin[owner])
    piece = np.minimum(piece, end[owner] - (point_end[at] - point_mass[along[at]]))
    piece = np.where(number[owner] == 1, fragment_mass[order[owner]], np.maximum(piece, 0.0))
    chosen = np.empty(order.size, dtype=np.int64)
    chosen[order] = np.searchsorted(point_end, begin + (end - begin) * draws.uniform("chosen", order.size)[order])
    kept = order[owner] < wanted
    return Clusters(
        fragment_mass[:wanted], order[owner][kept], along[at][kept], piece[kept],
        along[np.minimum(chosen[:wanted], last)],
    )  # fmt: skip
