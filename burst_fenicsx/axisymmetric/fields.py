"""The state of the axisymmetric burst: the fields of the burst on quadrilaterals, and what rings have besides."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx import compat
from burst_fenicsx.axisymmetric.rings import areas, folded, longest_edges, nodal_volumes, ring_volumes
from burst_fenicsx.kernels.axisymmetric.quadrilateral import AxisymmetricState
from burst_fenicsx.kernels.lanes import LANES
from burst_fenicsx.kernels.step.levels import move_lanes
from burst_fenicsx.mechanics.fields import BurstFields, Element, make_fields
from burst_fenicsx.meshing.distributed import DistributedMesh
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.axisymmetric.mesh import MeridianMesh
    from burst_fenicsx.problem import BurstSettings, Round

__all__ = ["RingFields", "make_ring_fields", "on_dolfinx"]

_TO_TENSOR = [0, 1, 3, 2]  # counter-clockwise to tensor-product order; its own inverse


@dataclass
class RingFields(BurstFields):
    """State of the axisymmetric burst; `mesh.dofmap` (cells, 4) is counter-clockwise in (r, z).

    Attributes
    ----------
    rings : what the kernels need besides.
    """

    rings: AxisymmetricState

    @property
    def momentum_is_conserved(self) -> tuple[bool, bool, bool]:
        """Of rings along the axis: radial momentum is no vector of the whole ring."""
        return (False, False, True)

    def volumes(self) -> np.ndarray:
        """Volumes of the cells now (cells,) in m3; of eroded ones as they were then."""
        found = ring_volumes(self.nodes.position, self.mesh.dofmap)
        return np.where(self.eroded, self.blocks.by_cell(self.grid.volume), found)

    def cell_velocities(self) -> np.ndarray:
        """Mean of each cell's nodal velocities (cells, 3) in m/s."""
        found: np.ndarray = self.nodes.velocity[self.mesh.dofmap].mean(axis=1)
        return found

    def folded(self, cells: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Whether a corner of each quadrilateral is turned inside out (cells,); eroded ones are no cells any more."""
        return folded(self.nodes.position, self.mesh.dofmap[cells]) & ~self.eroded[cells]

    def solid_sums(self) -> np.ndarray:
        """Elastic energy (J); mass (kg), size of momentum (kg m/s) and kinetic energy (J) of the casing, (4,)."""
        solid, modulus, poisson = self._elastic
        stress = self.solid.stress[solid, 0]
        square = (stress[:, :3] ** 2).sum(axis=1) + 2.0 * (stress[:, 3:] ** 2).sum(axis=1)
        twice = (1.0 + poisson) * square - poisson * stress[:, :3].sum(axis=1) ** 2
        volume = self.blocks.by_cell(self.grid.volume)[solid]
        strain = 0.5 * (volume * twice / modulus).sum()
        casing = self._casing
        mass = self.cell_mass[casing]
        speed = np.linalg.norm(self.nodes.velocity[self.mesh.dofmap[casing]].mean(axis=1), axis=1)
        return np.array([strain, mass.sum(), (mass * speed).sum(), 0.5 * (mass * speed**2).sum()])

    @cached_property
    def _elastic(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Cells of casing and fuze, their elastic modulus (Pa) and Poisson ratio."""
        parameters = self.solid.parameters[len(Part) * self.mesh.round + self.mesh.part]
        solid = np.flatnonzero(parameters[:, 0] > 0.0)
        return solid, parameters[solid, 0], parameters[solid, 1]

    @cached_property
    def _casing(self) -> np.ndarray:
        return np.flatnonzero(self.mesh.part == Part.CASING)

    def regroup(self, level: np.ndarray, highest: int) -> None:
        """As `BurstFields.regroup`, with the rings' own arrays."""
        source = self.blocks.slot_of_cell
        super().regroup(level, highest)
        inverse_share = np.empty((len(self.blocks.cells), 4 * LANES))
        blocks = np.arange(len(inverse_share))
        move_lanes(source[self.blocks.cells.ravel()], blocks, self.rings.inverse_share, inverse_share)
        self.rings = self.rings._replace(inverse_share=inverse_share, slot=self.blocks.slot_of_cell)


def on_dolfinx(mesh: MeridianMesh) -> DistributedMesh:
    """Hand a meridian to dolfinx: quadrilaterals in space, all on the calling rank."""
    domain = compat.create_quadrilateral_mesh(MPI.COMM_SELF, mesh.cells[:, _TO_TENSOR], mesh.nodes)
    cell = np.asarray(domain.topology.original_cell_index, dtype=np.int64)
    dofmap = np.ascontiguousarray(compat.geometry_dofmap(domain)[:, _TO_TENSOR])
    node = np.asarray(domain.geometry.input_global_indices, dtype=np.int64)
    part, of_round, segment = mesh.part[cell], mesh.round[cell], mesh.segment[cell]
    return DistributedMesh(
        domain=domain,
        dofmap=dofmap,
        cell=cell,
        node=node,
        row=np.arange(len(cell), dtype=np.int32),
        owned_nodes=int(domain.geometry.index_map().size_local),
        part=part,
        round=of_round,
        segment=segment,
        station=mesh.station[cell],
        all_dofmap=dofmap,
        all_cell=cell,
        all_part=part,
        all_round=of_round,
    )


def make_ring_fields(
    mesh: DistributedMesh,
    rounds: Sequence[Round],
    settings: BurstSettings,
    **inputs: Any,
) -> RingFields:
    """Allocate the fields of one round on the origin with its axis along z; `inputs` as for `make_fields`."""
    plain = make_fields(mesh, rounds, settings, element=_RING, chunk_size=max(mesh.cells, 1), **inputs)
    plain.grid = plain.grid._replace(rounding=0.0)  # one rank sums in one order: nothing is rounded
    position = plain.nodes.position
    share = _RING.shares(position, mesh.dofmap) * plain.cell_mass[:, None]
    of_slots = plain.blocks.by_slot(1.0 / share).reshape(-1, LANES, 4)
    rings = AxisymmetricState(
        inverse_share=np.ascontiguousarray(of_slots.transpose(0, 2, 1)).reshape(-1, 4 * LANES),
        slot=plain.blocks.slot_of_cell,
        mass=plain.mass,
        axis=np.flatnonzero(position[:, 0] == 0.0).astype(np.int32),
    )
    return RingFields(**{item.name: getattr(plain, item.name) for item in fields(plain)}, rings=rings)


def _shares(position: np.ndarray, dofmap: np.ndarray) -> np.ndarray:
    found = nodal_volumes(position, dofmap)
    shares: np.ndarray = found / found.sum(axis=1)[:, None]
    return shares


def _corner_cells(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners (cells, 4, 3) as nodes of their own and cells."""
    return corners.reshape(-1, 3), np.arange(4 * len(corners)).reshape(-1, 4)


def _burn_rates(corners: np.ndarray, volumes: np.ndarray, velocity: float) -> np.ndarray:  # noqa: ARG001
    """Rate of the burn fraction (1/s), Eq. 5 in the plane: the longest edge over the area for face over volume."""
    nodes, cells = _corner_cells(corners)
    return 2.0 * velocity * longest_edges(nodes, cells) / (3.0 * areas(nodes, cells))


def _largest_faces(corners: np.ndarray) -> np.ndarray:
    """Largest face of each ring (cells,) in m2."""
    nodes, cells = _corner_cells(corners)
    return 2.0 * np.pi * corners[..., 0].max(axis=1) * longest_edges(nodes, cells)


_RING = Element(
    volumes=ring_volumes,
    shares=_shares,
    burn_rates=_burn_rates,
    lengths=lambda position, dofmap, volume: np.sqrt(areas(position, dofmap)),  # noqa: ARG005 - as every element
    largest_faces=_largest_faces,
)
