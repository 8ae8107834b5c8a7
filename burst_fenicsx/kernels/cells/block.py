"""The step of a block of cells, one routine for every element and every material.

What a module of an element and one of a material have to offer:

Element (`one_point`, `eight_points`, `axisymmetric.quadrilateral`)
    gather, move : nodal values into the scratch; the cells' mean motion in the step and their shape after it.
    POINTS, MIN_VOLUME (row) : with several points, their number; smallest volume that a point stands for (m3).
    move_point, add_point, end_points : with several, motion at one, what its stress adds, and what is left of all.
    store_forces, add_forces : nodal forces of a mean stress and of hourglass forces; into the nodes' sums.
    turn_stored : stored forces of hourglass control turned with the cell.
    set_damping, set_stiffness : coefficients of a lane; both return what the step must bear of a vector of square one.
    STORED_ROWS : numbers of elastic hourglass forces that a cell stores. RINGS : whether its cells are rings.
    may_exceed, bound : whether that may be too much; upper limits of the coefficients.
    dashpots, springs_and_dashpots : generalised forces against the modes (N) and their power (W).

Material (`solid.make_solid`, `charge`)
    PARAMETERS, HAS_SPRINGS : columns of its table; whether its hourglass control has springs.
    load, make_update, store : the cells' state into the scratch, through the step, and back.
    prefetch_state : the state of a block brought near before it is loaded.
    load_point, store_point : the state of one point, where there is any.
    elasticity, sound_speeds, total_stress : for the stable step, viscosity and forces.
    erode, clear_state : of cells that are no continuum any more, see `erosion`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.cells.erosion import drop_forces, freeze_cells
from burst_fenicsx.kernels.cells.solid import make_solid
from burst_fenicsx.kernels.lanes import LANES, block_kernel, inlined_kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.vectors.cell_values import load_slots, prefetch_dofs, prefetch_slots, store_slots
from burst_fenicsx.kernels.vectors.exact import quantise, row_sum
from burst_fenicsx.materials import laws

if TYPE_CHECKING:
    from types import ModuleType

    from burst_fenicsx.kernels.state import Grid, Nodes, SolidState

__all__ = ["make_block", "make_solid_block", "viscosity_and_step"]

_LAW = at.SOLID_PARAMETERS.index("law")


@lane_function
def viscosity_and_step(
    dilatation: float,
    length: float,
    density: float,
    sound: float,
    fastest: float,
    linear: float,
    quadratic: float,
) -> tuple[float, float]:
    """Artificial viscous pressure q (Pa) in compression and the stable step (s) with it.

    q = rho L |D| (q1 c + q2 L |D|), D the rate of volume (von Neumann and Richtmyer 1950, Landshoff 1955).
    The damped mode of frequency omega = 2 c/L with the ratio zeta = q1 + q2 L |D| / c of the critical
    damping allows dt <= (2/omega) (sqrt(1 + zeta^2) - zeta) (Belytschko et al. 2000, section 6.2).
    `fastest` is the sound speed that the step must allow for.
    """
    closing = length * max(-dilatation, 0.0)
    speed = quadratic * closing
    damped = linear * fastest + speed if dilatation < 0.0 else 0.0
    viscous = density * closing * (linear * sound + speed)
    return viscous, length / (np.sqrt(fastest * fastest + damped * damped) + damped)


@block_kernel
def _lower_limits(
    block: int, min_volume: int, fraction: float, grid: Grid, scratch: np.ndarray, limits: np.ndarray
) -> None:
    """Take a block's stable steps over `fraction` (s) and volumes (m3) into the smallest of `limits`."""
    for lane in range(grid.filled[block]):
        stable, volume = scratch[at.STABLE * LANES + lane], scratch[min_volume * LANES + lane]
        if stable < fraction * limits[0]:
            limits[0] = stable / fraction
        if not volume >= limits[1]:
            # Not a number must not be overwritten by the next cell.
            limits[1] = volume if volume == volume else -np.inf
            limits[2] = grid.cells[block, lane]


@lane_function
def _nothing(*_: Any) -> None:
    """What an element of one point does for its points, and a material whose points have no state."""


