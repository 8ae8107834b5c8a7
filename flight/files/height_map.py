"""Maps of heights from files: metres at the nodes of a grid along x and y."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
from flight.files.gdal_raster import DRIVERS, own_environment, read_gdal_raster
from flight.files.map_plane import Plane, plane_of, read_projection, vertical_of
from flight.files.raster import HEIGHT_UNITS, MOST_NODES, metres_of, read_esri_grid, unit_words

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from flight.files.raster import Raster


FARTHEST = 25_000.0
"""Distance (m) from x = y = 0 along x and y to which a map is read; no fragment flies farther."""
_LATTICE = 9  # nodes each way, through which the transformation of a grid is interpolated
_CLOSE = 0.01  # of a pixel, by which that may be off; else every node is transformed
_EDGE = 1e-6  # of a pixel
_SAME_UNIT = 1e-5  # relative: feet and US survey feet are one for heights


@dataclass(frozen=True, eq=False)
class Grid:
    """Heights (m) at nodes (rows, columns), southernmost row first, not a number in holes; step and corner (m).

    `facts` says in words how the file was read: `format`, `crs`, `plan_unit`, `height_unit`, `vertical`, `north`,
    `position`, and a list of `notes`.
    """

    heights: NDArray[np.float64]
    step: tuple[float, float]
    corner: tuple[float, float]
    facts: dict[str, Any]


def read_grid(
    path: Path, site: tuple[float, float] | None = None, earth: tuple[float, float, float] | None = None,
    band: int | None = None, height_unit: str | None = None,
) -> Grid:  # fmt: skip
    """Read a map; see `flight.HeightMap.read`. Raises InputError where it cannot be read as heights in metres."""
    suffix = path.suffix.lower()
    if suffix != ".asc" and suffix not in DRIVERS:
        raise InputError(
            f"{path}: a height map is an ESRI ASCII grid (.asc) or, with the extra terrain, a GeoTIFF (.tif, .tiff), "
            "an SRTM tile (.hgt), DTED (.dt0, .dt1, .dt2) or Erdas Imagine (.img); gdal_translate makes a GeoTIFF of "
            "others"
        )
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    if suffix == ".asc":
        if band is not None and band != 1:
            raise InputError(f"{path}: band {band} is chosen; allowed: 1")
        raster = read_esri_grid(path)
    else:
        raster = read_gdal_raster(path, band)
    with own_environment():
        if raster.crs is None or raster.crs.is_engineering:
            raster.crs = read_projection(path) or raster.crs
        factor, words = _height_unit(raster, height_unit)
        plane = plane_of(raster, site, earth)
        grid = (_of_own_grid if plane.own_grid and raster.affine[1] == raster.affine[3] == 0.0 else _resampled)(
            raster, plane
        )
    facts = {"format": raster.form, **plane.words, **words, "notes": raster.notes + grid.facts["notes"]}
    return Grid(grid.heights * factor, grid.step, grid.corner, facts)


def _height_unit(raster: Raster, given: str | None) -> tuple[float, dict[str, str]]:
    """Metres in a unit of height, and in words where that comes from; raises InputError where it is not certain."""
    path = raster.path
    vertical = vertical_of(path, raster.crs)
    stated = {"the case": None if given is None else HEIGHT_UNITS[given], "its band": None, "its datum": vertical.unit}
    if raster.unit is not None:
        stated["its band"] = metres_of(path, raster.unit)
    found = {source: size for source, size in stated.items() if size is not None}
    if found and max(found.values()) > min(found.values()) * (1.0 + _SAME_UNIT):
        words = " and ".join(f"{unit_words(size)} by {source}" for source, size in found.items())
        raise InputError(f"{path}: the unit of its heights is {words}; one of them must go")
    if found:
        source, size = next(iter(found.items()))
        return size, {"height_unit": f"{unit_words(size)}, by {source}", "vertical": vertical.words}
    plan = None if raster.crs is None else next((one.unit_conversion_factor for one in raster.crs.axis_info), 1.0)
    if plan is not None and not _is_geographic(raster.crs) and plan != 1.0:
        raise InputError(
            f"{path}: the unit of its heights is not stated, and its plan is in {unit_words(plan)}; say which: "
            'height_unit = "m", "ft" or "us_ft"'
        )
    return 1.0, {"height_unit": "metres, which the file does not state", "vertical": vertical.words}


def _is_geographic(crs: Any) -> bool:  # noqa: ANN401
    return bool(crs.is_geographic)


def _window(raster: Raster, plane: Plane) -> tuple[slice, slice]:
    """Rows and columns within `FARTHEST` of x = y = 0; raises InputError where that lies off the map."""
    rows, columns = raster.shape
    column, row = (float(value) for value in plane.to_pixels(0.0, 0.0))
    if not (-_EDGE <= column <= columns - 1 + _EDGE and -_EDGE <= row <= rows - 1 + _EDGE):
        corners = raster.coordinates(0, 0), raster.coordinates(columns - 1, rows - 1)
        (x0, x1), (y0, y1) = (sorted(ends) for ends in zip(*corners, strict=True))
        raise InputError(
            f"{raster.path}: {plane.words['position']} ({plane.words['crs']}) lies off the map, which reaches from "
            f"{x0:.10g} to {x1:.10g} and from {y0:.10g} to {y1:.10g} in its own coordinates"
        )
    edge = np.linspace(-FARTHEST, FARTHEST, 33)
    x, y = np.meshgrid(edge, edge)
    reached = plane.to_pixels(x, y)
    found = []
    for number, values in zip((columns, rows), reached, strict=True):
        values = values[np.isfinite(values)]
        low, high = (values.min(), values.max()) if values.size else (0.0, 0.0)
        first, last = max(0, int(np.floor(low)) - 1), min(number, int(np.ceil(high)) + 2)
        found.append(slice(first, last))
    across, down = found
    number = (down.stop - down.start) * (across.stop - across.start)
    if number > MOST_NODES:
        raise InputError(
            f"{raster.path}: {number} nodes within {FARTHEST / 1e3:g} km of x = y = 0; allowed: {MOST_NODES}; cut the "
            "map (gdal_translate -projwin) or make it coarser"
        )
    return down, across


def _cut_words(raster: Raster, down: slice, across: slice) -> list[str]:
    if (down.stop - down.start, across.stop - across.start) == raster.shape:
        return []
    return [f"of {raster.shape[1]} x {raster.shape[0]} nodes those within {FARTHEST / 1e3:g} km of x = y = 0 are read"]


def _of_own_grid(raster: Raster, plane: Plane) -> Grid:
    try:
        down, across = _window(raster, plane)
    except InputError:
        down, across = slice(0, raster.shape[0]), slice(0, raster.shape[1])  # the site may lie off it, with a datum
        if raster.shape[0] * raster.shape[1] > MOST_NODES:
            raise
    heights = raster.read(down, across)
    x, y = plane.from_pixels(np.array([across.start, across.stop - 1]), np.array([down.start, down.stop - 1]))
    if x[1] < x[0]:
        heights, x = heights[:, ::-1], x[::-1]
    if y[1] < y[0]:
        heights, y = heights[::-1], y[::-1]
    rows, columns = heights.shape
    if min(rows, columns) < 2:
        raise InputError(f"{raster.path}: {rows} x {columns} nodes; needed: two rows and two columns or more")
    step = float(x[1] - x[0]) / (columns - 1), float(y[1] - y[0]) / (rows - 1)
    notes = _cut_words(raster, down, across)
    return Grid(np.ascontiguousarray(heights), step, (float(x[0]), float(y[0])), {"notes": notes})


def _resampled(raster: Raster, plane: Plane) -> Grid:
    """Heights at nodes along x and y, as far apart as the map's, bilinear between the map's.

    The grid is the rectangle that the map fills; a node beside a hole is a hole.
    """
    down, across = _window(raster, plane)
    x, y = _nodes(raster, plane, down, across)
    column, row = _on_grid(plane, x, y)
    inside = (column >= across.start - _EDGE) & (column <= across.stop - 1 + _EDGE)
    inside &= (row >= down.start - _EDGE) & (row <= down.stop - 1 + _EDGE)
    rows, columns = _filled_rectangle(inside, int(np.argmin(np.abs(y))), int(np.argmin(np.abs(x))))
    if min(rows.stop - rows.start, columns.stop - columns.start) < 2:
        raise InputError(f"{raster.path}: {plane.words['position']} lies on the edge of the map")
    column = np.clip(column[rows, columns] - across.start, 0.0, across.stop - across.start - 1.0)
    row = np.clip(row[rows, columns] - down.start, 0.0, down.stop - down.start - 1.0)
    heights = _bilinear(raster.read(down, across), column, row)
    x, y = x[columns], y[rows]
    notes = [*_cut_words(raster, down, across), "heights at the nodes are interpolated between those of the map"]
    return Grid(heights, (float(x[1] - x[0]), float(y[1] - y[0])), (float(x[0]), float(y[0])), {"notes": notes})


def _nodes(raster: Raster, plane: Plane, down: slice, across: slice) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """X and y of nodes over a window of the raster; one of them is x = y = 0."""
    column, row = (float(value) for value in plane.to_pixels(0.0, 0.0))
    near_x, near_y = plane.from_pixels(column + np.array([0.0, 1.0, 0.0]), row + np.array([0.0, 0.0, 1.0]))
    along, up = (np.array([near_x[k] - near_x[0], near_y[k] - near_y[0]]) for k in (1, 2))
    steps = float(np.hypot(*along)), float(np.hypot(*up))
    if abs(along[0]) < abs(along[1]):
        steps = steps[::-1]
    edge_x, edge_y = np.meshgrid(
        np.linspace(across.start, across.stop - 1, 33), np.linspace(down.start, down.stop - 1, 33)
    )
    ends = []
    for values, step in zip(plane.from_pixels(edge_x, edge_y), steps, strict=True):
        low, high = max(np.nanmin(values), -FARTHEST), min(np.nanmax(values), FARTHEST)
        ends.append(step * np.arange(int(np.floor(low / step)), int(np.ceil(high / step)) + 1))
    number = (down.stop - down.start) * (across.stop - across.start)
    if ends[0].size * ends[1].size > min(MOST_NODES, 4 * number + 10_000):  # a turned map fills half of its rectangle
        raise InputError(f"{raster.path}: {number} nodes would become {ends[0].size} x {ends[1].size} along x and y")
    return ends[0], ends[1]


def _on_grid(
    plane: Plane, x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Columns and rows of the nodes of a grid, by polynomials through some of them where these are exact enough."""
    from numpy.polynomial import chebyshev

    def scaled(values: NDArray[np.float64], along: NDArray[np.float64]) -> NDArray[np.float64]:
        return 2.0 * (values - along[0]) / (along[-1] - along[0]) - 1.0

    def spread(along: NDArray[np.float64], number: int) -> NDArray[np.float64]:
        angle = (np.arange(number) + 0.5) * np.pi / number
        return 0.5 * (along[0] + along[-1]) + 0.5 * (along[-1] - along[0]) * np.cos(angle)

    def vander(values: NDArray[np.float64], along: NDArray[np.float64]) -> NDArray[np.float64]:
        return chebyshev.chebvander(scaled(values, along), _LATTICE - 1)

    sample_x, sample_y = spread(x, _LATTICE), spread(y, _LATTICE)
    to_x, to_y = np.linalg.inv(vander(sample_x, x)), np.linalg.inv(vander(sample_y, y))
    test_x, test_y = spread(x, 12), spread(y, 12)
    exact, sampled = plane.to_pixels(*np.meshgrid(test_x, test_y)), plane.to_pixels(*np.meshgrid(sample_x, sample_y))
    found = []
    for values, truth in zip(sampled, exact, strict=True):
        c = to_y @ values @ to_x.T
        if not np.abs(vander(test_y, y) @ c @ vander(test_x, x).T - truth).max() < _CLOSE:
            rows = [plane.to_pixels(x, np.full_like(x, one)) for one in y]
            return np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
        found.append(vander(y, y) @ c @ vander(x, x).T)
    return found[0], found[1]


