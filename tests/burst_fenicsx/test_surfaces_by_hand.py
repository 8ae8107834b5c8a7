"""Surfaces that may touch, by hand: nodes at planes, faces that open beside torn metal, where a charge slides."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from burst_fenicsx.contact import ContactForces
from burst_fenicsx.contact.forces import Penetrations
from burst_fenicsx.contact.near_faces import NearFaces
from burst_fenicsx.contact.planes import held_in_plane, nodes_at_planes
from burst_fenicsx.contact.slide_surface import faces_of, interface_faces, make_contacts, smooth_surface, widened
from burst_fenicsx.contact.surfaces import contact_surfaces
from burst_fenicsx.contact.torn_faces import TornFaces, sides_beside
from burst_fenicsx.meshing import merge
from burst_fenicsx.meshing.cut import split_charges
from burst_fenicsx.problem import ContactSettings, Part, RigidPlane
from tests.burst_fenicsx.boxes import BARE, box, burst, grid

pytestmark = pytest.mark.dolfinx


def test_what_lies_in_a_plane_of_symmetry_for_good_never_meets_it():
    """To a nanometre, and only where it is held."""
    height = np.array([0.0, 0.9e-9, -0.9e-9, 1.1e-9, -1.1e-9, 0.0])
    normal = np.array([0.0, 0.6, 0.8])
    nodes = np.outer(height + 0.3, normal)
    held = np.array([1, 2, 1, 1, 1, 0], dtype=np.uint8)
    mesh = SimpleNamespace(nodes=nodes, held=held)
    plane = RigidPlane("cut", tuple(0.3 * normal), tuple(5.0 * normal))
    every = np.arange(6)
    assert held_in_plane(mesh, every, plane).tolist() == [True, True, True, False, False, False]
    assert held_in_plane(mesh, every[::-1][:4], plane).tolist() == [False, False, False, True]
    mesh.held = None
    assert not held_in_plane(mesh, every, plane).any()


def test_a_plane_stops_all_of_a_casing_and_the_outside_of_a_charge():
    casing, charge = box((3, 3, 3), (0.03,) * 3), box((3, 3, 3), (0.03,) * 3, Part.CHARGE)
    away = {"nodes": charge.nodes + np.array([0.5, 0.0, 0.0]), "round": charge.round + 1, "segments": ((),)}
    both = merge([replace(casing, segments=((),)), replace(charge, **away)])
    nodes, interior = nodes_at_planes(both, contact_surfaces(both))
    of_charge = both.nodes[nodes, 0] > 0.4
    assert len(nodes) == 64 + 56
    assert (of_charge.sum(), interior.sum(), (interior & of_charge).sum()) == (56, 8, 0)
    within = np.abs(both.nodes[nodes] - 0.015).max(axis=1) < 0.014
    np.testing.assert_array_equal(interior, within)


def opened(mesh, torn):
    """Faces that open, as nodes of the mesh in outward order, with their bodies, cells and edges (m)."""
    surfaces = contact_surfaces(mesh)
    found = TornFaces(mesh, surfaces).opened(torn)
    known = len(surfaces.faces)
    np.testing.assert_array_equal(found.faces[:known], surfaces.faces)
    assert found.on_surface == surfaces.on_surface
    return found.node[found.faces[known:]], found.face_body[known:], found.cell[known:], found.edge[known:]


def test_a_torn_cell_opens_the_sides_of_its_neighbours_towards_it():
    """Of a cell in the middle of a block's top: four sides; that below lies between layers and is known already."""
    size = 0.01
    block = replace(box((3, 3, 3), (3 * size,) * 3), segments=((),))
    other = replace(block, nodes=block.nodes + 1.0, round=block.round + 1)
    mesh = merge([block, other])
    centre = mesh.nodes[mesh.cells].mean(axis=1)
    torn = np.linalg.norm(centre - (1.0 + size * np.array([1.5, 1.5, 2.5])), axis=1) < 1e-6
    assert torn.sum() == 1
    faces, body, cell, edge = opened(mesh, torn)
    assert len(faces) == 4
    assert body.tolist() == [2] * 4
    np.testing.assert_allclose(edge, size)
    hole = centre[torn][0]
    for nodes, owner in zip(faces, cell, strict=True):
        corner = mesh.nodes[nodes]
        normal = np.cross(corner[2] - corner[0], corner[3] - corner[1])
        np.testing.assert_allclose(normal / np.linalg.norm(normal), (hole - centre[owner]) / size, atol=1e-9)
        np.testing.assert_allclose(corner.mean(axis=0), 0.5 * (hole + centre[owner]), atol=1e-9)
    neither = opened(mesh, np.zeros(len(torn), dtype=bool))[0]
    assert len(neither) == 0
    # A second hole beside the first, at the edge: the side between both belongs to no whole cell.
    torn |= np.linalg.norm(centre - (1.0 + size * np.array([2.5, 1.5, 2.5])), axis=1) < 1e-6
    assert len(opened(mesh, torn)[0]) == 3 + 3


