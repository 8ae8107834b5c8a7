"""The substeps of a macro step: the loops over all nodes, and over all cells by coloured chunks.

Chunks of one colour share no node, so their forces may be added side by side; each chunk adds in its own fixed
order. The sums are therefore bitwise the same for any number of threads.
"""

from __future__ import annotations

import numba
import numpy as np

from burst_fenicsx.kernels.axisymmetric import quadrilateral
from burst_fenicsx.kernels.axisymmetric.quadrilateral import AxisymmetricState
from burst_fenicsx.kernels.axisymmetric.slide_line import LineContact, act_on_line
from burst_fenicsx.kernels.cells import charge as charge_cells
from burst_fenicsx.kernels.cells import eight_points, one_point
from burst_fenicsx.kernels.cells.block import make_block, make_solid_block
from burst_fenicsx.kernels.cells.layout import SCRATCH_ROWS
from burst_fenicsx.kernels.lanes import LANES, kernel, widest_vectors
from burst_fenicsx.kernels.state import ChargeState, Grid, HeldNodes, Motion, Nodes, Schedule, SolidState, Totals
from burst_fenicsx.kernels.threads import on_threads
from burst_fenicsx.kernels.vectors.rows import hold_rows
from burst_fenicsx.problem import Part

__all__ = [
    "FULL_QUADRATURE",
    "ONE_POINT",
    "RINGS",
    "advance_halves",
    "make_scratch",
]

ONE_POINT, RINGS, FULL_QUADRATURE = (1,), (1, 1), (2, 2, 2)
"""Elements, distinguished by the length of these, known while compiling: hexahedra, rings, hexahedra in full."""

_LINE = 8  # doubles of a cache line, and of the widest vectors
_PARTS = len(Part)  # rows of material parameters that each round has

_advance_solid = make_solid_block(one_point)
_advance_solid_full = make_solid_block(eight_points)
_advance_charge = make_block(one_point, charge_cells)
_advance_solid_rings = make_solid_block(quadrilateral)
_advance_charge_rings = make_block(quadrilateral, charge_cells)


