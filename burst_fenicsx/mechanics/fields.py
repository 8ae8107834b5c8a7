"""The state of the burst: dolfinx functions in the order of the mesh, and the kernels' views of their arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numba
import numpy as np
from dolfinx import fem
from mpi4py import MPI

from burst_fenicsx import compat
from burst_fenicsx.kernels.axisymmetric import quadrilateral
from burst_fenicsx.kernels.cells import one_point
from burst_fenicsx.kernels.cells.erosion import WHOLE
from burst_fenicsx.kernels.cells.hexahedron import hexahedron_volumes
from burst_fenicsx.kernels.cells.layout import SOLID_PARAMETERS
from burst_fenicsx.kernels.constants import AHEAD, LARGEST_WORK
from burst_fenicsx.kernels.lanes import LANES
from burst_fenicsx.kernels.state import Cells, ChargeState, Grid, Nodes, SolidState, Totals
from burst_fenicsx.kernels.step.assembly import (
    FULL_QUADRATURE,
    ONE_POINT,
    RINGS,
    CellKernels,
    cell_kernels,
    make_scratch,
)
from burst_fenicsx.kernels.vectors.exact import quantise, rounding_constant
from burst_fenicsx.materials import laws
from burst_fenicsx.materials.products import make_products
from burst_fenicsx.mechanics.detonation import burn_rates, cell_ignition, earliest_motion, largest_faces
from burst_fenicsx.mechanics.material_tables import fastest_signal, largest_pressure, material_tables
from burst_fenicsx.mechanics.schedule import Blocks, Chunks
from burst_fenicsx.meshing.quality import folded_cells
from burst_fenicsx.problem import Part
from fragfield_base.elementary import cbrt

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from burst_fenicsx.materials.products import Products
    from burst_fenicsx.meshing.distributed import DistributedMesh
    from burst_fenicsx.problem import BurstSettings, Round


@dataclass(frozen=True)
class Element:
    """What a kind of cell gives to the fields; positions (nodes, 3) in m, `dofmap` (cells, corners).

    Attributes
    ----------
    kind : its kernels, see `kernels.step.assembly`.
    momentum_is_conserved : along which coordinates that of all nodes is.
    volumes : of the cells (cells,) in m3, from positions and dofmap.
    folded : whether a corner of each cell is turned inside out (cells,), from positions and dofmap.
    mass_fractions : of each cell's mass that its nodes carry (cells, corners), from positions and dofmap.
    burn_rates : of the cells (1/s), from corners (cells, corners, 3), volumes and detonation velocity (m/s), Eq. 5.
    lengths : of the cells (m), which softening is scaled by, from positions, dofmap and volumes.
    largest_faces : (cells,) m2, from corners.
    """

    kind: tuple[int, ...]
    momentum_is_conserved: tuple[bool, bool, bool]
    volumes: Callable[[np.ndarray, np.ndarray], np.ndarray]
    folded: Callable[[np.ndarray, np.ndarray], np.ndarray]
    mass_fractions: Callable[[np.ndarray, np.ndarray], np.ndarray]
    burn_rates: Callable[[np.ndarray, np.ndarray, float], np.ndarray]
    lengths: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
    largest_faces: Callable[[np.ndarray], np.ndarray]


HEXAHEDRON = Element(
    kind=ONE_POINT,
    momentum_is_conserved=(True, True, True),
    volumes=hexahedron_volumes,
    folded=folded_cells,
    mass_fractions=lambda position, dofmap: np.broadcast_to(0.125, dofmap.shape),  # noqa: ARG005 - as every element
    burn_rates=burn_rates,
    lengths=lambda position, dofmap, volume: cbrt(volume),  # noqa: ARG005
    largest_faces=largest_faces,
)


@dataclass
class BurstFields:
    """State of the burst on one rank.

    Attributes
    ----------
    mesh : the distributed mesh; its geometry lies where the nodes are now.
    functions : the state as dolfinx functions by name: velocity (m/s) and force (N), linear in the cells; stress (Pa),
        plastic_shear_strain, plastic_volumetric_strain, pressure (Pa), burn_fraction and products_energy (J/m3),
        constant in cells or, of solids with full quadrature, known at points. Ghost cells lag behind until they are
        sent (`x.scatter_forward`).
    start : (local nodes, 3) initial positions (m).
    mass, inverse_mass : (local nodes,) lumped mass (kg) and its inverse, complete on every rank.
    cell_mass : (owned cells,) kg.
    at_rest_until : (owned cells,) s, until when each cell stays as it is.
    element, kind : of the cells, and which kernels step it.
    products : products of each round's charge.
    nodes, grid, solid, charge : the kernels' views of the functions' arrays, and what they need besides; velocities are
        half a step behind the positions. inverse_share : as in `Cells`.
    totals, scratch : what the kernels add up, and their scratch.
    blocks : cells in blocks, chunks and colours. chunks : what arranges them.
    """

    mesh: DistributedMesh
    functions: dict[str, Any]
    start: np.ndarray
    mass: np.ndarray
    inverse_mass: np.ndarray
    cell_mass: np.ndarray
    at_rest_until: np.ndarray
    element: Element
    kind: tuple[int, ...]
    products: list[Products]
    nodes: Nodes
    grid: Grid
    solid: SolidState
    charge: ChargeState
    inverse_share: np.ndarray
    totals: Totals
    scratch: np.ndarray
    blocks: Blocks
    chunks: Chunks

    @property
    def cells(self) -> Cells:
        """What the kernels step the cells with."""
        return Cells(
            self.nodes, self.grid, self.blocks.schedule, self.solid, self.charge,
            self.inverse_share, self.totals, self.scratch,
        )  # fmt: skip

    @cached_property
    def kernels(self) -> CellKernels:
        """Machine code that steps the cells; it does not depend on how they are arranged."""
        return cell_kernels(self.kind, self.cells)

    def volumes(self) -> np.ndarray:
        """Volumes of this rank's cells now (cells,) in m3; of eroded ones as they were then."""
        now = self.element.volumes(self.nodes.position, self.mesh.dofmap)
        return np.where(self.eroded, self.blocks.by_cell(self.grid.volume), now)

    def casing_speeds(self, half_step: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Own cells of casings (k,), and the size of the mean of each one's nodal velocities (k,) in m/s.

        The velocities are brought on by `half_step` (s).
        """
        velocity, corners = self.nodes.velocity, self.mesh.dofmap[self._casing].T
        if half_step > 0.0:
            velocity = velocity + (half_step * self.inverse_mass)[:, None] * self.nodes.force
        x, y, z = (sum(velocity[nodes] for nodes in corners) / len(corners)).T  # corner by corner: the same anywhere
        return self._casing, np.sqrt(x**2 + y**2 + z**2)

    @cached_property
    def _casing(self) -> np.ndarray:
        return np.flatnonzero(self.mesh.part == Part.CASING)

    def folded(self, cells: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Whether a corner of each of the cells (cells,) is turned inside out; eroded ones are no cells any more."""
        return self.element.folded(self.nodes.position, self.mesh.dofmap[cells]) & ~self.eroded[cells]

    def without_strength(self) -> np.ndarray:
        """Whether the metal of each of this rank's cells has lost its strength (cells,); false for a charge."""
        mesh, solid = self.mesh, self.solid
        parameters = solid.parameters[len(Part) * mesh.round + mesh.part]
        scale = self.blocks.by_cell(solid.softening_scale)
        of_law = parameters[:, SOLID_PARAMETERS.index("law")]
        weak = np.zeros(mesh.cells, dtype=bool)
        for number, law in enumerate(laws("solids")):
            strains = solid.shear_strain[: mesh.cells], solid.volume_strain[: mesh.cells]
            weak |= (of_law == number) & law.without_strength(parameters, *strains, scale)
        return weak & (mesh.part != Part.CHARGE)

    @cached_property
    def _elastic(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Cells of metal, their modulus (Pa) and ratio of Poisson, (k,)."""
        mesh = self.mesh
        cells = np.flatnonzero(mesh.part != Part.CHARGE)
        modulus, poisson = self.solid.parameters[len(Part) * mesh.round[cells] + mesh.part[cells], :2].T
        return cells, modulus, poisson

    def node_sums(self, half_step: float) -> np.ndarray:
        """Kinetic energy (J), momentum and the sum of its sizes (kg m/s) of all nodes (5,); collective.

        The velocities are brought on by `half_step` (s).
        """
        momentum = self.mass[:, None] * self.nodes.velocity + half_step * self.nodes.force
        x, y, z = momentum.T
        square = x**2 + y**2 + z**2
        return self.mesh.node_sums(np.column_stack([0.5 * square * self.inverse_mass, momentum, np.sqrt(square)]))

    def solid_sums(self, half_step: float = 0.0) -> np.ndarray:
        """Elastic energy (J), casings' mass (kg), size of momentum (kg m/s), kinetic energy of each (J); collective.

        (3 + rounds,). A casing's cell moves with the mean velocity of its nodes, brought on by `half_step` (s).
        """
        terms = np.zeros((self.mesh.cells, 3 + len(self.products)))
        slot = self.blocks.slot_of_cell
        cells, modulus, poisson = self._elastic
        xx, yy, zz, xy, yz, zx = np.moveaxis(self.solid.stress[cells], 2, 0)  # each (cells, points)
        square = xx**2 + yy**2 + zz**2 + 2.0 * (xy**2 + yz**2 + zx**2)
        twice = sum(((1.0 + poisson[:, None]) * square - poisson[:, None] * (xx + yy + zz) ** 2).T)
        terms[cells, 0] = 0.5 * self.grid.volume[slot[cells]] * twice / (modulus * xx.shape[1])
        casing, speed = self.casing_speeds(half_step)
        mass = self.cell_mass[casing]
        terms[casing, 1], terms[casing, 2] = mass, mass * speed
        terms[casing, 3 + self.mesh.round[casing]] = 0.5 * mass * speed**2
        return self.mesh.cell_sums(terms)

    @cached_property
    def charge_cells(self) -> list[np.ndarray]:
        """Own cells of each round's charge."""
        charge = self.mesh.part == Part.CHARGE
        return [np.flatnonzero(charge & (self.mesh.round == index)) for index in range(len(self.products))]

    def sums_by_charge(self, values: Sequence[np.ndarray]) -> np.ndarray:
        """Sums (rounds,) over the cells of each round's charge of their values; collective."""
        terms = np.zeros((self.mesh.cells, len(self.products)))
        for index, (cells, own) in enumerate(zip(self.charge_cells, values, strict=True)):
            terms[cells, index] = own
        return self.mesh.cell_sums(terms)

    @property
    def eroded(self) -> np.ndarray:
        """Whether each of this rank's cells has been eroded, metal or crushed products (cells,)."""
        found: np.ndarray = self.blocks.by_cell(self.solid.eroded) != WHOLE
        return found

    @property
    def eroded_metal(self) -> np.ndarray:
        """Whether it is metal (cells,): through its place, other rounds' metal may come."""
        return self.eroded & (self.mesh.part != Part.CHARGE)

    def regroup(self, level: np.ndarray, highest: int) -> None:
        """Arrange the blocks again by the levels of the cells' steps, (owned cells,), and the highest of all ranks.

        Those of the nodes, `Nodes.finest`, are known by then.
        """
        old, new = self.blocks, self.chunks.blocks(level, highest)
        source = old.slot_of_cell[new.cells.ravel()]
        hourglass = np.zeros((len(new.cells), self.solid.hourglass.shape[1]))
        of_solids = np.flatnonzero(new.material % len(Part) != Part.CHARGE)  # a charge's cells store none
        hourglass[of_solids] = _moved(self.solid.hourglass, source.reshape(-1, LANES)[of_solids])
        grid, solid, nodes = self.grid, self.solid, new.nodes(self.mesh.dofmap)
        self.blocks = new
        self.grid = grid._replace(
            nodes=nodes,
            cells=new.cells,
            filled=new.count,
            material=new.material,
            level=new.level,
            mixed=(self.nodes.finest[nodes] > new.level[:, None, None]).any(axis=(1, 2)),
            mass=grid.mass[source],
            volume=grid.volume[source],
            viscous=grid.viscous[source],
            stable=grid.stable[source],
        )
        self.solid = solid._replace(
            hourglass=hourglass,
            softening_scale=solid.softening_scale[source],
            eroded=solid.eroded[source],
        )
        if self.inverse_share.size:
            self.inverse_share = _moved(self.inverse_share, source.reshape(-1, LANES))


def _moved(rows: np.ndarray, source: np.ndarray) -> np.ndarray:
    """Rows of lanes (blocks, rows LANES) in a new order of the slots; `source` (blocks, LANES) are the old ones."""
    by_slot = rows.reshape(len(rows), -1, LANES).transpose(0, 2, 1).reshape(-1, rows.shape[1] // LANES)
    return _by_lanes(by_slot[source.ravel()])


def make_fields(
    mesh: DistributedMesh,
    rounds: Sequence[Round],
    settings: BurstSettings,
    *,
    fuze_density: Sequence[float],
    axial_slice: np.ndarray,
    leakage: np.ndarray,
    lengths: Sequence[float],
    element: Element = HEXAHEDRON,
) -> BurstFields:
    """Allocate the functions on a mesh at rest and unreacted.

    Parameters
    ----------
    mesh, rounds, settings : the problem.
    fuze_density : of each round's fuze (kg/m3).
    axial_slice : (owned cells,) int32, row of `leakage`.
    leakage : (slices + 1,) factors on the products' pressure, those of `AxialSlices`.
    lengths : of each round (m).
    element : the kind of the cells.
    """
    points = 8 if settings.quadrature == "full" else 1
    functions = _functions(mesh, points)
    of_nodes = {name: functions[name].x.array.reshape(-1, 3) for name in ("velocity", "force")}
    of_cells = {name: _owned(mesh, functions[name], points) for name in functions if name not in of_nodes}
    material = (len(Part) * mesh.round + mesh.part).astype(np.int32)
    is_charge = np.tile([part == Part.CHARGE for part in Part], len(rounds))
    # Forces of rings are not rounded: one thread sums them in one order.
    chunks = Chunks(mesh.dofmap, material, is_charge, max(mesh.cells, 1) if element.kind == RINGS else None)
    blocks = chunks.blocks(np.zeros(mesh.cells, dtype=np.int8))
    position = mesh.domain.geometry.x
    volume = element.volumes(position, mesh.dofmap)
    products = [make_products(item.explosive, settings.products) for item in rounds]
    solid_table, charge_table, density = material_tables(rounds, settings, products, fuze_density)
    cell_mass = density[material] * volume
    corner_mass = cell_mass[:, None] * element.mass_fractions(position, mesh.dofmap)
    nodal_mass = _nodal_masses(mesh, functions["force"], cell_mass, corner_mass)
    pressure = max(largest_pressure(item) for item in rounds)
    largest_force = 0.5 * pressure * _largest(mesh, element.largest_faces(position[mesh.dofmap]))

    slot_volume = blocks.by_slot(volume)
    stored_rows = quadrilateral.STORED_ROWS if element.kind == RINGS else one_point.STORED_ROWS
    reference = np.array([item.casing.softening_length or 0.0 for item in rounds])[mesh.round]
    own_length = element.lengths(position, mesh.dofmap, volume)
    inverse_scale = np.where(reference > 0.0, own_length / np.where(reference > 0.0, reference, 1.0), 1.0)

    ignition, burn, compression = cell_ignition(mesh, rounds, products, lengths, position, volume, element.burn_rates)
    fastest = fastest_signal(solid_table, products, rounds)
    reached = earliest_motion(position[mesh.dofmap].mean(axis=1), rounds, lengths, fastest)
    energy = of_cells["products_energy"]
    for index, model in enumerate(products):
        energy[(mesh.round == index) & (mesh.part == Part.CHARGE)] = model.start_energy
    nodes = Nodes(
        position, of_nodes["velocity"], of_nodes["force"], rounding_constant(largest_force),
        np.zeros(len(position), dtype=np.int8), np.zeros_like(position),
    )  # fmt: skip
    grid = Grid(
        blocks.nodes(mesh.dofmap), blocks.cells, blocks.count, blocks.material, blocks.level,
        np.zeros(len(blocks.cells), dtype=bool),
        blocks.by_slot(cell_mass), slot_volume,
        np.zeros_like(slot_volume), np.full_like(slot_volume, np.inf), 0.0,
        rounding_constant(LARGEST_WORK * pressure * float(mesh.cell_sums(volume))),
    )  # fmt: skip
    return BurstFields(
        mesh=mesh,
        functions=functions,
        start=position.copy(),
        mass=nodal_mass,
        inverse_mass=1.0 / np.where(nodal_mass > 0.0, nodal_mass, np.inf),
        cell_mass=cell_mass,
        at_rest_until=reached - AHEAD * settings.cell_size / fastest,
        element=element,
        kind=FULL_QUADRATURE if points > 1 else element.kind,
        products=products,
        nodes=nodes,
        grid=grid,
        solid=SolidState(
            parameters=solid_table,
            stress=of_cells["stress"],
            shear_strain=of_cells["plastic_shear_strain"],
            volume_strain=of_cells["plastic_volumetric_strain"],
            hourglass=np.zeros((len(blocks.cells), stored_rows * LANES)),
            softening_scale=blocks.by_slot(inverse_scale),
            eroded=np.zeros(len(slot_volume), dtype=np.int8),
        ),
        charge=ChargeState(
            parameters=charge_table,
            stress=of_cells["stress"],
            pressure=of_cells["pressure"],
            burn_fraction=of_cells["burn_fraction"],
            energy=energy,
            ignition_time=ignition,
            burn_rate=burn,
            compression_from=compression,
            axial_slice=axial_slice.astype(np.int32),
            leakage=leakage,
        ),
        inverse_share=_by_lanes(blocks.by_slot(1.0 / corner_mass)) if element.kind == RINGS else np.zeros((0, 0)),
        totals=Totals.of_chunks(blocks.schedule.chunk.size, len(rounds)),
        # For every thread that there may be: how many step is settled again at every call.
        scratch=make_scratch(numba.config.NUMBA_NUM_THREADS),
        blocks=blocks,
        chunks=chunks,
    )


def _by_lanes(values: np.ndarray) -> np.ndarray:
    """Rows of slots (slots, k) as blocks of k rows of lanes, (blocks, k LANES)."""
    rows = values.shape[1]
    return np.ascontiguousarray(values.reshape(-1, LANES, rows).transpose(0, 2, 1)).reshape(-1, rows * LANES)


def _functions(mesh: DistributedMesh, points: int) -> dict[str, Any]:
    of_cells, at_points = mesh.cell_space(), mesh.cell_space(points=points) if points > 1 else None
    spaces = {
        "velocity": mesh.vector_space,
        "force": mesh.vector_space,
        "stress": mesh.cell_space(6, points),
        "plastic_shear_strain": at_points or of_cells,
        "plastic_volumetric_strain": at_points or of_cells,
        "pressure": of_cells,
        "burn_fraction": of_cells,
        "products_energy": of_cells,
    }
    return {name: fem.Function(space, name=name) for name, space in spaces.items()}


def _owned(mesh: DistributedMesh, function: Any, points: int) -> np.ndarray:  # noqa: ANN401 - dolfinx's class
    """View of a function's values in this rank's own cells: (cells,), (cells, points) or (cells, points, 6)."""
    shape = {"stress": (points, 6), "plastic_shear_strain": (points,), "plastic_volumetric_strain": (points,)}
    own = (mesh.cells, *shape.get(function.name, ()))
    view: np.ndarray = function.x.array[: int(np.prod(own))].reshape(own)
    return view


def _nodal_masses(mesh: DistributedMesh, scratch: Any, cell_mass: np.ndarray, corner_mass: np.ndarray) -> np.ndarray:  # noqa: ANN401
    """Lumped mass (local nodes,) in kg by those of the cells' corners (cells, corners), summed exactly; collective.

    `scratch` is a function of nodal vectors, zero before and after.
    """
    rounding = rounding_constant(_largest(mesh, cell_mass))
    values = scratch.x.array.reshape(-1, 3)
    for corner in range(corner_mass.shape[1]):
        masses = quantise(corner_mass[:, corner], rounding)
        values[:, 0] += np.bincount(mesh.dofmap[:, corner], weights=masses, minlength=len(values))
    compat.add_ghosts(scratch.x)
    scratch.x.scatter_forward()
    mass = values[:, 0].copy()
    values[:] = 0.0
    return mass


def _largest(mesh: DistributedMesh, values: np.ndarray) -> float:
    return float(mesh.comm.allreduce(float(values.max(initial=0.0)), op=MPI.MAX))