def make_block(element: ModuleType, material: Any) -> Any:  # noqa: ANN401
    """Kernel that advances a block of cells of one element and one material.

    It is compiled into its caller, and so are the parts of the element and the material that work on one lane: the
    loops over the lanes are vectorised as if they had been written out for this pair.
    """
    update = material.make_update(element.turn_stored)
    resistance_of = element.springs_and_dashpots if material.HAS_SPRINGS else element.dashpots
    linear, quadratic = (material.PARAMETERS.index(f"{name}_viscosity") for name in ("linear", "quadratic"))
    springs, damping = material.HAS_SPRINGS, material.PARAMETERS.index("hourglass_viscous")
    stiffness = material.PARAMETERS.index("hourglass_stiffness") if springs else 0
    points, min_volume = getattr(element, "POINTS", 1), getattr(element, "MIN_VOLUME", at.VOLUME)
    move_point, add_point, end_points = (
        getattr(element, name, _nothing) for name in ("move_point", "add_point", "end_points")
    )
    load, store, erode, clear_state = material.load, material.store, material.erode, material.clear_state
    prefetch_state = material.prefetch_state
    load_point, store_point = (getattr(material, name, _nothing) for name in ("load_point", "store_point"))
    elasticity, sound_speeds, total_stress = material.elasticity, material.sound_speeds, material.total_stress

    @block_kernel
    def stiffen(step: float, next_dt: float, parameters: np.ndarray, scratch: np.ndarray) -> int:
        """Artificial viscosity, stable steps and hourglass coefficients; count the cells that may not bear the latter.

        Their limits depend on the next step, `next_dt` (s).
        """
        widest_vectors()
        constants = elasticity(parameters)
        per_step = 1.0 / next_dt if next_dt > 0.0 else np.inf
        count = 0
        for lane in range(LANES):
            density = scratch[at.MASS * LANES + lane] / scratch[at.VOLUME * LANES + lane]
            sound, fastest = sound_speeds(density, constants, parameters, scratch, lane)
            viscous, stable = viscosity_and_step(
                scratch[at.DILATATION * LANES + lane],
                1.0 / scratch[at.FREQUENCY * LANES + lane],
                density,
                sound,
                fastest,
                parameters[linear],
                parameters[quadratic],
            )
            scratch[at.VISCOUS * LANES + lane] = viscous
            scratch[at.STABLE * LANES + lane] = stable
            most = element.set_damping(parameters[damping], sound, scratch, lane)
            if springs:
                most = max(most, element.set_stiffness(parameters[stiffness], constants[0], step, scratch, lane))
            count += 1 if element.may_exceed(most, per_step, scratch, lane) else 0
        return count

    @block_kernel
    def resist(fraction: float, rounding: float, scratch: np.ndarray) -> None:
        """Nodal forces of stress, artificial viscosity and hourglass control."""
        widest_vectors()
        for lane in range(LANES):
            resistance, power = resistance_of(scratch, lane)
            scratch[at.POWER * LANES + lane] = power
            element.store_forces(total_stress(scratch, lane), resistance, fraction, rounding, scratch, lane)

    @block_kernel
    def find_work(
        step: float, fraction: float, filled: int, rounding: float, scratch: np.ndarray, limits: np.ndarray
    ) -> int:
        """Work of viscosity and hourglass control of the lanes that hold a cell; count those below the `limits`."""
        widest_vectors()
        count = 0
        for lane in range(LANES):
            volume, viscous = scratch[at.VOLUME * LANES + lane], scratch[at.VISCOUS * LANES + lane]
            # Mean of both ends of the step, as the forces work: at a front q changes within it.
            viscous = 0.5 * (scratch[at.OLD_VISCOUS * LANES + lane] + viscous)
            heat = -quantise(viscous * (volume - scratch[at.OLD_VOLUME * LANES + lane]), rounding)
            work = quantise(scratch[at.POWER * LANES + lane] * step, rounding)
            scratch[at.HEAT * LANES + lane] = heat if lane < filled else 0.0
            scratch[at.POWER * LANES + lane] = work if lane < filled else 0.0
            low = scratch[at.STABLE * LANES + lane] < fraction * limits[0]
            count += 0 if (scratch[min_volume * LANES + lane] >= limits[1]) & (not low) else 1
        return count

    @block_kernel
    def add_work(
        block: int,
        step: float,
        fraction: float,
        grid: Grid,
        scratch: np.ndarray,
        energy: np.ndarray,
        limits: np.ndarray,
    ) -> None:
        """Add up the work of viscosity and hourglass control and find the limits."""
        if find_work(step, fraction, grid.filled[block], grid.rounding, scratch, limits) > 0:
            _lower_limits(block, min_volume, fraction, grid, scratch, limits)
        store_slots(block, scratch, at.VISCOUS, grid.viscous)
        store_slots(block, scratch, at.STABLE, grid.stable)
        store_slots(block, scratch, at.VOLUME, grid.volume)
        energy[1] += row_sum(scratch, at.HEAT)
        energy[2] += row_sum(scratch, at.POWER)

    @block_kernel
    def prefetch_next(block: int, grid: Grid, state: Any) -> None:  # noqa: ANN401
        """Bring near what the next block keeps, and which nodes the one after it has; its nodes `gather` brings."""
        last = len(grid.filled) - 1
        next_block = min(block + 1, last)
        prefetch_slots(next_block, grid.mass)
        prefetch_slots(next_block, grid.volume)
        prefetch_slots(next_block, grid.viscous)
        prefetch_slots(next_block, grid.stable)
        prefetch_state(next_block, grid, state)
        prefetch_dofs(grid.cells[min(block + 2, last)], grid.dofmap)

    @inlined_kernel
    def advance_block(
        block: int,
        step: float,
        time: float,
        fraction: float,
        nodes: Nodes,
        grid: Grid,
        state: Any,  # noqa: ANN401 - of the material
        rings: Any,  # noqa: ANN401 - what the element keeps besides
        eroded: np.ndarray,
        scratch: np.ndarray,
        energy: np.ndarray,
        limits: np.ndarray,
    ) -> None:
        """Advance one block of cells by `step` to `time` (s) and add its nodal forces times `fraction`.

        Parameters
        ----------
        fraction : `step` over the longest that any cell takes.
        state : `SolidState` or `ChargeState`. rings : `AxisymmetricState` of rings, else None.
        eroded : that of `SolidState`.
        energy : (5,) J, added to: plastic, viscous and hourglass work of this step, work of the charge's pressure, and
            the part of it that the charge's own artificial viscosity turns to heat.
        limits : (3,): smallest stable step over `fraction` (s), smallest volume (m3) and its cell; updated.
        """
        parameters = state.parameters[grid.material[block]]
        element.gather(block, nodes, grid, rings, scratch)
        load_slots(block, grid.mass, scratch, at.MASS)
        load_slots(block, grid.volume, scratch, at.OLD_VOLUME)
        load_slots(block, grid.viscous, scratch, at.OLD_VISCOUS)
        element.move(step, scratch)
        stage = load(block, time, parameters, grid, state, scratch)
        any_eroded = erode(block, min_volume, parameters, grid, state, eroded, scratch) > 0
        for point in range(points):
            move_point(point, step, scratch)
            if any_eroded:
                freeze_cells(block, min_volume, grid, eroded, scratch)
            load_point(block, point, grid, state, scratch)
            update(block, step, stage, parameters, grid, state, scratch, energy)
            add_point(point, scratch)
            store_point(block, point, grid, state, scratch)
        end_points(scratch)
        next_dt = max(step, fraction * grid.longest)
        element.bound(next_dt, stiffen(step, next_dt, parameters, scratch) > 0, scratch)
        if any_eroded:
            clear_state(block, grid, parameters, state, eroded, scratch)
        prefetch_next(block, grid, state)
        resist(fraction, nodes.rounding, scratch)
        if any_eroded:
            drop_forces(block, eroded, scratch)
        element.add_forces(block, grid, scratch, nodes.force)
        store(block, step, parameters, grid, state, scratch, energy)
        add_work(block, step, fraction, grid, scratch, energy, limits)

    return advance_block


def make_solid_block(element: ModuleType) -> Any:  # noqa: ANN401
    """Kernel that advances a block of solid cells of one element by the law of their material."""

    def before(number: int, advance: Any, others: Any) -> Any:  # noqa: ANN401
        @inlined_kernel
        def choose(
            block: int,
            step: float,
            time: float,
            fraction: float,
            nodes: Nodes,
            grid: Grid,
            state: SolidState,
            rings: Any,  # noqa: ANN401
            eroded: np.ndarray,
            scratch: np.ndarray,
            energy: np.ndarray,
            limits: np.ndarray,
        ) -> None:
            if state.parameters[grid.material[block], _LAW] == number:
                advance(block, step, time, fraction, nodes, grid, state, rings, eroded, scratch, energy, limits)
            else:
                others(block, step, time, fraction, nodes, grid, state, rings, eroded, scratch, energy, limits)

        return choose

    rings = getattr(element, "RINGS", False)
    *first, last = (make_block(element, make_solid(law, element.STORED_ROWS, rings=rings)) for law in laws("solids"))
    for number in reversed(range(len(first))):
        last = before(number, first[number], last)
    return last
