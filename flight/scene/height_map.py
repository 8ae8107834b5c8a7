"""Ground as a height map: a regular grid of nodes, bilinear between them."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.arguments import real_array, require_number
from flight.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

    from flight.kernels.terrain import Terrain


_LOWEST, _HIGHEST = -500.0, 9000.0  # m, of ground on Earth
_SMALLEST = 10.0  # m, of a map


@dataclass(frozen=True, eq=False, repr=False)
class HeightMap:
    """Heights of the ground at the nodes of a regular grid.

    Parameters
    ----------
    heights : (rows, columns) array
        z (m); rows run towards +y (north), the southernmost first, columns towards +x (east), two or more of each.
    step : float or (2,) floats
        Distance of the nodes (m), the same both ways or along x and y.
    corner : (2,) floats
        x and y of heights[0, 0] (m).
    datum : float, optional
        Height above sea level of z = 0 (m), of which a flight takes the air; None: not known, as at sea level.
    name : str
        For messages and reports.
    beyond : (rows, columns) bool, optional
        Nodes whose heights are not known; there the map counts as ended.
    facts : mapping
        How a file was read, in words.

    Raises
    ------
    InputError
        Not a grid of two by two nodes or more, smaller than 10 m, heights that are none on Earth, or nodes that are not
        numbers or masked.

    Notes
    -----
    The surface between four nodes is bilinear; a flight meets it exactly. Beyond the outermost nodes the ground goes on
    level, at the height of the nearest point of the map's edge.
    """

    heights: NDArray[np.float64]
    step: tuple[float, float]
    corner: tuple[float, float] = (0.0, 0.0)
    _: KW_ONLY
    datum: float | None = None
    name: str = "height map"
    beyond: NDArray[np.bool_] | None = None
    facts: Mapping[str, Any] = field(default_factory=dict)

    if TYPE_CHECKING:

        def __init__(
            self, heights: ArrayLike, step: float | tuple[float, float], corner: tuple[float, float] = (0.0, 0.0), *,
            datum: float | None = None, name: str = "height map", beyond: NDArray[np.bool_] | None = None,
            facts: Mapping[str, Any] | None = None,
        ) -> None: ...  # fmt: skip

    def __post_init__(self) -> None:
        name = self.name
        if np.iscomplexobj(self.heights):
            raise InputError(f"{name}: heights are complex; needed: metres as numbers")
        grid = real_array(name, "heights", self.heights, "m").copy()
        if np.ma.isMaskedArray(self.heights):
            grid[np.ma.getmaskarray(self.heights)] = np.nan
        if grid.ndim != 2 or min(grid.shape) < 2:
            raise InputError(f"{name}: heights have shape {grid.shape}, needed: two rows and two columns or more")
        steps = np.broadcast_to(real_array(name, "step", self.step, "m"), 2)
        if not (np.isfinite(steps).all() and (steps > 0.0).all()):
            raise InputError(f"{name}: step is {self.step}, needed: above zero (m)")
        corner = real_array(name, "corner", self.corner, "m", (2,))
        if self.datum is not None:
            require_number(name, "datum", self.datum, "m")
        _check_heights(grid, self.datum, name)
        lengths = [float(size * (number - 1)) for size, number in zip(steps, grid.shape[::-1], strict=True)]
        if min(lengths) < _SMALLEST:
            raise InputError(
                f"{name}: the map measures {lengths[0]:.4g} m by {lengths[1]:.4g} m; needed: {_SMALLEST:g} m or more "
                "both ways; are its coordinates metres?"
            )
        for key, value in (("heights", grid), ("step", steps), ("corner", corner)):
            object.__setattr__(self, key, value if key == "heights" else tuple(map(float, value)))

    def __repr__(self) -> str:
        rows, columns = self.heights.shape
        low, high = float(self.heights.min()), float(self.heights.max())
        return f"<flight.HeightMap {self.name!r}: {rows} x {columns} nodes, {low:.4g} to {high:.4g} m>"

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
    missing = np.argwhere(~np.isfinite(grid))
    if len(missing):
        row, column = missing[0]
        raise InputError(
            f"{name}: {len(missing)} of {grid.size} nodes have no height ({100.0 * len(missing) / grid.size:.3g} %), "
            f'the first in row {row} from the south, column {column}; cut the map, or fill them: holes = "neighbours"'
        )
