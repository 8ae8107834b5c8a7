"""Surfaces that wind around points, cavities of casings, and products that have come out of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from burst_fenicsx.kernels.geometry.faces import FACES
from burst_fenicsx.kernels.geometry.winding import add_windings
from burst_fenicsx.meshing import merge
from burst_fenicsx.meshing.cut import cut_mesh
from burst_fenicsx.meshing.split import split_charges
from burst_fenicsx.problem import Part, Round
from burst_fenicsx.records.passage import Passage
from burst_fenicsx.symmetry.part import Cut
from tests.burst_fenicsx.bodies import QUIET, bodies, moved
from tests.burst_fenicsx.boxes import ELASTIC, TNT, box, distorted_box, rotation_matrix

pytestmark = pytest.mark.dolfinx

CELL = 0.01
SHELL = 8 * CELL  # edge of a cube with walls of two cells around a charge of 4 x 4 x 4


def windings(points, mesh):
    cell, side = np.nonzero(mesh.neighbours < 0)
    faces = mesh.cells[cell[:, None], FACES[side]].astype(np.int32)
    found = np.zeros(len(points))
    add_windings(np.ascontiguousarray(points), np.ascontiguousarray(mesh.nodes), faces, found)
    return found


@pytest.mark.parametrize("turn", [0.0, 1.1])
def test_a_closed_surface_winds_once_around_what_lies_within_it(turn):
    """A bent cube: its cells' middles lie within, their images far outside and just outside of its faces do not."""
    mesh = distorted_box(4, CELL)
    mesh = replace(mesh, nodes=mesh.nodes @ rotation_matrix((1.0, -2.0, 0.5), turn).T)
    centres = mesh.nodes[mesh.cells].mean(axis=1)
    assert windings(centres, mesh) == pytest.approx(np.ones(len(centres)), abs=1e-12)
    cell, side = np.nonzero(mesh.neighbours < 0)
    corner = mesh.nodes[mesh.cells[cell[:, None], FACES[side]]]
    normal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    for height, wanted in ((1e-5 * CELL, 0.0), (-1e-5 * CELL, 1.0), (3 * CELL, 0.0)):
        found = windings(corner.mean(axis=1) + height * normal, mesh)
        assert found == pytest.approx(np.full(len(found), wanted), abs=1e-12)


def test_a_face_takes_up_its_share_of_a_cubes_solid_angle():
    """Seen from the centre a side of a cube is a sixth of the sphere; the three opposite a corner, an eighth."""
    mesh = box((1, 1, 1), (CELL, CELL, CELL))
    for side in range(6):
        found = np.zeros(1)
        add_windings(np.full((1, 3), 0.5 * CELL), mesh.nodes, mesh.cells[:1, FACES[side]].astype(np.int32), found)
        assert found[0] == pytest.approx(1.0 / 6.0, rel=1e-14)
    found = np.zeros(1)
    far = [side for side in range(6) if (mesh.nodes[mesh.cells[0, FACES[side]]] > 0.0).any(axis=0).all()]
    add_windings(np.zeros((1, 3)), mesh.nodes, mesh.cells[0, FACES[far]].astype(np.int32), found)
    assert found[0] == pytest.approx(1.0 / 8.0, rel=1e-14)


def shell(cuts=()):
    """A charge of 4 x 4 x 4 cells in a casing two cells thick, centred on the origin; the charge has its own nodes."""
    mesh = box((8, 8, 8), (SHELL, SHELL, SHELL))
    mesh = replace(mesh, nodes=mesh.nodes - 0.5 * SHELL)
    near = np.abs(mesh.nodes[mesh.cells].mean(axis=1)).max(axis=1) < 2 * CELL
    part = np.where(near, Part.CHARGE, Part.CASING).astype(np.int32)
    return moved(split_charges(cut_mesh(replace(mesh, part=part), cuts)), (0.0, 0.0, 0.0), 1)


def passed(bar, around, cuts=()):
    """Mass, in cells, of the bar that has passed into the shell, whose charge has grown to `around` times its size."""
    target = shell(cuts)
    settings = replace(QUIET, cell_size=CELL)
    solver = bodies([bar, target], [(0.0, 0.0, 0.0)] * 2, settings)
    rounds = [Round(name, TNT, ELASTIC) for name in ("bar", "shell")]
    mesh = merge([replace(one, segments=((),)) for one in (bar, target)])
    passage = Passage(mesh, solver.fields, rounds, settings)
    own = np.unique(solver.fields.mesh.dofmap[solver.fields.mesh.part == Part.CHARGE])
    solver.fields.nodes.position[own] *= around
    return passage.look(0.0).in_rounds[0] / (CELL**3 * ELASTIC.density)


@pytest.mark.parametrize("around", [0.99, 3.0])
def test_metal_among_products_that_have_come_out_has_passed_through_nothing(around):
    """A bar along x from -8.8 to 3.2 cells: of its sections the last eight lie in the shell, the last one half a cell.

    Where the charge has burst out to three times its size, two more sections lie among products in front of the wall.
    """
    bar = moved(box((12, 1, 1), (12 * CELL, CELL, CELL)), (-8.8 * CELL, -0.3 * CELL, 0.2 * CELL))
    assert passed(bar, around) == pytest.approx(7.5, abs=1e-9)


def test_the_image_of_a_cut_round_closes_its_cavity():
    """Half a shell: metal in the plane of symmetry, and near it, lies within the cavity; beside the shell none does."""
    cut = Cut(bit=0, point=(0.0, 0.0, 0.0), normal=(0.0, 1.0, 0.0))
    for height in (0.0, 1e-6):
        bar = moved(box((12, 1, 1), (12 * CELL, CELL, CELL)), (-8.8 * CELL, height, 0.2 * CELL))
        assert passed(bar, 3.0, (cut,)) == pytest.approx(7.5, abs=1e-9)
