"""Cells and nodes in the order of the mesh that was given, and dolfinx functions of what is kept in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from burst_fenicsx import compat
from burst_fenicsx.kernels.geometry.faces import TENSOR_ORDER
from burst_fenicsx.meshing import mesh_round
from burst_fenicsx.meshing.distributed import distribute
from burst_fenicsx.meshing.split import split_charges
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
    assert not np.array_equal(spread.dolfinx_node, spread.node)
    assert np.array_equal(spread.dofmap, mesh.cells[:, TENSOR_ORDER])
    assert np.array_equal(spread.domain.geometry.x[spread.dolfinx_node], mesh.nodes)
    original = np.asarray(spread.domain.topology.original_cell_index)
    assert np.array_equal(original[spread.dolfinx_cell], spread.cell)


def test_a_mesh_in_no_order_gets_that_of_dolfinx():
    """Its cells' nodes lie near each other then."""
    mesh = shuffled(box((40, 6, 6), (0.04, 0.006, 0.006)))
    spread = distribute(MPI.COMM_SELF, mesh)
    assert np.array_equal(spread.dolfinx_node, np.arange(len(mesh.nodes)))
    assert np.array_equal(spread.node[spread.dofmap], mesh.cells[spread.cell][:, TENSOR_ORDER])
    assert np.array_equal(spread.domain.geometry.x, mesh.nodes[spread.node])
    there, given = (np.ptp(dofmap, axis=1).max() for dofmap in (spread.dofmap, mesh.cells))
    assert there < 0.1 * given


@pytest.mark.parametrize("quadrature", ["one_point", "full"])
def test_functions_have_the_values_of_their_cells_and_nodes(quadrature):
    solver = burst(box((4, 3, 5), (4e-3, 3e-3, 5e-3)), replace(BARE, quadrature=quadrature))
    fields = solver.fields
    nodes, mesh = fields.nodes, fields.mesh
    nodes.position[:] += [1.0, 2.0, 3.0]
    nodes.velocity[:], nodes.force[:] = 2.0 * nodes.position, -nodes.position
    centre = nodes.position[mesh.dofmap].mean(axis=1)
    fields.solid.stress[:] = (
        np.repeat(centre, 2, axis=1)[:, None] * (1.0 + np.arange(fields.solid.stress.shape[1]))[:, None]
    )
    fields.charge.pressure[:] = centre[:, 0]
    functions = fields.functions()
    assert set(functions) == {"velocity", "force", *fields.of_cells}
    domain = mesh.domain
    place, corners = domain.geometry.x, compat.geometry_dofmap(domain)
    assert np.array_equal(np.sort(place[:, 0]), np.sort(nodes.position[:, 0]))
    assert np.array_equal(functions["velocity"].x.array.reshape(-1, 3), 2.0 * place)
    assert np.array_equal(functions["force"].x.array.reshape(-1, 3), -place)
    middle = place[corners].mean(axis=1)
    np.testing.assert_allclose(functions["pressure"].x.array, middle[:, 0], rtol=1e-14)
    stress = functions["stress"].x.array.reshape(len(middle), -1, 6)
    assert stress.shape[1] == (8 if quadrature == "full" else 1)
    for point in range(stress.shape[1]):
        np.testing.assert_allclose(stress[:, point], np.repeat(middle, 2, axis=1) * (1.0 + point), rtol=1e-14)
