"""Rounds as bodies of revolution in space, and how deep one reaches into another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Profile
    from fragfield.case.round_table import RoundTable

__all__ = ["PlacedBody", "deepest_overlap", "placed_body"]

_STATIONS = 101
_DIRECTIONS = 72
_SHELLS = (1.0, 0.75, 0.5, 0.25, 0.0)  # shares of the outer radius at which points lie
_TOUCHING = 1e-6  # rounds that only touch do not overlap (m)


@dataclass(frozen=True)
class PlacedBody:
    """The outside of a round in space: profile, centre of the base (3,) (m), unit vector from base to nose (3,)."""

    profile: Profile
    base: NDArray[np.float64]
    axis: NDArray[np.float64]

    @property
    def lowest(self) -> float:
        """Height z of the lowest point (m)."""
        return float(self.points()[:, 2].min())

    def points(self) -> NDArray[np.float64]:
        """Points of the surface and of the inside down to the axis, shape (n, 3) (m)."""
        even = np.linspace(0.0, self.profile.length, _STATIONS)
        station = np.unique(np.concatenate([even, self.profile.outer.stations]))
        radius = np.outer(_SHELLS, self.profile.section(station).outer_radius).ravel()
        station = np.tile(station, len(_SHELLS))
        angle = np.linspace(0.0, 2.0 * np.pi, _DIRECTIONS, endpoint=False)
        across = np.linalg.svd(self.axis[None, :])[2][1:]
        circle = np.cos(angle)[:, None] * across[0] + np.sin(angle)[:, None] * across[1]
        along = self.base + (self.profile.length - station)[:, None] * self.axis
        return np.asarray((along[:, None, :] + radius[:, None, None] * circle[None]).reshape(-1, 3))

    def depth(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """How deep points (n, 3) lie inside, radially or to the nearer end face; not positive outside (m)."""
        relative = points - self.base
        height = relative @ self.axis
        station = self.profile.length - height
        within = np.minimum(station, height)
        radius = self.profile.section(np.clip(station, 0.0, self.profile.length)).outer_radius
        distance = np.linalg.norm(relative - height[:, None] * self.axis, axis=1)
        return np.asarray(np.minimum(radius - distance, within))


def placed_body(entry: RoundTable) -> PlacedBody:
    """Body of a resolved round that has a profile."""
    from burst_fenicsx.geometry import profile_from_table

    assert isinstance(entry.profile, dict)  # resolved
    axis = np.array(entry.axis, dtype=np.float64)
    return PlacedBody(
        profile_from_table(entry.profile, where=entry.name), np.array(entry.position), axis / np.linalg.norm(axis)
    )


def deepest_overlap(first: PlacedBody, second: PlacedBody) -> float:
    """Thickness (m) of what two rounds have in common, on a fine net of points; 0 where they are apart or touch."""
    points = np.concatenate([first.points(), second.points()])
    in_first, in_second = first.depth(points), second.depth(points)
    common = (in_first > -_TOUCHING) & (in_second > -_TOUCHING)
    deepest = float((in_first + in_second)[common].max(initial=0.0))
    return deepest if deepest > _TOUCHING else 0.0
