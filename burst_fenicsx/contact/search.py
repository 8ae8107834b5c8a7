"""Boxes with faces parallel to the axes, low then high corner (m), and balls that hold points."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree


def box_around(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Box (6,), low then high corner, around boxes with corners (n, 3) m; around none, one that meets nothing."""
    return np.concatenate([low.min(axis=0, initial=np.inf), high.max(axis=0, initial=-np.inf)])


def meet(boxes: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Whether boxes (n, 6) meet a box (6,)."""
    overlap = (boxes[:, :3] <= box[3:]) & (boxes[:, 3:] >= box[:3])
    found: np.ndarray = overlap[:, 0] & overlap[:, 1] & overlap[:, 2]
    return found


def in_balls(points: np.ndarray, centre: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of a point (p, 3) and a ball (b, 3), (b,) m that holds it: the points and the balls."""
    found = [np.zeros((2, 0), dtype=np.int64)]
    for balls in _by_size(radius):
        point, ball = _near(points, centre[balls], float(radius[balls].max()))
        held = ((points[point] - centre[balls[ball]]) ** 2).sum(axis=1) <= radius[balls[ball]] ** 2
        found.append(np.stack([point[held], balls[ball[held]]]))
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
