"""The axisymmetric burst of one round from mesh to snapshot."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numba
import numpy as np
from mpi4py import MPI

from burst_fenicsx.axisymmetric.applicability import why_not_axisymmetric
from burst_fenicsx.axisymmetric.fields import make_ring_fields, on_dolfinx
from burst_fenicsx.axisymmetric.mesh import MeridianMesh, meridian_quality, mesh_meridian
from burst_fenicsx.axisymmetric.slide_line import meridian_contact
from burst_fenicsx.axisymmetric.solver import RingSolver
from burst_fenicsx.axisymmetric.surfaces import meridian_surfaces
from burst_fenicsx.errors import InputError, NumericalStop
from burst_fenicsx.files.revolve import revolution, write_revolved
from burst_fenicsx.meshing.placement import frame, place
from burst_fenicsx.meshing.split import split_charges
from burst_fenicsx.problem import Part
from burst_fenicsx.records.gather import output_fields
from burst_fenicsx.simulation import Simulation

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from burst_fenicsx.axisymmetric.fields import RingFields
    from burst_fenicsx.contact import ContactForces
    from burst_fenicsx.meshing import MeshQuality
    from burst_fenicsx.meshing.distributed import DistributedMesh
    from burst_fenicsx.problem import BurstSettings, Round
    from burst_fenicsx.records.surfaces import RadialSurfaces
    from burst_fenicsx.simulation import BurstProgress, BurstResult

__all__ = ["AxisymmetricSimulation", "one_thread"]


@contextmanager
def one_thread() -> Iterator[None]:
    """Compute on one thread: the shared loops of so small a mesh cost more in waiting for each other than they gain."""
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        yield
    finally:
        numba.set_num_threads(before)


class AxisymmetricSimulation(Simulation):
    """The burst of one round in its meridian; computed on the ranks' first, as one thread.

    Raises
    ------
    InputError
        The burst is not axisymmetric; besides what `Simulation` raises.
    NumericalStop
        The casing has reached a plane, which only the burst in three dimensions has.
    """

    geometry = "axisymmetric"
    mesh: MeridianMesh  # type: ignore[assignment]
    fields: RingFields

    def __init__(
        self,
        rounds: Sequence[Round],
        settings: BurstSettings,
        out_dir: Path,
        provenance: dict[str, str],
        on_progress: Callable[[BurstProgress], None] | None = None,
    ) -> None:
        reason = why_not_axisymmetric(rounds, settings)
        if reason is not None:
            raise InputError(f"the burst is not axisymmetric: {reason}; compute it in three dimensions")
        self._planes = settings.planes
        free = replace(settings, planes=(), symmetry="off")
        super().__init__(rounds, free, out_dir, MPI.COMM_SELF, provenance, on_progress)

    def _make_mesh(self) -> tuple[MeridianMesh, MeshQuality]:  # type: ignore[override]
        profile = self.rounds[0].profile
        assert profile is not None
        mesh = mesh_meridian(profile, self.settings.cell_size)
        found = meridian_quality(mesh, profile)
        return (split_charges(mesh) if self.settings.contact.charge_casing == "sliding" else mesh), found

    def _make_surfaces(self, bins: int) -> RadialSurfaces:
        return meridian_surfaces(self.mesh, self.settings.leakage.parts, bins)

    def _distribute(self) -> DistributedMesh:
        return on_dolfinx(self.mesh)

    def _make_fields(self, distributed: DistributedMesh, **inputs: Any) -> RingFields:
        upright = replace(self.rounds[0], position=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0))
        return make_ring_fields(distributed, [upright], self.settings, **inputs)

    def _make_contact(self) -> ContactForces:
        contact, self._line = meridian_contact(self.mesh, self.fields, self.settings)
        return contact

    def _make_initiation(self) -> None:
        """Nothing: one round alone."""

    def _make_solver(self) -> RingSolver:
        return RingSolver(self.fields, self.settings, self.leakage, self.ledger, self.contact, self._line)

    def _write_output(self) -> None:
        super()._write_output()
        self._check_planes()

    def _check_planes(self) -> None:
        """Stop where a ring of the casing reaches a plane."""
        item, mesh = self.rounds[0], self.fields.mesh
        nodes = np.unique(mesh.dofmap[mesh.part == Part.CASING])
        radius, height = self.fields.nodes.position[nodes, 0], self.fields.nodes.position[nodes, 2]
        axis = frame(item.axis)[2]
        for plane in self._planes:
            normal = np.asarray(plane.normal, dtype=float) / np.linalg.norm(plane.normal)
            along = float(axis @ normal)
            base = float((np.asarray(item.position) - np.asarray(plane.point)) @ normal)
            lowest = float((base + along * height - np.sqrt(max(1.0 - along**2, 0.0)) * radius).min())
            if lowest < 0.0:
                raise NumericalStop(
                    f"the casing of round '{item.name}' has reached the plane '{plane.name}', which an axisymmetric "
                    'burst leaves aside; compute it with burst.geometry = "3d"',
                    self.solver.time,
                )

    def finish(self) -> BurstResult:
        """Write the snapshot and the last state swept around the axis for ParaView, and give the summary."""
        result = super().finish()
        if not self.writes_series:
            return result
        points, cells = output_fields(self.fields, self.contact.force if self.contact.exists else None)
        self._to_world(points, cells)
        item, start = self.rounds[0], {"reference": self.mesh.nodes}
        self._place(start)
        swept = revolution(start["reference"], self.mesh.cells, item.position, item.axis)
        path = self.out_dir / "burst_revolved"
        write_revolved(path, swept, self.solver.time, points.pop("position"), points, cells, self.provenance)
        return result

    def _place(self, fields: dict[str, np.ndarray]) -> None:
        """Carry nodal fields to the half plane of the round's axis and its first direction across it."""
        item = self.rounds[0]
        for name, values in fields.items():
            if name in ("position", "reference"):
                fields[name] = place(values, item.position, item.axis)
            else:
                fields[name] = values @ frame(item.axis)
