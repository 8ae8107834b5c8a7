"""A burst before its first step: mesh, distribution, fields, contact and solver of a problem."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx.axisymmetric.meridian import MERIDIAN
from burst_fenicsx.errors import InputError
from burst_fenicsx.geometries import THREE_DIMENSIONS
from burst_fenicsx.mechanics.detonation import AxialSlices
from burst_fenicsx.mechanics.fields import make_fields
from burst_fenicsx.mechanics.initiation import ShockInitiations
from burst_fenicsx.mechanics.ledger import Ledger
from burst_fenicsx.mechanics.material_tables import density_of_fuze
from burst_fenicsx.mechanics.solver import BurstSolver
from burst_fenicsx.meshing.cut import split_charges
from burst_fenicsx.problem import BurstSettings, Round
from burst_fenicsx.records.acceleration import Acceleration
from burst_fenicsx.records.exposure import ShockExposures
from burst_fenicsx.records.interpenetration import InterpenetrationCheck
from burst_fenicsx.records.measures import Measures
from burst_fenicsx.records.surfaces import radial_surfaces
from burst_fenicsx.symmetry import smallest_part, symmetry_words
from burst_fenicsx.symmetry.completion import Completion

if TYPE_CHECKING:
    from burst_fenicsx.geometries import Geometry
    from burst_fenicsx.meshing import MeshQuality
    from burst_fenicsx.meshing.distributed import DistributedMesh
    from burst_fenicsx.meshing.mesh import CellMesh
    from burst_fenicsx.records.surfaces import RadialSurfaces
    from burst_fenicsx.symmetry.part import SymmetricPart


_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class MeshedRounds:
    """Rounds at rest as cells, before anything is said of what they are made of.

    Attributes
    ----------
    mesh, quality, surfaces, distributed : as of `AssembledBurst`.
    cell_size : edge of the largest mean cell of a round (m).
    """

    mesh: Any
    quality: MeshQuality
    cell_size: float
    surfaces: RadialSurfaces
    distributed: DistributedMesh

    @classmethod
    def of(
        cls, geometry: Geometry, part: SymmetricPart, settings: BurstSettings, standing: Sequence[Round], comm: MPI.Comm
    ) -> MeshedRounds:
        """Mesh the rounds of a part; `standing`: the same as they stand in the mesh."""
        mesh, quality = geometry.make_mesh(part.rounds, part.cuts, settings)
        cell_size = _cell_size(mesh, part.rounds, settings.cell_size)
        mesh = split_charges(mesh) if settings.contact.charge_casing == "sliding" else mesh
        bins = int(np.clip(max(mesh.lengths) / (1.5 * cell_size), 8, 60))
        surfaces = radial_surfaces(mesh, standing, settings.leakage.parts, bins)
        return cls(mesh, quality, cell_size, surfaces, geometry.distribute(comm, mesh, part.rounds))

    @classmethod
    def kept(
        cls, geometry: Geometry, part: SymmetricPart, settings: BurstSettings, standing: Sequence[Round], comm: MPI.Comm
    ) -> MeshedRounds:
        """As `of`, for one round in its meridian; where the last one was the same, that again, its nodes moved back."""
        key = (part.rounds[0].profile, settings.cell_size, settings.contact.charge_casing, settings.leakage.parts)
        if key not in _kept:
            _kept.clear()
            _kept[key] = cls.of(geometry, part, settings, standing, comm)
        kept = _kept[key]
        kept.distributed.domain.geometry.x[:] = kept.mesh.nodes[kept.distributed.node]
        return kept


_kept: dict[object, MeshedRounds] = {}


class AssembledBurst:
    """All objects of a burst at time zero, in the geometry of the settings.

    Attributes
    ----------
    geometry : what makes them.
    part, rounds, settings : what of the arrangement is computed, its rounds, and the settings with its planes.
    mesh, quality, surfaces : of all ranks. fuze_density : of each round (kg/m3).
    fields, contact, initiation, leakage, ledger, solver : the state, what acts on it, its sums and what steps it.
    acceleration, exposures, measures, interpenetration, completion : what looks at it, and what adds the mirrored
        rounds.
    """

    def __init__(
        self, rounds: Sequence[Round], settings: BurstSettings, comm: MPI.Comm, *, keep_mesh: bool = False
    ) -> None:
        _check(rounds, settings)
        self.geometry = geometry = MERIDIAN if settings.geometry == "axisymmetric" else THREE_DIMENSIONS
        self._given = settings
        settings = geometry.prepare(rounds, settings)
        self.part = smallest_part(rounds, settings)
        self.rounds = list(self.part.rounds)  # those that are computed, some of them in part
        self.settings = settings = replace(settings, planes=(*settings.planes, *self.part.rigid))
        self.comm = comm
        self._announce(len(rounds))
        standing = [replace(item, position=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0)) for item in self.rounds]
        standing = standing if geometry.upright else self.rounds
        make = MeshedRounds.kept if keep_mesh and geometry.upright else MeshedRounds.of
        meshed = make(geometry, self.part, settings, standing, comm)
        self.settings = settings = replace(settings, cell_size=meshed.cell_size)
        self.mesh, self.quality, self.surfaces = meshed.mesh, meshed.quality, meshed.surfaces
        mesh, distributed = meshed.mesh, meshed.distributed
        self.fuze_density = [density_of_fuze(item) for item in self.rounds]
        self.completion = Completion(self.part, mesh)
        self.leakage = self._leakage(distributed)
        self.fields = make_fields(
            distributed,
            standing,
            settings,
            fuze_density=self.fuze_density,
            axial_slice=self.surfaces.cell_slice[distributed.cell],
            leakage=self.leakage.factor,
            lengths=mesh.lengths,
            element=geometry.element,
        )
        self.ledger = Ledger.at_rest(self.fields, settings.energy_tolerance, balanced=self.part.held_directions)
        self.contact = geometry.make_contact(mesh, self.fields, settings)
        self.initiation = ShockInitiations.of_rounds(self.rounds, self.fields)
        self.solver = BurstSolver(
            self.fields,
            settings,
            self.leakage,
            self.ledger,
            contact=self.contact,
            initiation=self.initiation,
            constraints=geometry.constrain(mesh, self.fields),
        )
        radii = self.leakage.mean_radii(self.leakage.initial_radius, len(self.rounds))
        self.acceleration = Acceleration(
            self.fields.products, settings.leakage, settings.acceleration_left, self.ledger.chemical_energies, radii
        )
        self.exposures = ShockExposures(self.rounds, self.fields)
        self.measures = Measures(
            self.fields,
            self.surfaces,
            mesh,
            multiplicity=self.part.multiplicity,
            images=self.part.images,
        )
        self.interpenetration = InterpenetrationCheck(
            mesh,
            self.fields,
            self.rounds,
            settings,
            images=self.part.images,
            multiplicity=self.part.multiplicity,
            eroded=self.contact.eroded,
        )

    def _announce(self, rounds: int) -> None:
        if self.comm.rank > 0:
            return
        if not self.geometry.upright:
            for line in symmetry_words(self.part.summary()):
                _log.info("%s", line)
        if rounds > 1 and not self.settings.contact.surfaces:
            _log.warning(
                "%d rounds are computed as if each stood alone: contact of surfaces is switched off, and the distances "
                "are not those of a stack",
                rounds,
                extra={"code": "rounds_alone"},
            )

    def _leakage(self, distributed: DistributedMesh) -> AxialSlices:
        surfaces, own = self.surfaces, distributed.node[: distributed.owned_nodes]
        return AxialSlices.of_charges(
            self.settings.leakage,
            distributed.comm,
            surfaces.charge_slice[own],
            self.mesh.nodes[own],
            surfaces.radius[own],
            surfaces.outward[own],
            surfaces.slices,
            self.mesh.node_weight[own],
        )

    def check_state(self) -> None:
        """Stop where metal has come to where the geometry leaves something out, or has passed through; collective."""
        self.geometry.check_state(self.fields, self.rounds, self._given, self.solver.time)
        self.interpenetration.check(self.solver.time)


def _cell_size(mesh: CellMesh, rounds: Sequence[Round], wanted: float) -> float:
    """Edge of the largest mean cell of a round (m): as `wanted`, or as a mesh file has it."""
    edges = [wanted for item in rounds if item.mesh_file is None]
    for index, item in enumerate(rounds):
        if item.mesh_file is not None:
            edges.append(float(np.cbrt(mesh.volumes[mesh.round == index].mean())))
    return max(edges)


def _check(rounds: Sequence[Round], settings: BurstSettings) -> None:
    if not rounds:
        raise InputError("there is no round to burst")
    if not settings.cell_size > 0.0:
        raise InputError(f"cell_size = {settings.cell_size} m; it must be positive")
    for item in rounds:
        if not item.ignition and item.initiation is None:
            raise InputError(
                f"round '{item.name}' has no ignition point; give at least one, or let it be initiated by shock"
            )
    if not any(item.ignition for item in rounds):
        raise InputError("no round has an ignition point: nothing would burst")
    for plane in settings.planes:
        if not np.linalg.norm(plane.normal) > 0.0:
            raise InputError(f"plane '{plane.name}' has the normal {plane.normal}; it must not be zero")
