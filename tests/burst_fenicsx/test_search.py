"""Colliding surfaces: the search and the face that a node has entered, against brute force."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from burst_fenicsx.contact.search import box_around, boxes_of, in_balls, meet, opposed_in_balls
from burst_fenicsx.kernels.constants import UNLOADED_TIME
from burst_fenicsx.kernels.contact.collisions import Candidates, collide
from burst_fenicsx.kernels.contact.facets import closest_point
from burst_fenicsx.kernels.contact.law import Law
from burst_fenicsx.kernels.contact.pairs import Rows, no_pairs

pytestmark = pytest.mark.dolfinx


def test_boxes_meet_where_they_overlap_along_every_axis():
    low = np.random.default_rng(4).integers(0, 6, (400, 3)).astype(float)
    boxes = np.hstack([low, low + np.random.default_rng(5).integers(0, 3, (400, 3))])
    one = np.array([2.0, 3.0, 1.0, 3.0, 5.0, 4.0])
    expected = [all(a[i] <= one[3 + i] and one[i] <= a[3 + i] for i in range(3)) for a in boxes]
    assert 0.05 < np.mean(expected) < 0.6
    assert meet(boxes, one).tolist() == expected


def test_around_nothing_is_a_box_that_meets_nothing():
    boxes = boxes_of(np.random.default_rng(1).normal(size=(50, 3)), np.full(50, 3.0))
    assert meet(boxes, box_around(np.zeros((1, 3)), np.ones((1, 3)))).any()
    assert not meet(boxes, box_around(np.zeros((0, 3)), np.zeros((0, 3)))).any()


@pytest.mark.parametrize("largest", [1.0, 30.0])
def test_the_search_finds_what_brute_force_finds(largest):
    """Balls of like sizes, and a few large ones; places alone, and with normals that oppose the balls' directions."""
    rng = np.random.default_rng(3)
    points, centre = rng.uniform(0.0, 1.0, (400, 3)), rng.uniform(0.0, 1.0, (300, 3))
    radius = rng.uniform(0.02, 0.1, 300)
    radius[:5] *= largest
    normals, directions = rng.normal(size=(2, 400, 3))
    directions = directions[:300]
    normals, directions = (v / np.linalg.norm(v, axis=1)[:, None] for v in (normals, directions))
    held = np.linalg.norm(points[:, None] - centre, axis=2) <= radius
    opposed = normals @ directions.T < -0.2
    for found, expected in (
        (in_balls(points, centre, radius), held),
        (opposed_in_balls(points, normals, centre, radius, directions), held & opposed),
    ):
        pairs = list(zip(*found, strict=True))
        assert len(set(pairs)) == len(pairs) == expected.sum() > 20
        assert expected[found].all()
    none = opposed_in_balls(points[:0], normals[:0], centre, radius, directions)
    assert [len(some) for some in none] == [0, 0]


def crumpled(count, seed):
    """A crumpled square sheet of count x count faces, turned: nodes and faces."""
    rng = np.random.default_rng(seed)
    number = np.arange((count + 1) ** 2).reshape(count + 1, count + 1)
    faces = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    u, v = np.meshgrid(np.linspace(0, 1, count + 1), np.linspace(0, 1, count + 1), indexing="ij")
    flat = np.stack([u, v, 0.15 * np.sin(7 * u) * np.cos(5 * v)], axis=-1).reshape(-1, 3)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return flat @ turn + rng.normal(0, 0.05 / count, flat.shape), faces.astype(np.int32)


def one_node_over(faces, node, outward, rounds=1):
    """Pairs of a node, the last of all, with each of other rounds, of which each has as many of the faces."""
    pairs, count = no_pairs(np.full(rounds, node), 4), len(faces)
    turned = np.asarray(outward) / max(np.linalg.norm(outward), 1e-300)
    seen = Candidates(
        other=np.arange(rounds, dtype=np.int32),
        same=np.zeros(rounds, dtype=bool),
        outward=np.tile(turned, (rounds, 1)),
        unloaded=np.zeros(rounds),
        first=np.linspace(0, count, rounds + 1).astype(np.int64),
        candidate=np.arange(count, dtype=np.int32),
        facets=faces,
        edge=np.ones(count),
        near=np.arange(count, dtype=np.int32),
        ball=np.zeros((count, 5)),
    )
    return pairs, seen


def met(pairs, seen, position, velocity, step=0.1):
    """Let the nodes at places (n, 3) m with velocities (n, 3) m/s meet the faces."""
    count = len(position)
    rows = Rows(
        np.arange(count, dtype=np.int32), np.ones(count), position, velocity, np.zeros(count), np.zeros((count, 4))
    )
    collide(Law(1.0, step, 0.0), pairs, seen, rows)


