"""Landing on a height map, bilinear on each of its cells.

A step is halved until it lies above everything below it, by a pyramid of the cells' greatest heights, or over at most
two by two cells. There it is cut where it passes from cell to cell, by the same sign changes that find crossings, and
its height above the cell is a polynomial of degree 10. So no cell that the path enters is left out. The outermost
cells, which `HeightMap.table` adds, are level outward and go on without end.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from flight.kernels.compiling import inner_kernel
from flight.kernels.faces import NOWHERE, Scratch, highest_of, lowest_of, put_in_order
from flight.kernels.roots import PRODUCT, sign_changes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

# parts of a step: coefficients of x, y and z, lower and upper end; the last row is scratch
TERRAIN_PIECES_SHAPE = (72, 20)
_PART, _DEEPEST = 71, 68
_LOW, _HIGH = 18, 19


class Terrain(NamedTuple):
    """Heights at the nodes of a regular grid, a ring of level cells around; no rows: flat ground, or none. Units: m."""

    heights: Array  # (rows, columns), rows towards +y, columns towards +x
    west: float  # x of the first column
    south: float  # y of the first row
    step_x: float
    step_y: float
    pyramid: Array  # greatest heights: of the cells, of two by two of them, ... row by row
    levels: NDArray[np.int64]  # (levels, 3): first entry in the pyramid, rows, columns
    highest: float


@inner_kernel()
def _index(position: float, start: float, step: float, cells: int) -> int:
    """Cell of a position along one axis; the nearest one beyond the edges."""
    index = math.floor((position - start) / step)
    return int(min(max(index, 0.0), cells - 1.0))


@inner_kernel()
def _shape(terrain: Terrain, row: int, column: int) -> tuple[float, float, float, float]:
    """Height of a cell's first corner, its rise over one cell along x, along y, and its twist."""
    h = terrain.heights
    corner, east, north = h[row, column], h[row, column + 1], h[row + 1, column]
    return corner, east - corner, north - corner, (h[row + 1, column + 1] - north) - (east - corner)


@inner_kernel()
def _within(terrain: Terrain, x: float, y: float) -> tuple[int, int, float, float]:
    """Row and column of the cell below a position, and the fractions of it along x and y."""
    row = _index(y, terrain.south, terrain.step_y, terrain.heights.shape[0] - 1)
    column = _index(x, terrain.west, terrain.step_x, terrain.heights.shape[1] - 1)
    u = (x - (terrain.west + column * terrain.step_x)) / terrain.step_x
    return row, column, u, (y - (terrain.south + row * terrain.step_y)) / terrain.step_y


@inner_kernel()
def height_at(terrain: Terrain, x: float, y: float) -> float:
    """Height of the ground (m)."""
    row, column, u, v = _within(terrain, x, y)
    corner, rise_x, rise_y, twist = _shape(terrain, row, column)
    return corner + u * rise_x + v * rise_y + u * v * twist


@inner_kernel()
def slope_at(terrain: Terrain, x: float, y: float) -> tuple[float, float]:
    """Rise of the ground per length along x and along y."""
    row, column, u, v = _within(terrain, x, y)
    _, rise_x, rise_y, twist = _shape(terrain, row, column)
    return (rise_x + v * twist) / terrain.step_x, (rise_y + u * twist) / terrain.step_y


@inner_kernel()
def cross_terrain(terrain: Terrain, until: float, step: Scratch) -> float:
    """Find the first position on the step, before `until`, that lies below the ground; 2.0 if none does.

    Landing is the first position below, not a sign change: a step below by rounding between two cells lands there.
    """
    points, pieces = step.points, step.terrain_pieces
    if lowest_of(points[2], 0) > terrain.highest:
        return NOWHERE
    for j in range(3):
        for i in range(6):
            pieces[0, 6 * j + i] = points[j, i]
    pieces[0, _LOW], pieces[0, _HIGH] = 0.0, 1.0
    rows, columns = terrain.heights.shape[0] - 1, terrain.heights.shape[1] - 1
    depth = 1
    while depth > 0:
        depth -= 1
        piece = pieces[depth]
        if piece[_LOW] >= until:
            return NOWHERE
        lowest = lowest_of(piece, 12)
        if lowest > terrain.highest:
            continue
        west = _index(lowest_of(piece, 0), terrain.west, terrain.step_x, columns)
        east = _index(highest_of(piece, 0), terrain.west, terrain.step_x, columns)
        south = _index(lowest_of(piece, 6), terrain.south, terrain.step_y, rows)
        north = _index(highest_of(piece, 6), terrain.south, terrain.step_y, rows)
        if lowest > _greatest(terrain, south, north, west, east):
            continue
        if (east - west <= 1 and north - south <= 1) or depth + 2 > _DEEPEST:
            theta = _cross_cells(piece, terrain, south, north, west, east, step)
            if theta <= 1.0:
                return piece[_LOW] + (piece[_HIGH] - piece[_LOW]) * theta
            continue
        _cut(piece, 0.5, pieces[depth + 1])
        middle = 0.5 * (piece[_LOW] + piece[_HIGH])
        pieces[depth + 1, _LOW], pieces[depth + 1, _HIGH] = piece[_LOW], middle
        piece[_LOW] = middle
        depth += 2
    return NOWHERE


