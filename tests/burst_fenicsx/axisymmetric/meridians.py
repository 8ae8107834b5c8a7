"""Small meridians and a one-call burst on them, for tests of the axisymmetric solver."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx.axisymmetric.meridian import RING, axis_constraint, on_dolfinx
from burst_fenicsx.axisymmetric.mesh import MeridianMesh
from burst_fenicsx.axisymmetric.slide_line import meridian_contact
from burst_fenicsx.kernels.axisymmetric.slide_line import add_line_forces
from burst_fenicsx.mechanics.fields import make_fields
from burst_fenicsx.mechanics.ledger import Ledger
from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from burst_fenicsx.mechanics.solver import BurstSolver
from burst_fenicsx.problem import BurstSettings, CasingMaterial, Explosive, Part, Round
from tests.burst_fenicsx.boxes import BARE, ELASTIC, TNT, no_leakage, plain_inputs

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from burst_fenicsx.kernels.contact.law import Law

__all__ = ["hold", "meridian", "named", "random_meridian", "rectangle", "ring_burst", "stressed", "whole_steps"]


def meridian(
    counts: Sequence[int], mapping: Callable[[np.ndarray], np.ndarray], part: Part = Part.CASING
) -> MeridianMesh:
    """Quadrilaterals of the unit square, counts[0] x counts[1], carried by `mapping` (n, 2) to (r, z) in m."""
    axes = [np.linspace(0.0, 1.0, count + 1) for count in counts]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    number = np.arange(len(points)).reshape(counts[0] + 1, counts[1] + 1)
    corners = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
    cells = np.stack([corner.ravel() for corner in corners], axis=1).astype(np.int64)
    r, z = mapping(points).T
    nodes = np.stack([r, np.zeros(len(r)), z], axis=1)
    height = float(z.max())
    return MeridianMesh(
        nodes=nodes,
        cells=cells,
        part=np.full(len(cells), part, dtype=np.int32),
        round=np.zeros(len(cells), dtype=np.int32),
        segment=np.full(len(cells), 0 if part == Part.CASING else -1, dtype=np.int32),
        station=height - z[cells].mean(axis=1),
        segments=((),),
        lengths=(height,),
    )


def rectangle(
    counts: Sequence[int], radii: tuple[float, float], height: float, part: Part = Part.CASING
) -> MeridianMesh:
    """Regular meridian of a cylinder or tube between two radii (m)."""
    inner, outer = radii
    return meridian(counts, lambda p: np.stack([inner + (outer - inner) * p[:, 0], height * p[:, 1]], axis=1), part)


def random_meridian(
    count: int, size: float, inner: float = 0.0, part: Part = Part.CASING, share: float = 0.25
) -> MeridianMesh:
    """Square of `count` cells of edge `size` (m), sheared, tapered, its nodes moved at random by up to `share`."""
    mesh = rectangle((count, count), (0.0, count * size), count * size, part)
    move = np.random.default_rng(7).uniform(-share, share, mesh.nodes.shape) * size
    move[:, 1] = 0.0
    move[mesh.nodes[:, 0] == 0.0, 0] = 0.0
    r, _, z = (mesh.nodes + move).T
    whole = count * size
    nodes = np.stack([inner + r * (1.0 + 0.2 * z / whole), np.zeros(len(r)), z * (1.0 + 0.1 * r / whole) + 0.15 * r], 1)
    return replace(mesh, nodes=nodes)


def named(mesh: MeridianMesh, part: np.ndarray) -> MeridianMesh:
    """The mesh with these parts (cells,)."""
    return replace(mesh, part=part.astype(np.int32), segment=np.where(part == Part.CASING, 0, -1).astype(np.int32))


def stressed(solver: BurstSolver, part: Part) -> Any:
    """Put constant stress into every cell, of products or at random, and add its forces; gives its function."""
    state = solver.fields
    values = state.solid.stress[:, 0]
    if part == Part.CHARGE:
        state.charge.burn_fraction[:] = 1.0
        state.nodes.position[:] *= [1.05, 1.0, 0.98]
        solver.add_forces(0.0)
        values[:] = 0.0
        values[:, :3] = -state.charge.pressure[:, None]
        assert state.charge.pressure.min() > 1e9
    else:
        random = np.random.default_rng(11).normal(size=values.shape) * 1e9
        random[:, 3:5] = 0.0  # nothing shears towards a ring's circumference
        values[:] = random
        solver.add_forces(0.0)
    return state.functions["stress"]


def whole_steps(settings: BurstSettings, **changes: Any) -> BurstSettings:
    """The settings with one step for all cells."""
    return replace(settings, time_step=replace(settings.time_step, subcycling=False), **changes)


def ring_burst(
    mesh: MeridianMesh,
    settings: BurstSettings = BARE,
    *,
    casing: CasingMaterial = ELASTIC,
    explosive: Explosive = TNT,
    ignition: tuple = (),
    **options: Any,
) -> BurstSolver:
    """Solver on the meridian of one round; nodes and cells keep dolfinx's order; `options` go to `BurstSolver`."""
    distributed = on_dolfinx(MPI.COMM_SELF, mesh)
    item = Round(name="ring", explosive=explosive, casing=casing, ignition=ignition)
    leakage = no_leakage(settings)
    inputs = plain_inputs(distributed, mesh, leakage)
    fields = make_fields(distributed, [item], settings, element=RING, **inputs)
    charge = distributed.part == Part.CHARGE
    chemical = float(fields.cell_mass[charge].sum()) / explosive.density * fields.products[0].energy
    ledger = Ledger(settings.energy_tolerance, 1.0, np.array([chemical]), MPI.COMM_SELF)
    contact, on_axis = meridian_contact(mesh, fields, settings), axis_constraint(mesh, fields)
    return BurstSolver(fields, settings, leakage, ledger, contact=contact, constraints=on_axis, **options)


def hold(solver: BurstSolver, held: np.ndarray) -> None:
    """Let nodes not move along r or z from now on, (nodes, 2) bool, and find the forces again."""
    across, along = (NodalConstraint(np.flatnonzero(held[:, k]), np.eye(3)[2 * k]) for k in range(2))
    solver.constraints = (*solver.constraints, across, along)
    solver.add_forces(0.0)


def contacts_of(solver: BurstSolver) -> SimpleNamespace:
    """The charge's contacts: arrays of pairs and bonds, the local nodes `slave`, and those of the line's `edges`."""
    interface, rows = solver.contact.interface, solver.contact.nodes.rows
    return SimpleNamespace(
        **interface.pairs._asdict(),
        **interface.bonds._asdict(),
        slave=rows.local[interface.pairs.node],
        edges=rows.local[interface.surface.facets],
        hollow=interface.surface.hollow,
        spread=interface.spread,
    )


def line_forces(solver: BurstSolver, law: Law, velocity: np.ndarray | None = None) -> np.ndarray:
    """Forces of contact (nodes, 3) in N at the places that the nodes now have, as a step of the kernels finds them."""
    fields, rows = solver.fields, solver.contact.nodes.rows
    velocity = fields.nodes.velocity if velocity is None else velocity
    rows.position[:], rows.velocity[:] = fields.nodes.position[rows.local], velocity[rows.local]
    rows.load[:], rows.sums[:] = rows.sums[:, 3], 0.0
    add_line_forces(
        solver.contact.interface.in_substeps(law, 0, 0.0), fields.charge, fields.solid.eroded, fields.grid.rounding
    )
    force = np.zeros_like(fields.nodes.force)
    force[rows.local] = rows.sums[:, :3]
    return force
