"""What differs between bursts in three dimensions and in the meridian: one record of factories for each.

All else, from the step to the snapshot, is one code.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.contact import ContactForces
from burst_fenicsx.errors import InputError
from burst_fenicsx.kernels.constants import PLANE_SLACK
from burst_fenicsx.mechanics.fields import HEXAHEDRON
from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from burst_fenicsx.meshing import merge, mesh_round, quality
from burst_fenicsx.meshing.distributed import distribute, partition

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from mpi4py import MPI

    from burst_fenicsx.mechanics.fields import BurstFields, Element
    from burst_fenicsx.meshing import HexahedralMesh, MeshQuality
    from burst_fenicsx.meshing.distributed import DistributedMesh
    from burst_fenicsx.meshing.mesh import CellMesh
    from burst_fenicsx.problem import BurstSettings, Mirror, Round


@dataclass(frozen=True)
class Geometry:
    """How the objects of a burst are made in one geometry. The meshes of a burst and its fields are of one kind.

    Attributes
    ----------
    name : "3d" or "axisymmetric", written into the snapshot.
    element : of the cells.
    upright : whether the mesh has its one round upright on the origin; outputs are carried to where it stands.
    prepare : the settings as they are computed; raises InputError where the rounds cannot be.
    make_mesh : mesh of the rounds and its quality, from rounds, the planes that cut each, and settings.
    distribute : hands the mesh of the rounds to dolfinx on the ranks.
    make_contact : contact, from mesh, fields and settings.
    constrain : nodes that may not move along a direction, from mesh and fields.
    check_state : stops where the fields have come to what the geometry leaves out, from fields, rounds, the settings
        before `prepare`, and time (s).
    """

    name: str
    element: Element
    upright: bool
    prepare: Callable[[Sequence[Round], BurstSettings], BurstSettings]
    make_mesh: Callable[[Sequence[Round], Sequence[Sequence[Mirror]], BurstSettings], tuple[Any, MeshQuality]]
    distribute: Callable[[MPI.Comm, Any, Sequence[Round]], DistributedMesh]
    make_contact: Callable[[Any, BurstFields, BurstSettings], ContactForces]
    constrain: Callable[[CellMesh, BurstFields], tuple[NodalConstraint, ...]]
    check_state: Callable[[BurstFields, Sequence[Round], BurstSettings, float], None]


def _mesh(
    rounds: Sequence[Round], cuts: Sequence[Sequence[Mirror]], settings: BurstSettings
) -> tuple[HexahedralMesh, MeshQuality]:
    """Every rank makes the mesh, which is quick and saves sending it; an error then ends them all alike."""
    each = [
        mesh_round(item, settings.cell_size, index, own)
        for index, (item, own) in enumerate(zip(rounds, cuts, strict=True))
    ]
    mesh = merge(each)
    _check_planes(rounds, settings, mesh)
    return mesh, quality(mesh)


def _check_planes(rounds: Sequence[Round], settings: BurstSettings, mesh: HexahedralMesh) -> None:
    slack = PLANE_SLACK * settings.cell_size
    for plane in settings.planes:
        normal = np.asarray(plane.normal) / np.linalg.norm(plane.normal)
        height = (mesh.nodes - np.asarray(plane.point)) @ normal
        for index, item in enumerate(rounds):
            deepest = -float(height[mesh.cells[mesh.round == index]].min())
            if deepest > slack:
                raise InputError(
                    f"round '{item.name}' lies {1e3 * deepest:.3g} mm behind the plane '{plane.name}'; "
                    "every round must stand wholly on the side to which the plane's normal points"
                )


def _distribute(comm: MPI.Comm, mesh: HexahedralMesh, rounds: Sequence[Round]) -> DistributedMesh:
    owner = partition(mesh, rounds, comm.size) if comm.rank == 0 and comm.size > 1 else None
    return distribute(comm, mesh if comm.rank == 0 else None, destination=owner)


def _in_planes(mesh: CellMesh, fields: BurstFields) -> tuple[NodalConstraint, ...]:
    """Nodes in planes that cut rounds, which stay there."""
    if mesh.held is None:
        return ()
    local = mesh.held[fields.mesh.node]
    return tuple(
        NodalConstraint(np.flatnonzero(local >> bit & 1), np.array(normal)) for bit, normal in mesh.held_normals
    )


THREE_DIMENSIONS = Geometry(
    name="3d",
    element=HEXAHEDRON,
    upright=False,
    prepare=lambda rounds, settings: settings,  # noqa: ARG005 - any rounds
    make_mesh=_mesh,
    distribute=_distribute,
    make_contact=ContactForces.of_mesh,
    constrain=_in_planes,
    check_state=lambda *_: None,  # planes have contact
)
"""Hexahedra of any number of rounds."""