def test_torn_metal_on_a_charge_opens_the_face_between_both():
    """By the metal's nodes, which keep its mass, looking out of the charge."""
    size = 0.01
    mesh = box((1, 1, 2), (size, size, 2 * size))
    above = mesh.nodes[mesh.cells].mean(axis=1)[:, 2] > size
    mesh = replace(mesh, part=np.where(above, Part.CASING, Part.CHARGE).astype(np.int32))
    faces, body, cell, edge = opened(mesh, above)
    (nodes,) = faces
    assert set(nodes.tolist()) == set(mesh.cells[above][0][mesh.nodes[mesh.cells[above][0], 2] < 1.5 * size].tolist())
    corner = mesh.nodes[nodes]
    assert np.cross(corner[2] - corner[0], corner[3] - corner[1])[2] > 0.0
    assert (body.tolist(), cell.tolist()) == ([0], np.flatnonzero(~above).tolist())
    np.testing.assert_allclose(edge, size)
    beside = sides_beside(mesh.neighbours, above)
    assert (beside[~above].sum(), beside[above].sum()) == (1, 0)


def roof(angle, ridge=4):
    """Two rows of `ridge` unit faces that meet in a ridge and lean by `angle` (degrees) against each other."""
    half = np.radians(0.5 * angle)
    x, y = np.meshgrid([-1.0, 0.0, 1.0], np.arange(ridge + 1.0), indexing="ij")
    nodes = np.column_stack([x.ravel() * np.cos(half), y.ravel(), -np.abs(x.ravel()) * np.sin(half)])
    number = np.arange(len(nodes)).reshape(3, -1)
    faces = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    return nodes, faces


@pytest.mark.parametrize(("angle", "smooth"), [(0.0, True), (44.0, True), (46.0, False), (90.0, False)])
def test_faces_are_one_smooth_surface_where_they_lean_by_less_than_half_a_right_angle(angle, smooth):
    """Along the ridge a node has one group or two, and a face a neighbour across it or none."""
    nodes, faces = roof(angle)
    surface, group_row = smooth_surface(nodes, faces, len(nodes))
    on_ridge = np.isclose(nodes[:, 0], 0.0)
    np.testing.assert_array_equal(np.bincount(group_row), np.where(on_ridge & (not smooth), 2, 1))
    assert len(surface.first_face) == len(group_row) + 1
    for face, row in enumerate(faces):
        for k in range(4):
            corner = surface.corner[face, k]
            assert group_row[corner] == row[k]
            assert face in surface.face[surface.first_face[corner] : surface.first_face[corner + 1]]
            edge = {int(row[k]), int(row[(k + 1) % 4])}
            others = [other for other in range(len(faces)) if other != face and edge <= set(faces[other].tolist())]
            ridge = on_ridge[list(edge)].all()
            assert surface.neighbour[face, k] == (others[0] if others and (smooth or not ridge) else -1)
    assert surface.known.all()
    np.testing.assert_array_equal(surface.faces, faces)