@inner_kernel()
def _greatest(terrain: Terrain, south: int, north: int, west: int, east: int) -> float:
    """Bound from above of the heights over a block of cells, from the level where it covers few entries."""
    level = 0
    while max(north - south, east - west) > 3 and level + 1 < terrain.levels.shape[0]:
        south, north, west, east = south // 2, north // 2, west // 2, east // 2
        level += 1
    first, columns = terrain.levels[level, 0], terrain.levels[level, 2]
    greatest = -np.inf
    for row in range(south, north + 1):
        for column in range(west, east + 1):
            greatest = max(greatest, terrain.pyramid[first + row * columns + column])
    return greatest


@inner_kernel()
def _cut(piece: Array, at: float, left: Array) -> None:
    """Cut the curve at a position in [0, 1] (de Casteljau): the left part into `left`, the right part stays."""
    for j in range(0, 18, 6):
        left[j] = piece[j]
        for level in range(1, 6):
            for i in range(6 - level):
                piece[j + i] += at * (piece[j + i + 1] - piece[j + i])
            left[j + level] = piece[j]


@inner_kernel()
def _cross_cells(piece: Array, terrain: Terrain, south: int, north: int, west: int, east: int, step: Scratch) -> float:
    """`cross_terrain` of a piece, which is cut up, over at most two by two cells; the position on the piece."""
    joints, stack, roots = step.joints, step.stack, step.roots  # where it passes a line, and 1 for one of constant x
    count = 0
    row, column = south, west
    if east > west:
        line = terrain.west + east * terrain.step_x
        for i in range(6):
            stack[0, i] = piece[i] - line
        column = east if stack[0, 0] >= 0.0 else west
        for k in range(sign_changes(stack, 5, abs(line) + terrain.step_x, roots)):
            put_in_order(joints, count, roots[k], 1.0)
            count += 1
    if north > south:
        line = terrain.south + north * terrain.step_y
        for i in range(6):
            stack[0, i] = piece[6 + i] - line
        row = north if stack[0, 0] >= 0.0 else south
        for k in range(sign_changes(stack, 5, abs(line) + terrain.step_y, roots)):
            put_in_order(joints, count, roots[k], 0.0)
            count += 1
    start, part = 0.0, step.terrain_pieces[_PART]
    for k in range(count + 1):
        end = joints[0, k] if k < count else 1.0
        if end > start:
            if k < count:
                _cut(piece, (end - start) / (1.0 - start), part)
            theta = _cross_cell(part if k < count else piece, terrain, row, column, stack, roots)
            if theta <= 1.0:
                return start + (end - start) * theta
            start = end
        if k < count:
            if joints[1, k] > 0.0:
                column = west + east - column
            else:
                row = south + north - row
    return NOWHERE


@inner_kernel()
def _cross_cell(part: Array, terrain: Terrain, row: int, column: int, stack: Array, roots: Array) -> float:
    """`cross_terrain` of a part over one cell; the position on the part."""
    corner, rise_x, rise_y, twist = _shape(terrain, row, column)
    x, y = terrain.west + column * terrain.step_x, terrain.south + row * terrain.step_y
    coefficients = stack[0]
    for k in range(11):
        coefficients[k] = 0.0
    scale = 0.0
    for i in range(6):
        u, z = (part[i] - x) / terrain.step_x, part[12 + i]
        plane = z - (corner + u * rise_x)
        scale = max(scale, abs(z) + abs(corner) + abs(u * rise_x))
        for j in range(6):
            v = (part[6 + j] - y) / terrain.step_y
            coefficients[i + j] += PRODUCT[i, j] * (plane - v * (rise_y + u * twist))
    lowest = np.inf
    for k in range(11):
        lowest = min(lowest, coefficients[k])
    if lowest >= 0.0:
        return NOWHERE
    if coefficients[0] < 0.0:
        return 0.0
    return roots[0] if sign_changes(stack, 10, scale, roots) > 0 else NOWHERE
