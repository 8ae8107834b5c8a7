"""The scene of a flight: ground, flat or a height map, and obstacles; checks of where fragments start.

A height map is a regular grid of nodes, bilinear between them.
"""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.arguments import real_array, require_number
from flight.errors import InputError
from flight.scene.obstacles import Obstacle, depth_in, pack_obstacles
from flight.scene.ricochet import Ricochet

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

    from flight.fragments import Fragments
    from flight.kernels.terrain import Terrain


ON_THE_GROUND = 1e-9  # m above a map's surface at which a fragment on it starts, as LIFT in flight.kernels.events


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


@dataclass(frozen=True, eq=False)
class Scene:
    """The ground (height in m, map, or None), how fragments ricochet off it (None: not at all), and the obstacles."""

    ground: float | HeightMap | None = 0.0
    ricochet: Ricochet | None = None
    obstacles: tuple[Obstacle, ...] = ()

    @property
    def ricochets(self) -> bool:
        """Whether any flight goes on after an impact."""
        return (self.ricochet is not None and self.ground is not None) or any(
            Ricochet.of(obstacle.ricochet) is not None for obstacle in self.obstacles
        )

    @property
    def flat_height(self) -> float:
        """Height of flat ground (m); not a number where there is a map or no ground."""
        return math.nan if self.ground is None or isinstance(self.ground, HeightMap) else float(self.ground)

    def ground_at(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Heights of the ground (n,) in m, None where there is none."""
        if isinstance(self.ground, HeightMap):
            return np.asarray(self.ground.at(x, y))
        return None if self.ground is None else np.full(len(x), float(self.ground))

    def height_at(self, x: float, y: float) -> float:
        """Height of the ground (m), zero where there is none."""
        found = self.ground_at(np.array([x], dtype=np.float64), np.array([y], dtype=np.float64))
        return 0.0 if found is None else float(found[0])

    def terrain(self) -> Terrain | None:
        """The map for the kernels; none where the ground is flat, or there is none."""
        return self.ground.table() if isinstance(self.ground, HeightMap) else None

    def obstacle_rows(self) -> NDArray[np.float64]:
        """The obstacles for the kernels."""
        lowest = float(self.ground.heights.min()) if isinstance(self.ground, HeightMap) else self.ground
        return pack_obstacles(self.obstacles, lowest, self.ground_at)

    def surfaces(self) -> NDArray[np.float64]:
        """How fragments ricochet off the ground, then off each obstacle."""
        return Ricochet.table([self.ricochet, *(Ricochet.of(obstacle.ricochet) for obstacle in self.obstacles)])

    def lifted(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Places at which fragments start: those on a map's surface just above it."""
        if not isinstance(self.ground, HeightMap):
            return position
        lifted = position.copy()
        lifted[:, 2] = np.maximum(lifted[:, 2], self.ground.at(position[:, 0], position[:, 1]) + ON_THE_GROUND)
        return lifted

    def check(self, fragments: Fragments, origin: tuple[float, float]) -> None:
        """Refuse what cannot be flown: fragments below the ground, off the map, in an obstacle; an origin in one."""
        if self.ground is not None and not isinstance(self.ground, HeightMap):
            require_number("fly", "ground", self.ground, "m", finite=True)
        self.check_places(fragments.position, origin, "fragments")
        if isinstance(self.ground, HeightMap):
            height = self.ground.at(fragments.position[:, 0], fragments.position[:, 1])
            self._check_above(fragments, height, f"of {self.ground.name}")
        elif self.ground is not None:
            self._check_above(fragments, np.full(len(fragments), float(self.ground)), f"at {self.ground} m")

    def check_places(self, position: NDArray[np.float64], origin: tuple[float, float], what: str) -> None:
        """Refuse places (n, 3) off the map or in an obstacle, and an origin in one; `what` stands there."""
        if isinstance(self.ground, HeightMap):
            x, y = position[:, 0], position[:, 1]
            off = ~self.ground.contains(x, y)
            if off.any():
                first = int(np.argmax(off))
                raise InputError(
                    f"{what}: {off.sum()} start off {self.ground.name}, {self.ground.extent()}; the first is number "
                    f"{first} at x = {x[first]} m, y = {y[first]} m; is the map's site right?"
                )
        self._check_obstacles(position, origin, what)

    @staticmethod
    def _check_above(fragments: Fragments, ground: NDArray[np.float64], which: str) -> None:
        below = fragments.position[:, 2] < ground
        if below.any():
            first = int(np.argmax(below))
            raise InputError(
                f"fragments: {int(below.sum())} start below the ground {which}, the first is fragment {first} at "
                f"z = {fragments.position[first, 2]} m where the ground is at {ground[first]} m; "
                "raise the rounds or lower the ground"
            )

    def _check_obstacles(self, position: NDArray[np.float64], origin: tuple[float, float], what: str) -> None:
        if not self.obstacles:
            return
        rows = self.obstacle_rows()
        for index, obstacle in enumerate(self.obstacles):
            own = rows[rows[:, 0] == index]
            inside = np.flatnonzero((depth_in(own, position) > 0.0).any(axis=1))
            if inside.size:
                raise InputError(
                    f"obstacle {obstacle.name}: {inside.size} {what} start inside it, the first is number {inside[0]} "
                    f"at {tuple(position[inside[0]].round(3).tolist())} m; move the obstacle off the rounds"
                )
            at_origin = np.array([[*origin, self.height_at(*origin)]])
            if self.ground is not None and (depth_in(own, at_origin) > 0.0).any():
                place = (float(origin[0]), float(origin[1]))
                raise InputError(
                    f"obstacle {obstacle.name}: it stands on the origin {place} m, from which distances are "
                    "counted; move the obstacle, or the origin"
                )