@pytest.mark.parametrize("slope", [0.0, 0.2])
def test_of_two_equally_near_faces_geometry_decides(slope):
    """A node sunk in over the edge that two faces share: the same one, whichever the mesh numbers first."""
    # Faces to the left and right of x = 0, bent along it; the node's own surface leans against the left one.
    position = np.array(
        [[x, y, -slope * abs(x)] for x in (-1.0, 0.0, 1.0) for y in (0.0, 1.0)] + [[0.0, 0.4, -0.02]], dtype=float
    )
    left, right = [0, 2, 3, 1], [2, 4, 5, 3]
    taken = []
    for faces in ([left, right], [right, left]):
        pairs, seen = one_node_over(np.array(faces, dtype=np.int32), node=6, outward=[slope, 0.0, -1.0])
        velocity = np.zeros_like(position)
        velocity[6] = (0.0, 0.0, -1.0)
        met(pairs, seen, position, velocity)
        taken.append(faces[pairs.facet[0]])
    assert taken == [left, left]


def test_a_node_behind_the_faces_of_two_rounds_is_pushed_out_of_both():
    """A floor and a wall of two rounds meet in a corner; a node of a third lies in it, deeper behind the floor."""
    position = np.array(
        [[x, y, 0.0] for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        + [[0.0, y, z] for y, z in ((-1, -1), (1, -1), (1, 1), (-1, 1))] + [[-0.01, 0.1, -0.02]], dtype=float
    )  # fmt: skip
    faces = np.arange(8, dtype=np.int32).reshape(2, 4)
    pairs, seen = one_node_over(faces, node=8, outward=[-1.0, 0.0, -1.0], rounds=2)
    velocity = np.zeros_like(position)
    velocity[8] = (-1.0, 0.0, -1.0)
    met(pairs, seen, position, velocity)
    assert pairs.facet.tolist() == [0, 1]
    assert -pairs.gap == pytest.approx([0.02, 0.01])
    assert (pairs.force[:, [2, 0]].diagonal() > 0.0).all()
    assert pairs.force[0, :2] == pytest.approx(0.0, abs=1e-15)
    assert pairs.force[1, 1:] == pytest.approx(0.0, abs=1e-15)


def test_a_depth_that_was_there_before_contact_is_loaded_within_microseconds():
    """A node at rest, met beside a face at once: nothing presses at first, all of its depth after the time."""
    position = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0.1, 0.2, -0.05]], dtype=float)
    faces, still, step = np.arange(4, dtype=np.int32)[None], np.zeros((5, 3)), 0.05 * UNLOADED_TIME
    pairs, seen = one_node_over(faces, node=4, outward=[0.0, 0.0, -1.0])
    press = []
    for _ in range(100):
        met(pairs, seen, position, still, step)
        press.append(pairs.force[0, 2])
        assert pairs.gap[0] == pytest.approx(-0.05)
    assert press[0] == 0.0
    assert (np.diff(press) > 0.0).all()
    whole = pairs.stiffness[0] * 0.05
    assert press[20] == pytest.approx((1.0 - 0.95**20) * whole, rel=1e-9)
    assert press[-1] > 0.99 * whole


def test_bounds_reject_no_face_that_a_node_has_entered():
    """The face found is the one of brute force over all faces with the closest point alone."""
    rng = np.random.default_rng(5)
    sheet, faces = crumpled(6, seed=3)
    sheet = 6.0 * sheet + rng.uniform(-0.1, 0.1, sheet.shape)
    node, entered = len(sheet), []
    for _ in range(2000):
        under = sheet[rng.integers(node)] + rng.uniform(-0.4, 0.4, 3)
        moving = rng.normal(0.0, 4.0, 3)
        pairs, seen = one_node_over(faces, node, rng.normal(0.0, 1.0, 3))
        position, velocity = np.vstack([sheet, under]), np.vstack([np.zeros_like(sheet), moving])
        met(pairs, seen, position, velocity)
        found = entered_face(sheet[faces], under, moving, seen.outward[0], 0.1)
        assert pairs.facet[0] == found
        entered.append(found)
    assert 200 < np.count_nonzero(np.array(entered) >= 0) < 1800


def entered_face(corners, place, velocity, outward, step):
    """Number of the nearest face of another round at rest that a node has just entered, -1 for none."""
    four = np.arange(4, dtype=np.int32)
    points = [closest_point(tuple(place), four, corner) for corner in corners]
    near = [(np.array([xi, eta]), np.array(foot), np.array(turned)) for xi, eta, foot, turned in points]
    away = np.array([place - foot for _, foot, _ in near])
    normal = np.array([turned for *_, turned in near])
    distance, depth = np.linalg.norm(away, axis=1), -(away * normal).sum(axis=1)
    facing, approach = normal @ outward, -(normal @ velocity)
    under = (depth > 0.0) & (depth <= 0.5) & (distance <= 1.5 * depth)
    entered = (depth <= 1.5 * step * approach) & (facing < 0.0) | (depth <= 0.1) & (facing < -0.2)
    if not (under & entered).any():
        return -1
    best = int(np.argmin(np.where(under & entered, distance, np.inf)))
    off_rim = np.abs(near[best][0]).max() >= 1.0
    in_front = (-depth > 0.1 * distance[best]) & (distance < distance[best])
    return -1 if off_rim and in_front.any() else best
