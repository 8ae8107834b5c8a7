"""Boxes with faces parallel to the axes, low then high corner (m): which meet each other, which hold a point."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.lanes import kernel

__all__ = ["are_inside", "around_rounds", "box_around", "meet", "meet_others"]


@kernel
def box_around(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Box (6,) around boxes with the corners `low` and `high` (n, 3); around none, one that meets nothing."""
    box = np.empty(6)
    for i in range(3):
        box[i], box[3 + i] = np.inf, -np.inf
    for k in range(low.shape[0]):
        for i in range(3):
            box[i] = min(box[i], low[k, i])
            box[3 + i] = max(box[3 + i], high[k, i])
    return box


@kernel
def meet(boxes: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Whether boxes (n, 6) meet a box (6,)."""
    found = np.empty(boxes.shape[0], dtype=np.bool_)
    for k in range(boxes.shape[0]):
        found[k] = _meet(boxes[k], box)
    return found


@kernel
def _meet(one: np.ndarray, other: np.ndarray) -> bool:
    meets = (one[0] <= other[3]) & (one[1] <= other[4]) & (one[2] <= other[5])
    return meets & (one[3] >= other[0]) & (one[4] >= other[1]) & (one[5] >= other[2])


@kernel
def around_rounds(numbers: np.ndarray, boxes: np.ndarray, of_round: np.ndarray, below: int, around: np.ndarray) -> None:
    """Boxes `around` (rounds, 6) those of each round's members whose number lies `below` the given one.

    `numbers` (n,) are those of the members with the `boxes` (n, 6); `of_round` is the round by number.
    """
    for index in range(around.shape[0]):
        for i in range(3):
            around[index, i], around[index, 3 + i] = np.inf, -np.inf
    for k in range(numbers.size):
        if numbers[k] < below:
            box = around[of_round[numbers[k]]]
            for i in range(3):
                box[i] = min(box[i], boxes[k, i])
                box[3 + i] = max(box[3 + i], boxes[k, 3 + i])


@kernel
def meet_others(
    numbers: np.ndarray,
    boxes: np.ndarray,
    of_round: np.ndarray,
    below: int,
    points: np.ndarray,
    round_of_points: np.ndarray,
    rounds: int,
) -> np.ndarray:
    """Whether boxes (n, 6) meet the box around points (p, 3) m: all points, or those of other rounds.

    Members whose number lies `below` the given one are held against all points, the others against those of other
    rounds than their own; `numbers`, `of_round` as in `around_rounds`, `round_of_points` (p,).
    """
    around = np.empty((rounds + 1, 6))  # all points, then those of other rounds than each
    around[:, :3], around[:, 3:] = np.inf, -np.inf
    for p in range(points.shape[0]):
        for index in range(rounds + 1):
            if index == 0 or round_of_points[p] != index - 1:
                box = around[index]
                for i in range(3):
                    box[i] = min(box[i], points[p, i])
                    box[3 + i] = max(box[3 + i], points[p, i])
    found = np.empty(numbers.size, dtype=np.bool_)
    for k in range(numbers.size):
        others = 0 if numbers[k] < below else of_round[numbers[k]] + 1
        found[k] = _meet(boxes[k], around[others])
    return found


@kernel
def are_inside(position: np.ndarray, points: np.ndarray, boxes: np.ndarray, skip: int) -> np.ndarray:
    """Whether `points` (p,), rows of `position` (m), lie in any of the `boxes` (n, 6) but that of the number `skip`."""
    found = np.zeros(points.size, dtype=np.bool_)
    for p in range(points.size):
        x, y, z = position[points[p], 0], position[points[p], 1], position[points[p], 2]
        for k in range(boxes.shape[0]):
            if k != skip:
                within = (x >= boxes[k, 0]) & (x <= boxes[k, 3]) & (y >= boxes[k, 1]) & (y <= boxes[k, 4])
                found[p] |= within & (z >= boxes[k, 2]) & (z <= boxes[k, 5])
    return found
