"""Points of facets: followed over a smooth surface and closest ones, by hand, by NumPy and by a minimiser."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

pytest.importorskip("dolfinx")

from burst_fenicsx.contact.sliding import smooth_surface
from burst_fenicsx.kernels.contact.facets import area_vectors, closest_point, find_point, group_vectors

pytestmark = pytest.mark.dolfinx

COUNT = 12  # faces along a side of the sheet
_S, _T = np.array([-1.0, 1.0, 1.0, -1.0]), np.array([-1.0, -1.0, 1.0, 1.0])


def sheet():
    """A wavy square sheet of 12 x 12 faces with a sharp bend along its middle: nodes, surface."""
    number = np.arange((COUNT + 1) ** 2).reshape(COUNT + 1, COUNT + 1)
    faces = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, COUNT + 1), np.linspace(0, 1, COUNT + 1), indexing="ij"))
    nodes = np.stack([u, v, 1.5 * np.abs(u - 0.5) + 0.05 * np.sin(9 * u) * np.cos(7 * v)], axis=-1)
    nodes += np.random.default_rng(3).normal(0, 0.004, nodes.shape)
    surface, _ = smooth_surface(nodes, faces.astype(np.int32))
    sum_vectors(surface, nodes)
    return nodes, surface


def sum_vectors(surface, nodes):
    facets, groups = (np.arange(len(values), dtype=np.int32) for values in (surface.facets, surface.vector))
    area_vectors(0, len(facets), facets, surface.facets, nodes, surface.area)
    group_vectors(0, len(groups), groups, surface)


def at(face, xi, eta, nodes, surface):
    """Tangents, place and area vector at a point of a face."""
    x, v = nodes[surface.facets[face]], surface.vector[surface.corner[face]]
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
    """Follow one node over the faces to the last digit: where it lies, and how far beyond the surface's edge."""
    for _ in range(10):
        for _ in range(40):
            gap, n, size, along, (xi, eta), change = improved(node, face, xi, eta, nodes, surface)
            if change < 1e-14:
                break
        if max(abs(xi), abs(eta)) <= 1 + 1e-9:
            return face, xi, eta, gap, n, size, 0.0
        over = np.array([-eta, xi, eta, -xi])
        other = surface.neighbour[face]
        over[(other < 0) | ~surface.known[np.maximum(other, 0)]] = -np.inf
        edge = int(np.argmax(over))
        if over[edge] <= 1 + 1e-9:
            xi, eta = np.clip([xi, eta], -1.0, 1.0)
            gap, n, size, along, _, _ = improved(node, face, xi, eta, nodes, surface)
            return face, xi, eta, gap, n, size, np.linalg.norm(along)
        face, xi, eta = int(other[edge]), 0.0, 0.0
    return None


@pytest.mark.parametrize(("count", "moved"), [(300, 0.01), (100, 0.03)])
def test_points_are_those_found_by_hand(count, moved):
    """Nodes that stay in their face, walk over several, or leave over a rim or a bend."""
    nodes, surface = sheet()
    surface.known[[40, 77]] = False
    rng = np.random.default_rng(count)
    face = rng.choice(np.flatnonzero(surface.known), count).astype(np.int32)
    point = rng.uniform(-1, 1, (count, 2))
    walked, left, compared = 0, 0, 0
    for k in range(count):
        start = at(face[k], *point[k], nodes, surface)[2]
        node = start + rng.normal(0, moved, 3) * (1, 1, 0.2)
        by_hand = found_by_hand(node, face[k], *point[k], nodes, surface)
        if by_hand is None:
            continue
        compared += 1
        at_face, xi, eta, gap, n, beyond, size = find_point(tuple(node), face[k], *point[k], False, surface, nodes)
        assert at_face == by_hand[0]
        # The last change of the coordinates, of 1e-6 at most, is in the gap but not in the normal.
        assert gap == pytest.approx(by_hand[3], rel=0, abs=1e-9)
        expected = [*by_hand[1:3], *by_hand[4], *by_hand[5:]]
        np.testing.assert_allclose([xi, eta, *n, size, beyond], expected, rtol=0, atol=1e-6)
        walked, left = walked + (at_face != face[k]), left + (beyond > 0.0)
    assert compared > 0.9 * count
    assert walked > 5
    assert left > 2


def point_of(place, corner):
    xi, eta, foot, normal = closest_point(tuple(place), np.arange(4, dtype=np.int32), np.asarray(corner, dtype=float))
    return np.array([xi, eta]), np.array(foot), np.array(normal)


def test_closest_point_of_a_flat_face():
    """Foot of the perpendicular within, clamped without; the normal looks outward."""
    corner = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]])
    local, place, normal = point_of((1.5, 0.25, -0.3), corner)
    assert local == pytest.approx([0.5, -0.5])
    assert place == pytest.approx([1.5, 0.25, 0.0])
    assert normal == pytest.approx([0, 0, 1])
    assert point_of((5.0, -2.0, 0.1), corner)[1] == pytest.approx([2, 0, 0])
    for kept in ([0, 1, 2, 2], [0, 1, 1, 1]):  # corners may coincide
        assert np.isfinite(np.concatenate(point_of((0.7, 0.2, 0.1), corner[kept]))).all()


def test_closest_point_of_a_twisted_face_is_the_nearest():
    """Against a minimiser, on warped faces and points near them."""
    rng = np.random.default_rng(11)
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    for _ in range(30):
        corner = square + rng.uniform(-0.15, 0.15, (4, 3))
        local = rng.uniform(-0.95, 0.95, 2)

        def at_point(uv, corner=corner):
            x, y = uv
            weight = 0.25 * np.array([(1 - x) * (1 - y), (1 + x) * (1 - y), (1 + x) * (1 + y), (1 - x) * (1 + y)])
            return weight @ corner

        target = at_point(local) + rng.normal(0, 0.02, 3)
        best = minimize(
            lambda uv, target=target, at=at_point: np.sum((at(uv) - target) ** 2), local, bounds=[(-1, 1)] * 2,
            tol=1e-14,
        )  # fmt: skip
        _, place, _ = point_of(target, corner)
        assert np.linalg.norm(place - target) == pytest.approx(np.sqrt(best.fun), rel=1e-3, abs=1e-6)


@pytest.mark.parametrize("held", [(), (0,), (0, 1)])
def test_in_a_plane_of_symmetry_the_normal_lies_in_it_and_counts_the_image(held):
    """A bent face with its corner node in the planes x = 0 and y = 0: as with the images' faces around the node."""
    corner = np.array([[0.0, 0, 0.1], [1, 0, 0], [1, 1, 0.2], [0, 1, -0.1]])
    faces, nodes = [[0, 1, 2, 3]], [corner]
    for plane in range(2):
        if plane in held:
            for mirrored in [one.copy() for one in nodes]:
                mirrored[:, plane] *= -1.0
                nodes.append(mirrored[::-1])
    expected = sum(0.5 * np.cross(one[2] - one[0], one[3] - one[1]) for one in nodes)
    lies = np.zeros((4, 2), dtype=bool)
    lies[0, list(held)] = True
    surface, group_node = smooth_surface(corner, np.array(faces, dtype=np.int32), lies, np.eye(3)[:2])
    sum_vectors(surface, corner)
    np.testing.assert_allclose(surface.vector[group_node == 0][0], expected, atol=1e-15)
