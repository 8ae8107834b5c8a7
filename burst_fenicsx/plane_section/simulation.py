"""The burst of a stack in a plane section, from mesh to summary."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx.axisymmetric.fields import make_ring_fields, on_dolfinx
from burst_fenicsx.errors import InputError
from burst_fenicsx.mechanics.detonation import front_near
from burst_fenicsx.meshing.mesh import merge
from burst_fenicsx.meshing.split import split_charges
from burst_fenicsx.plane_section.contact import SectionContact
from burst_fenicsx.plane_section.directions import Flight, casing_flight, direction_summary
from burst_fenicsx.plane_section.mesh import SectionMesh, mesh_section, section_quality
from burst_fenicsx.plane_section.passage import SectionPassage
from burst_fenicsx.plane_section.section import WORDS, find_section
from burst_fenicsx.plane_section.solver import SectionSolver
from burst_fenicsx.plane_section.surfaces import section_radii
from burst_fenicsx.problem import Part
from burst_fenicsx.simulation import Simulation
from burst_fenicsx.symmetry import smallest_part
from burst_fenicsx.symmetry.completion import turned_stress

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from burst_fenicsx.axisymmetric.fields import RingFields
    from burst_fenicsx.files.snapshot import RoundRecord
    from burst_fenicsx.mechanics.ledger import Ledger
    from burst_fenicsx.meshing import MeshQuality
    from burst_fenicsx.meshing.distributed import DistributedMesh
    from burst_fenicsx.problem import BurstSettings, Round
    from burst_fenicsx.records.measures import RoundMeasures
    from burst_fenicsx.records.surfaces import RadialSurfaces
    from burst_fenicsx.simulation import BurstProgress
    from burst_fenicsx.symmetry.part import SymmetricPart

__all__ = ["SectionSimulation"]

_log = logging.getLogger(__name__)
_SLACK = 0.02  # of the cell size: the outline of the cells bulges a little over the circle
_MIN_WORK = 1e-2  # of the chemical energy: below, the ledger's error is taken relative to it


class SectionSimulation(Simulation):
    """The burst of all rounds in a plane section; computed on one rank, as one thread. Quantities are per metre.

    Raises
    ------
    InputError
        The rounds have no common section; besides what `Simulation` raises.
    """

    geometry = "plane"
    mesh: SectionMesh  # type: ignore[assignment]
    fields: RingFields
    contact: SectionContact

    def __init__(
        self,
        rounds: Sequence[Round],
        settings: BurstSettings,
        out_dir: Path,
        provenance: dict[str, str],
        on_progress: Callable[[BurstProgress], None] | None = None,
    ) -> None:
        section, reason = find_section(rounds, settings)
        if section is None:
            raise InputError(f"the burst has no plane section: {reason}; compute it in three dimensions")
        self.whole_section = section
        _log.info("%s: %s", WORDS, self.section_words(rounds))
        super().__init__(rounds, settings, out_dir, MPI.COMM_SELF, provenance, on_progress)

    def _find_part(self, rounds: Sequence[Round], settings: BurstSettings) -> SymmetricPart:
        """What of the arrangement is computed: rounds on one side of the planes of symmetry between them."""
        return smallest_part(rounds, settings, through_rounds=False)

    def section_words(self, rounds: Sequence[Round]) -> str:
        """Where the rounds are cut and when their sections ignite, in words."""
        return ", ".join(
            f"'{item.name}' at station {1e3 * station:.4g} mm, ignited at {1e6 * time:.4g} us"
            for item, station, time in zip(
                rounds, self.whole_section.stations, self.whole_section.ignition, strict=True
            )
        )

    def _make_mesh(self) -> tuple[SectionMesh, MeshQuality]:  # type: ignore[override]
        self.section = self.whole_section.of_rounds(self.part.indices)
        self.section_planes = self.section.planes(self.settings.planes)
        meshes = []
        for index, item in enumerate(self.rounds):
            assert item.profile is not None
            u, v = self.section.centres[index]
            station = float(self.section.stations[index])
            meshes.append(
                mesh_section(item.profile, station, self.settings.cell_size, centre=(u, v), round_index=index)
            )
        mesh = merge(meshes)
        found = section_quality(mesh)
        self._check_planes(mesh)
        return (split_charges(mesh) if self.settings.contact.charge_casing == "bonded" else mesh), found

    def _check_planes(self, mesh: SectionMesh) -> None:
        """Refuse rounds that a plane cuts or that stand behind it."""
        for plane in self.section_planes:
            height = (mesh.nodes - np.asarray(plane.point)) @ np.asarray(plane.normal)
            for index, item in enumerate(self.rounds):
                deepest = -float(height[mesh.cells[mesh.round == index]].min())
                if deepest > _SLACK * self.settings.cell_size:
                    raise InputError(
                        f"round '{item.name}' lies {1e3 * deepest:.3g} mm behind the plane '{plane.name}'; "
                        "every round must stand wholly on the side to which the plane's normal points"
                    )

    def _make_surfaces(self, bins: int) -> RadialSurfaces:  # noqa: ARG002 - a section has one for each round
        return section_radii(self.mesh, self.section)

    def _distribute(self) -> DistributedMesh:
        return on_dolfinx(self.mesh)

    def _make_fields(self, distributed: DistributedMesh, **inputs: Any) -> RingFields:
        """The state; all of a round's section ignites when the front reaches its axis there."""
        fields = make_ring_fields(distributed, self.rounds, self.settings, plane=True, **inputs)
        charge, mesh = fields.charge, fields.mesh
        for index, time in enumerate(self.section.ignition):
            own = (mesh.round == index) & (mesh.part == Part.CHARGE)
            charge.ignition_time[own] = time
            charge.compression_from[own] = front_near(np.full(int(own.sum()), time), charge.burn_rate[own])
        return fields

    def _make_contact(self) -> SectionContact:
        return SectionContact(self.mesh, self.fields, self.settings, self.section_planes)

    def _make_initiation(self) -> None:
        """Nothing: a shock does not initiate a section."""

    def _make_solver(self) -> SectionSolver:
        solver = SectionSolver(self.fields, self.settings, self.leakage, self.ledger, self.contact)
        # Before the first front nothing happens.
        solver.time = float(self.section.ignition.min())
        return solver

    def resume(self) -> None:
        """Go on from the checkpoint."""
        super().resume()
        self.solver.subcycling.steady_contact = self.contact.near

    def _make_ledger(self) -> Ledger:
        """The ledger; all charges burn in the first microsecond, before which next to no work is done."""
        ledger = super()._make_ledger()
        ledger.min_work = _MIN_WORK * float(ledger.chemical_energies.sum())
        return ledger

    def _make_passage(self) -> SectionPassage:
        return SectionPassage(
            self.mesh,
            self.fields,
            self.rounds,
            replace(self.settings, planes=self.section_planes),
            images=self.part.images,
        )

    def _place(self, fields: dict[str, np.ndarray]) -> None:
        """Carry nodal fields from the section's coordinates to the world's."""
        for name, values in fields.items():
            if name in ("position", "reference"):
                fields[name] = self.section.world(values)
            else:
                fields[name] = values @ self.section.directions

    def _records(self, masses: Sequence[np.ndarray], speeds: Sequence[np.ndarray]) -> list[RoundRecord]:
        """The rounds as the snapshot describes them, per metre; a section has no segments."""
        return [replace(record, segments=()) for record in super()._records(masses, speeds)]

    def _turn_stress(self, fields: dict[str, np.ndarray]) -> None:
        fields["stress"] = turned_stress(fields["stress"], self.section.directions.T)

    def _summary(self, along: Sequence[RoundMeasures], charge_masses: Sequence[float]) -> dict[str, Any]:
        found = super()._summary(along, charge_masses)
        flight, section = self._flight(), self.whole_section
        for entry, station, time in zip(found["rounds"], section.stations, section.ignition, strict=True):
            entry["section_station"], entry["section_ignition"] = float(station), float(time)
            entry["fastest_station"] = float(station)
        return {
            **found,
            "section": {
                "words": WORDS,
                "origin": section.origin.tolist(),
                "directions": section.directions[[0, 2]].tolist(),
                "torn_mass": float(flight.mass[flight.torn].sum()),
                **direction_summary(flight, self._focus()),
            },
        }

    def _flight(self) -> Flight:
        """The casings of all rounds in flight, those of images reflected."""
        part, axes = self.part, self.section.directions
        casings = [casing_flight(self.fields, index) for index in range(len(self.rounds))]
        images = []
        for source, mirrors in zip(part.source.tolist(), part.mirrors.tolist(), strict=True):
            reflected = (axes @ part.matrix(mirrors) @ axes.T)[np.ix_([0, 2], [0, 2])]
            images.append(replace(casings[source], velocity=casings[source].velocity @ reflected.T))
        return Flight(
            mass=np.concatenate([one.mass for one in images]),
            velocity=np.concatenate([one.velocity for one in images]),
            torn=np.concatenate([one.torn for one in images]),
        )

    def _focus(self) -> float | None:
        """Azimuth (degrees) across the line from the first round to its nearest neighbour or mirror image."""
        centres = self.whole_section.centres
        images = [
            centres[0] - 2.0 * ((centres[0] - point) @ normal) * normal
            for plane in self.section_planes
            if plane.symmetry
            for point, normal in [(np.asarray(plane.point)[[0, 2]], np.asarray(plane.normal)[[0, 2]])]
        ]
        others = np.array([*centres[1:], *images]).reshape(-1, 2)
        if not len(others):
            return None
        away = others - centres[0]
        u, v = away[np.argmin(np.linalg.norm(away, axis=1))]
        return float((np.degrees(np.arctan2(v, u)) + 90.0) % 180.0)
