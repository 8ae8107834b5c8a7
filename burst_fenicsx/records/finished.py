"""What the records and the summary read of a finished burst: no more than this of the run that drove it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import numpy as np
    from mpi4py import MPI

    from burst_fenicsx.contact import ContactForces
    from burst_fenicsx.mechanics.detonation import LeakageParts
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.mechanics.initiation import ShockInitiations
    from burst_fenicsx.mechanics.ledger import Ledger
    from burst_fenicsx.mechanics.solver import BurstSolver
    from burst_fenicsx.meshing.mesh import HexahedralMesh
    from burst_fenicsx.meshing.quality import MeshQuality
    from burst_fenicsx.problem import BurstSettings, Round
    from burst_fenicsx.records.clocks import Clocks
    from burst_fenicsx.records.exposure import ShockExposures
    from burst_fenicsx.records.interpenetration import InterpenetrationCheck
    from burst_fenicsx.records.measures import Measures
    from burst_fenicsx.records.surfaces import RadialSurfaces
    from burst_fenicsx.symmetry.completion import Completion
    from burst_fenicsx.symmetry.part import SymmetricPart

__all__ = ["FinishedBurst"]


class FinishedBurst(Protocol):
    """A burst at its end; see `burst_fenicsx.simulation.Simulation`, which is one."""

    geometry: str
    rounds: list[Round]
    settings: BurstSettings
    comm: MPI.Comm
    mesh: HexahedralMesh
    quality: MeshQuality
    fuze_density: list[float]
    part: SymmetricPart
    completion: Completion
    surfaces: RadialSurfaces
    fields: BurstFields
    solver: BurstSolver
    ledger: Ledger
    leakage: LeakageParts
    contact: ContactForces
    initiation: ShockInitiations | None
    exposures: ShockExposures
    measures: Measures
    interpenetration: InterpenetrationCheck
    clocks: Clocks
    radii: list[tuple[float, np.ndarray, np.ndarray]]
    first_cell_step_at: int
    acceleration_complete: float | None
