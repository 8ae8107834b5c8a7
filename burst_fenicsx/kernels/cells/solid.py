"""Casing and fuze: objective rate, plastic return and softening at every point; element erosion of what is torn."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.cells.elastic import elastic_energy, moduli, ring_trial, turned_trial
from burst_fenicsx.kernels.cells.erosion import BEFORE, NOW, WHOLE, clear_lane
from burst_fenicsx.kernels.constants import NOTHING_LEFT
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.state import Grid, SolidState
from burst_fenicsx.kernels.vectors.exact import quantise, row_sum
from burst_fenicsx.kernels.vectors.nodal_values import (
    cells_of_lanes,
    load_cells,
    load_slots,
    prefetch_slots,
    store_cells,
)
from burst_fenicsx.kernels.vectors.tensors import Symmetric, load_matrix, load_symmetric, store_symmetric
from burst_fenicsx.kernels.vectors.transposition import (
    WIDTH,
    address,
    addresses,
    later,
    load_triples,
    prefetch,
    store_triples,
)

if TYPE_CHECKING:
    from types import ModuleType

__all__ = ["make_solid"]

_DENSITY = at.SOLID_PARAMETERS.index("density")
_STRESS_BYTES, _HALF_A_STRESS = np.uint64(48), np.uint64(24)  # of a point's stress


@block_kernel
def _load_point(block: int, point: int, grid: Grid, state: SolidState, scratch: np.ndarray) -> None:
    """Gather the state of one point of each cell into lanes."""
    points = np.uint64(state.stress.shape[1])
    start = address(state.stress) + _STRESS_BYTES * np.uint64(point)
    for first in range(0, LANES, WIDTH):
        stored = addresses(start, _STRESS_BYTES * points, cells_of_lanes(grid.cells[block], first))
        load_triples(stored, scratch, at.STRESS * LANES + first)
        load_triples(later(stored, _HALF_A_STRESS), scratch, (at.STRESS + 3) * LANES + first)
    cells, in_rows, count = grid.cells[block], grid.in_rows[block], state.stress.shape[1]
    later_by = np.uint64(8 * point)
    load_cells(cells, in_rows, address(state.shear_strain) + later_by, count, scratch, at.SOLID_SHEAR_STRAIN)
    load_cells(cells, in_rows, address(state.volume_strain) + later_by, count, scratch, at.SOLID_VOLUME_STRAIN)


@block_kernel
def _store_point(block: int, point: int, grid: Grid, state: SolidState, scratch: np.ndarray) -> None:
    """Write the state of one point of each cell back."""
    points = np.uint64(state.stress.shape[1])
    start = address(state.stress) + _STRESS_BYTES * np.uint64(point)
    for first in range(0, LANES, WIDTH):
        stored = addresses(start, _STRESS_BYTES * points, cells_of_lanes(grid.cells[block], first))
        store_triples(scratch, at.STRESS * LANES + first, stored)
        store_triples(scratch, (at.STRESS + 3) * LANES + first, later(stored, _HALF_A_STRESS))
    cells, in_rows, count = grid.cells[block], grid.in_rows[block], state.stress.shape[1]
    later_by = np.uint64(8 * point)
    store_cells(cells, in_rows, address(state.shear_strain) + later_by, count, scratch, at.SOLID_SHEAR_STRAIN)
    store_cells(cells, in_rows, address(state.volume_strain) + later_by, count, scratch, at.SOLID_VOLUME_STRAIN)


@lane_function
def _elasticity(parameters: np.ndarray) -> tuple[float, float]:
    """Modulus of a plane wave (Pa), and what is left of its speed without shear strength."""
    shear, lame = moduli(parameters)
    stiff = lame + 2.0 * shear
    return stiff, np.sqrt((lame + 2.0 / 3.0 * shear) / stiff)


@lane_function
def _total_stress(scratch: np.ndarray, lane: int) -> Symmetric:
    """Stress with the viscous pressure taken off (Pa)."""
    viscous = scratch[at.VISCOUS * LANES + lane]
    xx, yy, zz, xy, yz, zx = load_symmetric(scratch, at.STRESS, lane)
    return xx - viscous, yy - viscous, zz - viscous, xy, yz, zx


@block_kernel
def _clear_state(
    block: int, grid: Grid, parameters: np.ndarray, state: SolidState, eroded: np.ndarray, scratch: np.ndarray
) -> None:
    """Take stress and resistance from eroded cells; what they hold elastically goes to the plastic work."""
    for lane in range(LANES):
        slot = block * LANES + lane
        if eroded[slot] == WHOLE:
            continue
        cell, points = np.uint64(grid.cells[block, lane]), state.stress.shape[1]
        scratch[at.SOLID_DISSIPATION * LANES + lane] = 0.0
        for point in range(points):
            s = state.stress[cell, point]
            if eroded[slot] == NOW:
                stress = (s[0], s[1], s[2], s[3], s[4], s[5])
                scratch[at.SOLID_DISSIPATION * LANES + lane] += elastic_energy(stress, parameters) / points
            if lane < grid.filled[block]:
                s[:] = 0.0
        eroded[slot] = BEFORE
        scratch[at.SPRING * LANES + lane] = 0.0
        for k in range(12):
            scratch[(at.HOURGLASS_FORCE + k) * LANES + lane] = 0.0
        clear_lane(scratch, lane)


def make_solid(law: ModuleType, stored_rows: int, *, rings: bool = False) -> SimpleNamespace:
    """Material of solids for `block.make_block`, with the strength of a module of `materials.solids`.

    `stored_rows` is how many numbers of hourglass forces the element stores; of `rings` the hoop stress is principal.
    """
    strengths, is_elastic = law.strengths, law.is_elastic
    trial_of, return_stress = turned_trial, law.return_stress
    if rings:
        trial_of, return_stress = ring_trial, getattr(law, "return_ring_stress", law.return_stress)

    @block_kernel
    def load(
        block: int,
        time: float,  # noqa: ARG001
        parameters: np.ndarray,  # noqa: ARG001
        grid: Grid,  # noqa: ARG001
        state: SolidState,
        scratch: np.ndarray,
    ) -> float:
        """Gather what a block's cells keep besides the state of their points."""
        load_slots(block, state.softening_scale, scratch, at.SOLID_SOFTENING)
        for lane in range(LANES):
            scratch[at.SOLID_STRENGTH * LANES + lane] = 0.0
        for k in range(stored_rows * LANES):
            scratch[at.HOURGLASS_FORCE * LANES + k] = state.hourglass[block, k]
        return 0.0

    @block_kernel
    def prefetch_state(block: int, grid: Grid, state: SolidState) -> None:
        """Bring a block's state near."""
        prefetch_slots(block, state.softening_scale)
        points = np.uint64(8 * state.shear_strain.shape[1])
        for lane in (0, WIDTH, LANES - 1):
            later_by = points * np.uint64(grid.cells[block, lane])
            prefetch(address(state.shear_strain) + later_by)
            prefetch(address(state.volume_strain) + later_by)
        start = address(state.hourglass) + np.uint64(block * stored_rows * LANES * 8)
        for line in range(stored_rows * LANES * 8 // 64):
            prefetch(start + np.uint64(64 * line))
        start, stride = address(state.stress), _STRESS_BYTES * np.uint64(state.stress.shape[1])
        for lane in range(LANES):
            prefetch(start + stride * np.uint64(grid.cells[block, lane]))

    @block_kernel
    def find_work(filled: int, rounding: float, scratch: np.ndarray) -> None:
        """Plastic work of the lanes that hold a cell."""
        widest_vectors()
        for lane in range(LANES):
            work = scratch[at.SOLID_DISSIPATION * LANES + lane] * scratch[at.VOLUME * LANES + lane]
            scratch[at.PLASTIC * LANES + lane] = quantise(work, rounding) if lane < filled else 0.0

    @block_kernel
    def store(
        block: int,
        step: float,  # noqa: ARG001
        parameters: np.ndarray,  # noqa: ARG001
        grid: Grid,
        state: SolidState,
        scratch: np.ndarray,
        energy: np.ndarray,
    ) -> None:
        """Write the stored hourglass forces back and add up the plastic work."""
        for k in range(stored_rows * LANES):
            state.hourglass[block, k] = scratch[at.HOURGLASS_FORCE * LANES + k]
        find_work(grid.filled[block], grid.rounding, scratch)
        energy[0] += row_sum(scratch, at.PLASTIC)

    @lane_function
    def strengths_of(parameters: np.ndarray, scratch: np.ndarray, lane: int) -> tuple[float, float]:
        """Shear and tensile strength (Pa) after the strains so far."""
        shear_strain = scratch[at.SOLID_SHEAR_STRAIN * LANES + lane]
        volume_strain = scratch[at.SOLID_VOLUME_STRAIN * LANES + lane]
        return strengths(parameters, shear_strain, volume_strain, scratch[at.SOLID_SOFTENING * LANES + lane])

    @block_kernel
    def return_plastic(parameters: np.ndarray, scratch: np.ndarray) -> None:
        """Return the stresses of a block.

        What `is_elastic` finds elastic stays as it is, to the last bit: it does so in a block without plastic cells,
        and a cell's result must not depend on the other cells of its block.
        """
        widest_vectors()
        for lane in range(LANES):
            tau, sigma = strengths_of(parameters, scratch, lane)
            trial = load_symmetric(scratch, at.STRESS, lane)
            elastic = is_elastic(trial, tau, sigma)
            stress, shear_strain, volume_strain, dissipation = return_stress(
                trial, np.inf if elastic else tau, np.inf if elastic else sigma, parameters[0], parameters[1]
            )
            store_symmetric(stress, scratch, at.STRESS, lane)
            scratch[at.SOLID_SHEAR_STRAIN * LANES + lane] += shear_strain
            scratch[at.SOLID_VOLUME_STRAIN * LANES + lane] += volume_strain
            scratch[at.SOLID_DISSIPATION * LANES + lane] = dissipation

    def make_update(turn_stored: Any) -> Any:  # noqa: ANN401 - compiled functions
        """Kernel that advances the stress at a point of each cell; `turn_stored` is the hourglass control's."""

        @block_kernel
        def try_elastic(step: float, parameters: np.ndarray, scratch: np.ndarray) -> int:
            """Turn what is stored and add the elastic increment; count the cells that may be plastic."""
            widest_vectors()
            shear, lame = moduli(parameters)
            plastic = 0
            for lane in range(LANES):
                rate = load_matrix(scratch, at.RATE, lane)
                rotation, stress = trial_of(load_symmetric(scratch, at.STRESS, lane), rate, step, lame, shear)
                store_symmetric(stress, scratch, at.STRESS, lane)
                turn_stored(rotation, scratch, lane)
                tau, sigma = strengths_of(parameters, scratch, lane)
                plastic += 0 if is_elastic(stress, tau, sigma) else 1
                scratch[at.SOLID_DISSIPATION * LANES + lane] = 0.0
            return plastic

        @block_kernel
        def update(
            block: int,  # noqa: ARG001
            step: float,
            stage: float,  # noqa: ARG001
            parameters: np.ndarray,
            grid: Grid,  # noqa: ARG001
            state: SolidState,
            scratch: np.ndarray,
            energy: np.ndarray,  # noqa: ARG001
        ) -> None:
            if try_elastic(step, parameters, scratch) > 0:
                return_plastic(parameters, scratch)
            if state.stress.shape[1] > 1:
                for lane in range(LANES):
                    tau, _ = strengths_of(parameters, scratch, lane)
                    scratch[at.SOLID_STRENGTH * LANES + lane] = max(scratch[at.SOLID_STRENGTH * LANES + lane], tau)

        return update

    @lane_function
    def sound_speeds(
        density: float, constants: tuple[float, float], parameters: np.ndarray, scratch: np.ndarray, lane: int
    ) -> tuple[float, float]:
        """Sound speed, and the one that the step must allow for (m/s); `constants` are those of `elasticity`.

        Without shear strength only the bulk modulus answers, and the step may be longer by a quarter.
        """
        sound = np.sqrt(constants[0] / density)
        tau, _ = strengths_of(parameters, scratch, lane)
        return sound, sound if (tau > 0.0) | (scratch[at.SOLID_STRENGTH * LANES + lane] > 0.0) else constants[1] * sound

    @block_kernel
    def is_spent(cell: int, parameters: np.ndarray, scale: float, state: SolidState) -> bool:
        """Whether the metal of a cell has lost its shear strength at every point; `scale` that of softening."""
        for point in range(state.shear_strain.shape[1]):
            tau, _ = strengths(parameters, state.shear_strain[cell, point], state.volume_strain[cell, point], scale)
            if tau > 0.0:
                return False
        tau, _ = strengths(parameters, 0.0, 0.0, scale)
        return tau > 0.0

    @block_kernel
    def erode(
        block: int,
        min_volume: int,
        parameters: np.ndarray,
        grid: Grid,
        state: SolidState,
        eroded: np.ndarray,
        scratch: np.ndarray,
    ) -> int:
        """Mark cells without strength of which hardly any volume is left; how many of the block are eroded.

        A cell is judged before its state advances, so that a shape out of which no finite number can come reaches no
        state. `min_volume` is a row of the scratch.
        """
        slot, count = block * LANES, 0
        for lane in range(LANES):
            if eroded[slot + lane] == WHOLE:
                volume = scratch[min_volume * LANES + lane] * parameters[_DENSITY]
                if not volume > NOTHING_LEFT * scratch[at.MASS * LANES + lane]:
                    cell = np.uint64(grid.cells[block, lane])
                    if is_spent(cell, parameters, scratch[at.SOLID_SOFTENING * LANES + lane], state):
                        eroded[slot + lane] = NOW
            count += 0 if eroded[slot + lane] == WHOLE else 1
        return count

    return SimpleNamespace(
        PARAMETERS=at.SOLID_PARAMETERS,
        HAS_SPRINGS=True,
        load=load,
        load_point=_load_point,
        make_update=make_update,
        return_plastic=return_plastic,
        store_point=_store_point,
        store=store,
        prefetch_state=prefetch_state,
        elasticity=_elasticity,
        sound_speeds=sound_speeds,
        total_stress=_total_stress,
        erode=erode,
        clear_state=_clear_state,
    )
