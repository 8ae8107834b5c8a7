"""Convex solids, known by how far they reach in any direction: pieces of a round, or the hull of a mesh's nodes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import ArrayLike, NDArray

    from burst_fenicsx.geometry.contour import Contour
    from burst_fenicsx.geometry.profile import Profile

    Vectors = NDArray[np.float64]

__all__ = ["Hull", "Revolved", "Solid", "solids_of_profile"]

CHORD_ERROR = 1e-7  # of an arc that bulges outwards, replaced by chords (m)
INNER_CHORD_ERROR = 1e-5  # of an arc that bulges inwards: each chord is a piece of its own


class Solid(Protocol):
    """A convex solid in space."""

    @property
    def centre(self) -> Vectors:
        """A point within it (m), shape (3,)."""

    @property
    def directions(self) -> Vectors:
        """Unit vectors that its shape prefers, shape (n, 3)."""

    def support(self, directions: Vectors) -> Vectors:
        """Greatest x . u over the solid (m) for unit vectors u, shape (n, 3)."""

    def support_point(self, direction: Vectors) -> Vectors:
        """A point of the solid (m) that lies farthest along a vector (3,)."""


@dataclass(frozen=True)
class Revolved:
    """A convex solid of revolution.

    Attributes
    ----------
    position : numpy.ndarray, shape (3,)
        Point of the axis from which heights count (m).
    axis : numpy.ndarray, shape (3,)
        Unit vector.
    heights, radii : numpy.ndarray, shape (n,)
        Meridian: heights along the axis, and radii there (m); straight in between.
    """

    position: Vectors
    axis: Vectors
    heights: Vectors
    radii: Vectors

    @property
    def centre(self) -> Vectors:
        """Centre of its part of the axis (m)."""
        middle: Vectors = self.position + 0.5 * (self.heights[0] + self.heights[-1]) * self.axis
        return middle

    @property
    def directions(self) -> Vectors:
        """The axis."""
        return self.axis[None, :]

    def support(self, directions: Vectors) -> Vectors:
        """Greatest x . u over the solid (m) for unit vectors u, shape (n, 3)."""
        along = directions @ self.axis
        across = np.linalg.norm(directions - along[:, None] * self.axis, axis=1)
        reach: Vectors = (np.outer(along, self.heights) + np.outer(across, self.radii)).max(axis=1)
        return directions @ self.position + reach

    def support_point(self, direction: Vectors) -> Vectors:
        """A point (m) that lies farthest along a vector (3,); on the axis where a whole disc does."""
        along = float(direction @ self.axis)
        outward = direction - along * self.axis
        across = float(np.linalg.norm(outward))
        flat = across <= 1e-14 * abs(along)
        best = int(np.argmax(along * self.heights + (0.0 if flat else across) * self.radii))
        point: Vectors = self.position + self.heights[best] * self.axis
        return point if flat else point + self.radii[best] / across * outward


@dataclass(frozen=True)
class Hull:
    """The convex hull of points (m), shape (n, 3), with the unit vector (3,) of its axis."""

    points: Vectors
    axis: Vectors

    @classmethod
    def of(cls, points: ArrayLike, axis: ArrayLike) -> Hull:
        """Hull of many points that do not lie in a plane; those within are dropped."""
        from scipy.spatial import ConvexHull

        places = np.asarray(points, dtype=np.float64)
        direction = np.asarray(axis, dtype=np.float64)
        return cls(places[ConvexHull(places).vertices], direction / np.linalg.norm(direction))

    @property
    def centre(self) -> Vectors:
        """Mean of the points (m)."""
        mean: Vectors = self.points.mean(axis=0)
        return mean

    @property
    def directions(self) -> Vectors:
        """The axis."""
        return self.axis[None, :]

    def support(self, directions: Vectors) -> Vectors:
        """Greatest x . u over the solid (m) for unit vectors u, shape (n, 3)."""
        greatest: Vectors = (directions @ self.points.T).max(axis=1)
        return greatest

    def support_point(self, direction: Vectors) -> Vectors:
        """A point (m) that lies farthest along a vector (3,)."""
        point: Vectors = self.points[int(np.argmax(self.points @ direction))]
        return point


def solids_of_profile(
    profile: Profile,
    position: Sequence[float],
    axis: Sequence[float],
    *,
    stations: ArrayLike | None = None,
    enlargement: float = 1.0,
) -> tuple[Revolved, ...]:
    """Convex pieces of a profile's outside; parameters as of `clearance.placed_body`."""
    base, direction = np.array(position, dtype=np.float64), np.array(axis, dtype=np.float64)
    direction /= np.linalg.norm(direction)
    place = np.asarray(stations, dtype=np.float64) if stations is not None else _chords(profile.outer)
    heights = (profile.length - place)[::-1]
    radii = enlargement * profile.outer.radius(place)[::-1]
    return tuple(
        Revolved(base, direction, heights[piece].copy(), radii[piece].copy()) for piece in _convex(heights, radii)
    )


def _chords(contour: Contour) -> Vectors:
    """Stations (m) between which the contour is straight, or curved by less than the error allowed."""
    found = [np.array(contour.stations[:1])]
    for (start, end), (low, high), arc in zip(
        pairwise(contour.stations), pairwise(contour.radii), contour.arcs, strict=True
    ):
        error = CHORD_ERROR if arc > 0.0 else INNER_CHORD_ERROR
        length = np.hypot(end - start, high - low)
        pieces = 1 if arc == 0.0 else int(np.ceil(1.1 * length / np.sqrt(8.0 * abs(arc) * error)))
        # Equal steps of the station are unequal steps of the arc where it is steep; half as many again make up for it.
        found.append(np.linspace(start, end, pieces + (pieces + 1) // 2 + 1 if arc else 2)[1:])
    return np.concatenate(found)


def _convex(heights: Vectors, radii: Vectors) -> Iterator[slice]:
    """Cut a meridian where it turns outwards, so that every piece is convex."""
    slopes = np.diff(radii) / np.diff(heights)
    start = 0
    for corner in range(1, len(slopes)):
        # Chords of an arc turn by more than this; a straight run's round-off turns it by less.
        if slopes[corner] > slopes[corner - 1] + 1e-9 * (1.0 + abs(slopes[corner])):
            yield slice(start, corner + 1)
            start = corner
    yield slice(start, len(heights))
