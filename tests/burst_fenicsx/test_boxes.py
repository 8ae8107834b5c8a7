"""Boxes that meet each other and hold points, beside NumPy's comparisons."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.geometry.boxes import are_inside, around_rounds, box_around, meet, meet_others
from burst_fenicsx.kernels.vectors.rows import add_to_rows

RANDOM = np.random.default_rng(5)
LOW = RANDOM.uniform(-1.0, 1.0, (300, 3))
BOXES = np.hstack([LOW, LOW + RANDOM.uniform(0.0, 0.4, (300, 3))])
NUMBERS = np.sort(RANDOM.choice(500, 300, replace=False)).astype(np.int32)
OF_ROUND = RANDOM.integers(0, 3, 500).astype(np.int32)
BELOW = 250
POINTS = RANDOM.uniform(0.2, 0.6, (40, 3))
OF_POINTS = RANDOM.integers(0, 2, 40).astype(np.int32)  # none of the round 2
POINTS[OF_POINTS > 0] -= 0.6


def meets(boxes, box):
    return (boxes[:, :3] <= box[3:]).all(axis=1) & (boxes[:, 3:] >= box[:3]).all(axis=1)


def around(points):
    return np.concatenate([points.min(axis=0, initial=np.inf), points.max(axis=0, initial=-np.inf)])


def test_boxes_meet_a_box():
    box = box_around(POINTS, POINTS + 0.1)
    np.testing.assert_array_equal(box, np.concatenate([POINTS.min(axis=0), (POINTS + 0.1).max(axis=0)]))
    found = meet(BOXES, box)
    assert found.any()
    assert not found.all()
    np.testing.assert_array_equal(found, meets(BOXES, box))
    touching = np.array([[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]])
    for axis in range(3):
        for step, holds in ((1.0, True), (1.0 + 1e-12, False)):
            beside = touching[0].copy()
            beside[[axis, 3 + axis]] += step
            assert meet(touching, beside)[0] == holds
            assert meet(beside[None], touching[0])[0] == holds


def test_around_nothing_is_a_box_that_meets_nothing():
    assert not meet(BOXES, box_around(np.zeros((0, 3)), np.zeros((0, 3)))).any()


def test_boxes_around_the_first_members_of_each_round():
    found = np.empty((4, 6))
    around_rounds(NUMBERS, BOXES, OF_ROUND, BELOW, found)
    for index in range(3):
        own = BOXES[(NUMBERS < BELOW) & (OF_ROUND[NUMBERS] == index)]
        np.testing.assert_array_equal(found[index], np.concatenate([own[:, :3].min(axis=0), own[:, 3:].max(axis=0)]))
    assert (found[3, :3] == np.inf).all()


def test_the_first_members_meet_all_points_the_others_those_of_other_rounds():
    found = meet_others(NUMBERS, BOXES, OF_ROUND, BELOW, POINTS, OF_POINTS, 3)
    expected = meets(BOXES, around(POINTS))
    for index in range(3):
        later = (NUMBERS >= BELOW) & (OF_ROUND[NUMBERS] == index)
        others = POINTS[np.flatnonzero(OF_POINTS - index)]
        expected[later] = meets(BOXES, around(others))[later]
    assert found.any()
    assert (found != meets(BOXES, around(POINTS))).any()
    np.testing.assert_array_equal(found, expected)


def test_points_inside_the_boxes_of_others():
    points = np.arange(5, 40)
    boxes = np.array([[0.2, 0.2, 0.2, 0.4, 0.4, 0.4], [0.3, 0.3, 0.3, 0.6, 0.6, 0.6]])
    places = POINTS[points]
    held = np.array([(places >= box[:3]).all(axis=1) & (places <= box[3:]).all(axis=1) for box in boxes])
    np.testing.assert_array_equal(are_inside(POINTS, points, boxes, 2), held.any(axis=0))
    for skip in (0, 1):
        np.testing.assert_array_equal(are_inside(POINTS, points, boxes, skip), held[1 - skip])
    assert held.any(axis=1).all()


def test_rows_named_several_times_are_added_in_turn():
    rows, values = RANDOM.integers(0, 7, 50), RANDOM.normal(size=(50, 4))
    found, expected = np.ones((9, 4)), np.ones((9, 4))
    add_to_rows(values, rows, found)
    np.add.at(expected, rows, values)
    np.testing.assert_array_equal(found, expected)
