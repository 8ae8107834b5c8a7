"""A burst before its first step: mesh, distribution, fields, contact and solver of a problem."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx.checks import check_planes, check_problem
from burst_fenicsx.contact import ContactForces
from burst_fenicsx.mechanics.detonation import LeakageParts
from burst_fenicsx.mechanics.exact_sums import exact_sums
from burst_fenicsx.mechanics.fields import make_fields
from burst_fenicsx.mechanics.initiation import ShockInitiations
from burst_fenicsx.mechanics.ledger import MIN_WORK, Ledger
from burst_fenicsx.mechanics.material_tables import density_of_fuze
from burst_fenicsx.mechanics.nodal_loads import Hold
from burst_fenicsx.mechanics.solver import BurstSolver
from burst_fenicsx.meshing import HexahedralMesh, MeshQuality, merge, mesh_round, quality
from burst_fenicsx.meshing.distributed import distribute
from burst_fenicsx.meshing.partition import partition
from burst_fenicsx.meshing.split import split_charges
from burst_fenicsx.problem import BurstSettings, Part, Round
from burst_fenicsx.records.exposure import ShockExposures
from burst_fenicsx.records.interpenetration import InterpenetrationCheck
from burst_fenicsx.records.measures import Measures
from burst_fenicsx.records.surfaces import radial_surfaces
from burst_fenicsx.symmetry import smallest_part, symmetry_words
from burst_fenicsx.symmetry.completion import Completion

if TYPE_CHECKING:
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.meshing.distributed import DistributedMesh
    from burst_fenicsx.records.surfaces import RadialSurfaces
    from burst_fenicsx.symmetry.part import SymmetricPart

__all__ = ["AssembledBurst"]

_log = logging.getLogger(__name__)


class AssembledBurst:
    """All objects of a burst at time zero; the burst in the meridian makes some in another way.

    Attributes
    ----------
    geometry : "3d" or "axisymmetric", written into the snapshot.
    part, rounds, settings : what of the arrangement is computed, its rounds, and the settings with its planes.
    mesh, quality, surfaces : of all ranks. fuze_density : of each round (kg/m3).
    fields, contact, initiation, leakage, ledger, solver : the state, what acts on it, its sums and what steps it.
    exposures, measures, interpenetration, completion : what looks at it, and what adds the rounds that planes mirror.
    """

    geometry = "3d"

    def __init__(self, rounds: Sequence[Round], settings: BurstSettings, comm: MPI.Comm) -> None:
        check_problem(rounds, settings)
        self.part = self._find_part(rounds, settings)
        self.rounds = list(self.part.rounds)  # those that are computed, some of them in part
        self.settings = settings = replace(settings, planes=(*settings.planes, *self.part.rigid))
        self.comm = comm
        if comm.rank == 0 and self.geometry != "axisymmetric":
            for line in symmetry_words(self.part.summary()):
                _log.info("%s", line)
        if len(rounds) > 1 and comm.rank == 0 and not settings.contact.surfaces:
            _log.warning(
                "%d rounds are computed as if each stood alone: contact of surfaces is switched off, and the distances "
                "are not those of a stack",
                len(rounds),
                extra={"code": "rounds_alone"},
            )
        self.mesh, self.quality = self._make_mesh()
        self.fuze_density = [density_of_fuze(item) for item in self.rounds]
        self.completion = Completion(self.part, self.mesh)
        bins = int(np.clip(max(self.mesh.lengths) / (1.5 * settings.cell_size), 8, 60))
        self.surfaces = self._make_surfaces(bins)
        self._make_state()
        self.exposures = ShockExposures(self.rounds, self.fields)
        self.measures = Measures(
            self.fields,
            self.surfaces,
            self.rounds,
            self.mesh.lengths,
            multiplicity=self.part.multiplicity,
            images=self.part.images,
            weight=self.mesh.node_weight,
        )
        self.interpenetration = self._make_interpenetration()

    def _find_part(self, rounds: Sequence[Round], settings: BurstSettings) -> SymmetricPart:
        """What of the arrangement is computed."""
        return smallest_part(rounds, settings)

    def _make_mesh(self) -> tuple[HexahedralMesh, MeshQuality]:
        """Every rank makes the mesh, which is quick and saves sending it; an error then ends them all alike."""
        mesh = merge(
            [
                mesh_round(item, self.settings.cell_size, index, cuts)
                for index, (item, cuts) in enumerate(zip(self.rounds, self.part.cuts, strict=True))
            ]
        )
        found = quality(mesh)
        return (split_charges(mesh) if self.settings.contact.charge_casing == "sliding" else mesh), found

    def _make_surfaces(self, bins: int) -> RadialSurfaces:
        """Where radii are measured, casings in so many `bins` each."""
        return radial_surfaces(self.mesh, self.rounds, self.settings.leakage.parts, bins)

    def _make_state(self) -> None:
        """Distribute the mesh and make the fields, what acts on them and the solver."""
        distributed = self._distribute()
        self.leakage = self._make_leakage(distributed)
        self.fields = self._make_fields(
            distributed,
            fuze_density=self.fuze_density,
            axial_part=self.surfaces.cell_part[distributed.cell],
            leakage=self.leakage.factor,
            lengths=self.mesh.lengths,
        )
        self.ledger = self._make_ledger()
        self.contact = self._make_contact()
        self.initiation = self._make_initiation()
        self.solver = self._make_solver()

    def _distribute(self) -> DistributedMesh:
        """Give every rank its share of the mesh."""
        mesh, comm = self.mesh, self.comm
        check_planes(self.rounds, self.settings, mesh)
        alone = comm.size == 1 or comm.rank > 0
        owner = None if alone else partition(mesh, self.rounds, comm.size)
        return distribute(comm, mesh if comm.rank == 0 else None, destination=owner)

    def _make_fields(self, distributed: DistributedMesh, **inputs: Any) -> BurstFields:
        """The state, at rest and unreacted; `inputs` as for `make_fields`."""
        return make_fields(distributed, self.rounds, self.settings, **inputs)

    def _make_contact(self) -> ContactForces:
        """Bonds, colliding surfaces and planes."""
        return ContactForces.of_mesh(self.mesh, self.fields, self.settings)

    def _make_initiation(self) -> ShockInitiations | None:
        """What looks for shocks that initiate a charge."""
        return ShockInitiations.of_rounds(self.rounds, self.fields)

    def _make_solver(self) -> BurstSolver:
        """What steps the state."""
        return BurstSolver(
            self.fields,
            self.settings,
            self.leakage,
            self.ledger,
            contact=self.contact,
            initiation=self.initiation,
            holds=self._holds(),
        )

    def _make_interpenetration(self) -> InterpenetrationCheck:
        """What finds metal that has passed through planes or into other rounds."""
        return InterpenetrationCheck(
            self.mesh,
            self.fields,
            self.rounds,
            self.settings,
            images=self.part.images,
            multiplicity=self.part.multiplicity,
            eroded=self.contact.eroded,
        )

    def _make_leakage(self, distributed: DistributedMesh) -> LeakageParts:
        """Axial parts of the charges with this rank's own nodes."""
        surfaces, own = self.surfaces, distributed.node[: distributed.owned_nodes]
        return LeakageParts.of_charges(
            self.settings.leakage,
            distributed.comm,
            surfaces.charge_part[own],
            self.mesh.nodes[own],
            surfaces.radius[own],
            surfaces.outward[own],
            surfaces.parts,
            self.mesh.node_weight[own],
        )

    def _holds(self) -> tuple[Hold, ...]:
        """Nodes in planes that cut rounds, which stay there."""
        held = self.mesh.held
        if held is None:
            return ()
        local = held[self.fields.mesh.node]
        return tuple(Hold(np.flatnonzero(local >> plane.bit & 1), np.array(plane.normal)) for plane in self.part.planes)

    def _make_ledger(self) -> Ledger:
        state = self.fields
        own = state.mesh.part == Part.CHARGE
        masses = exact_sums(self.comm, state.cell_mass[own, None], state.mesh.round[own], len(state.products))[:, 0]
        energies = [products.energy / products.density for products in state.products]
        chemical = masses * np.array(energies)
        return Ledger(
            self.settings.energy_tolerance,
            MIN_WORK * float(chemical.sum()),
            chemical,
            self.comm,
            balanced=self.part.held_directions,
        )
