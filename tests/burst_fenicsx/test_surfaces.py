"""Surfaces that may touch: faces that open beside eroded metal, smooth surfaces, where a charge slides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.contact.slide_surface import interface_faces, make_contacts, smooth_surface
from burst_fenicsx.contact.surfaces import OpenFaces, contact_surfaces, sides_beside
from burst_fenicsx.meshing import merge
from burst_fenicsx.meshing.cut import split_charges
from burst_fenicsx.problem import Part
from tests.burst_fenicsx.boxes import box, grid

pytestmark = pytest.mark.dolfinx


def opened(mesh, eroded):
    """Faces that open, as nodes of the mesh in outward order, with their bodies, cells and edges (m)."""
    surfaces = contact_surfaces(mesh)
    found = OpenFaces(mesh, surfaces).opened(eroded)
    known = len(surfaces.faces)
    np.testing.assert_array_equal(found.faces[:known], surfaces.faces)
    assert found.on_surface == surfaces.on_surface
    return found.node[found.faces[known:]], found.face_round[known:], found.cell[known:], found.edge[known:]


def test_an_eroded_cell_opens_the_sides_of_its_neighbours_towards_it():
    """Of a cell in the middle of a block's top: four sides; that below lies between layers and is known already."""
    size = 0.01
    block = replace(box((3, 3, 3), (3 * size,) * 3), segments=((),))
    other = replace(block, nodes=block.nodes + 1.0, round=block.round + 1)
    mesh = merge([block, other])
    centre = mesh.nodes[mesh.cells].mean(axis=1)
    eroded = np.linalg.norm(centre - (1.0 + size * np.array([1.5, 1.5, 2.5])), axis=1) < 1e-6
    assert eroded.sum() == 1
    faces, body, cell, edge = opened(mesh, eroded)
    assert len(faces) == 4
    assert body.tolist() == [1] * 4
    np.testing.assert_allclose(edge, size)
    hole = centre[eroded][0]
    for nodes, owner in zip(faces, cell, strict=True):
        corner = mesh.nodes[nodes]
        normal = np.cross(corner[2] - corner[0], corner[3] - corner[1])
        np.testing.assert_allclose(normal / np.linalg.norm(normal), (hole - centre[owner]) / size, atol=1e-9)
        np.testing.assert_allclose(corner.mean(axis=0), 0.5 * (hole + centre[owner]), atol=1e-9)
    neither = opened(mesh, np.zeros(len(eroded), dtype=bool))[0]
    assert len(neither) == 0
    # A second hole beside the first, at the edge: the side between both belongs to no whole cell.
    eroded |= np.linalg.norm(centre - (1.0 + size * np.array([2.5, 1.5, 2.5])), axis=1) < 1e-6
    assert len(opened(mesh, eroded)[0]) == 3 + 3


def test_eroded_metal_on_a_charge_opens_the_face_between_both():
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
    surface, group_row = smooth_surface(nodes, faces)
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
    surface, group_row = smooth_surface(nodes, faces)
    strength = np.arange(len(group_row), dtype=float)
    contacts = make_contacts(surface, group_row, group_row, np.arange(3), strength, strength, len(nodes))
    xi, eta = contacts.point.T
    weights = 0.25 * np.stack(
        [(1 - xi) * (1 - eta), (1 + xi) * (1 - eta), (1 + xi) * (1 + eta), (1 - xi) * (1 + eta)], 1
    )
    place = np.einsum("ck,cki->ci", weights, nodes[faces[contacts.face]])
    np.testing.assert_allclose(place, nodes[group_row], atol=1e-15)
    np.testing.assert_array_equal(contacts.of_node, np.bincount(group_row)[group_row])
    np.testing.assert_array_equal(contacts.strength, strength)
    assert (contacts.bonded == 1).all()
    assert (contacts.off == 0).all()


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


def test_a_charge_does_not_slide_on_a_charge():
    """Casing under charge, beside it charge whose free top is level with the casing's: two faces of the casing."""
    mesh = box((2, 1, 2), (0.02, 0.01, 0.02))
    right, upper = (mesh.nodes[mesh.cells].mean(axis=1)[:, [0, 2]] > 0.01).T
    part = np.where(right | upper, Part.CHARGE, Part.CASING)
    keep = ~(right & upper)
    mesh = replace(
        mesh, cells=mesh.cells[keep], part=part[keep], round=mesh.round[keep], segment=mesh.segment[keep],
        station=mesh.station[keep],
    )  # fmt: skip
    faces, cell, covered = interface_faces(mesh)
    assert (len(faces), covered) == (2, 2)
    assert (mesh.part[cell] == Part.CASING).all()
    middle = mesh.nodes[faces].mean(axis=1)
    assert sorted(middle.round(6).tolist()) == [[0.005, 0.005, 0.01], [0.01, 0.005, 0.005]]


@pytest.mark.parametrize("seed", range(4))
def test_a_charge_slides_on_along_a_floor_however_cells_are_numbered(seed):
    """A floor of four cells of casing, charge on two of them: the free half is reached in every order of the cells."""
    mesh = box((4, 1, 2), (0.04, 0.01, 0.02))
    centre = mesh.nodes[mesh.cells].mean(axis=1)
    keep = np.flatnonzero((centre[:, 2] < 0.01) | (centre[:, 0] < 0.02))
    keep = np.random.default_rng(seed).permutation(keep)
    part = np.where(centre[:, 2] > 0.01, Part.CHARGE, Part.CASING)
    mesh = replace(
        mesh, cells=mesh.cells[keep], part=part[keep], round=mesh.round[keep], segment=mesh.segment[keep],
        station=mesh.station[keep],
    )  # fmt: skip
    faces, cell, covered = interface_faces(mesh)
    assert (len(faces), covered) == (4, 2)
    assert (mesh.part[cell] == Part.CASING).all()
    middle = mesh.nodes[faces].mean(axis=1)
    np.testing.assert_allclose(middle[:, 2], 0.01, atol=1e-12)
    np.testing.assert_allclose(np.sort(middle[:, 0]), [0.005, 0.015, 0.025, 0.035], atol=1e-12)
    assert (middle[:2, 0] < 0.02).all()
