"""Colliding surfaces: the search and the face that a node has entered, against brute force."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from burst_fenicsx.contact.search import box_around, in_balls, meet
from burst_fenicsx.kernels.constants import UNLOADED_TIME
from burst_fenicsx.kernels.contact.collisions import Candidates, collide
from burst_fenicsx.kernels.contact.facets import closest_point
from burst_fenicsx.kernels.contact.law import Law
from burst_fenicsx.kernels.contact.pairs import Rows, no_pairs
from burst_fenicsx.kernels.contact.search import Bodies, face_shapes, find_candidates

pytestmark = pytest.mark.dolfinx


def test_boxes_meet_where_they_overlap_along_every_axis():
    low = np.random.default_rng(4).integers(0, 6, (400, 3)).astype(float)
    boxes = np.hstack([low, low + np.random.default_rng(5).integers(0, 3, (400, 3))])
    one = np.array([2.0, 3.0, 1.0, 3.0, 5.0, 4.0])
    expected = [all(a[i] <= one[3 + i] and one[i] <= a[3 + i] for i in range(3)) for a in boxes]
    assert 0.05 < np.mean(expected) < 0.6
    assert meet(boxes, one).tolist() == expected


def test_around_nothing_is_a_box_that_meets_nothing():
    centre = np.random.default_rng(1).normal(size=(50, 3))
    boxes = np.hstack([centre - 1.5, centre + 1.5])
    assert meet(boxes, box_around(np.zeros((1, 3)), np.ones((1, 3)))).any()
    assert not meet(boxes, box_around(np.zeros((0, 3)), np.zeros((0, 3)))).any()


@pytest.mark.parametrize("largest", [1.0, 30.0])
def test_balls_hold_the_points_that_brute_force_finds(largest):
    """Balls of like sizes, and a few large ones."""
    rng = np.random.default_rng(3)
    points, centre = rng.uniform(0.0, 1.0, (400, 3)), rng.uniform(0.0, 1.0, (300, 3))
    radius = rng.uniform(0.02, 0.1, 300)
    radius[:5] *= largest
    expected = np.linalg.norm(points[:, None] - centre, axis=2) <= radius
    found = in_balls(points, centre, radius)
    pairs = list(zip(*found, strict=True))
    assert len(set(pairs)) == len(pairs) == expected.sum() > 50
    assert expected[found].all()
    assert [len(some) for some in in_balls(points[:0], centre, radius)] == [0, 0]


def sheets(count, seed, bodies=4):
    """Crumpled square sheets of count x count faces at random places, every two a round, the second within it."""
    rng = np.random.default_rng(seed)
    nodes, faces, node_body, face_body = [], [], [], []
    number = np.arange((count + 1) ** 2).reshape(count + 1, count + 1)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    for body in range(bodies):
        u, v = np.meshgrid(np.linspace(0, 1, count + 1), np.linspace(0, 1, count + 1), indexing="ij")
        flat = np.stack([u, v, 0.15 * np.sin(7 * u + body) * np.cos(5 * v)], axis=-1).reshape(-1, 3)
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        faces.append(quads + body * len(flat))
        nodes.append(flat @ turn + rng.uniform(-0.3, 0.3, 3) + rng.normal(0, 0.05 / count, flat.shape))
        node_body.append(np.full(len(flat), body))
        face_body.append(np.full(len(quads), body))
    of_node, of_face = (np.concatenate(parts).astype(np.int32) for parts in (node_body, face_body))
    surfaces = Bodies(np.concatenate(faces).astype(np.int32), of_face // 2, of_node // 2, of_face % 2 == 1)
    return np.concatenate(nodes), surfaces


def found_by_hash(nodes, bodies, reach, cell):
    count = len(bodies.faces)
    boxes, areas, normals = face_shapes(nodes, bodies.faces, np.arange(count), np.full(count, reach), count)
    active = np.arange(len(nodes), dtype=np.int32)
    first, faces = find_candidates(nodes, bodies, areas, active, normals, boxes, cell)
    return {(node, face) for node in active for face in faces[first[node] : first[node + 1]]}, len(faces)


def found_by_hand(nodes, bodies, reach):
    """Every node with every face, in plain numpy."""
    corners = nodes[bodies.faces]
    low, high = corners.min(axis=1) - reach, corners.max(axis=1) + reach
    area = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal = np.zeros_like(nodes)
    for corner in range(4):
        np.add.at(normal, bodies.faces[:, corner], area)
    cosine = (normal @ area.T) / np.outer(np.linalg.norm(normal, axis=1), np.linalg.norm(area, axis=1))
    within = ((nodes[:, None] >= low) & (nodes[:, None] <= high)).all(axis=2)
    own_round = bodies.node_round[:, None] == bodies.face_round
    part_of = (np.arange(len(nodes))[:, None, None] == bodies.faces).any(axis=2)
    may = ~own_round | (~part_of & ~bodies.within & (cosine < -0.2))
    return set(zip(*np.nonzero(within & may), strict=True))


@pytest.mark.parametrize("cell", [0.03, 0.11, 0.9])
def test_the_hash_finds_what_brute_force_finds(cell):
    """Whatever the edge of the grid: the same pairs, each once."""
    nodes, bodies = sheets(14, 3)
    found, entries = found_by_hash(nodes, bodies, 0.02, cell)
    expected = found_by_hand(nodes, bodies, 0.02)
    assert found == expected
    assert len(expected) > 200
    assert entries == len(expected)


@pytest.mark.parametrize("turn", [0, 1, 2])
def test_a_wall_is_searched_where_it_is_folded(turn):
    """One body bent into a narrow U about any axis: what lies opposite is found, in the flat rest nothing."""
    number = np.arange(41 * 9).reshape(41, 9)
    faces = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    along, across = (x.ravel() for x in np.meshgrid(np.arange(41.0), np.arange(9.0), indexing="ij"))
    bend = np.pi * np.clip((along - 18.0) / 4.0, 0.0, 1.0)
    straight = along - np.maximum(along - 18.0, 0.0) - np.maximum(along - 22.0, 0.0)
    nodes = np.stack([straight + 1.3 * np.sin(bend), across, 1.3 * (1.0 - np.cos(bend))], axis=-1)
    nodes = np.roll(nodes + np.random.default_rng(2).normal(0, 0.02, nodes.shape), turn, axis=1)
    none = np.zeros(len(faces), dtype=np.int32)
    bodies = Bodies(faces.astype(np.int32), none, np.zeros(len(nodes), dtype=np.int32), none != 0)
    for reach in (1.0, 3.0):
        found, _ = found_by_hash(nodes, bodies, reach, 2.5)
        assert found == found_by_hand(nodes, bodies, reach)
    assert len(found) > 500


def turned_face(normal, turn, size):
    """Corners (4, 3) of a square about the origin with this normal, turned in its plane."""
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    across /= np.linalg.norm(across)
    angle = turn + 0.5 * np.pi * np.arange(4)[:, None]
    return size * (np.cos(angle) * across + np.sin(angle) * np.cross(normal, across))


@pytest.mark.parametrize("size", [0.01, 0.2])
@pytest.mark.parametrize("short", [0.0, 1e-9, 0.5])
def test_two_faces_alone_are_found_if_they_are_opposed(size, short):
    """Two in each of many places, at all angles, or at those whose cosine is the bound or less by 1e-9 of it."""
    rng = np.random.default_rng(21)
    nodes, faces = [], []
    for place in np.indices((6, 6, 6)).reshape(3, -1).T + 0.5:
        one, other = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
        if short < 0.5:
            cosine = -0.2 * (1.0 + short) if short else -0.2 * (1.0 - 1e-9)
            other -= (other @ one) * one
            other = cosine * one + np.sqrt(1.0 - cosine**2) * other / np.linalg.norm(other)
        nodes += [place + turned_face(one, 0.3, size), place + 0.1 * size + turned_face(other, 0.9, size)]
        faces += [4 * len(faces) + np.arange(4), 4 * len(faces) + 4 + np.arange(4)]
    nodes, faces = np.concatenate(nodes), np.array(faces, dtype=np.int32)
    none = np.zeros(len(nodes), dtype=np.int32)
    bodies = Bodies(faces, none[: len(faces)], none, none[: len(faces)] != 0)
    found, _ = found_by_hash(nodes, bodies, 0.2, 1.0)
    expected = found_by_hand(nodes, bodies, 0.2)
    assert found == expected
    assert (len(expected) > 400) == (short > 0.0)


@pytest.mark.parametrize("corner", [0, 1, 2, 3])
def test_a_node_of_a_sharp_fold_does_not_meet_its_own_faces(corner):
    """A large face and a small one folded back over it: the edge's nodes look like the large one, and meet neither."""
    nodes = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [1, 2, 0.3], [1, 0, 0.3], [0.9, 1, 0.4]], dtype=float)
    large, small = [0, 1, 2, 3], np.roll([0, 3, 4, 5], corner).tolist()
    for order in ([large, small], [small, large]):
        faces = np.array(order, dtype=np.int32)
        none = np.zeros(7, dtype=np.int32)
        bodies = Bodies(faces, none[:2], none, none[:2] != 0)
        found, _ = found_by_hash(nodes, bodies, 0.5, 4.0)
        number = order.index(small)
        assert {(node, face) for node, face in found if node < 4} == {(n, number) for n in (1, 2)} & found
        assert not {(n, number) for n in small} & found


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
    local, still = np.arange(count, dtype=np.int32), np.zeros(count, dtype=bool)
    rows = Rows(local, np.ones(count), still, position, velocity, np.zeros(count), np.zeros((count, 4)))
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
    """A node at rest, met beside a face: nothing presses at first, later all of its depth but for 1 % of the edge."""
    position = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0.1, 0.2, -0.05]], dtype=float)
    faces, still, step = np.arange(4, dtype=np.int32)[None], np.zeros((5, 3)), 0.05 * UNLOADED_TIME
    pairs, seen = one_node_over(faces, node=4, outward=[0.0, 0.0, -1.0])
    press = []
    for _ in range(100):
        met(pairs, seen, position, still, step)
        press.append(pairs.force[0, 2])
        assert pairs.gap[0] == pytest.approx(-0.05)
    assert press[0] == 0.0
    assert (np.diff(press) >= 0.0).all()
    assert press[20] == pytest.approx(pairs.stiffness[0] * 0.05 * (1.0 - 0.95**20), rel=1e-9)
    assert press[-1] == pytest.approx(pairs.stiffness[0] * (0.05 - 0.01), rel=1e-9)


def test_bounds_reject_no_face_that_a_node_has_entered():
    """The face found is the one of brute force over all faces with the closest point alone."""
    rng = np.random.default_rng(5)
    sheet, bodies = sheets(6, seed=3, bodies=1)
    faces, sheet = bodies.faces, 6.0 * sheet + rng.uniform(-0.1, 0.1, sheet.shape)
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
