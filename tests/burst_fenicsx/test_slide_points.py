"""Where nodes lie on a smooth surface: sixteen side by side against one at a time, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from burst_fenicsx.contact.slide_surface import make_contacts, smooth_surface
from burst_fenicsx.kernels.contact.slide_points import BEYOND, GAP, NORMAL, POINT_ROWS, SIZE, find_points
from burst_fenicsx.kernels.geometry.smooth_faces import face_vectors, group_vectors
from burst_fenicsx.kernels.lanes import LANES

COUNT = 12  # faces along a side of the sheet
_S, _T = np.array([-1.0, 1.0, 1.0, -1.0]), np.array([-1.0, -1.0, 1.0, 1.0])


def sheet():
    """A wavy square sheet of 12 x 12 faces with a sharp bend along its middle: nodes, faces, surface."""
    number = np.arange((COUNT + 1) ** 2).reshape(COUNT + 1, COUNT + 1)
    faces = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, COUNT + 1), np.linspace(0, 1, COUNT + 1), indexing="ij"))
    nodes = np.stack([u, v, 1.5 * np.abs(u - 0.5) + 0.05 * np.sin(9 * u) * np.cos(7 * v)], axis=-1)
    nodes += np.random.default_rng(3).normal(0, 0.004, nodes.shape)
    surface, _ = smooth_surface(nodes, faces.astype(np.int32))
    vectors = np.zeros((len(faces), 3))
    face_vectors(nodes, surface.faces, np.arange(len(faces), dtype=np.int32), vectors)
    groups = np.arange(len(surface.vector), dtype=np.int32)
    group_vectors(surface.first_face, surface.face, groups, vectors, surface.vector)
    return nodes, surface


def at(face, xi, eta, nodes, surface):
    """Tangents, place and area vector at a point of a face."""
    x, v = nodes[surface.faces[face]], surface.vector[surface.corner[face]]
    w = 0.25 * (1 + _S * xi) * (1 + _T * eta)
    return 0.25 * _S * (1 + _T * eta) @ x, 0.25 * _T * (1 + _S * xi) @ x, w @ x, w @ v


def improved(node, face, xi, eta, nodes, surface):
    """Offset along the normal, the normal, its length, offset along the surface, and the next coordinates."""
    a, b, x, v = at(face, xi, eta, nodes, surface)
    size = np.linalg.norm(v)
    n = v / size
    gap = (node - x) @ n
    along = node - x - gap * n
    flat = np.array([a - (a @ n) * n, b - (b @ n) * n])
    step = np.linalg.solve(flat @ flat.T, flat @ along)
    return gap, n, size, along, np.clip(np.array([xi, eta]) + step, -4.0, 4.0), np.abs(step).sum()


def found_by_hand(node, face, xi, eta, nodes, surface):
    """Follow one node over the faces: where it lies, and how far beyond the surface's edge."""
    slack = 1e-12
    for walk in range(10):
        for _ in range(12):
            gap, n, size, along, (xi, eta), change = improved(node, face, xi, eta, nodes, surface)
            if change < 1e-9:
                break
        if max(abs(xi), abs(eta)) <= 1 + slack:
            return face, xi, eta, gap, n, size, 0.0
        over = np.array([-eta, xi, eta, -xi])
        other = surface.neighbour[face]
        over[(other < 0) | ~surface.known[np.maximum(other, 0)]] = -np.inf
        edge = int(np.argmax(over))
        slack_now, slack = slack, 16 * slack
        if over[edge] <= 1 + slack_now or walk == 9:
            xi, eta = np.clip([xi, eta], -1.0, 1.0)
            if walk == 9:
                return face, xi, eta, gap, n, size, 0.0
            gap, n, size, along, _, _ = improved(node, face, xi, eta, nodes, surface)
            return face, xi, eta, gap, n, size, np.linalg.norm(along)
        face, xi, eta = int(other[edge]), 0.0, 0.0
    raise AssertionError


def found_together(places, face, point, nodes, surface):
    """The same by the kernel, for all nodes at once."""
    count = len(places)
    face, point, found = face.copy(), point.copy(), np.zeros((count, 6))
    contact, slave = np.arange(count, dtype=np.int32), np.arange(count, dtype=np.int32)[::-1].copy()
    find_points(
        contact, slave, places[::-1].copy(), np.zeros((count, 3)), surface, nodes, face, point, found,
        np.zeros(POINT_ROWS * LANES), np.zeros((4, LANES), dtype=np.int64),
    )  # fmt: skip
    return face, point, found


@pytest.mark.parametrize(("count", "moved"), [(300, 0.01), (61, 0.3), (5, 0.1), (1, 0.0)])
def test_points_found_side_by_side_are_those_found_one_by_one(count, moved):
    """Nodes that stay in their face, walk over several, or leave over a rim or a bend; few and many of them."""
    nodes, surface = sheet()
    surface.known[[40, 77]] = False
    rng = np.random.default_rng(count)
    face = rng.choice(np.flatnonzero(surface.known), count).astype(np.int32)
    point = rng.uniform(-1, 1, (count, 2))
    start = np.array([at(f, *p, nodes, surface)[2] for f, p in zip(face, point, strict=True)])
    places = start + rng.normal(0, moved, (count, 3)) * (1, 1, 0.2)
    faces, points, found = found_together(places, face, point, nodes, surface)
    walked, left = 0, 0
    for k in range(count):
        at_face, xi, eta, gap, n, size, beyond = found_by_hand(places[k], face[k], *point[k], nodes, surface)
        assert faces[k] == at_face
        np.testing.assert_allclose(points[k], (xi, eta), rtol=0, atol=1e-10)
        np.testing.assert_allclose(found[k, [GAP, SIZE, BEYOND]], (gap, size, beyond), rtol=0, atol=1e-10)
        np.testing.assert_allclose(found[k, NORMAL : NORMAL + 3], n, rtol=0, atol=1e-10)
        walked, left = walked + (at_face != face[k]), left + (beyond > 0.0)
    if count > 50:
        assert walked > 5
        assert left > 2


def test_a_lane_does_not_depend_on_the_others():
    """Alone or among many, a node's point is the same to the last bit."""
    nodes, surface = sheet()
    rng = np.random.default_rng(8)
    face = rng.integers(0, len(surface.faces), 90).astype(np.int32)
    point, places = rng.uniform(-1, 1, (90, 2)), rng.uniform(0, 1, (90, 3))
    together = found_together(places, face, point, nodes, surface)
    for k in (0, 17, 89):
        alone = found_together(places[k : k + 1], face[k : k + 1], point[k : k + 1], nodes, surface)
        assert all(np.array_equal(one[k], other[0]) for one, other in zip(together, alone, strict=True))


def test_every_contact_begins_where_its_node_lies():
    """At the corner of its face that is its node, in one contact for each smooth side of the bend."""
    nodes, surface = sheet()
    _, row = smooth_surface(nodes, surface.faces)
    mine = np.arange(len(row), dtype=np.int32)
    contacts = make_contacts(surface, row, mine, mine, np.ones(len(row)), np.ones(len(row)), len(nodes))
    assert {tuple(point) for point in contacts.point.tolist()} == {(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)}
    for c, (xi, eta) in enumerate(contacts.point):
        _, _, place, _ = at(contacts.face[c], xi, eta, nodes, surface)
        np.testing.assert_allclose(place, nodes[row[c]], atol=1e-14)
    on_bend = np.bincount(row) == 2
    assert on_bend.sum() == COUNT + 1
    assert (contacts.of_node == np.where(on_bend, 2.0, 1.0)[row]).all()
