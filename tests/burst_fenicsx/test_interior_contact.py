"""Surfaces that may touch, that open or lie within; walls thrown so hard that their outer cells fold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.contact.sliding import interface_faces, smooth_surface
from burst_fenicsx.contact.surfaces import OpenFaces, contact_surfaces, outward_sides, sides_beside
from burst_fenicsx.kernels.contact.facets import weigh
from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from burst_fenicsx.meshing import merge
from burst_fenicsx.meshing.cut import split_charges
from burst_fenicsx.meshing.quality import folded_cells
from burst_fenicsx.problem import Mirror, Part, TimeStep
from tests.burst_fenicsx.bodies import QUIET, bodies, momentum, moved
from tests.burst_fenicsx.boxes import ELASTIC, TNT, box, grid, rotation_matrix

pytestmark = pytest.mark.dolfinx


CELL = 5e-3
METAL = replace(ELASTIC, density=7850.0, shear_strength=462e6, tensile_strength=800e6)
SETTINGS = replace(QUIET, cell_size=CELL, time_step=TimeStep(cfl=0.6))
MIRROR = Mirror("mirror", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))


def wall(counts, degrees):
    """A wall of `counts` cells, turned about z, its nearest edge 0.1 mm before the plane x = 0."""
    mesh = box(counts, [count * CELL for count in counts])
    nodes = mesh.nodes @ rotation_matrix((0.0, 0.0, 1.0), np.radians(degrees)).T
    return replace(mesh, nodes=nodes - [nodes[:, 0].min() - 1e-4, 0.0, 0.0])


def mirrored(mesh):
    return replace(mesh, nodes=mesh.nodes * [-1, 1, 1], cells=mesh.cells[:, [1, 0, 3, 2, 5, 4, 7, 6]])


def momentum_size(solver):
    return np.abs(solver.fields.mass[:, None] * solver.fields.nodes.velocity).sum()


def test_a_folding_wall_does_not_pass_a_plane():
    """Four cells thick, at 1500 m/s and 60 degrees: no interior node deeper than a twentieth of a cell at any time.

    While only surface nodes met the plane, 48 nodes ended up behind it, the deepest by 9 mm.
    """
    solver = bodies([wall((4, 14, 3), 60.0)], [(-1500.0, 0.0, 0.0)], replace(SETTINGS, planes=(MIRROR,)), casing=METAL)
    start, folded = momentum(solver), 0
    while solver.time < 40e-6:
        solver.step()
        folded = max(folded, int(folded_cells(solver.fields.nodes.position, solver.fields.mesh.dofmap).sum()))
    assert folded > 10
    penetrations = solver.contact.penetrations
    assert 0.0 < penetrations.interior_plane < 0.05 * CELL
    assert solver.fields.nodes.position[:, 0].min() > -0.05 * CELL
    # The plane without friction gives nothing along itself.
    assert np.abs((momentum(solver) - start)[1:]).max() < 1e-12 * momentum_size(solver)


def thrown(order=(0, 1), *, speed=1000.0, counts=(4, 16, 8), comm=MPI.COMM_SELF, casing=METAL):
    """A wall and its mirror image thrown at each other at 45 degrees, in plane strain."""
    one = wall(counts, 45.0)
    meshes = [(one, mirrored(one))[k] for k in order]
    speeds = [((-speed, 0.0, 0.0), (speed, 0.0, 0.0))[k] for k in order]
    placed = [moved(mesh, (0, 0, 0), k) for k, mesh in enumerate(meshes)]
    solver = bodies(placed, speeds, SETTINGS, casing=casing, comm=comm)
    solver.constraints = (NodalConstraint(np.arange(len(solver.fields.mass)), (0.0, 0.0, 1.0)),)
    return solver


def collide(order=(0, 1), *, until=50e-6, contacts=None, **changes):
    """`thrown` walls at a time (s), or so many steps after the first contact of interior nodes: `contacts`."""
    solver = thrown(order, **changes)
    while solver.time < until:
        solver.step()
        if contacts is not None and solver.contact.penetrations.interior_collision > 0.0:
            contacts -= 1
            if contacts == 0:
                break
    return solver


def touches_inside(solver):
    """Whether any interior node touches a face."""
    contact = solver.contact
    pairs, surfaces = contact.collisions.pairs, contact.collisions.surfaces
    interior = contact.nodes.rows_of(surfaces.node[surfaces.interior])
    return np.isin(pairs.node[pairs.facet >= 0], interior).any()


def test_folding_walls_do_not_pass_each_other():
    """Four cells thick, at 1000 m/s each: in the end no node is beyond the plane of symmetry by a tenth of a cell.

    Nodes near the free sides, where metal goes round the rim, are left out. While only surface nodes met faces, the
    deepest was 5.3 mm.
    """
    solver = collide()
    fields = solver.fields
    sizes = momentum_size(solver)
    own = np.unique(fields.mesh.dofmap[fields.mesh.round == 0])
    height = fields.start[own, 2] / CELL
    within = own[(height > 1.5) & (height < 6.5)]
    assert folded_cells(fields.nodes.position, fields.mesh.dofmap).sum() > 50
    assert fields.nodes.position[within, 0].min() > -0.1 * CELL
    assert solver.contact.penetrations.interior_collision > 0.0
    assert np.abs(momentum(solver)[0]) < 1e-12 * sizes


def test_contact_of_interior_nodes_is_the_same_after_exchanging_the_bodies():
    """Forces on the nodes of both walls a few steps after interior nodes have met faces, whichever wall comes first."""
    ways = []
    for order in ((0, 1), (1, 0)):
        solver = collide(order, contacts=3)
        assert solver.contact.penetrations.interior_collision > 0.0
        assert touches_inside(solver)
        fields = solver.fields
        half = len(fields.mass) // 2
        number = fields.mesh.node
        rows = np.empty((2, half, 3))
        rows[number // half, number % half] = solver.contact.force
        ways.append(rows[list(order)])
        assert np.abs(solver.contact.force.sum(axis=0)).max() < 1e-12 * np.abs(solver.contact.force).sum()
    assert np.abs(ways[0]).max() > 0.0
    assert np.allclose(ways[0], ways[1], rtol=1e-6, atol=1e-9 * np.abs(ways[0]).max())


def test_layers_are_nested_and_look_outward():
    """A cube of 5 cells: of its 98 + 26 + 1 cells in layers, the faces between them enclose cubes of 3 and 1 cells."""
    size = 5 * CELL
    pair = [box((5, 5, 5), (size, size, size)), moved(box((2, 2, 2), (size, size, size)), (2 * size, 0, 0), 1)]
    mesh = merge([replace(one, segments=((),)) for one in pair])
    surfaces = contact_surfaces(mesh)
    inner = surfaces.faces[surfaces.on_surface :]
    assert len(inner) == 6 * 9 + 6
    assert surfaces.interior.sum() == 4**3 + 1
    corners = mesh.nodes[surfaces.node[inner]]
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    outward = corners.mean(axis=1) - 0.5 * size
    assert (np.einsum("ij,ij->i", normal, outward) > 0.0).all()
    assert set(surfaces.face_round[surfaces.on_surface :].tolist()) == {0}
    assert outward_sides(mesh)[:125].sum() == 6 * 25 + 6 * 9 + 6


def test_nodes_of_the_bore_look_for_other_rounds():
    """A cube of 3 cells with a charge of one: its casing's 8 nodes there meet a body that has come so far."""
    size = 3 * CELL
    cased = box((3, 3, 3), (size, size, size))
    centre = cased.nodes[cased.cells].mean(axis=1)
    charge = np.isclose(centre, 0.5 * size).all(axis=1)
    cased = replace(cased, part=np.where(charge, Part.CHARGE, Part.CASING).astype(np.int32))
    other = moved(box((2, 2, 2), (size, size, size)), (1.5 * size, 0.0, 0.0), 1)
    mesh = split_charges(merge([replace(one, segments=((),)) for one in (cased, other)]))
    surfaces = contact_surfaces(mesh)
    bore = surfaces.node[surfaces.inner & (surfaces.node_round == 0)]
    assert len(bore) == 8
    assert np.abs(mesh.nodes[bore] - 0.5 * size).max() == pytest.approx(0.5 * CELL)
    assert not surfaces.interior[np.isin(surfaces.node, bore)].any()
    solver = bodies([cased, replace(other, nodes=other.nodes - [0.9 * size, 0.0, 0.0])], [(0.0,) * 3] * 2, SETTINGS)
    collisions = solver.contact.collisions
    collisions.search()
    inner = np.flatnonzero(collisions.surfaces.inner & (collisions.surfaces.node_round == 0))
    assert len(inner) == 8
    rows = solver.contact.nodes.rows_of(collisions.surfaces.node[inner])
    assert set(rows.tolist()) <= set(collisions.pairs.node[collisions.seen.other == 1].tolist())


