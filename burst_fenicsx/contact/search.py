"""Which facets a node may meet before the next search: those whose balls hold it, by trees of points."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

__all__ = ["box_around", "boxes_of", "in_balls", "meet", "opposed_in_balls"]

OPPOSED = -0.2
"""A node meets a facet of its own round only where their normals are opposed: cosine below this."""


def box_around(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Box (6,), low then high corner, around boxes with corners (n, 3) m; around none, one that meets nothing."""
    return np.concatenate([low.min(axis=0, initial=np.inf), high.max(axis=0, initial=-np.inf)])


def meet(boxes: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Whether boxes (n, 6) meet a box (6,)."""
    found: np.ndarray = (boxes[:, :3] <= box[3:]).all(axis=1) & (boxes[:, 3:] >= box[:3]).all(axis=1)
    return found


def boxes_of(centre: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Boxes (n, 6) m around balls."""
    return np.concatenate([centre - radius[:, None], centre + radius[:, None]], axis=1)


def in_balls(points: np.ndarray, centre: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of a point (p, 3) and a ball (b, 3), (b,) m that holds it: the points and the balls."""
    found = [np.zeros((2, 0), dtype=np.int64)]
    for balls in _by_size(radius):
        point, ball = _near(points, centre[balls], float(radius[balls].max()))
        held = ((points[point] - centre[balls[ball]]) ** 2).sum(axis=1) <= radius[balls[ball]] ** 2
        found.append(np.stack([point[held], balls[ball[held]]]))
    point, ball = np.concatenate(found, axis=1)
    return point, ball


def opposed_in_balls(
    points: np.ndarray, normals: np.ndarray, centre: np.ndarray, radius: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """As `in_balls`, where the unit `normals` (p, 3) of the points oppose the `directions` (b, 3) of the balls.

    Places and normals are one space of six dimensions: a wall that is not folded, whose nodes lie in all balls around
    them, has no pair there.
    """
    found = [np.zeros((2, 0), dtype=np.int64)]
    for balls in _by_size(radius):
        scale = float(radius[balls].max())
        # Of unit vectors u and -v the squared distance is 2 + 2 u.v.
        apart = scale * np.sqrt(1.0 + 2.0 * (1.0 + OPPOSED))
        here, there = np.hstack([points, -scale * normals]), np.hstack([centre, scale * directions])[balls]
        point, ball = _near(here, there, apart)
        ball = balls[ball]
        held = ((points[point] - centre[ball]) ** 2).sum(axis=1) <= radius[ball] ** 2
        held &= (normals[point] * directions[ball]).sum(axis=1) < OPPOSED
        found.append(np.stack([point[held], ball[held]]))
    point, ball = np.concatenate(found, axis=1)
    return point, ball


def _by_size(radius: np.ndarray) -> list[np.ndarray]:
    """Numbers of balls of like size: few are large, and would have every point looked at far around."""
    octave = np.frexp(radius)[1]
    return [np.flatnonzero(octave == size) for size in np.unique(octave)]


def _near(points: np.ndarray, others: np.ndarray, distance: float) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of points (p, d) and others (o, d) no farther apart than a distance, or hardly more."""
    if not len(points):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    slack = 1.0 + 1e-9
    pairs = cKDTree(points).sparse_distance_matrix(cKDTree(others), slack * distance, output_type="ndarray")
    return pairs["i"], pairs["j"]
