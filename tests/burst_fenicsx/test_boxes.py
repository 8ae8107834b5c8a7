"""Boxes and bounds of faces, beside NumPy's comparisons."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.contact.boxes import are_inside, around_rounds, box_around, meet, meet_others
from burst_fenicsx.kernels.geometry.bilinear import bound_faces

RANDOM = np.random.default_rng(5)
LOW = RANDOM.uniform(-1.0, 1.0, (300, 3))
BOXES = np.hstack([LOW, LOW + RANDOM.uniform(0.0, 0.4, (300, 3))])
OF_BOXES = RANDOM.integers(0, 3, 300)
POINTS = RANDOM.uniform(0.2, 0.6, (40, 3))
OF_POINTS = RANDOM.integers(0, 2, 40)  # none of the round 2
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


def test_boxes_around_the_members_of_each_round():
    found = around_rounds(OF_BOXES, BOXES, 4)
    for index in range(3):
        own = BOXES[index == OF_BOXES]
        np.testing.assert_array_equal(found[index], np.concatenate([own[:, :3].min(axis=0), own[:, 3:].max(axis=0)]))
    assert (found[3, :3] == np.inf).all()


def test_boxes_meet_the_points_of_other_rounds_and_those_of_none_all():
    members = np.where(np.arange(300) < 150, -1, OF_BOXES)
    found = meet_others(BOXES, members, POINTS, OF_POINTS)
    for index in range(-1, 3):
        others = POINTS[index != OF_POINTS]
        np.testing.assert_array_equal(found[members == index], meets(BOXES, around(others))[members == index])
    assert found.any()
    assert (found != meets(BOXES, around(POINTS))).any()


def test_points_inside_boxes():
    boxes = np.array([[0.2, 0.2, 0.2, 0.4, 0.4, 0.4], [0.3, 0.3, 0.3, 0.6, 0.6, 0.6]])
    held = np.array([(box[:3] <= POINTS).all(axis=1) & (box[3:] >= POINTS).all(axis=1) for box in boxes])
    np.testing.assert_array_equal(are_inside(POINTS, boxes), held.any(axis=0))
    np.testing.assert_array_equal(are_inside(POINTS, boxes[1:]), held[1])
    assert held.any(axis=1).all()
    assert not are_inside(POINTS, boxes[:0]).any()


SQUARE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])


def bounds_of(corners, velocity=None, near=None):
    """Ball (faces, 5) and corner bounds (faces, 4, 5) of separate faces with corners (faces, 4, 3); not near: NaN."""
    count = len(corners)
    position = np.ascontiguousarray(corners.reshape(-1, 3))
    velocity = np.zeros_like(position) if velocity is None else np.ascontiguousarray(velocity.reshape(-1, 3))
    ball, bound = np.full((count, 5), np.nan), np.full((count, 20), np.nan)
    faces = np.arange(4 * count, dtype=np.int64).reshape(count, 4)
    near = np.arange(count) if near is None else np.array(near, dtype=np.int64)
    bound_faces(position, velocity, faces, near, ball, bound)
    return ball, bound.reshape(count, 4, 5)


def test_a_warped_face_lies_between_its_bounds():
    """200 faces, more than a run: the bilinear face within the ball, its corners between the bounds of each normal."""
    rng = np.random.default_rng(5)
    corners = SQUARE + rng.uniform(-0.2, 0.2, (200, 4, 3)) + rng.uniform(-5.0, 5.0, (200, 1, 3))
    ball, bound = bounds_of(corners)
    xi, eta = rng.uniform(-1.0, 1.0, (2, 50))
    shape = 0.25 * np.stack([(1 - xi) * (1 - eta), (1 + xi) * (1 - eta), (1 + xi) * (1 + eta), (1 - xi) * (1 + eta)])
    centre = ball[:, None, :3]
    inner, outer = np.einsum("nk,fni->fki", shape, corners) - centre, corners - centre
    assert (np.linalg.norm(inner, axis=2) <= ball[:, 3:4]).all()
    np.testing.assert_allclose(np.linalg.norm(outer, axis=2).max(axis=1), ball[:, 3], rtol=1e-12)
    for n in range(4):
        edges = [corners[:, (n + step) % 4] - corners[:, n] for step in (1, -1)]
        normal = bound[:, n, :3]
        np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, rtol=1e-12)
        for edge in edges:
            np.testing.assert_allclose(np.einsum("fi,fi->f", normal, edge), 0.0, atol=1e-12)
        assert (np.linalg.det(np.stack([*edges, normal], axis=1)) > 0.0).all()
        heights = np.einsum("fki,fi->fk", outer, normal)
        slack = 1e-9 * ball[:, 3]
        np.testing.assert_allclose(bound[:, n, 3], heights.min(axis=1) - slack, atol=1e-12)
        np.testing.assert_allclose(bound[:, n, 4], heights.max(axis=1) + slack, atol=1e-12)


def test_a_rectangle_has_the_ball_over_its_diagonal_no_height_and_the_speed_of_its_fastest_corner():
    """Sides 3 and 4 m, turned: radius 2.5 m around the middle, all four normals that of the plane."""
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    corners = SQUARE * [3.0, 4.0, 0.0] @ turn.T + [10.0, -20.0, 30.0]
    velocity = np.array([[1.0, 2.0, 2.0], [2.0, -6.0, 9.0], [0.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    ball, bound = bounds_of(corners[None], velocity[None])
    np.testing.assert_allclose(ball[0], [*corners.mean(axis=0), 2.5, 11.0], rtol=1e-14)
    np.testing.assert_allclose(bound[0, :, :3], np.tile(turn[:, 2], (4, 1)), atol=1e-13)
    np.testing.assert_allclose(bound[0, :, 3:], np.tile([-2.5e-9, 2.5e-9], (4, 1)), atol=1e-13)


def test_faces_that_are_far_are_left_alone_and_corners_may_coincide():
    """A corner whose edges are one has no normal: its bounds are nothing but the slack, which rejects no node."""
    ball, bound = bounds_of(np.stack([SQUARE, SQUARE[[0, 1, 2, 2]], SQUARE[[0, 1, 1, 1]]]), near=[1, 2])
    assert np.isnan(ball[0]).all()
    assert np.isnan(bound[0]).all()
    np.testing.assert_allclose(bound[1, :2, :3], [[0.0, 0.0, 1.0]] * 2)
    np.testing.assert_allclose(bound[2, :, :3], 0.0)
    assert (bound[2, :, 3] < 0.0).all()
    assert (bound[2, :, 4] > 0.0).all()
