"""Bodies without a charge, for checks of the solid alone: grids of hexahedra and the solver on them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx.contact import ContactForces
from burst_fenicsx.kernels.geometry.faces import reordered
from burst_fenicsx.materials.library import load_explosive
from burst_fenicsx.mechanics.detonation import AxialSlices
from burst_fenicsx.mechanics.fields import make_fields
from burst_fenicsx.mechanics.ledger import Ledger
from burst_fenicsx.mechanics.solver import BurstSolver
from burst_fenicsx.meshing import HexahedralMesh
from burst_fenicsx.meshing.disc import section_grid
from burst_fenicsx.meshing.distributed import distribute
from burst_fenicsx.problem import BurstSettings, CasingMaterial, ContactSettings, Leakage, Part, Round

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.mechanics.ledger import Entry

__all__ = ["SETTINGS", "elastic", "energy", "grid", "record", "rod", "solver_on", "wave_speed"]

SETTINGS = BurstSettings(
    cell_size=1e-3, leakage=Leakage(enabled=False), contact=ContactSettings(charge_casing="shared", surfaces=False)
)
"""As a burst has them, with artificial viscosity and hourglass control."""

_ENDLESS = 1e15  # Pa: a strength that is never reached


def elastic(values: Mapping[str, Any], **changes: Any) -> CasingMaterial:
    """Material of a table of the reference, never yielding but for `changes`."""
    made = CasingMaterial(
        name="body",
        density=values["density"],
        elastic_modulus=values["elastic_modulus"],
        poisson_ratio=values["poisson_ratio"],
        shear_strength=_ENDLESS,
        tensile_strength=4.0 * _ENDLESS,
        shear_softening_strain=None,
        tensile_softening_strain=None,
        softening_length=None,
    )
    return replace(made, **changes)


def wave_speed(material: CasingMaterial) -> float:
    """Speed of plane longitudinal waves, sqrt((lambda + 2 mu)/rho) (m/s)."""
    nu = material.poisson_ratio
    held = material.elastic_modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return float(np.sqrt(held / material.density))


def grid(counts: Sequence[int], carry: Callable[[NDArray[Any]], NDArray[Any]]) -> HexahedralMesh:
    """Hexahedra of the unit cube, counts[0] x counts[1] x counts[2], carried by `carry` of points (n, 3)."""
    axes = [np.linspace(0.0, 1.0, count + 1) for count in counts]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape([count + 1 for count in counts])
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    windows = [tuple(slice(s, s + n) for s, n in zip(corner, counts, strict=True)) for corner in corners]
    return _mesh(carry(points), np.stack([number[window].ravel() for window in windows], axis=1))


def rod(radius: float, length: float, core: int) -> HexahedralMesh:
    """Round rod along z from 0 to `length` (m); `core` cells along the side of its section's core, even cells."""
    section = section_grid(core, rings=core // 2, wall=1)
    # The outermost ring is the grid's wall, as deep as the others.
    flat = section.nodes(radius * (1.0 - 0.25 / (core // 2 + 1)), radius)
    layers = round(length / (np.pi * radius / (2.0 * core)))
    height = np.linspace(0.0, length, layers + 1)
    nodes = np.concatenate([np.column_stack([flat, np.full(len(flat), z)]) for z in height])
    lower = section.quads[None] + len(flat) * np.arange(layers)[:, None, None]
    return _mesh(nodes, np.concatenate([lower, lower + len(flat)], axis=2).reshape(-1, 8))


def _mesh(nodes: NDArray[Any], cells: NDArray[Any]) -> HexahedralMesh:
    height = float(nodes[:, 2].max())
    return HexahedralMesh(
        nodes=nodes,
        cells=reordered(cells.astype(np.int64)),
        part=np.full(len(cells), Part.CASING, dtype=np.int32),
        round=np.zeros(len(cells), dtype=np.int32),
        segment=np.zeros(len(cells), dtype=np.int32),
        station=height - nodes[cells].mean(axis=1)[:, 2],
        lengths=(height,),
    )


def solver_on(mesh: HexahedralMesh, material: CasingMaterial, settings: BurstSettings, **options: Any) -> BurstSolver:
    """Solver on one body at rest, on this process alone; `options` go to `BurstSolver`.

    Nodes stand in the mesh's order: read places from `solver.fields.start`.
    """
    distributed = distribute(MPI.COMM_SELF, mesh)
    # A round names an explosive even where it has no charge.
    item = Round(name="body", explosive=load_explosive("tnt"), casing=material)
    nothing = np.zeros(0)
    leakage = AxialSlices.of_charges(
        settings.leakage, MPI.COMM_SELF, np.zeros(0, dtype=np.int32), np.zeros((0, 3)), nothing, np.zeros((0, 3)), 0
    )
    fields = make_fields(
        distributed,
        [item],
        settings,
        fuze_density=[material.density],
        axial_slice=np.zeros(distributed.cells, dtype=np.int32),
        leakage=leakage.factor,
        lengths=mesh.lengths,
    )
    # The ledger's own error is relative to work; these bodies may start with energy that no work gave them.
    ledger = Ledger(np.inf, 1.0, np.zeros(1), MPI.COMM_SELF)
    contact = ContactForces.of_mesh(mesh, fields, settings) if settings.planes else None
    return BurstSolver(fields, settings, leakage, ledger, contact=contact, **options)


def record(solver: BurstSolver) -> Entry:
    """The ledger's entry now."""
    return solver.ledger.record(solver.fields, solver.time, solver.time_step, 0.0, solver.contact)


def energy(entry: Entry) -> float:
    """All that an entry holds or has lost (J), external work not taken off."""
    stored = entry.kinetic + entry.strain + entry.plastic
    return stored + entry.viscous + entry.hourglass + entry.contact + entry.damping
