"""Small meshes and a one-call burst on them, for tests of the solver: boxes, distorted boxes, sectors of a ring."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx.materials.library import load_explosive
from burst_fenicsx.mechanics.detonation import AxialSlices
from burst_fenicsx.mechanics.fields import make_fields
from burst_fenicsx.mechanics.initiation import ShockInitiations
from burst_fenicsx.mechanics.ledger import Ledger
from burst_fenicsx.mechanics.solver import BurstSolver
from burst_fenicsx.meshing import HexahedralMesh
from burst_fenicsx.meshing.distributed import distribute
from burst_fenicsx.problem import (
    BurstSettings,
    CasingMaterial,
    Explosive,
    Hourglass,
    Leakage,
    Part,
    Round,
    ShockInitiation,
    TimeStep,
    Viscosity,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from burst_fenicsx.meshing.distributed import DistributedMesh
    from burst_fenicsx.meshing.mesh import CellMesh

TNT, COMP_B = (replace(load_explosive(name), critical_energy=None) for name in ("tnt", "comp_b"))
STEEL = CasingMaterial(
    name="steel",
    density=7850.0,
    elastic_modulus=210e9,
    poisson_ratio=0.3,
    shear_strength=800e6,
    tensile_strength=800e6,
    softening_length=None,
)
ELASTIC = replace(
    STEEL,
    name="elastic",
    elastic_modulus=200e9,
    shear_strength=1e15,
    tensile_strength=4e15,
    shear_softening_strain=None,
    tensile_softening_strain=None,
)
BARE = BurstSettings(
    cell_size=1e-2,
    viscosity=Viscosity(linear=0.0, quadratic=0.0),
    hourglass=Hourglass(charge_viscous=0.0, casing_viscous=0.0, casing_stiffness=0.0),
    leakage=Leakage(enabled=False),
)
"""No artificial viscosity, no hourglass control, no leakage: the pure scheme."""
CONTROLLED = replace(BARE, hourglass=Hourglass(casing_viscous=0.05, casing_stiffness=0.05, charge_viscous=0.1))
"""With hourglass control, to show that it leaves uniform strain and rotation alone."""


def with_fixed_step(settings: BurstSettings, step: float, **changes: Any) -> BurstSettings:
    """The settings with a fixed time step (s) and other changes."""
    return replace(settings, time_step=TimeStep(fixed=step), **changes)


def grid(
    counts: Sequence[int], mapping: Callable[[np.ndarray], np.ndarray], part: Part = Part.CASING
) -> HexahedralMesh:
    """Hexahedra of the unit cube, counts[0] x counts[1] x counts[2], carried by `mapping` of points (n, 3)."""
    axes = [np.linspace(0.0, 1.0, count + 1) for count in counts]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape([count + 1 for count in counts])
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    windows = [tuple(slice(s, s + n) for s, n in zip(corner, counts, strict=True)) for corner in corners]
    cells = np.stack([number[window].ravel() for window in windows], axis=1).astype(np.int64)
    nodes = mapping(points)
    height = nodes[:, 2].max()
    station = height - nodes[cells].mean(axis=1)[:, 2]
    return HexahedralMesh(
        nodes=nodes,
        cells=cells,
        part=np.full(len(cells), part, dtype=np.int32),
        round=np.zeros(len(cells), dtype=np.int32),
        segment=np.full(len(cells), 0 if part == Part.CASING else -1, dtype=np.int32),
        station=station,
        lengths=(float(height),),
    )


def box(counts: Sequence[int], size: Sequence[float], part: Part = Part.CASING) -> HexahedralMesh:
    """Regular box of edges `size` (m)."""
    return grid(counts, lambda points: points * np.asarray(size), part)


def distorted_box(count: int, size: float, part: Part = Part.CASING, share: float = 0.25) -> HexahedralMesh:
    """Cube of count^3 cells of edge `size` (m) each, its inner nodes moved at random by up to `share` of an edge."""
    mesh = box((count, count, count), (count * size,) * 3, part)
    move = np.random.default_rng(7).uniform(-share, share, mesh.nodes.shape) * size
    move[boundary_nodes(mesh)] = 0.0
    # The boundary is sheared and tapered as well, so that no cell is a brick.
    nodes = mesh.nodes + move
    x, y, z = nodes.T / (count * size)
    bent = np.stack([x + 0.2 * y * z, y + 0.15 * z + 0.1 * x * z, z + 0.1 * x + 0.1 * x * y], axis=1) * count * size
    return replace(mesh, nodes=bent)


def carried(solver: BurstSolver, place: Callable[[np.ndarray], np.ndarray], step: float) -> None:
    """Prescribe the nodes' next places (function of the initial ones) and advance the cells by one step (s)."""
    nodes = solver.fields.nodes
    after = place(solver.fields.start)
    nodes.velocity[:] = (after - nodes.position) / step
    nodes.position[:] = after
    solver.time += step
    solver.add_forces(step)


