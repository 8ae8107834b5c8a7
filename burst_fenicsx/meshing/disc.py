"""The O-grid of a round's section: a rounded square of N x N quadrilaterals, rings around it, and the wall's rings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fragfield_base.elementary import cos, sin

if TYPE_CHECKING:
    from numpy.typing import NDArray


# Corner distance of the core square over the disc's radius, and the turn of each of its sides' arcs: with them the
# three angles at a corner of the core are 130 and twice 115 degrees, and its cells are as large as those of the rings.
# Of the shapes tried (0.72 to 0.83, 20 to 28 degrees) on the built-in rounds this one has the longest shortest edge.
CORE_RADIUS = 0.75
SIDE_TURN = math.radians(20.0)
CORE_SIDE_RADIUS = CORE_RADIUS * np.sqrt(0.5) * (1.0 + math.tan(SIDE_TURN / 2.0))


@dataclass(frozen=True)
class SectionGrid:
    """Topology and shape of one section; the nodes of every layer are this grid, scaled by the layer's two radii.

    Attributes
    ----------
    inner : (n, 2) nodes times the radius of the boundary between cavity and wall.
    outer : (n, 2) nodes times the outer radius; a node lies at `inner * r_i + outer * r_o`.
    quads : (k, 4) counter-clockwise quadrilaterals, the cavity's first.
    cavity_quads : how many of them lie within the cavity.
    """

    inner: NDArray[np.float64]
    outer: NDArray[np.float64]
    quads: NDArray[np.int64]
    cavity_quads: int

    def nodes(self, inner_radius: float, outer_radius: float) -> NDArray[np.float64]:
        """Return the nodes of a layer across the axis (m), shape (n, 2)."""
        return self.inner * inner_radius + self.outer * outer_radius


def equal_area_factor(sides: int) -> float:
    """Return the factor on the radius that gives a regular polygon its circle's area.

    It is sqrt(a / sin a) with a = 2 pi / n.
    """
    angle = 2.0 * np.pi / sides
    return math.sqrt(angle / math.sin(angle))


def section_grid(core: int, rings: int, wall: int) -> SectionGrid:
    """Build the section.

    Parameters
    ----------
    core : cells along a side of the core square, N; the circumference has 4 N.
    rings : rings of cells between core and wall.
    wall : rings of cells through the wall.
    """
    around = 4 * core
    angle = -0.25 * np.pi + 2.0 * np.pi * np.arange(around) / around
    circle = equal_area_factor(around) * np.column_stack([cos(angle), sin(angle)])

    square = _rounded_square(core)
    edge = np.arange(core)
    last = core
    grid = np.arange((core + 1) ** 2).reshape(core + 1, core + 1)  # [row along y, column along x]
    perimeter = np.concatenate([grid[edge, last], grid[last, last - edge], grid[last - edge, 0], grid[0, edge]])

    start = square[perimeter]
    share = np.arange(1, rings + 1)[:, None, None] / rings
    ring_nodes = ((1.0 - share) * start + share * circle).reshape(-1, 2)
    depth = np.arange(1, wall + 1)[:, None, None] / wall
    inner = np.concatenate([square, ring_nodes, ((1.0 - depth) * circle).reshape(-1, 2)])
    outer = np.concatenate([np.zeros_like(square), np.zeros_like(ring_nodes), (depth * circle).reshape(-1, 2)])

    core_quads = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=-1).reshape(-1, 4)
    loops = len(square) + np.arange((rings + wall) * around).reshape(rings + wall, around)
    loops = np.concatenate([perimeter[None, :], loops])
    following = np.roll(loops, -1, axis=1)
    ring_quads = np.stack([loops[:-1], loops[1:], following[1:], following[:-1]], axis=-1).reshape(-1, 4)
    quads = np.concatenate([core_quads, ring_quads]).astype(np.int64)
    return SectionGrid(inner, outer, quads, core * core + rings * around)


def _rounded_square(core: int) -> NDArray[np.float64]:
    """Nodes of the core over the disc's radius, row by row, shape ((N + 1)^2, 2): transfinite between four arcs."""
    half = CORE_RADIUS * np.sqrt(0.5)
    arc_radius = half / math.sin(SIDE_TURN)
    place = np.linspace(-1.0, 1.0, core + 1)
    along = arc_radius * sin(SIDE_TURN * place)
    height = half - arc_radius * math.cos(SIDE_TURN) + arc_radius * cos(SIDE_TURN * place)
    # Opposite sides mirror each other, so the transfinite map is a product: each row is a scaled arc.
    u, v = np.meshgrid(place, place)
    x = u * height[:, None] + along[None, :] - half * u
    y = v * height[None, :] + along[:, None] - half * v
    return np.column_stack([x.ravel(), y.ravel()])
