"""Small plane sections and a one-call burst on them, for tests."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from burst_fenicsx.axisymmetric.fields import make_ring_fields, on_dolfinx
from burst_fenicsx.mechanics.ledger import Ledger
from burst_fenicsx.meshing.mesh import merge
from burst_fenicsx.plane_section.contact import SectionContact
from burst_fenicsx.plane_section.mesh import SectionMesh
from burst_fenicsx.plane_section.solver import SectionSolver
from burst_fenicsx.problem import BurstSettings, CasingMaterial, Explosive, Part, RigidPlane, Round
from tests.burst_fenicsx.axisymmetric.meridians import rectangle
from tests.burst_fenicsx.boxes import BARE, ELASTIC, TNT, no_leakage, plain_inputs

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.axisymmetric.mesh import MeridianMesh

__all__ = ["blocks", "section_burst", "section_of"]


def section_of(mesh: MeridianMesh, shift: tuple[float, float] = (0.0, 0.0), index: int = 0) -> SectionMesh:
    """The quadrilaterals of a meridian as a plane section, moved by `shift` (m), of the round `index`."""
    values = {item.name: getattr(mesh, item.name) for item in fields(mesh)}
    nodes = mesh.nodes + np.array([shift[0], 0.0, shift[1]])
    return SectionMesh(**{**values, "nodes": nodes, "round": np.full(len(mesh.cells), index, dtype=np.int32)})


def blocks(counts: Sequence[int], size: float, places: Sequence[tuple[float, float]]) -> SectionMesh:
    """Blocks of casing, counts[0] x counts[1] cells of edge `size` (m), with their lower left corners at `places`."""
    block = rectangle(counts, (0.0, counts[0] * size), counts[1] * size)
    return merge([section_of(block, place, index) for index, place in enumerate(places)])


def section_burst(
    mesh: SectionMesh,
    settings: BurstSettings = BARE,
    *,
    casing: CasingMaterial = ELASTIC,
    explosive: Explosive = TNT,
    planes: Sequence[RigidPlane] = (),
    cell_size: float | None = None,
) -> SectionSolver:
    """Solver on a section of as many rounds as the mesh has; nodes and cells keep dolfinx's order."""
    settings = settings if cell_size is None else replace(settings, cell_size=cell_size)
    distributed = on_dolfinx(mesh)
    rounds = [Round(name=f"round {index}", explosive=explosive, casing=casing) for index in range(len(mesh.lengths))]
    leakage = no_leakage(settings)
    state = make_ring_fields(distributed, rounds, settings, **plain_inputs(distributed, mesh, leakage), plane=True)
    charge = distributed.part == Part.CHARGE
    chemical = np.array(
        [
            state.cell_mass[charge & (distributed.round == index)].sum() / explosive.density * products.energy
            for index, products in enumerate(state.products)
        ]
    )
    ledger = Ledger(settings.energy_tolerance, 1.0, chemical, MPI.COMM_SELF)
    return SectionSolver(state, settings, leakage, ledger, SectionContact(mesh, state, settings, planes))
