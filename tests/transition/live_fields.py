"""Velocity fields of dolfinx: `python -m tests.transition.live_fields KIND` prints what is handed over, on rank 0."""

from __future__ import annotations

import json
import sys
from typing import Any

import numpy as np
from dolfinx import fem, mesh
from mpi4py import MPI

from transition import BreakUpSettings, CasingInMesh, break_up, snapshot_of

LENGTH, INNER, OUTER = 0.1, 0.04, 0.05


def _space(domain: Any, degree: int = 1) -> Any:
    shape = (domain.geometry.dim,)
    if hasattr(fem, "functionspace"):
        return fem.functionspace(domain, ("Lagrange", degree, shape))
    return fem.VectorFunctionSpace(domain, ("Lagrange", degree))


def made(comm: MPI.Comm, kind: str) -> tuple[Any, Any, CasingInMesh]:
    """Velocity, displacement and casing: a bent plate of hexahedra, or a ring in its meridian."""
    casing = CasingInMesh(density=7850.0, length=LENGTH)
    if kind == "meridian":
        corners = [[INNER, 0.0], [OUTER, LENGTH]]
        domain = mesh.create_rectangle(comm, corners, [3, 12], mesh.CellType.quadrilateral)
    else:
        corners = [[INNER, -0.03, 0.0], [OUTER, 0.03, LENGTH]]
        domain = mesh.create_box(comm, corners, [3, 8, 12], mesh.CellType.hexahedron)
        domain.geometry.x[:, 0] -= 4.0 * domain.geometry.x[:, 1] ** 2
    space = _space(domain)
    velocity, displacement = fem.Function(space), fem.Function(space)
    dimension = domain.geometry.dim
    outward = np.eye(dimension)[0][:, None]
    velocity.interpolate(lambda x: 2e4 * x[:dimension] + 3e5 * x[dimension - 1] * x[0])
    displacement.interpolate(lambda x: 0.3 * outward * x[0])
    return velocity, displacement, casing


def digest(comm: MPI.Comm, kind: str) -> dict[str, Any]:
    """Numbers of what the break-up takes and makes."""
    velocity, displacement, casing = made(comm, kind)
    snapshot = snapshot_of(velocity, casing, displacement=displacement)
    fragments = break_up(snapshot, BreakUpSettings(mean_mass=2e-3), seed=3).fragments
    return {
        "fragments": len(fragments),
        "velocity": snapshot.velocity[snapshot.cells].sum(axis=(0, 1)).tolist(),
        "position": np.sort(snapshot.position, axis=0)[::7].ravel().tolist(),
        "mass": snapshot.mass[::5].tolist(),
    }


def halves(velocity: Any) -> Any:
    """Cell tags 1 and 2 of the two halves of the cells."""
    domain = velocity.function_space.mesh
    number = domain.topology.index_map(domain.topology.dim).size_local
    cells = np.arange(number, dtype=np.int32)
    return mesh.meshtags(domain, domain.topology.dim, cells, np.where(cells < number // 2, 1, 2).astype(np.int32))


def tags_of(distributed: Any, snapshot: Any) -> Any:
    """Cell tags of the burst's mesh: the parts of its cells."""
    domain = distributed.domain
    number = domain.topology.index_map(domain.topology.dim).size_local
    given = np.asarray(domain.topology.original_cell_index)[:number]
    cells = np.arange(number, dtype=np.int32)
    return mesh.meshtags(domain, domain.topology.dim, cells, snapshot.part[given].astype(np.int32))


def of_tetrahedra(comm: MPI.Comm) -> Any:
    return fem.Function(_space(mesh.create_unit_cube(comm, 2, 2, 2)))


def scalar(velocity: Any) -> Any:
    domain = velocity.function_space.mesh
    if hasattr(fem, "functionspace"):
        return fem.Function(fem.functionspace(domain, ("Lagrange", 1)))
    return fem.Function(fem.FunctionSpace(domain, ("Lagrange", 1)))


def main() -> None:
    found = digest(MPI.COMM_WORLD, sys.argv[1])
    if MPI.COMM_WORLD.rank == 0:
        sys.stdout.write(json.dumps(found) + "\n")


if __name__ == "__main__":
    main()
