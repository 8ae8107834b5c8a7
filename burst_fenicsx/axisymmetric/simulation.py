"""The axisymmetric burst of one round from mesh to snapshot."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from burst_fenicsx.axisymmetric.fields import make_ring_fields, on_dolfinx
from burst_fenicsx.axisymmetric.mesh import MeridianMesh, meridian_quality, mesh_meridian
from burst_fenicsx.axisymmetric.slide_line import MeridianContact
from burst_fenicsx.axisymmetric.solver import RingSolver
from burst_fenicsx.axisymmetric.surfaces import meridian_surfaces
from burst_fenicsx.errors import InputError
from burst_fenicsx.meshing.placement import frame, place
from burst_fenicsx.meshing.split import split_charges
from burst_fenicsx.simulation import Simulation

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from burst_fenicsx.meshing import MeshQuality
    from burst_fenicsx.problem import BurstSettings, Round
    from burst_fenicsx.simulation import BurstProgress
    from burst_fenicsx.surfaces import RadialSurfaces

__all__ = ["AxisymmetricSimulation", "why_not_axisymmetric"]


def why_not_axisymmetric(rounds: Sequence[Round], settings: BurstSettings) -> str | None:
    """Why a burst cannot be computed in the meridian, in words; None where it can.

    Planes are left aside here: whether a casing reaches them is for the caller to judge.
    """
    if len(rounds) != 1:
        return f"{len(rounds)} rounds may meet"
    (item,) = rounds
    if item.profile is None:
        return f"round '{item.name}' comes from a mesh file"
    off_axis = [point for point in item.ignition if any(point.offset)]
    if off_axis:
        return f"round '{item.name}' is initiated off its axis"
    if item.initiation is not None or not item.ignition:
        return f"round '{item.name}' may be initiated by shock"
    if settings.quadrature != "one_point":
        return "2 x 2 x 2 points belong to hexahedra"
    return None


class AxisymmetricSimulation(Simulation):
    """The burst of one round in its meridian; computed on the ranks' first, as one thread.

    Raises
    ------
    InputError
        The burst is not axisymmetric; besides what `Simulation` raises.
    """

    geometry = "axisymmetric"

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
        # Casings that do not reach a plane do not feel it.
        super().__init__(rounds, replace(settings, planes=()), out_dir, MPI.COMM_SELF, provenance, on_progress)

    def _make_mesh(self) -> tuple[MeridianMesh, MeshQuality]:
        profile = self.rounds[0].profile
        assert profile is not None
        mesh = mesh_meridian(profile, self.settings.cell_size)
        found = meridian_quality(mesh, profile)
        return (split_charges(mesh) if self.settings.contact.charge_casing == "bonded" else mesh), found

    def _make_surfaces(self, bins: int) -> RadialSurfaces:
        return meridian_surfaces(self.mesh, self.settings.leakage.parts, bins)

    def _make_state(self) -> None:
        mesh, settings = self.mesh, self.settings
        distributed = on_dolfinx(mesh)
        self.leakage = self._make_leakage(distributed)
        self.fields = make_ring_fields(
            distributed,
            replace(self.rounds[0], position=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0)),
            settings,
            fuze_density=self.fuze_density[0],
            axial_part=self.surfaces.cell_part[distributed.cell],
            leakage=self.leakage.factor,
            length=mesh.lengths[0],
        )
        self.ledger = self._make_ledger()
        self.contact = MeridianContact(mesh, self.fields, settings)
        self.initiation = None
        self.solver = RingSolver(self.fields, settings, self.leakage, self.ledger, self.contact)

    def _place(self, fields: dict[str, np.ndarray]) -> None:
        """Carry nodal fields to the half plane of the round's axis and its first direction across it."""
        item = self.rounds[0]
        for name, values in fields.items():
            if name in ("position", "reference"):
                fields[name] = place(values, item.position, item.axis)
            else:
                fields[name] = values @ frame(item.axis)
