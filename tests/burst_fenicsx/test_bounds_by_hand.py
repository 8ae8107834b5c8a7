"""Bounds of faces by hand: the ball around a face, its fastest corner, and the heights along the corners' normals."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from burst_fenicsx.kernels.geometry.bounds import bound_faces

pytestmark = pytest.mark.dolfinx

SQUARE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])


def bounds_of(corners, velocity=None, near=None):
    """Ball (faces, 5) and corner bounds (faces, 4, 5) of separate faces with corners (faces, 4, 3)."""
    count = len(corners)
    position = np.ascontiguousarray(corners.reshape(-1, 3))
    velocity = np.zeros_like(position) if velocity is None else np.ascontiguousarray(velocity.reshape(-1, 3))
    ball, bound = np.full((count, 5), np.nan), np.full((count, 20), np.nan)
    faces = np.arange(4 * count, dtype=np.int64).reshape(count, 4)
    near = np.arange(count, dtype=np.int64) if near is None else np.asarray(near, dtype=np.int64)
    bound_faces(position, velocity, faces, near, ball, bound)
    return ball, bound.reshape(count, 4, 5)


def test_a_rectangle_has_the_ball_over_its_diagonal_and_no_height():
    """Sides 3 and 4 m, turned: radius 2.5 m around the middle, all four normals that of the plane."""
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    corners = SQUARE * [3.0, 4.0, 0.0] @ turn.T + [10.0, -20.0, 30.0]
    velocity = np.array([[1.0, 2.0, 2.0], [2.0, -6.0, 9.0], [0.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    ball, bound = bounds_of(corners[None], velocity[None])
    np.testing.assert_allclose(ball[0, :3], corners.mean(axis=0), rtol=1e-14)
    assert ball[0, 3:] == pytest.approx([2.5, 11.0])
    np.testing.assert_allclose(bound[0, :, :3], np.tile(turn[:, 2], (4, 1)), atol=1e-13)
    np.testing.assert_allclose(bound[0, :, 3:], np.tile([-2.5e-9, 2.5e-9], (4, 1)), atol=1e-13)


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


def test_faces_that_are_far_are_left_alone_and_corners_may_coincide():
    """A corner whose edges are one has no normal: its bounds are nothing but the slack, which rejects no node."""
    corners = np.stack([SQUARE, SQUARE[[0, 1, 2, 2]], SQUARE[[0, 1, 1, 1]]])
    ball, bound = bounds_of(corners, near=[1, 2])
    assert np.isnan(ball[0]).all()
    assert np.isnan(bound[0]).all()
    np.testing.assert_allclose(bound[1, :2, :3], [[0.0, 0.0, 1.0]] * 2)
    np.testing.assert_allclose(bound[2, :, :3], 0.0)
    assert (bound[2, :, 3] < 0.0).all()
    assert (bound[2, :, 4] > 0.0).all()