def turned_inside_out(solver: BurstSolver, cell: int, step: float = 1e-7) -> None:
    """Mirror a cell's nodes in its centre within one step (s)."""
    nodes, own = solver.fields.nodes, solver.fields.mesh.dofmap[cell]
    centre = nodes.position[own].mean(axis=0)
    nodes.velocity[own] = -2.0 * (nodes.position[own] - centre) / step
    nodes.position[own] = 2.0 * centre - nodes.position[own]
    solver.add_forces(step)


def boundary_nodes(mesh: HexahedralMesh) -> np.ndarray:
    """Mask of the nodes on a regular box's surface."""
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    near = 1e-9 * (high - low)
    return ((mesh.nodes < low + near) | (mesh.nodes > high - near)).any(axis=1)


def ring_sector(
    inner: float, outer: float, angle: float, height: float, counts: Sequence[int], part: Part = Part.CASING
) -> HexahedralMesh:
    """Sector of a ring about z from azimuth 0 to `angle` (rad); radii and height in m, counts (radial, azimuth, z)."""

    def carry(points: np.ndarray) -> np.ndarray:
        radius = inner + (outer - inner) * points[:, 0]
        azimuth = angle * points[:, 1]
        return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), height * points[:, 2]], axis=1)

    return grid(counts, carry, part)


def no_leakage(settings: BurstSettings, comm: MPI.Comm = MPI.COMM_SELF) -> AxialSlices:
    """Venting of charges that have no parts."""
    none, nowhere = np.zeros(0), np.zeros((0, 3))
    return AxialSlices.of_charges(settings.leakage, comm, np.zeros(0, dtype=np.int32), nowhere, none, nowhere, 0)


def plain_inputs(distributed: DistributedMesh, mesh: CellMesh, leakage: AxialSlices) -> dict[str, Any]:
    """What `make_fields` takes of rounds without fuze and axial parts."""
    return {
        "fuze_density": [3000.0] * len(mesh.lengths),
        "axial_slice": np.zeros(distributed.cells, dtype=np.int32),
        "leakage": leakage.factor,
        "lengths": mesh.lengths,
    }


def burst(
    mesh: HexahedralMesh,
    settings: BurstSettings = BARE,
    *,
    casing: CasingMaterial = ELASTIC,
    explosive: Explosive = TNT,
    ignition: tuple = (),
    initiation: ShockInitiation | None = None,
    min_work: float = 1.0,
    comm: MPI.Comm = MPI.COMM_SELF,
    **options: Any,
) -> BurstSolver:
    """Solver on one mesh of one round; `options` go to `BurstSolver`. Nodes and cells keep the mesh's order."""
    distributed = distribute(comm, mesh if comm.rank == 0 else None)
    item = Round(name="box", explosive=explosive, casing=casing, ignition=ignition, initiation=initiation)
    leakage = no_leakage(settings, comm)
    fields = make_fields(distributed, [item], settings, **plain_inputs(distributed, mesh, leakage))
    chemical = 0.0
    if (mesh.part == Part.CHARGE).any():
        chemical = float(fields.cell_mass.sum()) / explosive.density * fields.products[0].energy
    ledger = Ledger(settings.energy_tolerance, min_work, np.array([chemical]), comm)
    shock = ShockInitiations.of_rounds([item], fields)
    return BurstSolver(fields, settings, leakage, ledger, initiation=shock, **options)


def run_until(solver: BurstSolver, time: float) -> None:
    """Step to the time (s)."""
    while solver.time < time * (1.0 - 1e-12):
        solver.step(time)


def matrices(six: np.ndarray) -> np.ndarray:
    """Symmetric 3x3 matrices of rows xx, yy, zz, xy, yz, zx."""
    return six[..., [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(*six.shape[:-1], 3, 3)


def rotation_matrix(axis: Sequence[float], angle: float) -> np.ndarray:
    """Rotation by `angle` (rad) about `axis`."""
    unit = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    cross = np.array([[0.0, -unit[2], unit[1]], [unit[2], 0.0, -unit[0]], [-unit[1], unit[0], 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
