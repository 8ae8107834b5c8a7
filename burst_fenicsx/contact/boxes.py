"""Boxes with faces parallel to the axes, low then high corner (m): which meet each other, which hold a point."""

from __future__ import annotations

import numpy as np

__all__ = ["are_inside", "around_rounds", "box_around", "meet", "meet_others"]


def box_around(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Box (6,) around boxes with the corners `low` and `high` (n, 3); around none, one that meets nothing."""
    return np.concatenate([low.min(axis=0, initial=np.inf), high.max(axis=0, initial=-np.inf)])


def meet(boxes: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Whether boxes (n, 6) meet a box (6,)."""
    found: np.ndarray = (boxes[:, :3] <= box[3:]).all(axis=1) & (boxes[:, 3:] >= box[:3]).all(axis=1)
    return found


def around_rounds(members: np.ndarray, boxes: np.ndarray, rounds: int) -> np.ndarray:
    """Boxes (rounds, 6) around those (n, 6) of each round's members; `members` (n,) are their rounds."""
    around = np.empty((rounds, 6))
    for index in range(rounds):
        own = boxes[members == index]
        around[index] = box_around(own[:, :3], own[:, 3:])
    return around


def meet_others(boxes: np.ndarray, members: np.ndarray, points: np.ndarray, of_points: np.ndarray) -> np.ndarray:
    """Whether boxes (n, 6) of the rounds `members` (n,) meet the box around points (p, 3) m of other rounds.

    A box of the round -1 is held against all points; `of_points` (p,) are the points' rounds.
    """
    found = np.zeros(len(boxes), dtype=bool)
    for index in np.unique(members):
        others, own = points[of_points != index], members == index
        found[own] = meet(boxes[own], box_around(others, others))
    return found


def are_inside(points: np.ndarray, boxes: np.ndarray) -> np.ndarray:
    """Whether points (p, 3) m lie in any of the `boxes` (n, 6)."""
    found = np.zeros(len(points), dtype=bool)
    for box in boxes:
        found |= ((points >= box[:3]) & (points <= box[3:])).all(axis=1)
    return found
