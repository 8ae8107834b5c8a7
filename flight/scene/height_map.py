"""Ground as a height map: a regular grid of nodes, bilinear between them."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from flight.arguments import real_array, require_number
from flight.errors import FlightWarning, InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from flight.kernels.terrain import Terrain

__all__ = ["HeightMap"]


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
    filled : int
        Nodes that had no height and were given one.

    Notes
    -----
    The surface between four nodes is bilinear; a flight meets it exactly. Beyond the outermost nodes the ground goes on
    level, at the height of the nearest point of the map's edge.
    """

    heights: NDArray[np.float64]
    step: tuple[float, float]
    corner: tuple[float, float] = (0.0, 0.0)
    name: str = "height map"
    filled: int = field(default=0, repr=False)

    def __init__(
        self,
        heights: ArrayLike,
        step: float | tuple[float, float],
        corner: tuple[float, float] = (0.0, 0.0),
        *,
        holes: Literal["refuse", "neighbours"] | float = "refuse",
        name: str = "height map",
    ) -> None:
        """Take an array of heights; nodes that are not numbers are holes.

        Parameters
        ----------
        heights : (rows, columns) array
            Heights (m), the southernmost row first.
        step : float or (2,) floats
            Distance of the nodes (m), the same both ways or along x and y.
        corner : (2,) floats
            x and y of the first node of the first row (m).
        holes : "refuse", "neighbours" or float
            What becomes of holes: an error, the mean of the neighbours from the rim inwards, or one height (m).
        name : str
            For messages.

        Raises
        ------
        InputError
            Not a grid of two by two nodes or more, or holes while `holes` is "refuse".
        """
        grid = real_array(name, "heights", heights, "m").copy()
        if grid.ndim != 2 or min(grid.shape) < 2:
            raise InputError(f"{name}: heights have shape {grid.shape}, needed: two rows and two columns or more")
        steps = np.broadcast_to(real_array(name, "step", step, "m"), 2)
        if not (np.isfinite(steps).all() and (steps > 0.0).all()):
            raise InputError(f"{name}: step is {step}, needed: above zero (m)")
        position = real_array(name, "corner", corner, "m")
        if position.shape != (2,) or not np.isfinite(position).all():
            raise InputError(f"{name}: corner is {corner}, needed: two finite numbers (m)")
        object.__setattr__(self, "filled", _fill(grid, holes, name))
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
        site: tuple[float, float] = (0.0, 0.0),
        datum: float | Literal["site"] = 0.0,
        holes: Literal["refuse", "neighbours"] | float = "refuse",
    ) -> HeightMap:
        """Read an ESRI ASCII grid (.asc) or a GeoTIFF (.tif, .tiff; needs the extra `terrain`).

        Parameters
        ----------
        path : path
            The file; its coordinates must be metres, x towards east and y towards north.
        site : (2,) floats
            The map's coordinates (easting, northing) of x = y = 0 (m).
        datum : float or "site"
            The map's height of z = 0 (m); "site": its height at the site, so that the ground there is z = 0.
        holes : "refuse", "neighbours" or float
            As above; the one height is in z.

        Raises
        ------
        InputError
            The file cannot be read, is not in metres, or has holes that are refused.
        """
        from flight.files.height_map import read_grid

        path = Path(path)
        position = real_array(str(path), "site", site, "m")
        if position.shape != (2,) or not np.isfinite(position).all():
            raise InputError(f"{path}: site is {site}, needed: two finite numbers (m)")
        grid = read_grid(path)
        corner = (grid.corner[0] - site[0], grid.corner[1] - site[1])
        if datum == "site":
            hole = ~np.isfinite(grid.heights)  # elsewhere it does not matter here
            raw = cls(np.where(hole, 0.0, grid.heights), grid.step, corner, name=str(path))
            if not raw.contains(0.0, 0.0).all():
                raise InputError(f"{path}: the site {site} lies off the map, {raw.extent(site)}")
            zero = float(raw.at(0.0, 0.0))
            if cls(hole, grid.step, corner).at(0.0, 0.0) > 0.0:
                raise InputError(f"{path}: the map has a hole at the site {site}; give datum as a height (m)")
        else:
            require_number(str(path), 'datum other than "site"', datum, "m")
            zero = float(datum)
            if not math.isfinite(zero):
                raise InputError(f'{path}: datum is {datum}, needed: a finite height (m) or "site"')
        return cls(grid.heights - zero, grid.step, corner, holes=holes, name=str(path))

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
        return np.minimum(*distances)

    def contains(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.bool_]:
        """Whether positions lie on the map, its edges included."""
        x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
        (west, south), (east, north) = self.corner, self.end
        return np.asarray((x >= west) & (x <= east) & (y >= south) & (y <= north))

    def at(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
        """Heights (m) at positions; off the map that of the nearest point of its edge."""
        rows, columns = self.heights.shape
        u = np.clip((np.asarray(x, dtype=np.float64) - self.corner[0]) / self.step[0], 0.0, columns - 1.0)
        v = np.clip((np.asarray(y, dtype=np.float64) - self.corner[1]) / self.step[1], 0.0, rows - 1.0)
        i, j = np.clip(np.floor(u), 0, columns - 2).astype(int), np.clip(np.floor(v), 0, rows - 2).astype(int)
        u, v, h = u - i, v - j, self.heights
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


def _fill(grid: NDArray[np.float64], holes: str | float, name: str) -> int:
    """Fill the holes in place; returns their number."""
    missing = ~np.isfinite(grid)
    number = int(missing.sum())
    if isinstance(holes, str) and holes not in ("refuse", "neighbours"):
        raise InputError(f'{name}: holes is {holes!r}, allowed: "refuse", "neighbours" or a height (m)')
    if number == 0:
        return 0
    share = f"{number} of {grid.size} nodes have no height ({100.0 * number / grid.size:.3g} %)"
    if holes == "refuse":
        row, column = (int(index) for index in np.argwhere(missing)[0])
        raise InputError(
            f"{name}: {share}, the first in row {row} from the south, column {column}; "
            'cut the map, or fill them: holes = "neighbours", or one height'
        )
    if number == grid.size:
        raise InputError(f"{name}: no node has a height")
    if isinstance(holes, str):
        _fill_from_rim(grid, missing)
        words = "they were filled from their neighbours"
    else:
        if not math.isfinite(holes):
            raise InputError(f"{name}: holes is {holes}, needed: a finite height (m)")
        grid[missing] = holes
        words = f"they were set to {holes:g} m"
    warnings.warn(f"{name}: {share}; {words}", FlightWarning, stacklevel=4)
    return number


def _fill_from_rim(grid: NDArray[np.float64], missing: NDArray[np.bool_]) -> None:
    """Give the holes, from the rim inwards, the mean of those of their eight neighbours that have a height."""
    while missing.any():
        known = np.pad(~missing, 1).astype(np.float64)
        value = np.pad(np.where(missing, 0.0, grid), 1)
        rows, columns = grid.shape
        windows = [(slice(a, a + rows), slice(b, b + columns)) for a in range(3) for b in range(3)]
        count, total = sum(known[w] for w in windows), sum(value[w] for w in windows)
        rim = missing & (np.asarray(count) > 0)
        grid[rim] = np.asarray(total)[rim] / np.asarray(count)[rim]
        missing &= ~rim