def make_scratch(threads: int) -> np.ndarray:
    """Scratch of `threads` threads, (threads, rows), each thread's on cache lines of its own.

    Vectors that straddle two lines would cost a tenth of the forces.
    """
    doubles = (SCRATCH_ROWS + 4) * LANES
    room = np.zeros(threads * doubles + _LINE)
    first = -(room.ctypes.data // room.itemsize) % _LINE
    return room[first : first + threads * doubles].reshape(threads, doubles)


@kernel
def advance_halves(
    threads: int,
    first: int,
    last: int,
    begin: float,
    duration: float,
    step: float,
    velocity_step: float,
    element: tuple[int, ...],
    nodes: Nodes,
    motion: Motion,
    held: HeldNodes,
    grid: Grid,
    schedule: Schedule,
    solid: SolidState,
    charge: ChargeState,
    rings: AxisymmetricState | None,
    contact: LineContact | None,
    totals: Totals,
    scratch: np.ndarray,
) -> None:
    """Advance by the halves `first` to `last` of the substeps of a macro step `step` (s).

    In the half 2 k the nodes move from the substep k to the next one (Eq. 3), and their used forces are cleared. In
    the half 2 k + 1 the cells that end a step there follow and add forces (N) to their nodes (Eq. 1). A cell of level l
    advances by `step` / 2^l, and its forces count for that fraction of it, and so do those of a meridian's `contact`
    (Eqs. 12-15) at the ends of its own steps. Held nodes lose their forces where more halves follow.

    The work is shared by so many `threads`. The macro step begins at the time `begin` (s) and lasts `duration` (s);
    `velocity_step` is the interval of the velocity update in its first half (s). `element` is one of those above; the
    kernels of the others are not compiled. The stresses, pressures and histories in `solid` and `charge` are advanced
    in place. `totals` receives the sums and limits of every chunk.
    """
    highest = motion.moving.size - 1
    for half in range(first, last):
        substep = half // 2
        if half == 2 * substep:
            if half > first:
                hold_rows(nodes.force, held.direction, held.first, held.node)
            moving = motion.moving[_min_level(substep, highest)]
            interval = step if substep > 0 else velocity_step
            if len(element) == 2:  # rings are advanced by one thread; known while compiling
                _move_nodes(0, moving, motion, interval, step, substep, nodes)
            else:
                on_threads(moving, _move_nodes, (motion, interval, step, substep, nodes))
            continue
        min_level, time = _min_level(substep + 1, highest), begin + duration * ((substep + 1) / (1 << highest))
        for colour in range(schedule.colour_offset.size - 1):
            chunks = schedule.chunk[schedule.colour_offset[colour] : schedule.colour_offset[colour + 1]]
            cells = element, nodes, grid, schedule, solid, charge, rings, totals
            if len(element) == 2:
                for chunk in chunks:
                    _run_chunk(chunk, step, time, min_level, *cells, scratch[0])
            else:
                on_threads(threads, _run_pieces, (threads, chunks, step, time, min_level, *cells, scratch))
        if contact is not None and min_level <= contact.level:
            act_on_line(time, contact, nodes, grid, solid, charge)


@kernel
def _min_level(substep: int, highest: int) -> int:
    """Lowest level of the cells that end a step with so many substeps of a macro step.

    Cells of the shortest steps end one with every substep, those of twice the step with every second, ...
    """
    level = highest
    while level > 0 and substep % 2 == 0:
        substep //= 2
        level -= 1
    return level


@kernel
def _run_pieces(
    start: int,
    stop: int,
    threads: int,
    chunks: np.ndarray,
    step: float,
    time: float,
    min_level: int,
    element: tuple[int, ...],
    nodes: Nodes,
    grid: Grid,
    schedule: Schedule,
    solid: SolidState,
    charge: ChargeState,
    rings: AxisymmetricState | None,
    totals: Totals,
    scratch: np.ndarray,
) -> None:
    """Run the pieces of a colour's `chunks` from `start` to `stop`, of so many `threads`."""
    work = scratch[numba.get_thread_id()]
    first = _piece_begins(start, threads, chunks, schedule.active, min_level)
    last = _piece_begins(stop, threads, chunks, schedule.active, min_level)
    for k in range(first, last):
        _run_chunk(chunks[k], step, time, min_level, element, nodes, grid, schedule, solid, charge, rings, totals, work)


@kernel
def _piece_begins(thread: int, threads: int, chunks: np.ndarray, active: np.ndarray, min_level: int) -> int:
    """First chunk of a thread's piece of all blocks that take part; `active` as in `Schedule`."""
    if thread == threads:
        return chunks.size
    whole = 0
    for chunk in chunks:
        whole += active[chunk, min_level, 0] + active[chunk, min_level, 1]
    before = 0
    for k in range(chunks.size):
        own = active[chunks[k], min_level, 0] + active[chunks[k], min_level, 1]
        # A chunk belongs to the piece in which its middle lies.
        if (2 * before + own) * threads >= 2 * thread * whole:
            return k
        before += own
    return chunks.size


@kernel
def _run_chunk(
    chunk: int,
    step: float,
    time: float,
    min_level: int,
    element: tuple[int, ...],
    nodes: Nodes,
    grid: Grid,
    schedule: Schedule,
    solid: SolidState,
    charge: ChargeState,
    rings: AxisymmetricState | None,
    totals: Totals,
    work: np.ndarray,
) -> None:
    """Run the blocks of one chunk that take part, solid ones first."""
    widest_vectors()  # also for the stack, which is this kernel's where others are compiled into it
    energy = work[SCRATCH_ROWS * LANES : SCRATCH_ROWS * LANES + 5]
    limits = work[SCRATCH_ROWS * LANES + 5 : SCRATCH_ROWS * LANES + 8]
    energy[:] = 0.0
    limits[0] = limits[1] = np.inf
    limits[2] = -1.0
    first = schedule.first_solid[chunk]
    for block in range(first, first + schedule.active[chunk, min_level, 0]):
        level = grid.level[block]
        fraction = 1.0 / (1 << level)
        if len(element) == 1:  # known while compiling: the other branches are left out
            _advance_solid(
                block, fraction * step, time, fraction, nodes, grid, solid, None, solid.eroded, work, energy, limits
            )
        elif len(element) == 2:
            _advance_solid_rings(
                block, fraction * step, time, fraction, nodes, grid, solid, rings, solid.eroded, work, energy, limits
            )
        else:
            _advance_solid_full(
                block, fraction * step, time, fraction, nodes, grid, solid, None, solid.eroded, work, energy, limits
            )
    first = schedule.first_charge[chunk]
    for block in range(first, first + schedule.active[chunk, min_level, 1]):
        level = grid.level[block]
        fraction = 1.0 / (1 << level)
        work_before, heat_before = energy[3], energy[4]
        if len(element) == 2:
            _advance_charge_rings(
                block, fraction * step, time, fraction, nodes, grid, charge, rings, solid.eroded, work, energy, limits
            )
        else:
            _advance_charge(
                block, fraction * step, time, fraction, nodes, grid, charge, None, solid.eroded, work, energy, limits
            )
        owner = grid.material[block] // _PARTS
        totals.released[chunk, owner, 0] += energy[3] - work_before
        totals.released[chunk, owner, 1] += energy[4] - heat_before
    for i in range(5):
        totals.energy[chunk, i] += energy[i]
    totals.stable_step[chunk] = limits[0]
    totals.smallest_volume[chunk] = limits[1]
    totals.smallest[chunk] = int(limits[2])


@kernel
def _move_nodes(
    first: int, last: int, motion: Motion, velocity_step: float, step: float, substep: int, nodes: Nodes
) -> None:
    """Semi-implicit Euler (Eq. 3): first the velocity, v += dt F/m, then with the new velocity x += dt v.

    Each node moves on by its own step, `step` / 2^level. Where it belongs to cells of twice that, its mean velocity
    over theirs is that of its own two steps in it.

    Parameters
    ----------
    first, last : which nodes move, in order. motion : their levels and masses.
    velocity_step : interval of the velocity update (s). step : macro step (s).
    substep : how many of the shortest steps of the macro step have gone by.
    nodes : positions, velocities and mean velocities are advanced under the forces, the resultants of Eq. 2, which are
        cleared for the cells to add to: their lines are in the cache here.
    """
    order, levels, has_coarser_cell, inverse_mass = motion[:4]
    highest = motion.moving.size - 1
    position, velocity, force, mean = nodes.position, nodes.velocity, nodes.force, nodes.mean
    for k in range(first, last):
        node, level = np.uint64(order[k]), levels[k]  # unsigned: no code for negative ones
        own, push = step / (1 << level), velocity_step * inverse_mass[k]
        x = velocity[node, 0] + push * force[node, 0]
        y = velocity[node, 1] + push * force[node, 1]
        z = velocity[node, 2] + push * force[node, 2]
        velocity[node, 0], velocity[node, 1], velocity[node, 2] = x, y, z
        force[node, 0] = force[node, 1] = force[node, 2] = 0.0
        position[node, 0] += own * x
        position[node, 1] += own * y
        position[node, 2] += own * z
        if has_coarser_cell[k]:
            # After the first of the two steps the mean is that step's velocity.
            before = 0.5 * ((substep >> (highest - level)) & 1)
            mean[node, 0] = (1.0 - before) * x + before * mean[node, 0]
            mean[node, 1] = (1.0 - before) * y + before * mean[node, 1]
            mean[node, 2] = (1.0 - before) * z + before * mean[node, 2]
