"""Several small bodies that may touch, for tests of contact: each is a round of its own."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx.contact import ContactForces
from burst_fenicsx.mechanics.fields import make_fields
from burst_fenicsx.mechanics.ledger import Ledger
from burst_fenicsx.mechanics.solver import BurstSolver
from burst_fenicsx.meshing import HexahedralMesh, merge
from burst_fenicsx.meshing.distributed import distribute
from burst_fenicsx.problem import CasingMaterial, Hourglass, Round, Viscosity
from tests.burst_fenicsx.boxes import BARE, ELASTIC, TNT, grid, no_leakage, plain_inputs

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.problem import BurstSettings

BAR = replace(ELASTIC, poisson_ratio=0.0)
"""No lateral strain: a bar's wave is one-dimensional however coarse its section."""

QUIET = replace(
    BARE,
    viscosity=Viscosity(linear=0.06, quadratic=1.5),
    hourglass=Hourglass(charge_viscous=0.1, casing_viscous=0.03, casing_stiffness=0.03),
)


def moved(mesh: HexahedralMesh, offset: Sequence[float], index: int = 0) -> HexahedralMesh:
    """The mesh, shifted (m), as the round `index`."""
    return replace(
        mesh,
        nodes=mesh.nodes + np.asarray(offset),
        round=np.full(len(mesh.cells), index, dtype=np.int32),
        segments=((),),
    )


def ball(count: int, radius: float) -> HexahedralMesh:
    """Ball of count^3 cells: a cube whose shells are pulled to spheres."""

    def carry(points: np.ndarray) -> np.ndarray:
        cube = 2.0 * points - 1.0
        longest = np.abs(cube).max(axis=1)
        length = np.linalg.norm(cube, axis=1)
        on_sphere = cube * (longest / np.where(length > 0.0, length, 1.0))[:, None]
        share = longest[:, None]  # of the sphere: cubes within, spheres without
        return radius * ((1.0 - share) * 0.7 * cube + share * on_sphere)

    return grid((count, count, count), carry)


def bodies(
    meshes: Sequence[HexahedralMesh],
    velocities: Sequence[Sequence[float]],
    settings: BurstSettings = BARE,
    *,
    casing: CasingMaterial = ELASTIC,
    comm: MPI.Comm = MPI.COMM_SELF,
    **options: Any,
) -> BurstSolver:
    """Solver on bodies that start with the given velocities (m/s); `options` go to `BurstSolver`."""
    mesh = merge([replace(one, segments=((),)) for one in meshes])
    distributed = distribute(comm, mesh if comm.rank == 0 else None)
    rounds = [Round(name=f"body {number}", explosive=TNT, casing=casing) for number in range(len(meshes))]
    leakage = no_leakage(settings, comm)
    fields = make_fields(distributed, rounds, settings, **plain_inputs(distributed, mesh, leakage))
    ledger = Ledger(settings.energy_tolerance, 1.0, np.zeros(len(rounds)), comm)
    contact = ContactForces.of_mesh(mesh, fields, settings)
    solver = BurstSolver(fields, settings, leakage, ledger, contact=contact, **options)
    owner = np.zeros(len(mesh.nodes), dtype=int)
    owner[mesh.cells] = mesh.round[:, None]
    fields.nodes.velocity[:] = np.asarray(velocities, dtype=float)[owner[distributed.node]]
    return solver


def momentum(solver: BurstSolver) -> np.ndarray:
    """Momentum of all nodes (3,) in kg m/s."""
    fields = solver.fields
    total: np.ndarray = fields.mass @ fields.nodes.velocity
    return total


def mean_velocity(solver: BurstSolver, index: int) -> np.ndarray:
    """Mass-weighted velocity (3,) of the body `index` (m/s)."""
    fields = solver.fields
    nodes = np.unique(fields.mesh.dofmap[fields.mesh.round == index])
    mass = fields.mass[nodes]
    mean: np.ndarray = mass @ fields.nodes.velocity[nodes] / mass.sum()
    return mean


def energy(solver: BurstSolver) -> float:
    """Kinetic energy and all that the ledger stores or has lost, less the work done from outside (J)."""
    entry = replace_entry(solver)
    stored = entry.kinetic + entry.strain + entry.plastic + entry.viscous + entry.hourglass + entry.contact
    return stored - entry.external_work


def replace_entry(solver: BurstSolver):
    """The ledger's entry now, without its bounds: these bodies start with an energy that no work gave them."""
    ledger = solver.ledger
    ledger.energy_tolerance = np.inf
    assert solver.contact is not None
    return ledger.record(solver.fields, solver.time, solver.time_step, 0.0, solver.contact)