def _filled_rectangle(inside: NDArray[np.bool_], row: int, column: int) -> tuple[slice, slice]:
    """Rows and columns about a node, all of whose edges lie inside: the edge with most nodes outside goes first."""
    top, left, bottom, right = 0, 0, inside.shape[0] - 1, inside.shape[1] - 1
    while True:
        edges = {
            "top": (inside[top, left : right + 1], top < row),
            "bottom": (inside[bottom, left : right + 1], bottom > row),
            "left": (inside[top : bottom + 1, left], left < column),
            "right": (inside[top : bottom + 1, right], right > column),
        }
        worst = max(edges, key=lambda name: (not edges[name][0].all()) * (edges[name][1] + (~edges[name][0]).mean()))
        if edges[worst][0].all() or not edges[worst][1]:
            good = all(nodes.all() for nodes, _ in edges.values())
            return (slice(top, bottom + 1), slice(left, right + 1)) if good else (slice(0, 0), slice(0, 0))
        top, bottom = top + (worst == "top"), bottom - (worst == "bottom")
        left, right = left + (worst == "left"), right - (worst == "right")


def _bilinear(
    heights: NDArray[np.float64], column: NDArray[np.float64], row: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Heights at fractions of columns and rows; not a number where one that takes part is not."""
    i = np.clip(np.floor(column), 0, heights.shape[1] - 2).astype(np.int64)
    j = np.clip(np.floor(row), 0, heights.shape[0] - 2).astype(np.int64)
    u, v = column - i, row - j
    total = np.zeros_like(column)
    for down in (0, 1):
        for across in (0, 1):
            weight = (v if down else 1.0 - v) * (u if across else 1.0 - u)
            total += np.where(weight > _EDGE, weight * heights[j + down, i + across], 0.0)
    return total
