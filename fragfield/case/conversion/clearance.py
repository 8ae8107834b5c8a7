"""The clear distance between rounds in space, and their heights over planes; negative where they overlap.

The outside of one round is sampled, finer and finer around the nearest points; how far each point lies from the other
round is exact. For rounds with a profile the clear distance is found within 0.1 mm (usually 1e-6 m). Where rounds
overlap it is minus the depth at which the deepest point of either lies within the other, as found by the samples.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from burst_fenicsx.geometry import Contour, Profile

Vectors = NDArray[np.float64]


ALIKE = 1e-9  # distances that differ by less are equal, and the first pair counts (m)
_CHORD_ERROR = 1e-6  # of an arc replaced by chords (m)
_SPACING = 10e-3  # of samples along a meridian or an edge (m)
_CORNER = 0.05  # rad, the turn of a meridian from which its corner is a sample
_ANGLES = 72
_STARTS = 5  # samples around which one looks closer
_FINEST = 1e-7  # m


@dataclass(frozen=True)
class Revolved:
    """A solid of revolution."""

    position: Vectors
    """numpy.ndarray, shape (3,): point of the axis from which heights count (m)."""
    axis: Vectors
    """numpy.ndarray, shape (3,): unit vector."""
    heights: Vectors
    radii: Vectors
    """numpy.ndarray, shape (n,): meridian: rising heights along the axis, and radii there (m); straight in between."""

    @property
    def centre(self) -> Vectors:
        """Centre of its part of the axis (m)."""
        middle: Vectors = self.position + 0.5 * (self.heights[0] + self.heights[-1]) * self.axis
        return middle

    def reach(self, direction: ArrayLike) -> tuple[float, float]:
        """Minimum and maximum of x . u over the body (m) for a unit vector u (3,): its extent, or its heights."""
        unit = np.asarray(direction, dtype=np.float64)
        along = float(unit @ self.axis)
        wide = float(np.linalg.norm(unit - along * self.axis)) * self.radii
        foot = float(unit @ self.position)
        return foot + float((along * self.heights - wide).min()), foot + float((along * self.heights + wide).max())

    def distances(self, points: Vectors) -> Vectors:
        """Distances (n,) of points (n, 3) from the body (m), negative within it, by the lines of its meridian."""
        from_base = points - self.position
        z = from_base @ self.axis
        r = np.linalg.norm(from_base - z[:, None] * self.axis, axis=1)
        (r0, z0), (dr, dz) = self._outline[:-1].T, np.diff(self._outline, axis=0).T
        from_r, from_z = r[:, None] - r0, z[:, None] - z0
        along = np.clip((from_r * dr + from_z * dz) / np.maximum(dr * dr + dz * dz, 1e-300), 0.0, 1.0)
        square = ((from_r - along * dr) ** 2 + (from_z - along * dz) ** 2).min(axis=1)
        inside = (z > self.heights[0]) & (z < self.heights[-1]) & (r < np.interp(z, self.heights, self.radii))
        found: Vectors = np.where(inside, -1.0, 1.0) * np.sqrt(square)
        return found

    def nearest_to(self, other: Body) -> float:
        """Smallest distance from another body of samples of its surface and its axis (m)."""
        outline = self._outline
        steps = np.diff(outline, axis=0)
        length = np.concatenate([[0.0], np.cumsum(np.hypot(*steps.T))])
        heading = np.arctan2(steps[:, 1], steps[:, 0])
        corners = length[1:-1][np.abs(np.diff(heading)) > _CORNER]
        between = np.linspace(0.0, length[-1], int(length[-1] / _SPACING) + 2)
        angles = 2.0 * np.pi * np.arange(_ANGLES) / _ANGLES
        s, turn = (grid.ravel() for grid in np.meshgrid(np.union1d(corners, between), angles, indexing="ij"))
        apart = other.distances(self._surface(outline, length, s, turn))
        on_axis = self.position + np.outer(np.linspace(self.heights[0], self.heights[-1], len(between)), self.axis)
        best = min(float(apart.min()), float(other.distances(on_axis).min()))
        grid = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, 9)] * 2), axis=-1).reshape(-1, 2)
        for start in _separate(apart, s, turn * float(self.radii.max())):
            at, reach = np.array([s[start], turn[start]]), 2.0 * np.array([_SPACING, angles[1]])
            while reach[0] > _FINEST:
                tried = at + grid * reach
                tried[:, 0] = np.clip(tried[:, 0], 0.0, length[-1])
                found = other.distances(self._surface(outline, length, tried[:, 0], tried[:, 1]))
                at, reach = tried[int(np.argmin(found))], 0.4 * reach
                best = min(best, float(found.min()))
        return best

    @property
    def _outline(self) -> Vectors:
        """Radii and heights (n + 2, 2) of the meridian with both ends, from the axis to the axis (m)."""
        low, high = [[0.0, self.heights[0]]], [[0.0, self.heights[-1]]]
        outline: Vectors = np.concatenate([low, np.column_stack([self.radii, self.heights]), high])
        return outline

    def _surface(self, outline: Vectors, length: Vectors, s: Vectors, turn: Vectors) -> Vectors:
        """Points (n, 3) at lengths along the outline (m) and angles about the axis."""
        r, z = np.interp(s, length, outline[:, 0]), np.interp(s, length, outline[:, 1])
        first, second = np.linalg.svd(self.axis[None, :])[2][1:]
        outward = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second
        points: Vectors = self.position + z[:, None] * self.axis + r[:, None] * outward
        return points


@dataclass(frozen=True)
class Hull:
    """The convex hull of points: of a round from a mesh file.

    Distances beyond its edges are those from the planes of its faces: never too large.
    """

    points: Vectors
    """(n, 3) m, corners, and points along the edges. axis : (3,) unit vector."""
    axis: Vectors
    normals: Vectors
    levels: Vectors
    """(faces, 3) outward unit normals, and (faces,) m, x . n on the faces."""

    @classmethod
    def of(cls, points: ArrayLike, axis: ArrayLike) -> Hull:
        """Hull of many points that do not lie in a plane."""
        from scipy.spatial import ConvexHull

        places, direction = np.asarray(points, dtype=np.float64), np.asarray(axis, dtype=np.float64)
        hull = ConvexHull(places)
        planes = np.unique(np.round(hull.equations, 12), axis=0)
        ends = places[np.unique(np.sort(hull.simplices[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)]
        pieces = int(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max() / _SPACING) + 1
        along = [(1.0 - part) * ends[:, 0] + part * ends[:, 1] for part in np.linspace(0.0, 1.0, min(pieces, 200) + 1)]
        return cls(np.concatenate(along), direction / np.linalg.norm(direction), planes[:, :3], -planes[:, 3])

    @property
    def centre(self) -> Vectors:
        """Mean of the points (m)."""
        mean: Vectors = self.points.mean(axis=0)
        return mean

    def reach(self, direction: ArrayLike) -> tuple[float, float]:
        """As of `Revolved`."""
        heights = self.points @ np.asarray(direction, dtype=np.float64)
        return float(heights.min()), float(heights.max())

    def distances(self, points: Vectors) -> Vectors:
        """As of `Revolved`."""
        found = np.full(len(points), -np.inf)
        for normal, level in zip(self.normals, self.levels, strict=True):
            np.maximum(found, points @ normal - level, out=found)
        return found

    def nearest_to(self, other: Body) -> float:
        """As of `Revolved`: of its points."""
        return float(other.distances(self.points).min())


Body = Revolved | Hull
"""The outside of a round in space, in world coordinates (m)."""


def placed_body(
    profile: Profile,
    position: Sequence[float],
    axis: Sequence[float],
    *,
    stations: ArrayLike | None = None,
    enlargement: float = 1.0,
) -> Revolved:
    """Body of a profile in space, the centre of its base plane at `position` (m), along `axis` of any length but zero.

    `stations` (m) are those between which the contour is straight, as in a mesh; left out: the contour itself, within
    1e-6 m. `enlargement` is a factor on the radii, as of the polygons of a mesh.
    """
    base, direction = np.array(position, dtype=np.float64), np.array(axis, dtype=np.float64)
    place = np.asarray(stations, dtype=np.float64) if stations is not None else _chords(profile.outer)
    radii = enlargement * profile.outer.radius(place)[::-1]
    return Revolved(base, direction / np.linalg.norm(direction), (profile.length - place)[::-1], radii)


def _chords(contour: Contour) -> Vectors:
    """Stations (m) between which the contour is straight, or curved by less than the error allowed."""
    found = [np.array(contour.stations[:1])]
    for (start, end), (low, high), arc in zip(
        pairwise(contour.stations), pairwise(contour.radii), contour.arcs, strict=True
    ):
        length = np.hypot(end - start, high - low)
        pieces = 1 if arc == 0.0 else int(np.ceil(1.1 * length / np.sqrt(8.0 * abs(arc) * _CHORD_ERROR)))
        # Equal steps of the station are unequal steps of the arc where it is steep; half as many again make up for it.
        found.append(np.linspace(start, end, pieces + (pieces + 1) // 2 + 1 if arc else 2)[1:])
    return np.concatenate(found)


def _separate(apart: Vectors, *places: Vectors) -> Iterator[int]:
    """Indices of the smallest values, none within two spacings of a smaller one."""
    chosen: list[int] = []
    for index in np.argsort(apart)[: 20 * _STARTS].tolist():
        if all(max(abs(one[index] - one[other]) for one in places) > 2.0 * _SPACING for other in chosen):
            chosen.append(index)
            yield index
        if len(chosen) == _STARTS:
            return


def clearance(first: Body, second: Body) -> float:
    """Return the clear distance of two bodies (m), negative where they overlap, 0 where they touch."""
    return min(first.nearest_to(second), second.nearest_to(first))


def near_pairs(bodies: Sequence[Body], within: float) -> Iterator[tuple[int, int, float]]:
    """Yield the pairs i < j of bodies that are at most `within` (m) apart, with their clear distance (m)."""
    for i, apart in _box_distances(bodies):
        for j in (i + 1 + np.flatnonzero(apart <= within)).tolist():
            if _bound(bodies[i], bodies[j]) <= within and (found := clearance(bodies[i], bodies[j])) <= within:
                yield i, j, found


def min_clearance(bodies: Sequence[Body]) -> tuple[int, int, float] | None:
    """Return the first pair i < j of the nearest bodies, with their clear distance (m); None for fewer than two."""
    bounds = [(float(gap), i, i + 1 + k) for i, apart in _box_distances(bodies) for k, gap in enumerate(apart)]
    best: tuple[int, int, float] | None = None
    for bound, i, j in sorted((round(bound / ALIKE) * ALIKE, i, j) for bound, i, j in bounds):
        if best is not None and bound >= best[2] + ALIKE:
            break  # this pair and all that follow are farther apart
        nearest = np.inf if best is None else best[2]
        if max(bound, _bound(bodies[i], bodies[j])) > nearest - 0.4 * ALIKE and best is not None and (i, j) > best[:2]:
            continue  # at best as near as a pair before it
        found = clearance(bodies[i], bodies[j])
        if best is None or found < best[2] - ALIKE or (found < best[2] + ALIKE and (i, j) < best[:2]):
            best = (i, j, found)
    return best


def _box_distances(bodies: Sequence[Body]) -> Iterator[tuple[int, Vectors]]:
    """Yield i and the distances (m) of its box along x, y and z to those of the bodies after it.

    They are lower bounds of the clear distances.
    """
    reach = np.array([[body.reach(direction) for direction in np.eye(3)] for body in bodies])  # (n, 3, 2)
    for i in range(len(bodies) - 1):
        others = reach[i + 1 :]
        yield i, np.maximum(others[:, :, 0] - reach[i, :, 1], reach[i, :, 0] - others[:, :, 1]).max(axis=1)


def _bound(first: Body, second: Body) -> float:
    """A lower bound of the clear distance, from the axes and from across them."""
    between = second.centre - first.centre
    rows = [
        between,
        *(item for axis in (first.axis, second.axis) for item in (axis, between - (between @ axis) * axis)),
    ]
    bound = -np.inf
    for row in rows:
        length = float(np.linalg.norm(row))
        if length > 1e-9:
            (low, high), (other_low, other_high) = first.reach(row / length), second.reach(row / length)
            bound = max(bound, other_low - high, low - other_high)
    return bound