def test_every_contact_begins_at_its_own_corner_and_shares_its_node():
    nodes, faces = roof(90.0)
    surface, group_row = smooth_surface(nodes, faces, len(nodes))
    strength = np.arange(len(group_row), dtype=float)
    contacts = make_contacts(surface, group_row, group_row, np.arange(3), strength)
    xi, eta = contacts.point.T
    weights = 0.25 * np.stack(
        [(1 - xi) * (1 - eta), (1 + xi) * (1 - eta), (1 + xi) * (1 + eta), (1 - xi) * (1 + eta)], 1
    )
    place = np.einsum("ck,cki->ci", weights, nodes[faces[contacts.face]])
    np.testing.assert_allclose(place, nodes[group_row], atol=1e-15)
    np.testing.assert_array_equal(contacts.share, np.bincount(group_row)[group_row])
    np.testing.assert_array_equal(contacts.strength, strength)
    assert (contacts.bonded == 1).all()
    assert (contacts.off == 0).all()
    for group in range(len(group_row)):
        own = faces_of(surface, np.array([group]))
        np.testing.assert_array_equal(own, surface.face[surface.first_face[group] : surface.first_face[group + 1]])
    both = faces_of(surface, np.array([0, 5]))
    np.testing.assert_array_equal(
        np.sort(both), np.sort(np.concatenate([faces_of(surface, np.array([k])) for k in (0, 5)]))
    )


def test_faces_are_widened_by_those_that_share_a_node():
    nodes, faces = roof(10.0, ridge=6)
    chosen = np.zeros(len(faces), dtype=bool)
    for _ in range(3):
        chosen[2] = True
        grown = widened(faces, chosen, len(nodes))
        touched = set(faces[chosen].ravel().tolist())
        np.testing.assert_array_equal(grown, [bool(touched & set(face.tolist())) for face in faces])
        chosen = grown
    assert not widened(faces, np.zeros(len(faces), dtype=bool), len(nodes)).any()


@pytest.mark.parametrize("step", [0.0, 1.0])
def test_a_charge_slides_on_the_faces_at_which_it_lies_and_on_what_these_lead_on_to(step):
    """A charge in a trough of casing, half as long as the trough: its free floor counts, beyond a step it does not."""

    def carry(points):
        bent = np.where(points[:, 0] > 0.5 + 1e-9, step, 0.0) * 0.01 * (points[:, 2] > 0.4) * (points[:, 0] < 0.76)
        return points * [0.04, 0.01, 0.02] + bent[:, None] * [0.0, 0.0, 1.0]

    mesh = grid((4, 1, 2), carry)
    centre = mesh.nodes[mesh.cells].mean(axis=1)
    floor = np.arange(len(mesh.cells)) % 2 == 0
    charge = ~floor & (centre[:, 0] < 0.02)
    keep = floor | charge
    mesh = replace(
        mesh, cells=mesh.cells[keep], part=np.where(charge, Part.CHARGE, Part.CASING)[keep].astype(np.int32),
        round=mesh.round[keep], segment=np.where(charge, -1, 0)[keep].astype(np.int32), station=mesh.station[keep],
    )  # fmt: skip
    used = np.unique(mesh.cells)
    mesh = replace(mesh, nodes=mesh.nodes[used], cells=np.searchsorted(used, mesh.cells))
    mesh = split_charges(mesh)
    faces, cell, covered = interface_faces(mesh)
    assert covered == 2
    middle = mesh.nodes[faces].mean(axis=1)
    normal = np.cross(
        mesh.nodes[faces[:, 2]] - mesh.nodes[faces[:, 0]], mesh.nodes[faces[:, 3]] - mesh.nodes[faces[:, 1]]
    )
    assert (normal[:, 2] > 0.0).all()
    assert sorted(middle[:2, 0].round(9).tolist()) == [0.005, 0.015]
    assert (mesh.part[cell] == Part.CASING).all()
    assert len(faces) == (4 if step == 0.0 else 2)


@pytest.mark.parametrize("order", [None, "before", "behind"])
def test_every_surface_node_is_known_by_its_row(order):
    """Of a charge whose inner nodes lie on no surface, numbered before or behind the others."""
    mesh = box((3, 3, 3), (0.03,) * 3, Part.CHARGE)
    if order is not None:
        inner = ((mesh.nodes > 1e-3) & (mesh.nodes < 0.029)).all(axis=1)
        sequence = np.argsort(inner if order == "behind" else ~inner, kind="stable")
        mesh = replace(mesh, nodes=mesh.nodes[sequence], cells=np.argsort(sequence)[mesh.cells])
    settings = replace(BARE, contact=ContactSettings(surfaces=True))
    fields = burst(mesh, settings).fields
    found = ContactForces(mesh, fields, settings).collisions
    assert len(found.surfaces.node) == 56
    assert sorted(found._rows.tolist()) == list(range(56))
    np.testing.assert_array_equal(fields.mesh.node[found._local], found.surfaces.node[found._rows])
    np.testing.assert_array_equal(found.near_faces.own, np.arange(54))
    found.search()
    np.testing.assert_array_equal(found.searched_at, mesh.nodes[found.surfaces.node])


