"""Walls thrown so hard that their outer cells fold: what lies within them passes neither planes nor other walls."""

from __future__ import annotations

import hashlib
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.contact.surfaces import contact_surfaces, outward_sides
from burst_fenicsx.files.checkpoint import read_checkpoint, write_checkpoint
from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from burst_fenicsx.meshing import merge
from burst_fenicsx.meshing.cut import split_charges
from burst_fenicsx.meshing.quality import folded_cells
from burst_fenicsx.problem import Mirror, Part, TimeStep
from tests.burst_fenicsx.bodies import QUIET, bodies, momentum, moved
from tests.burst_fenicsx.boxes import ELASTIC, box, rotation_matrix

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
        surfaces, state = solver.contact.collisions.surfaces, solver.contact.collisions.state
        assert (surfaces.interior[state.node[state.face >= 0]]).any()
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
    assert set(inner.tolist()) <= set(collisions.state.node[collisions.state.other == 1].tolist())


def test_a_lone_body_has_neither_interior_nodes_nor_layers():
    """Single rounds pay nothing."""
    surfaces = contact_surfaces(box((4, 4, 4), (0.04, 0.04, 0.04)))
    assert not surfaces.interior.any()
    assert surfaces.on_surface == len(surfaces.faces) == 6 * 16
    solver = bodies([box((4, 4, 4), (0.04, 0.04, 0.04))], [(0.0, 0.0, 0.0)], QUIET, comm=MPI.COMM_SELF)
    assert solver.contact.touched.sum() == 5**3 - 3**3


STATES = """
from mpi4py import MPI
from tests.burst_fenicsx.test_interior_contact import collided_state
found = collided_state(MPI.COMM_WORLD)
if MPI.COMM_WORLD.rank == 0:
    print(*found)
"""


def collided_state(comm):
    """Digests of places and contact forces after interior nodes have met faces, and the deepest of them (m)."""
    solver = collide(counts=(4, 16, 3), until=46e-6, comm=comm)
    mesh = solver.fields.mesh
    found = [mesh.gather_nodes(values) for values in (solver.fields.nodes.position, solver.contact.force)]
    digests = ["" if values is None else hashlib.sha256((values + 0.0).tobytes()).hexdigest() for values in found]
    return *digests, solver.contact.penetrations.over(comm).interior_collision.hex()


@pytest.mark.mpi
def test_ranks_change_no_bit_of_interior_contact(tmp_path, on_ranks):
    """Places, contact forces and the deepest interior node on three ranks are those on one."""
    script = tmp_path / "states.py"
    script.write_text(STATES)
    alone = collided_state(MPI.COMM_SELF)
    assert float.fromhex(alone[-1]) > 0.0
    assert on_ranks(3, script).split() == list(alone)


def test_a_checkpoint_keeps_interior_contact_to_the_last_bit(tmp_path):
    """Written while interior nodes touch, read into a new solver: the same places 40 steps later, searches included."""
    solver = collide(contacts=5)
    surfaces, state = solver.contact.collisions.surfaces, solver.contact.collisions.state
    assert surfaces.interior[state.node[state.touching]].any()
    write_checkpoint(tmp_path / "checkpoint.h5", solver, {}, "walls")
    again = thrown()
    read_checkpoint(tmp_path / "checkpoint.h5", again, "walls")
    searches = solver.contact.collisions.searches
    for going in (solver, again):
        for _ in range(40):
            going.step()
    assert solver.contact.collisions.searches > searches
    assert np.array_equal(again.fields.nodes.position, solver.fields.nodes.position)
    assert np.array_equal(again.contact.force, solver.contact.force)
    assert again.contact.penetrations == solver.contact.penetrations
