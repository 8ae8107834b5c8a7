"""The substeps of a macro step: the loops over all nodes, and over all cells by coloured chunks.

Chunks of one colour share no node, so their forces may be added side by side; each chunk adds in its own fixed
order. The sums are therefore bitwise the same for any number of threads.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numba
import numpy as np

from burst_fenicsx.kernels.axisymmetric.slide_line import act_on_line
from burst_fenicsx.kernels.cells.block import advance_charges, advance_solids
from burst_fenicsx.kernels.cells.layout import ENERGY, SCRATCH_ROWS
from burst_fenicsx.kernels.lanes import LANES, kernel
from burst_fenicsx.kernels.threads import address_of, call_at, on_threads
from burst_fenicsx.kernels.vectors.rows import hold_rows

if TYPE_CHECKING:
    from burst_fenicsx.kernels.axisymmetric.slide_line import LineContact
    from burst_fenicsx.kernels.state import Cells, HeldNodes, Motion, Nodes

ONE_POINT, RINGS, FULL_QUADRATURE = (1,), (1, 1), (2, 2, 2)
"""Elements, distinguished by the length of these, known while compiling: hexahedra, rings, hexahedra in full."""

_LINE = 8  # doubles of a cache line, and of the widest vectors


class Interval(NamedTuple):
    """Which part of a macro step is made: the halves `first` to `last` of its substeps."""

    first: int
    last: int
    begin: float  # s, time at the beginning of the macro step
    duration: float  # s, that passes in it
    step: float  # s, by which nodes and cells advance in it
    velocity_step: float  # s, interval of the velocity update in its first half


class CellKernels(NamedTuple):
    """Machine code of `advance_solids` and `advance_charges` for an element, at addresses (see `kernels.threads`)."""

    solids: np.uint64
    charges: np.uint64


def cell_kernels(element: tuple[int, ...], cells: Cells) -> CellKernels:
    """Compile the kernels of an element for arrays of the types of `cells`, or find them in the cache."""
    work = cells.scratch[0]
    return CellKernels(
        address_of(advance_solids, (element, 0, 0, 0.0, cells, work)),
        address_of(advance_charges, (element, 0, 0, 0.0, 0.0, cells, work, cells.totals.released[0])),
    )


def make_scratch(threads: int) -> np.ndarray:
    """Scratch of `threads` threads, (threads, rows), each thread's on cache lines of its own.

    Vectors that straddle two lines would cost a tenth of the forces.
    """
    doubles = SCRATCH_ROWS * LANES
    room = np.zeros(threads * doubles + _LINE)
    first = -(room.ctypes.data // room.itemsize) % _LINE
    return room[first : first + threads * doubles].reshape(threads, doubles)


@kernel
def advance_halves(
    interval: Interval,
    element: tuple[int, ...],
    kernels: CellKernels,
    threads: int,
    cells: Cells,
    motion: Motion,
    held: HeldNodes,
    contact: LineContact | None,
) -> None:
    """Advance by halves of the substeps of a macro step, on so many `threads`.

    In the half 2 k the nodes move from the substep k to the next one (Eq. 3), and their used forces are cleared. In
    the half 2 k + 1 the cells that end a step there follow and add forces (N) to their nodes (Eq. 1). A cell of level l
    advances by the step / 2^l, and its forces count for that fraction of it, and so do those of a meridian's `contact`
    (Eqs. 12-15) at the ends of its own steps. Held nodes lose their forces where more halves follow.
    """
    highest, nodes, step = motion.moving.size - 1, cells.nodes, interval.step
    for half in range(interval.first, interval.last):
        substep = half // 2
        if half == 2 * substep:
            if half > interval.first:
                hold_rows(nodes.force, held.direction, held.first, held.node)
            moving = motion.moving[_min_level(substep, highest)]
            velocity_step = step if substep > 0 else interval.velocity_step
            if threads > 1:
                on_threads(moving, _move_nodes, (motion, velocity_step, step, substep, nodes))
            else:
                _move_nodes(0, moving, motion, velocity_step, step, substep, nodes)
            continue
        min_level = _min_level(substep + 1, highest)
        time = interval.begin + interval.duration * ((substep + 1) / (1 << highest))
        schedule = cells.schedule
        for colour in range(schedule.colour_offset.size - 1):
            chunks = schedule.chunk[schedule.colour_offset[colour] : schedule.colour_offset[colour + 1]]
            if threads > 1:
                on_threads(threads, _run_pieces, (threads, chunks, step, time, min_level, element, kernels, cells))
            else:
                _run_pieces(0, 1, 1, chunks, step, time, min_level, element, kernels, cells)
        if contact is not None and min_level <= contact.level:
            act_on_line(time, contact, nodes, cells.grid, cells.solid, cells.charge)


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
    kernels: CellKernels,
    cells: Cells,
) -> None:
    """Run the pieces of a colour's `chunks` from `start` to `stop`, of so many `threads`."""
    schedule, totals = cells.schedule, cells.totals
    work = cells.scratch[numba.get_thread_id()]
    energy = work[ENERGY * LANES : ENERGY * LANES + 8]
    first = _piece_begins(start, threads, chunks, schedule.active, min_level)
    last = _piece_begins(stop, threads, chunks, schedule.active, min_level)
    for k in range(first, last):
        chunk = chunks[k]
        energy[:5] = 0.0
        energy[5] = energy[6] = np.inf
        energy[7] = -1.0
        solids, charges = schedule.first_solid[chunk], schedule.first_charge[chunk]
        end = solids + schedule.active[chunk, min_level, 0]
        call_at(kernels.solids, (element, np.int64(solids), np.int64(end), step, cells, work))
        end = charges + schedule.active[chunk, min_level, 1]
        released = totals.released[chunk]
        call_at(kernels.charges, (element, np.int64(charges), np.int64(end), step, time, cells, work, released))
        for part in range(5):  # two slices would have numba compile the text of an error
            totals.energy[chunk, part] += energy[part]
        totals.stable_step[chunk], totals.smallest_volume[chunk] = energy[5], energy[6]
        totals.smallest[chunk] = int(energy[7])


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
