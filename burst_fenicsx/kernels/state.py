"""The arrays that the kernels read and write, grouped by what they describe.

Arrays over cells or nodes lie in the order of `DistributedMesh`, most of them in dolfinx functions
(`BurstFields.functions`). Arrays "over slots" lie in the order of the blocks: slot = block * LANES + lane.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Nodes(NamedTuple):
    """Nodal fields, each (nodes, 3), and how the terms of the forces are rounded."""

    position: np.ndarray  # m
    velocity: np.ndarray  # m/s
    force: np.ndarray  # N, set to the element forces by the kernels, then the resultant
    rounding: float  # N, constant of `exact.quantise` for every term that is added to `force`
    finest: np.ndarray  # (nodes,) int8, level of the node, the highest of what acts on it: it takes 2^level steps
    mean: np.ndarray  # (nodes, 3) m/s over its last two steps, where a node belongs to cells of twice its step


class Grid(NamedTuple):
    """Blocks of cells of one material.

    Padded lanes repeat their block's last cell and are stepped and stored like it. So whatever stands over slots must
    be the same in them as in the lane that holds the cell: as `Blocks.by_slot` and `BurstFields.regroup` put it.
    """

    nodes: np.ndarray  # (blocks, corners, LANES) int32
    cells: np.ndarray  # (blocks, LANES) int32, padded with the block's last cell
    filled: np.ndarray  # (blocks,) int32, lanes that hold a cell
    material: np.ndarray  # (blocks,) int32, row of the material's parameters
    level: np.ndarray  # (blocks,) int32, of the cells' step: the longest one over 2^level
    mixed: np.ndarray  # (blocks,) bool, whether some of the nodes take shorter steps than the cells
    mass: np.ndarray  # (slots,) kg
    volume: np.ndarray  # (slots,) m3, current
    viscous: np.ndarray  # (slots,) Pa, artificial viscous pressure of the last step
    stable: np.ndarray  # (slots,) s, stable step of each cell
    longest: float  # s, the next macro step, where the state is computed again without a step
    rounding: float  # J, constant of `exact.quantise` for the work of each cell and contact in a step; 0: none


class Schedule(NamedTuple):
    """Chunks of blocks in colours: chunks of one colour share no node, so they may run side by side."""

    colour_offset: np.ndarray  # (colours + 1,) int32 into chunk
    chunk: np.ndarray  # (chunks,) int32, sorted by colour
    first_solid: np.ndarray  # (chunks,) int32, the chunk's first block of solid cells, those of short steps first
    first_charge: np.ndarray  # (chunks,) int32, likewise of charge
    active: np.ndarray  # (chunks, levels, 2) int32: from there on, how many blocks of that level or a higher one


class Motion(NamedTuple):
    """How the nodes move between the steps of their cells (see `burst_fenicsx.mechanics.subcycling`)."""

    order: np.ndarray  # (nodes,) int32, those of short steps first; in this order ...
    level: np.ndarray  # (nodes,) int8, `Nodes.finest`
    has_coarser_cell: np.ndarray  # (nodes,) int8, whether the node belongs to cells of twice its step, not longer
    inverse_mass: np.ndarray  # (nodes,) 1/kg
    moving: np.ndarray  # (levels,) how many nodes, the first in order, take steps of that level or shorter ones


class HeldNodes(NamedTuple):
    """Nodes that may not move along a direction (see `burst_fenicsx.mechanics.nodal_loads`)."""

    direction: np.ndarray  # (directions, 3) unit vectors
    first: np.ndarray  # (directions + 1,) into node
    node: np.ndarray  # int64, of each direction, each of them once


class SolidState(NamedTuple):
    """Casing and fuze."""

    parameters: np.ndarray  # (materials, columns of solid.PARAMETERS)
    stress: np.ndarray  # (cells, points, 6) Pa
    shear_strain: np.ndarray  # (cells, points), equivalent plastic shear strain
    volume_strain: np.ndarray  # (cells, points), plastic volumetric strain
    hourglass: np.ndarray  # (blocks, `STORED_ROWS` of the element LANES) N, stored elastic hourglass forces
    softening_scale: np.ndarray  # (slots,) inverse factor on the limit strains: cell's length over the reference
    eroded: np.ndarray  # (slots,) int8, of the cells of all materials, see `cells.erosion`


class ChargeState(NamedTuple):
    """The explosive and its products."""

    parameters: np.ndarray  # (materials, columns of charge_pressure.PARAMETERS)
    stress: np.ndarray  # (cells, points, 6) Pa; deviator of the unreacted charge
    pressure: np.ndarray  # (cells,) Pa
    burn_fraction: np.ndarray  # (cells,)
    energy: np.ndarray  # (cells,) J/m3 of initial volume (Jones-Wilkins-Lee)
    ignition_time: np.ndarray  # (cells,) s
    burn_rate: np.ndarray  # (cells,) 1/s, 2 D A / (3 V)
    compression_from: np.ndarray  # (cells,) s, when compression begins to burn the cell: not before a front is near
    axial_slice: np.ndarray  # (cells,) int32, row of the leakage factors
    leakage: np.ndarray  # (parts,) factor on the products' pressure


class Totals(NamedTuple):
    """What each chunk adds up, reduced afterwards in a fixed order, and its limits in the last step."""

    energy: np.ndarray  # (chunks, 5) J: plastic, viscous, hourglass, charge's work, charge's viscous
    released: np.ndarray  # (chunks, rounds, 2) J: each charge's work, its own viscous heat
    stable_step: np.ndarray  # (chunks,) s
    smallest_volume: np.ndarray  # (chunks,) m3
    smallest: np.ndarray  # (chunks,) int32, the cell of the smallest volume

    def clear(self) -> None:
        """Begin the sums again."""
        self.energy[:] = 0.0
        self.released[:] = 0.0

    @classmethod
    def of_chunks(cls, chunks: int, rounds: int) -> Totals:
        """Make room for so many chunks and the charges of so many rounds."""
        return cls(
            np.zeros((chunks, 5)),
            np.zeros((chunks, rounds, 2)),
            np.zeros(chunks),
            np.zeros(chunks),
            np.zeros(chunks, dtype=np.int32),
        )


class Cells(NamedTuple):
    """What the cells of a rank are stepped with."""

    nodes: Nodes
    grid: Grid
    schedule: Schedule
    solid: SolidState
    charge: ChargeState
    inverse_share: np.ndarray  # (blocks, 4 LANES) 1/kg, of rings each cell's share of its nodes' masses; else empty
    totals: Totals
    scratch: np.ndarray  # (threads, rows), see `cells.layout`
