"""The step of a block of one-point cells of casing and fuze."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.cells.common import FORCE, POSITION, VELOCITY, bound_hourglass, gather_velocities, move_cells
from burst_fenicsx.kernels.cells.solid import (
    add_work,
    fetch_next,
    load_state,
    resist,
    return_plastic,
    stiffen,
    store_state,
    try_elastic,
)
from burst_fenicsx.kernels.cells.torn_metal import drop_forces, hold_released, release_metal
from burst_fenicsx.kernels.lanes import LANES, inlined_kernel
from burst_fenicsx.kernels.state import Grid, Nodes, SolidState
from burst_fenicsx.kernels.vectors.nodal_values import add_nodal_forces, gather

__all__ = ["solid_block"]


@inlined_kernel
def solid_block(
    block: int,
    step: float,
    share: float,
    nodes: Nodes,
    grid: Grid,
    state: SolidState,
    scratch: np.ndarray,
    energy: np.ndarray,
    limits: np.ndarray,
) -> None:
    """Advance one block of solid cells by `step` (s) and add its nodal forces times `share`.

    Parameters
    ----------
    share : `step` over the longest that any cell takes.
    energy : (5,) J, added to: plastic, viscous, hourglass work of this step (entries 3 and 4 belong to the charge).
    limits : (3,): smallest stable step over `share` (s), smallest volume (m3) and its cell; updated.
    """
    cells = grid.cells[block]
    count = grid.filled[block]
    material = state.parameters[grid.material[block]]
    gather(cells, grid.dofmap, nodes.position, scratch[POSITION * LANES :])
    gather_velocities(block, nodes, grid, scratch[VELOCITY * LANES :])
    move_cells(step, scratch)
    load_state(block, grid, state, scratch)
    fetch_next(block, grid, state)
    torn = hold_released(block, grid, state, material, scratch) > 0
    if try_elastic(step, material, scratch) > 0:
        return_plastic(material, scratch)
    next_dt = max(step, share * grid.longest)
    bound_hourglass(next_dt, stiffen(step, next_dt, material, scratch) > 0, scratch)
    if torn:
        release_metal(block, state, material, scratch)
    resist(share, nodes.rounding, scratch)
    if torn:
        drop_forces(block, state.released, scratch)
    add_nodal_forces(count, cells, grid.dofmap, scratch[FORCE * LANES :], nodes.force)
    store_state(block, grid, state, scratch)
    add_work(block, step, share, grid, scratch, energy, limits)
