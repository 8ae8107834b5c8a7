"""The clear distance between rounds in space, and from rounds to planes; negative where they overlap.

A round is a union of convex pieces. For convex bodies A and B and a unit vector u let s(u) be the width of the gap
between them along u; it is negative where their shadows on u overlap. The clear distance is the largest s(u) over all
u, and where the bodies overlap minus that is the smallest translation that parts them. Apart, the best u comes from the
point of B - A nearest to the origin (Gilbert, Johnson and Keerthi 1988, IEEE J. Robotics Autom. 4, 193); overlapping,
from a search over all directions.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.geometry.solids import Solid, solids_of_profile

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import ArrayLike, NDArray

    from burst_fenicsx.geometry.profile import Profile

    Vectors = NDArray[np.float64]

__all__ = ["Body", "clearance", "min_clearance", "near_pairs", "placed_body"]

CONVERGED = 1e-10  # gap between the bounds of a distance (m)
ALIKE = 1e-9  # distances that differ by less are equal, and the first pair counts (m)
MOST_STEPS = 300
STARTS = 6  # directions from which the deepest overlap is refined


@dataclass(frozen=True)
class Body:
    """The outside of a round in space, in world coordinates (m): the union of convex pieces."""

    pieces: tuple[Solid, ...]

    def reach(self, direction: ArrayLike) -> tuple[float, float]:
        """Minimum and maximum of x . u over the body (m) for a unit vector u (3,): its extent, or its heights."""
        both = np.array([direction, np.negative(direction)], dtype=np.float64)
        supports = np.array([piece.support(both) for piece in self.pieces])
        return -float(supports[:, 1].max()), float(supports[:, 0].max())

    @property
    def directions(self) -> Vectors:
        """Unit vectors that its shape prefers, shape (n, 3)."""
        return np.concatenate([piece.directions for piece in self.pieces])


def placed_body(
    profile: Profile,
    position: Sequence[float],
    axis: Sequence[float],
    *,
    stations: ArrayLike | None = None,
    enlargement: float = 1.0,
) -> Body:
    """Body of a profile in space.

    Parameters
    ----------
    profile : Profile
        The round.
    position : sequence of float, shape (3,)
        Centre of the base plane (m).
    axis : sequence of float, shape (3,)
        Direction from base to nose, of any length but zero.
    stations : array_like, optional
        Stations (m) between which the contour is straight, as in a mesh; left out: the contour itself, within 1e-7 m.
    enlargement : float
        Factor on the radii, as of the polygons of a mesh.
    """
    return Body(solids_of_profile(profile, position, axis, stations=stations, enlargement=enlargement))


def clearance(first: Body, second: Body) -> float:
    """Return the clear distance of two bodies (m).

    Negative where they overlap: minus the smallest translation that parts the pieces that reach into each other
    deepest; exact where both are convex. 0 where they touch.
    """
    pairs = [(_bound(one, other), one, other) for one, other in product(first.pieces, second.pieces)]
    smallest = np.inf
    for bound, one, other in sorted(pairs, key=lambda pair: pair[0]):
        if bound < smallest:
            smallest = min(smallest, _convex_clearance(one, other, bound))
    return float(smallest)


def near_pairs(bodies: Sequence[Body], within: float) -> Iterator[tuple[int, int, float]]:
    """Yield the pairs i < j of bodies that are at most `within` (m) apart, with their clear distance (m)."""
    for i, j in _pairs_by_boxes(bodies, within):
        if _hull_bound(bodies[i], bodies[j]) <= within:
            found = clearance(bodies[i], bodies[j])
            if found <= within:
                yield i, j, found


def min_clearance(bodies: Sequence[Body]) -> tuple[int, int, float] | None:
    """Return the first pair i < j of the nearest bodies, with their clear distance (m); None for fewer than two."""
    if len(bodies) < 2:
        return None
    # Whatever the clear distance of the pair with the nearest boxes is, no pair with farther boxes is nearer.
    first = min((float(apart.min()), i, i + 1 + int(apart.argmin())) for i, apart in _box_distances(bodies))
    pairs = _pairs_by_boxes(bodies, clearance(bodies[first[1]], bodies[first[2]]) + 2.0 * ALIKE)
    bounds = sorted((round(_hull_bound(bodies[i], bodies[j]) / ALIKE) * ALIKE, i, j) for i, j in pairs)
    best: tuple[int, int, float] | None = None
    for bound, i, j in bounds:
        if best is not None and bound >= best[2] + ALIKE:
            break  # this pair and all that follow are farther apart
        if best is not None and bound > best[2] - 0.4 * ALIKE and (i, j) > best[:2]:
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


def _pairs_by_boxes(bodies: Sequence[Body], within: float) -> Iterator[tuple[int, int]]:
    """Yield the pairs i < j whose boxes are at most `within` (m) apart."""
    for i, apart in _box_distances(bodies):
        yield from ((i, i + 1 + int(k)) for k in np.flatnonzero(apart <= within))


def _gap(first: Solid, second: Solid, directions: Vectors) -> Vectors:
    """Width s(u) of the gap along unit vectors u, shape (n, 3)."""
    gap: Vectors = -first.support(directions) - second.support(-directions)
    return gap


def _hull_bound(first: Body, second: Body) -> float:
    """A lower bound of the clear distance, from few directions."""
    return min(_bound(one, other) for one, other in product(first.pieces, second.pieces))


def _bound(first: Solid, second: Solid) -> float:
    return float(_gap(first, second, _likely(first, second)).max())


def _likely(first: Solid, second: Solid) -> Vectors:
    """Directions along which bodies of revolution are often parted: axes, their normals, across each axis."""
    between = second.centre - first.centre
    own = np.concatenate([first.directions, second.directions])
    across = [between - (between @ axis) * axis for axis in own]
    crossed = [np.cross(a, b) for a, b in combinations(own, 2)]
    rows = np.array([between, *own, *across, *crossed])
    length = np.linalg.norm(rows, axis=1)
    rows = rows[length > 1e-9 * max(float(length.max()), 1e-300)]
    rows = np.concatenate([rows, np.eye(3)])
    unit: Vectors = rows / np.linalg.norm(rows, axis=1)[:, None]
    return np.concatenate([unit, -unit])


def _convex_clearance(first: Solid, second: Solid, bound: float) -> float:
    found = max(bound, _apart(first, second))
    return found if found > 0.0 else max(found, _overlap(first, second))


def _apart(first: Solid, second: Solid) -> float:
    """The largest s(u) that the search for the nearest point of B - A meets; not positive where they overlap."""

    def support(direction: Vectors) -> Vectors:
        return second.support_point(direction) - first.support_point(-direction)

    nearest = second.centre - first.centre
    corners = [support(-nearest)]
    nearest, best = corners[0], -np.inf
    scale = float(np.linalg.norm(nearest))
    for _ in range(MOST_STEPS):
        distance = float(np.linalg.norm(nearest))
        if distance <= 1e-13 * max(scale, 1e-3):
            break
        unit = nearest / distance
        corner = support(-unit)
        best = max(best, float(unit @ corner))
        if distance - best <= CONVERGED:
            break
        scale = max(scale, float(np.linalg.norm(corner)))
        corners, found = _nearest_in_simplex([corner, *corners])
        if len(corners) == 4 or not float(np.linalg.norm(found)) < distance:
            break  # the origin lies inside, or round-off ends the descent
        nearest = found
    return best


def _nearest_in_simplex(corners: list[Vectors]) -> tuple[list[Vectors], Vectors]:
    """Nearest point to the origin of the hull of up to four corners, and the corners that carry it.

    The first corner is the new one and always among them, since the others' nearest point lies behind it.
    """
    best: tuple[float, list[Vectors], Vectors] | None = None
    for count in range(len(corners)):
        for others in combinations(corners[1:], count):
            chosen = np.array([corners[0], *others])
            edges = chosen[1:] - chosen[0]
            if count:
                weight, _, rank, _ = np.linalg.lstsq(edges.T, -chosen[0], rcond=1e-12)
                if rank < count or weight.min() < 0.0 or weight.sum() > 1.0:
                    continue
                point = chosen[0] + weight @ edges
            else:
                point = chosen[0]
            size = float(point @ point)
            if best is None or size < best[0]:
                best = (size, [corners[0], *others], point)
    assert best is not None  # the corner by itself is always a choice
    return best[1], best[2]


def _overlap(first: Solid, second: Solid) -> float:
    """The largest s(u) over all directions of bodies that overlap: minus the smallest translation that parts them."""
    from scipy.optimize import minimize

    directions = np.concatenate([_likely(first, second), _sphere()])
    gaps = _gap(first, second, directions)
    best = float(gaps.max())
    for start in _best_apart(directions, gaps):
        across = np.linalg.svd(start[None, :])[2][1:]

        def narrower(turn: Vectors, start: Vectors = start, across: Vectors = across) -> float:
            direction = start + turn @ across
            return -float(_gap(first, second, (direction / np.linalg.norm(direction))[None])[0])

        found = minimize(
            narrower, np.zeros(2), method="Nelder-Mead",
            options={"initial_simplex": [[0, 0], [0.05, 0], [0, 0.05]], "xatol": 1e-10, "fatol": 1e-12, "maxiter": 400},
        )  # fmt: skip
        best = max(best, -float(found.fun))
    return best


def _best_apart(directions: Vectors, gaps: Vectors) -> Iterator[Vectors]:
    """The best directions, none within ten degrees of a better one."""
    chosen: list[Vectors] = []
    for index in np.argsort(-gaps):
        if all(directions[index] @ other < np.cos(np.radians(10.0)) for other in chosen):
            chosen.append(directions[index])
            yield directions[index]
        if len(chosen) == STARTS:
            return


def _sphere(count: int = 1000) -> Vectors:
    """Unit vectors spread evenly over the sphere, with their opposites, shape (2 count, 3)."""
    height = (np.arange(count) + 0.5) / count  # the upper half
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    across = np.sqrt(1.0 - height**2)
    upper = np.column_stack([across * np.cos(turn), across * np.sin(turn), height])
    return np.concatenate([upper, -upper])
