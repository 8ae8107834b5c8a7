"""Ground as a height map: a regular grid of nodes, bilinear between them; its holes filled from their rims."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from flight.arguments import real_array, require_number
from flight.errors import FlightWarning, InputError
from fragfield_base.errors import names_allowed

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import ArrayLike, NDArray

    from flight.files.height_map import Grid
    from flight.kernels.terrain import Terrain

    Indices = NDArray[np.int64]


_LOWEST, _HIGHEST = -500.0, 9000.0  # m, of ground on Earth
_SMALLEST = 10.0  # m, of a map


@dataclass(frozen=True, eq=False, repr=False)
class HeightMap:
    """Heights of the ground at the nodes of a regular grid.

    Attributes
    ----------
    heights : (rows, columns) float64
        z (m); rows run towards +y (north), columns towards +x (east), two or more of each.
    step : (2,) floats
        Distance of the columns and of the rows (m).
    corner : (2,) floats
        x and y of heights[0, 0] (m).
    name : str
        For messages and reports.
    datum : float or None
        Height above sea level of z = 0 (m), of which a flight takes the air; None: not known, as at sea level.
    filled : int
        Nodes that had no height and were given one.
    beyond : (rows, columns) bool or None
        Filled nodes of holes that are wide or reach the map's edge; there the map counts as ended.
    facts : mapping
        How a file was read, in words: `format`, `crs`, `plan_unit`, `height_unit`, `vertical`, `north`, `position`,
        and a list of `notes`; empty for an array.

    Notes
    -----
    The surface between four nodes is bilinear; a flight meets it exactly. Beyond the outermost nodes the ground goes on
    level, at the height of the nearest point of the map's edge.
    """

    heights: NDArray[np.float64]
    step: tuple[float, float]
    corner: tuple[float, float] = (0.0, 0.0)
    name: str = "height map"
    datum: float | None = None
    filled: int = field(default=0, repr=False)
    beyond: NDArray[np.bool_] | None = None
    facts: Mapping[str, Any] = field(default_factory=dict)

    def __init__(
        self,
        heights: ArrayLike,
        step: float | tuple[float, float],
        corner: tuple[float, float] = (0.0, 0.0),
        *,
        datum: float | None = None,
        holes: Literal["refuse", "neighbours"] | float = "refuse",
        name: str = "height map",
    ) -> None:
        """Take an array of heights; nodes that are not numbers, and those a masked array masks, are holes.

        Parameters
        ----------
        heights : (rows, columns) array
            Heights (m), the southernmost row first.
        step : float or (2,) floats
            Distance of the nodes (m), the same both ways or along x and y.
        corner : (2,) floats
            x and y of the first node of the first row (m).
        datum : float, optional
            Height above sea level of z = 0 (m).
        holes : "refuse", "neighbours" or float
            What becomes of holes: an error, the mean of the neighbours from the rim inwards, or one height (m). Of
            neighbours, holes wider than 30 m and four nodes, and those that reach the edge, count as beyond the map.
        name : str
            For messages.

        Raises
        ------
        InputError
            Not a grid of two by two nodes or more, smaller than 10 m, heights that are none on Earth, or holes while
            `holes` is "refuse".
        """
        if np.iscomplexobj(heights):
            raise InputError(f"{name}: heights are complex; needed: metres as numbers")
        grid = real_array(name, "heights", heights, "m").copy()
        if np.ma.isMaskedArray(heights):
            grid[np.ma.getmaskarray(heights)] = np.nan
        if grid.ndim != 2 or min(grid.shape) < 2:
            raise InputError(f"{name}: heights have shape {grid.shape}, needed: two rows and two columns or more")
        steps = np.broadcast_to(real_array(name, "step", step, "m"), 2)
        if not (np.isfinite(steps).all() and (steps > 0.0).all()):
            raise InputError(f"{name}: step is {step}, needed: above zero (m)")
        real_array(name, "corner", corner, "m", (2,))
        if datum is not None:
            require_number(name, "datum", datum, "m")
        _check_heights(grid, datum, name)
        filled, beyond = _fill(grid, holes, name, (float(steps[0]), float(steps[1])))
        lengths = [float(size * (number - 1)) for size, number in zip(steps, grid.shape[::-1], strict=True)]
        if min(lengths) < _SMALLEST:
            raise InputError(
                f"{name}: the map measures {lengths[0]:.4g} m by {lengths[1]:.4g} m; needed: {_SMALLEST:g} m or more "
                "both ways; are its coordinates metres?"
            )
        object.__setattr__(self, "datum", None if datum is None else float(datum))
        object.__setattr__(self, "filled", filled)
        object.__setattr__(self, "beyond", beyond)
        object.__setattr__(self, "facts", {})
        object.__setattr__(self, "heights", grid)
        object.__setattr__(self, "step", (float(steps[0]), float(steps[1])))
        object.__setattr__(self, "corner", (float(corner[0]), float(corner[1])))
        object.__setattr__(self, "name", name)

    def __repr__(self) -> str:
        rows, columns = self.heights.shape
        low, high = float(self.heights.min()), float(self.heights.max())
        return f"<flight.HeightMap {self.name!r}: {rows} x {columns} nodes, {low:.4g} to {high:.4g} m>"

    @classmethod
    def read(
        cls,
        path: str | Path,
        *,
        site: tuple[float, float] | None = None,
        earth: tuple[float, float, float] | None = None,
        datum: float | Literal["site"] = 0.0,
        holes: Literal["refuse", "neighbours"] | float = "refuse",
        band: int | None = None,
        height_unit: Literal["m", "ft", "us_ft"] | None = None,
    ) -> HeightMap:
        """Read an ESRI ASCII grid (.asc) or, with the extra `terrain`, a GeoTIFF (.tif), .hgt, .dt0 to .dt2 or .img.

        Parameters
        ----------
        path : path
            The file; what it says of units, scale, masks and coordinates is followed, or refused by name.
        site : (2,) floats, optional
            Easting and northing, in the map's grid, of x = y = 0 (m). Left out: by `earth`, else (0, 0), of a map in
            degrees its centre.
        earth : (3,) floats, optional
            Latitude and longitude (WGS 84) of x = y = 0, and bearing of +x (degrees): x and y are then metres on the
            ground from there. Without it +x is the map's grid east.
        datum : float or "site"
            The map's height of z = 0 (m); "site": its height at the site, so that the ground there is z = 0.
        holes : "refuse", "neighbours" or float
            As above; the one height is in z.
        band : int, optional
            Of a file with several.
        height_unit : "m", "ft" or "us_ft", optional
            Of a file that does not state it.

        Raises
        ------
        InputError
            The file cannot be read as heights in metres, or has holes that are refused.

        Notes
        -----
        A map is read up to 25 km from x = y = 0 along x and y. Its own nodes are kept where x and y are its own
        coordinates, else heights are interpolated at nodes as far apart.
        """
        from flight.files.height_map import read_grid
        from flight.files.raster import HEIGHT_UNITS

        path = Path(path)
        for place, found, size, unit in (("site", site, 2, "m"), ("earth", earth, 3, "degrees")):
            if found is not None:
                real_array(str(path), place, found, unit, (size,))
        if height_unit is not None and height_unit not in HEIGHT_UNITS:
            raise InputError(f"{path}: height_unit is {height_unit!r}{names_allowed(str(height_unit), HEIGHT_UNITS)}")
        grid = read_grid(path, site, earth, band, height_unit)
        _check_heights(grid.heights, 0.0, str(path))
        if datum == "site":
            zero = _height_at_site(grid, path, site)
        else:
            require_number(str(path), 'datum other than "site"', datum, "m", finite=True)
            zero = float(datum)
        made = cls(grid.heights - zero, grid.step, grid.corner, datum=zero, holes=holes, name=str(path))
        object.__setattr__(made, "facts", grid.facts)
        return made

    @property
    def end(self) -> tuple[float, float]:
        """Place (x, y) of the last node of the last row (m)."""
        rows, columns = self.heights.shape
        return self.corner[0] + (columns - 1) * self.step[0], self.corner[1] + (rows - 1) * self.step[1]

    def extent(self, site: tuple[float, float] = (0.0, 0.0)) -> str:
        """The map's edges in words."""
        (west, south), (east, north) = self.corner, self.end
        return (
            f"which reaches from {west + site[0]:g} to {east + site[0]:g} m along x and from {south + site[1]:g} to "
            f"{north + site[1]:g} m along y"
        )

    def reach(self, origin: tuple[float, float], azimuth: ArrayLike) -> NDArray[np.float64]:
        """Distances (m) from an origin on the map to its edge at azimuths (degrees from +x)."""
        turn = np.radians(np.asarray(azimuth, dtype=np.float64))
        distances = []
        for way, low, high, start in zip((np.cos(turn), np.sin(turn)), self.corner, self.end, origin, strict=True):
            with np.errstate(divide="ignore", invalid="ignore"):
                along = np.where(way > 0.0, (high - start) / way, (low - start) / way)
            distances.append(np.where(np.abs(way) < 1e-12, np.inf, along))
        edge = np.minimum(*distances)
        return edge if self.beyond is None else self._known(origin, turn, edge)

    def _known(
        self, origin: tuple[float, float], turn: NDArray[np.float64], edge: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Distances (m), up to `edge`, before the ground is a hole that ends the map."""
        assert self.beyond is not None
        rows, columns = self.heights.shape
        reached = []
        for one, end in zip(np.atleast_1d(turn), np.atleast_1d(edge), strict=True):
            along = np.arange(0.0, end, 0.5 * min(self.step))
            i = np.rint((origin[0] + along * np.cos(one) - self.corner[0]) / self.step[0]).astype(int)
            j = np.rint((origin[1] + along * np.sin(one) - self.corner[1]) / self.step[1]).astype(int)
            hidden = self.beyond[np.clip(j, 0, rows - 1), np.clip(i, 0, columns - 1)]
            reached.append(along[np.argmax(hidden)] if hidden.any() else end)
        return np.reshape(reached, np.shape(edge))

    def contains(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.bool_]:
        """Whether positions lie on the map, its edges included, and not in a hole that ends it."""
        x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
        (west, south), (east, north) = self.corner, self.end
        inside = np.asarray((x >= west) & (x <= east) & (y >= south) & (y <= north))
        if self.beyond is None:
            return inside
        i, j, _, _ = self._cells(x, y)
        hidden = self.beyond[j, i] | self.beyond[j, i + 1] | self.beyond[j + 1, i] | self.beyond[j + 1, i + 1]
        return np.asarray(inside & ~hidden)

    def _cells(self, x: ArrayLike, y: ArrayLike) -> tuple[Any, Any, Any, Any]:
        """Columns and rows of the cells of positions, and fractions within them."""
        rows, columns = self.heights.shape
        u = np.clip((np.asarray(x, dtype=np.float64) - self.corner[0]) / self.step[0], 0.0, columns - 1.0)
        v = np.clip((np.asarray(y, dtype=np.float64) - self.corner[1]) / self.step[1], 0.0, rows - 1.0)
        i, j = np.clip(np.floor(u), 0, columns - 2).astype(int), np.clip(np.floor(v), 0, rows - 2).astype(int)
        return i, j, u - i, v - j

    def at(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
        """Heights (m) at positions; off the map that of the nearest point of its edge."""
        (i, j, u, v), h = self._cells(x, y), self.heights
        return np.asarray(
            (1 - v) * ((1 - u) * h[j, i] + u * h[j, i + 1]) + v * ((1 - u) * h[j + 1, i] + u * h[j + 1, i + 1])
        )

    def table(self) -> Terrain:
        """The map for the kernels, with the greatest heights of its cells and of blocks of them.

        A ring of cells that are level outward is added; the kernels continue the outermost cells beyond it.
        """
        from flight.kernels.terrain import Terrain

        h = np.pad(self.heights, 1, mode="edge")
        west, south = self.corner[0] - self.step[0], self.corner[1] - self.step[1]
        level = np.maximum(np.maximum(h[:-1, :-1], h[1:, :-1]), np.maximum(h[:-1, 1:], h[1:, 1:]))
        blocks, rows, first = [], [], 0
        while True:
            blocks.append(level.ravel())
            rows.append((first, *level.shape))
            first += level.size
            if level.size == 1:
                break
            even = np.pad(level, [(0, n % 2) for n in level.shape], constant_values=-np.inf)
            level = even.reshape(even.shape[0] // 2, 2, even.shape[1] // 2, 2).max(axis=(1, 3))
        return Terrain(
            h, west, south, *self.step, np.concatenate(blocks), np.array(rows, dtype=np.int64), float(h.max())
        )


def _height_at_site(grid: Grid, path: Path, site: tuple[float, float] | None) -> float:
    place = "" if site is None else f" {site}"
    hole = ~np.isfinite(grid.heights)  # elsewhere it does not matter here
    raw = HeightMap(np.where(hole, 0.0, grid.heights), grid.step, grid.corner, name=str(path))
    if not raw.contains(0.0, 0.0).all():
        raise InputError(f"{path}: the site {site or (0.0, 0.0)} lies off the map, {raw.extent(site or (0.0, 0.0))}")
    if HeightMap(hole, grid.step, grid.corner).at(0.0, 0.0) > 0.0:
        raise InputError(f"{path}: the map has a hole at the site{place}; give datum as a height (m)")
    return float(raw.at(0.0, 0.0))


def _check_heights(grid: NDArray[np.float64], datum: float | None, name: str) -> None:
    """Refuse heights that no ground on Earth has, as undeclared sentinels; of a map whose datum is not known too."""
    low, high = (_LOWEST - _HIGHEST, _HIGHEST - _LOWEST) if datum is None else (_LOWEST, _HIGHEST)
    zero = datum or 0.0
    with np.errstate(invalid="ignore"):
        wrong = (grid + zero < low) | (grid + zero > high)
    if wrong.any():
        first = float(grid[wrong][0]) + zero
        raise InputError(
            f"{name}: {int(wrong.sum())} of {grid.size} heights are beyond {low:g} to {high:g} m, the first is "
            f"{first:.9g} m; nodes without a height must be declared as such (nodata, a mask, NaN)"
        )


def _fill(
    grid: NDArray[np.float64], holes: str | float, name: str, step: tuple[float, float]
) -> tuple[int, NDArray[np.bool_] | None]:
    """Fill the holes in place; returns their number, and which nodes belong to holes that end the map."""
    missing = ~np.isfinite(grid)
    number = int(missing.sum())
    if isinstance(holes, str) and holes not in ("refuse", "neighbours"):
        raise InputError(f'{name}: holes is {holes!r}, allowed: "refuse", "neighbours" or a height (m)')
    if number == 0:
        return 0, None
    share = f"{number} of {grid.size} nodes have no height ({100.0 * number / grid.size:.3g} %)"
    if holes == "refuse":
        row, column = (int(index) for index in np.argwhere(missing)[0])
        raise InputError(
            f"{name}: {share}, the first in row {row} from the south, column {column}; "
            'cut the map, or fill them: holes = "neighbours", or one height'
        )
    if number == grid.size:
        raise InputError(f"{name}: no node has a height")
    beyond = None
    if isinstance(holes, str):
        beyond = fill_holes(grid, step)
        words = "they were filled from their neighbours"
        if beyond is not None:
            words += f"; {int(beyond.sum())} of them, in wide holes or at the map's edge, count as beyond the map"
    else:
        require_number(name, "holes", holes, "m", finite=True)
        grid[missing] = holes
        words = f"they were set to {holes:g} m"
    warnings.warn(f"{name}: {share}; {words}", FlightWarning, stacklevel=4)
    return number, beyond


_AROUND = [(j, i) for j in (-1, 0, 1) for i in (-1, 0, 1) if (j, i) != (0, 0)]
_NARROW, _NARROW_NODES = 30.0, 4  # m, and nodes: a hole as wide as one of them is known by its rim


def fill_holes(grid: NDArray[np.float64], step: tuple[float, float]) -> NDArray[np.bool_] | None:
    """Fill the holes in place: from the rim inwards the mean of those of eight neighbours that have a height.

    `grid` (rows, columns) holds heights (m), not finite in holes, one at least finite; its columns and rows are `step`
    (m) apart. Returned are the nodes of holes that reach the map's edge, or are wider than 30 m and four nodes, as what
    is filled in there is no knowledge; None without such holes.
    """
    missing = ~np.isfinite(grid)
    beyond = _unknown(missing, step)
    grid[missing] = 0.0
    j, i = np.nonzero(missing)
    while len(j):
        total, count = np.zeros(len(j)), np.zeros(len(j))
        for down, across in _AROUND:
            there = (j + down >= 0) & (j + down < grid.shape[0]) & (i + across >= 0) & (i + across < grid.shape[1])
            known = np.zeros(len(j), dtype=bool)
            known[there] = ~missing[j[there] + down, i[there] + across]
            total[known] += grid[j[known] + down, i[known] + across]
            count += known
        rim = count > 0
        grid[j[rim], i[rim]] = total[rim] / count[rim]
        missing[j[rim], i[rim]] = False
        j, i = j[~rim], i[~rim]
    return beyond


def _unknown(missing: NDArray[np.bool_], step: tuple[float, float]) -> NDArray[np.bool_] | None:
    """Nodes of the holes that are too wide, or open to the edge."""
    j, i = np.nonzero(missing)
    number = np.full(missing.shape, -1, dtype=np.int64)
    number[j, i] = np.arange(len(j))
    hole = _components(len(j), list(_links(number, j, i)))
    wide = np.zeros(len(j), dtype=bool)
    for index, size, last in ((i, step[0], missing.shape[1] - 1), (j, step[1], missing.shape[0] - 1)):
        low, high = np.full(len(j), last), np.zeros(len(j), dtype=np.int64)
        np.minimum.at(low, hole, index)
        np.maximum.at(high, hole, index)
        nodes = high - low + 1
        wide |= (low == 0) | (high == last) | ((nodes > _NARROW_NODES) & (nodes * size > _NARROW))
    if not wide[hole].any():
        return None
    beyond = np.zeros(missing.shape, dtype=bool)
    beyond[j, i] = wide[hole]
    return beyond


def _links(number: Indices, j: Indices, i: Indices) -> Iterator[tuple[Indices, Indices]]:
    """Pairs of neighbouring nodes of holes, each once."""
    for down, across in ((0, 1), (1, -1), (1, 0), (1, 1)):
        there = (j + down < number.shape[0]) & (i + across >= 0) & (i + across < number.shape[1])
        other = number[j[there] + down, i[there] + across]
        yield np.flatnonzero(there)[other >= 0], other[other >= 0]


def _components(size: int, links: list[tuple[Indices, Indices]]) -> Indices:
    """The first node of each node's hole: labels are lowered along the links and shortened until they stand."""
    label = np.arange(size)
    one, other = (np.concatenate(ends) for ends in zip(*links, strict=True))
    while len(one):
        low, high = np.minimum(label[one], label[other]), np.maximum(label[one], label[other])
        np.minimum.at(label, high, low)
        while not np.array_equal(shorter := label[label], label):
            label = shorter
        apart = label[one] != label[other]
        one, other = one[apart], other[apart]
    return label
