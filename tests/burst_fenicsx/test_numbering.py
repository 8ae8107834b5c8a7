"""Cells and nodes in the order of the mesh that was given, and dolfinx functions of what is kept in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

import dolfinx
import ufl
from dolfinx import fem
from mpi4py import MPI

from burst_fenicsx import compat
from burst_fenicsx.meshing import mesh_round
from burst_fenicsx.meshing.cut import split_charges
from burst_fenicsx.meshing.distributed import distribute
from tests.burst_fenicsx.boxes import BARE, box, burst
from tests.burst_fenicsx.tubes import tube

pytestmark = pytest.mark.dolfinx


def shuffled(mesh):
    """The mesh with its cells and nodes in any order."""
    random = np.random.default_rng(8)
    cell, place = random.permutation(len(mesh.cells)), random.permutation(len(mesh.nodes))
    names = {name: getattr(mesh, name)[cell] for name in ("part", "round", "segment", "station")}
    return replace(mesh, nodes=mesh.nodes[np.argsort(place)], cells=place[mesh.cells[cell]], **names)


def test_cells_and_nodes_keep_the_order_of_the_mesh():
    mesh = split_charges(mesh_round(tube(), 12e-3, 0))
    spread = distribute(MPI.COMM_SELF, mesh)
    assert np.array_equal(spread.cell, np.arange(len(mesh.cells)))
    assert np.array_equal(spread.node, np.arange(len(mesh.nodes)))
    assert np.array_equal(spread.dofmap, mesh.cells)
    assert np.array_equal(spread.domain.geometry.x, mesh.nodes)
    assert np.array_equal(spread.row, spread.domain.topology.original_cell_index)
    assert not np.array_equal(spread.row, spread.cell)
    assert np.array_equal(compat.geometry_dofmap(spread.domain), spread.dofmap[spread.row])


def test_a_mesh_in_no_order_gets_that_of_dolfinx():
    """Its cells' nodes lie near each other then."""
    mesh = shuffled(box((40, 6, 6), (0.04, 0.006, 0.006)))
    spread = distribute(MPI.COMM_SELF, mesh)
    assert np.array_equal(spread.row, np.arange(len(mesh.cells)))
    assert np.array_equal(spread.node[spread.dofmap], mesh.cells[spread.cell])
    assert np.array_equal(spread.domain.geometry.x, mesh.nodes[spread.node])
    there, given = (np.ptp(dofmap, axis=1).max() for dofmap in (spread.dofmap, mesh.cells))
    assert there < 0.1 * given


@pytest.mark.parametrize("quadrature", ["one_point", "full"])
def test_functions_have_the_values_of_their_cells_and_nodes(quadrature):
    """What kernels write is in dolfinx's functions at once: by interpolation and by integrals over its own cells."""
    solver = burst(box((4, 3, 5), (4e-3, 3e-3, 5e-3)), replace(BARE, quadrature=quadrature))
    fields, mesh = solver.fields, solver.fields.mesh
    nodes, domain = fields.nodes, fields.mesh.domain
    nodes.position[:] += [1.0, 2.0, 3.0]
    assert np.shares_memory(nodes.position, domain.geometry.x)
    nodes.velocity[:], nodes.force[:] = 2.0 * nodes.position, -nodes.position
    linear = fem.Function(mesh.vector_space)
    linear.interpolate(lambda places: 2.0 * places)
    np.testing.assert_allclose(fields.functions["velocity"].x.array, linear.x.array, rtol=1e-14)
    np.testing.assert_allclose(fields.functions["force"].x.array, -0.5 * linear.x.array, rtol=1e-14)
    centre = nodes.position[mesh.dofmap].mean(axis=1)
    points = fields.solid.stress.shape[1]
    assert points == (8 if quadrature == "full" else 1)
    fields.solid.stress[:] = np.repeat(centre, 2, axis=1)[:, None] * (1.0 + np.arange(points))[:, None]
    fields.charge.pressure[:] = centre[:, 0]
    place = domain.geometry.x[compat.geometry_dofmap(domain)].mean(axis=1)  # of dolfinx's cells
    for name, values in (("pressure", place[:, :1]), ("stress", np.repeat(place, 2, axis=1))):
        function = fields.functions[name]
        dofs, size = compat.cells_dofmap(function.function_space), values.shape[1]
        found = function.x.array.reshape(-1, size)[dofs]
        for point in range(found.shape[1]):
            np.testing.assert_allclose(found[:, point], values * (1.0 + point), rtol=1e-14)
    moment = fields.functions["pressure"] * ufl.SpatialCoordinate(domain)[2] * ufl.dx
    volume = 1e-9
    expected = volume * (centre[:, 0] * centre[:, 2]).sum()
    assert dolfinx.fem.assemble_scalar(dolfinx.fem.form(moment)) == pytest.approx(expected, rel=1e-12)
