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

_STATIONS = 201
_DIRECTIONS = 144
_TOUCHING = 1e-6  # rounds that only touch do not overlap (m)


@dataclass(frozen=True)
class PlacedBody:
    """The outside of a round in space: profile, centre of the base (3,) (m), unit vector from base to nose (3,)."""

    profile: Profile
    base: NDArray[np.float64]
    axis: NDArray[np.float64]

    def surface(self) -> NDArray[np.float64]:
        """Points of the outer contour's surface, end faces included by their rims and centres, shape (n, 3) (m)."""
        even = np.linspace(0.0, self.profile.length, _STATIONS)
        station = np.unique(np.concatenate([even, self.profile.outer.stations]))
        radius = np.concatenate([self.profile.section(station).outer_radius, [0.0, 0.0]])
        station = np.concatenate([station, [0.0, self.profile.length]])
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
    """Largest depth (m) of one round's surface inside the other, on a fine net of points; 0 where they are apart."""
    deepest = max(float(first.depth(second.surface()).max()), float(second.depth(first.surface()).max()))
    return deepest if deepest > _TOUCHING else 0.0
