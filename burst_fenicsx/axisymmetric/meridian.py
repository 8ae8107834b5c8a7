"""The burst of one round in its meridian: its element and its record of factories."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx import compat
from burst_fenicsx.axisymmetric.applicability import lowest_height, why_not_axisymmetric
from burst_fenicsx.axisymmetric.mesh import areas, folded, longest_edges, mesh_meridian, nodal_volumes, ring_volumes
from burst_fenicsx.axisymmetric.slide_line import meridian_contact
from burst_fenicsx.errors import InputError, NumericalStop
from burst_fenicsx.geometries import Geometry
from burst_fenicsx.kernels.step.assembly import RINGS
from burst_fenicsx.mechanics.fields import Element
from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from burst_fenicsx.meshing.distributed import DistributedMesh
from burst_fenicsx.meshing.quality import quality
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mpi4py import MPI

    from burst_fenicsx.axisymmetric.mesh import MeridianMesh
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.meshing import MeshQuality
    from burst_fenicsx.meshing.mesh import CellMesh
    from burst_fenicsx.problem import BurstSettings, Mirror, Round


_TO_TENSOR = [0, 1, 3, 2]  # counter-clockwise to tensor-product order; its own inverse


def _prepare(rounds: Sequence[Round], settings: BurstSettings) -> BurstSettings:
    """Leave planes aside, which the casing does not reach: `_check_planes` stops where it does."""
    reason = why_not_axisymmetric(rounds, settings)
    if reason is not None:
        raise InputError(f"the burst is not axisymmetric: {reason}; compute it in three dimensions")
    return replace(settings, planes=(), symmetry="off")


def _mesh(
    rounds: Sequence[Round], _: Sequence[Sequence[Mirror]], settings: BurstSettings
) -> tuple[MeridianMesh, MeshQuality]:
    profile = rounds[0].profile
    assert profile is not None
    mesh = mesh_meridian(profile, settings.cell_size)
    return mesh, quality(mesh, profile)


def on_dolfinx(comm: MPI.Comm, mesh: MeridianMesh, _: Sequence[Round] = ()) -> DistributedMesh:
    """Hand a meridian to dolfinx: quadrilaterals in space, all on the only rank of `comm`."""
    if comm.size > 1:
        raise InputError("an axisymmetric burst is computed by one rank; call it on one communicator of one rank")
    domain = compat.create_quadrilateral_mesh(comm, mesh.cells[:, _TO_TENSOR], mesh.nodes)
    cell = np.asarray(domain.topology.original_cell_index, dtype=np.int64)
    dofmap = np.ascontiguousarray(compat.geometry_dofmap(domain)[:, _TO_TENSOR])
    part, of_round = mesh.part[cell], mesh.round[cell]
    return DistributedMesh(
        domain=domain,
        dofmap=dofmap,
        cell=cell,
        node=np.asarray(domain.geometry.input_global_indices, dtype=np.int64),
        row=np.arange(len(cell), dtype=np.int32),
        owned_nodes=int(domain.geometry.index_map().size_local),
        part=part,
        round=of_round,
        segment=mesh.segment[cell],
        station=mesh.station[cell],
        all_dofmap=dofmap,
        all_cell=cell,
        all_part=part,
        all_round=of_round,
    )


def axis_constraint(_: CellMesh, fields: BurstFields) -> tuple[NodalConstraint, ...]:
    """Nodes on the axis, which stay there."""
    return (NodalConstraint(np.flatnonzero(fields.start[:, 0] == 0.0), np.array([1.0, 0.0, 0.0])),)


def _check_planes(fields: BurstFields, rounds: Sequence[Round], settings: BurstSettings, time: float) -> None:
    (item,), mesh = rounds, fields.mesh
    nodes = np.unique(mesh.dofmap[mesh.part == Part.CASING])
    radius, _, height = fields.nodes.position[nodes].T
    for plane in settings.planes:
        if lowest_height(item, plane, radius, height) < 0.0:
            raise NumericalStop(
                f"the casing of round '{item.name}' has reached the plane '{plane.name}', which an axisymmetric "
                'burst leaves aside; compute it with burst.geometry = "3d"',
                time,
            )


def _mass_fractions(position: np.ndarray, dofmap: np.ndarray) -> np.ndarray:
    found = nodal_volumes(position, dofmap)
    fractions: np.ndarray = found / found.sum(axis=1)[:, None]
    return fractions


def _corner_cells(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners (cells, 4, 3) as nodes of their own and cells."""
    return corners.reshape(-1, 3), np.arange(4 * len(corners)).reshape(-1, 4)


def _burn_rates(corners: np.ndarray, volumes: np.ndarray, velocity: float) -> np.ndarray:  # noqa: ARG001
    """Rate of the burn fraction (1/s), Eq. 5 in the plane: the longest edge over the area for face over volume."""
    nodes, cells = _corner_cells(corners)
    return 2.0 * velocity * longest_edges(nodes, cells) / (3.0 * areas(nodes, cells))


def _largest_faces(corners: np.ndarray) -> np.ndarray:
    nodes, cells = _corner_cells(corners)
    return 2.0 * np.pi * corners[..., 0].max(axis=1) * longest_edges(nodes, cells)


RING = Element(
    kind=RINGS,
    momentum_is_conserved=(False, False, True),  # radial momentum is no vector of the whole ring
    volumes=ring_volumes,
    folded=folded,
    mass_fractions=_mass_fractions,
    burn_rates=_burn_rates,
    lengths=lambda position, dofmap, volume: np.sqrt(areas(position, dofmap)),  # noqa: ARG005 - as every element
    largest_faces=_largest_faces,
)
"""A quadrilateral of the half plane (r, z) that stands for a ring."""


MERIDIAN = Geometry(
    name="axisymmetric",
    element=RING,
    upright=True,
    prepare=_prepare,
    make_mesh=_mesh,
    distribute=on_dolfinx,
    make_contact=meridian_contact,
    constrain=axis_constraint,
    check_state=_check_planes,
)
"""Rings of one round, computed by one rank."""
