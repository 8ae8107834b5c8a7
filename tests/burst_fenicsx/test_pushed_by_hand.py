"""What planes and the casing do to nodes that have come too far, by hand: depths, forces, who is pushed at all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from burst_fenicsx.contact import ContactForces
from burst_fenicsx.contact.planes import nodes_at_planes
from burst_fenicsx.contact.slide_surface import interface_faces
from burst_fenicsx.contact.surfaces import contact_surfaces
from burst_fenicsx.meshing import merge
from burst_fenicsx.meshing.cut import split_charges
from burst_fenicsx.problem import ContactSettings, Part, RigidPlane
from tests.burst_fenicsx.bodies import QUIET, bodies
from tests.burst_fenicsx.boxes import BARE, box, burst

pytestmark = pytest.mark.dolfinx


def layered(index=0, offset=0.0, *, below=Part.CASING):
    """A block of 2 x 2 x 4 cells of 10 mm: casing under charge, or the other way round."""
    mesh = box((2, 2, 4), (0.02, 0.02, 0.04))
    upper = mesh.nodes[mesh.cells].mean(axis=1)[:, 2] > 0.02
    part = np.where(upper == (below == Part.CASING), Part.CHARGE, Part.CASING).astype(np.int32)
    return replace(
        mesh, part=part, segment=np.where(part == Part.CHARGE, -1, 0).astype(np.int32), segments=((),),
        nodes=mesh.nodes + np.array([offset, 0.0, 0.0]), round=np.full(16, index, dtype=np.int32),
    )  # fmt: skip


@pytest.mark.parametrize("height", [0.025, 0.012, 0.005])
def test_a_plane_pushes_every_node_that_has_come_through_it(height):
    """The outer nodes by up to their depth, the one in the middle of the box by its own."""
    plane = RigidPlane("wall", (0.0, 0.0, height), (0.0, 0.0, 3.0))
    mesh = box((2, 2, 2), (0.02,) * 3)
    settings = replace(BARE, contact=ContactSettings(surfaces=False), planes=(plane,))
    contact = ContactForces(mesh, burst(mesh, settings).fields, settings)
    contact.add_forces(0.0, 0.0, front_is_active=False)
    contact.add_forces(1e-6, 0.0, front_is_active=False)
    through = contact._fields.nodes.position[:, 2] < height
    np.testing.assert_array_equal(contact.force[:, 2] > 0.0, through)
    assert through.sum() == (27 if height > 0.02 else 18 if height > 0.01 else 9)
    assert contact.planes[0].deepest == pytest.approx(height, rel=1e-12)
    assert contact.planes[0].deepest_interior == pytest.approx(max(height - 0.01, 0.0), abs=1e-12)
    stiffness = contact.force[through, 2] / (height - contact._fields.nodes.position[through, 2])
    ratio = stiffness / contact._fields.mass[through]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)


def test_the_face_between_casing_and_charge_is_the_charges_surface_in_every_round():
    """Two rounds whose charges share nodes with the casing: within the casing alone a node lies on no surface."""
    both = merge([layered(), layered(1, 0.5)])
    nodes, interior = nodes_at_planes(both, contact_surfaces(both))
    assert len(nodes) == 2 * (45 - 1)
    inside = np.isclose(both.nodes[nodes] % 0.5, 0.01).all(axis=1)
    np.testing.assert_array_equal(interior, inside)
    assert inside.sum() == 2


@pytest.mark.parametrize("below", [Part.CASING, Part.CHARGE])
def test_a_charge_lies_on_the_casing_faces_towards_it_alone(below):
    """Outward from the casing; the casing's other faces stand at right angles to them."""
    mesh = layered(below=below)
    faces, cell, covered = interface_faces(mesh)
    assert (len(faces), covered) == (4, 4)
    np.testing.assert_allclose(mesh.nodes[faces, 2], 0.02, atol=1e-12)
    assert (mesh.part[cell] == Part.CASING).all()
    corner = mesh.nodes[faces]
    outward = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    np.testing.assert_allclose(outward, [[0, 0, 2e-4 if below == Part.CASING else -2e-4]] * 4, atol=1e-12)


@pytest.mark.parametrize(("gap", "tensile"), [(-1e-6, 0.0), (-3e-6, 1e12), (1e-9, 1e12), (1e-9, 0.0), (0.0, 1e12)])
def test_a_charge_moved_off_its_casing_is_drawn_or_pushed_back(gap, tensile):
    """All of it by one gap: depth, energy of the springs, forces that balance; it is free where it is not bonded."""
    settings = replace(QUIET, cell_size=0.01, contact=ContactSettings(tensile_strength=tensile, cohesion=0.0))
    solver = bodies([split_charges(layered())], [(0, 0, 0)], settings)
    interface, fields = solver.contact.interface, solver.fields
    charge = np.unique(fields.mesh.dofmap[fields.mesh.part == Part.CHARGE])
    still, force = np.zeros_like(fields.nodes.force), np.zeros_like(fields.nodes.force)
    fields.charge.burn_fraction[:] = fields.charge.pressure[:] = 0.0
    interface.add_forces(1e10, 1e-6, still, force)
    force[:] = 0.0
    fields.nodes.position[charge, 2] += gap
    interface.add_forces(1e10, 1e-6, still, force)
    contacts = interface.contacts
    holds = gap <= 0.0 or tensile > 0.0
    assert interface.deepest == pytest.approx(max(-gap, 0.0), rel=1e-9, abs=1e-18)
    np.testing.assert_allclose(contacts.gap, gap, rtol=1e-6, atol=1e-18)
    assert (contacts.stiffness > 0.0).all() == holds
    assert (contacts.bonded == int(tensile > 0.0)).all()
    np.testing.assert_allclose(contacts.force[:, 2], -contacts.stiffness * gap, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(contacts.tally[:, 0], 0.5 * contacts.stiffness * gap**2, rtol=1e-6, atol=1e-24)
    assert interface.energies[0] == pytest.approx(contacts.tally[:, 0].sum(), abs=1e-9)  # rounded to be exact on ranks
    lower = np.setdiff1d(np.arange(len(force)), charge)
    size = np.abs(force).max()
    assert (size > 0.0) == (holds and gap != 0.0)
    np.testing.assert_allclose(force[charge].sum(axis=0), -force[lower].sum(axis=0), atol=1e-9 * size)
    assert force[charge, 2].sum() == pytest.approx(contacts.force[:, 2].sum(), abs=1e-5)


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
