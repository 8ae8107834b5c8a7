"""The scene of a flight: ground, flat or a height map, and obstacles; checks of where fragments start."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flight.arguments import require_number
from flight.errors import InputError
from flight.scene.height_map import HeightMap
from flight.scene.obstacles import Obstacle, depth_in, pack_obstacles
from flight.scene.ricochet import Ricochet

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.fragments import Fragments
    from flight.kernels.terrain import Terrain


ON_THE_GROUND = 1e-9  # m above a map's surface at which a fragment on it starts, as LIFT in flight.kernels.impacts


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
            self._check_map(self.ground, position, what)
        self._check_obstacles(position, origin, what)

    @staticmethod
    def _check_map(ground: HeightMap, position: NDArray[np.float64], what: str) -> None:
        x, y = position[:, 0], position[:, 1]
        off = ~ground.contains(x, y)
        if off.any():
            first = int(np.argmax(off))
            raise InputError(
                f"{what}: {off.sum()} start off {ground.name}, {ground.extent()}; the first is number {first} at "
                f"x = {x[first]} m, y = {y[first]} m; is the map's site right?"
            )

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