def test_a_lone_body_has_neither_interior_nodes_nor_layers():
    """Single rounds pay nothing."""
    surfaces = contact_surfaces(box((4, 4, 4), (0.04, 0.04, 0.04)))
    assert not surfaces.interior.any()
    assert surfaces.on_surface == len(surfaces.faces) == 6 * 16
    solver = bodies([box((4, 4, 4), (0.04, 0.04, 0.04))], [(0.0, 0.0, 0.0)], QUIET, comm=MPI.COMM_SELF)
    assert solver.contact.touched.sum() == 5**3 - 3**3


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
    assert len(surface.first) == len(group_row) + 1
    for face, row in enumerate(faces):
        for k in range(4):
            corner = surface.corner[face, k]
            assert group_row[corner] == row[k]
            assert face in surface.member[surface.first[corner] : surface.first[corner + 1]]
            edge = {int(row[k]), int(row[(k + 1) % 4])}
            others = [other for other in range(len(faces)) if other != face and edge <= set(faces[other].tolist())]
            ridge = on_ridge[list(edge)].all()
            assert surface.neighbour[face, k] == (others[0] if others and (smooth or not ridge) else -1)
    assert surface.known.all()
    np.testing.assert_array_equal(surface.facets, faces)


def test_every_contact_begins_at_its_own_corner_and_shares_its_node():
    """The edge of a charge's cube between its casing's floor and wall has two contacts a node."""
    mesh = box((2, 2, 2), (0.02,) * 3)
    centre = mesh.nodes[mesh.cells].mean(axis=1)
    charge = (centre[:, 0] > 0.01) & (centre[:, 2] > 0.01)
    mesh = split_charges(replace(mesh, part=np.where(charge, Part.CHARGE, Part.CASING).astype(np.int32)))
    solver = bodies([mesh], [(0.0,) * 3], QUIET)
    interface, rows, start = solver.contact.interface, solver.contact.nodes.rows, solver.fields.start
    pairs, bonds = interface.pairs, interface.bonds
    weight = np.array([[weigh(corner, 4, xi, eta) for corner in range(4)] for xi, eta in pairs.point])
    nodes = start[rows.local[interface.facets[pairs.facet]]]
    node = rows.local[pairs.node]
    np.testing.assert_allclose(np.einsum("ck,cki->ci", weight, nodes), start[node], atol=1e-15)
    at_edge = np.isclose(start[node, 0], 0.01) & np.isclose(start[node, 2], 0.01)
    np.testing.assert_array_equal(bonds.of_node, np.where(at_edge, 2.0, 1.0))
    assert at_edge.sum() == 2 * 3
    np.testing.assert_allclose(bonds.strength, TNT.shear_strength)
    np.testing.assert_array_equal(bonds.cells, np.where(np.isclose(start[node, 1], 0.01), 2.0, 1.0))
    assert (bonds.bonded == 1).all()
    assert (bonds.off == 0).all()


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