def test_the_summary_of_contact_names_what_was_counted():
    interface = SimpleNamespace(counts=lambda: np.array([5.0, 3.0, 2.0]))
    contact = SimpleNamespace(
        comm=MPI.COMM_SELF, interface=interface, spring_energy=7.0, friction=11.0, work=-17.5, gain=0.5, exists=True,
        penetrations=Penetrations(1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3), collisions=SimpleNamespace(searches=9),
    )  # fmt: skip
    found = ContactForces.summary(contact)
    names = ("bonded", "touching", "off_surface", "spring_energy", "friction_heat", "max_penetration", "searches")
    assert [found[name] for name in names] == [5, 3, 2, 7.0, 11.0, 4e-3, 9]
    assert [found[f"max_{name}_penetration"] for name in (
        "collision", "plane", "interior_collision", "interior_plane", "interface",
    )] == [getattr(contact.penetrations, name) for name in (
        "collision", "plane", "interior_collision", "interior_plane", "interface_after",
    )]  # fmt: skip
    contact.interface = contact.collisions = None
    contact.exists = False
    found = ContactForces.summary(contact)
    assert [found[name] for name in names] == [0, 0, 0, 7.0, 11.0, None, 0]


@pytest.mark.parametrize("rank", [0, 1, 2])
@pytest.mark.parametrize("others", [(0.4, 9.0), (9.0, 2.1), (9.0, 9.0), (0.3, 1.9)])
def test_another_rank_is_sent_the_faces_near_its_nodes(rank, others):
    """Five faces in a row along x, a metre apart; each other rank searches at one place, this one everywhere."""
    faces = np.arange(20, dtype=np.int32).reshape(5, 4)
    position = np.random.default_rng(1).normal(size=(20, 3))
    low = np.array([[x - 0.45, -1.0, -1.0] for x in range(5)])
    boxes = np.hstack([low, low + np.array([0.9, 2.0, 2.0])])
    places = np.insert(np.array(others), rank, 2.0)
    sent = []

    def gather(around):
        every = [np.array([x, 0.0, 0.0, x, 0.0, 0.0]) for x in places]
        every[rank] = around
        return every

    def exchange(messages):
        sent.extend(messages)
        return [None, None, None]

    comm = SimpleNamespace(size=3, rank=rank, allgather=gather, alltoall=exchange)
    near = NearFaces.__new__(NearFaces)
    near._comm, near._faces = comm, faces
    mine = np.array([[-0.2, 0.0, 0.0], [4.2, 0.5, 0.5]])
    found = near.exchange(np.arange(5, dtype=np.int32), boxes, mine, position)
    assert len(found) == near.received == 0
    for other, place in enumerate(places):
        if other == rank or place > 5.0:
            assert sent[other] is None
        else:
            (face,) = sent[other][0]
            assert face == round(place)
            np.testing.assert_array_equal(sent[other][1], position[4 * face : 4 * face + 4])
    # What the others send is put in its place.
    chosen = np.array([3, 1], dtype=np.int32)
    answer = (chosen, 100.0 + np.arange(24.0).reshape(8, 3))
    comm.alltoall = lambda _: [answer, None, (np.array([2], dtype=np.int32), np.full((4, 3), -1.0))]
    found = near.exchange(np.arange(5, dtype=np.int32), boxes, mine, position)
    assert found.tolist() == [1, 2, 3]
    assert near.received == 12
    np.testing.assert_array_equal(position[[4, 5, 6, 7, 12, 13, 14, 15]], answer[1])
    assert (position[8:12] == -1.0).all()


def test_a_rank_has_the_faces_of_its_cells():
    surfaces = SimpleNamespace(faces=np.zeros((5, 4), dtype=np.int32), cell=np.array([4, 0, 2, 4, 1]))
    mesh = SimpleNamespace(cell=np.array([7, 4, 1, 9]))
    assert NearFaces(SimpleNamespace(size=2), surfaces, mesh).own.tolist() == [0, 3, 4]
    assert NearFaces(SimpleNamespace(size=1), surfaces, mesh).own.tolist() == [0, 1, 2, 3, 4]
