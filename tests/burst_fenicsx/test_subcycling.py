"""Local time stepping: levels, exactness for uniform motion, energy over long times, order in time."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from burst_fenicsx.mechanics.schedule import Chunks
from burst_fenicsx.problem import TimeStep
from tests.burst_fenicsx.boxes import BARE, ELASTIC, box, burst, grid, run_until

pytestmark = pytest.mark.dolfinx

# No width is a power of two times the thinnest: strains of 1e-4, or a last bit, would choose the levels.
WIDTHS = np.repeat([7e-3, 1.7e-3, 0.5e-3, 3.4e-3], [24, 8, 8, 12])
LENGTH = WIDTHS.sum()


def graded_bar():
    """Bar of cells 7, 1.7, 0.5 and 3.4 mm long, 8 mm wide: steps eight times apart."""
    lines = np.concatenate([[0.0], np.cumsum(WIDTHS)])

    def carry(points):
        x = lines[np.rint(points[:, 0] * len(WIDTHS)).astype(int)]
        return np.stack([x, 8e-3 * points[:, 1], 8e-3 * points[:, 2]], axis=1)

    return grid((len(WIDTHS), 1, 1), carry)


def standing_wave(subcycling, cfl=0.8, speed=1.0):
    """The bar with free ends, strained along its axis alone, swinging in its second mode; and its angular frequency."""
    settings = replace(BARE, time_step=TimeStep(cfl=cfl, subcycling=subcycling))
    lame = ELASTIC.elastic_modulus * 0.3 / (1.3 * 0.4)
    wave = np.sqrt((lame + ELASTIC.elastic_modulus / 1.3) / ELASTIC.density)
    everything = np.arange(4 * (len(WIDTHS) + 1))
    holds = (
        NodalConstraint(everything, np.array([0.0, 1.0, 0.0])),
        NodalConstraint(everything, np.array([0.0, 0.0, 1.0])),
    )
    solver = burst(graded_bar(), settings, casing=ELASTIC, constraints=holds)
    solver.fields.nodes.velocity[:, 0] = speed * np.cos(2.0 * np.pi * solver.fields.start[:, 0] / LENGTH)
    return solver, 2.0 * np.pi * wave / LENGTH


def energy(solver):
    """Kinetic and stored energy (J)."""
    entry = solver.ledger.record(solver.fields, solver.time, solver.time_step, 0.0)
    return entry.kinetic + entry.strain


def momentum(solver):
    """Along the bar (kg m/s); the impulses that wait at the ends of steps sum to nothing."""
    return float(solver.fields.mass @ solver.fields.nodes.velocity[:, 0])


def test_levels_follow_the_cells_and_differ_by_one_at_most():
    solver, _ = standing_wave(subcycling=True)
    solver.step()
    fields, cycles = solver.fields, solver.levels
    level = fields.blocks.cell_levels
    stable = fields.blocks.by_cell(fields.grid.stable)
    assert cycles.highest >= 3
    assert (cycles.step / 2.0**level <= 0.7 * stable).all()
    finest, motion = fields.nodes.finest, cycles.motion
    around = level[np.argsort(fields.mesh.dofmap.ravel(), kind="stable") // 8]
    first = np.searchsorted(np.sort(fields.mesh.dofmap.ravel()), np.arange(len(fields.mass)))
    np.testing.assert_array_equal(finest, np.maximum.reduceat(around, first))
    below = finest - np.minimum.reduceat(around, first)
    assert (below <= 1).all()
    assert (below == 1).any()
    # Those of short steps come first, and as many move as belong to cells of that level or a higher one.
    assert (np.diff(motion.level.astype(int)) <= 0).all()
    np.testing.assert_array_equal(motion.level, finest[motion.order])
    np.testing.assert_array_equal(motion.has_coarser_cell, below[motion.order])
    np.testing.assert_array_equal(motion.inverse_mass, fields.inverse_mass[motion.order])
    assert [int((finest >= min_level).sum()) for min_level in range(cycles.highest + 1)] == list(motion.moving)
    assert cycles.cell_steps == (2 ** level.astype(int)).sum()


def test_a_body_that_flies_uniformly_is_not_disturbed():
    solver, _ = standing_wave(subcycling=True, speed=0.0)
    solver.constraints = ()
    velocity = np.array([300.0, -200.0, 100.0])
    solver.fields.nodes.velocity[:] = velocity
    run_until(solver, 2e-5)
    moved = solver.fields.nodes.position - solver.fields.start
    np.testing.assert_allclose(moved, np.broadcast_to(2e-5 * velocity, moved.shape), rtol=1e-12, atol=1e-17)
    assert np.abs(solver.fields.solid.stress).max() < 1e-9 * ELASTIC.elastic_modulus


def test_mean_velocities_over_a_cells_step_are_its_nodes_displacements():
    """Nodes between cells of different steps: what the slow cell takes is what they have moved in its step."""
    solver, _ = standing_wave(subcycling=True)
    for _ in range(20):
        solver.step()
    nodes, motion = solver.fields.nodes, solver.levels.motion
    before = nodes.position.copy()
    solver.control.choose_again = np.inf
    solver.step()
    between = motion.order[(motion.level == 1) & (motion.has_coarser_cell == 1)]
    assert len(between)
    displacement = (nodes.position - before)[between]
    round_off = 2**solver.levels.highest * np.spacing(LENGTH)  # of the positions, in each substep
    assert np.abs(displacement[:, 0]).max() > 1e6 * round_off
    np.testing.assert_allclose(nodes.mean[between] * solver.time_step, displacement, rtol=0.0, atol=round_off)


def test_energy_and_momentum_stay_over_many_periods():
    """Without any damping, 24 periods and more than 1000 macro steps: energy to 0.3 %, momentum to round-off.

    With steps of 0.73 of the stable ones, beyond sin(pi/4), it grows by 2.4 % and goes on doubling every few periods.
    """
    solver, frequency = standing_wave(subcycling=True)
    solver.step()
    assert solver.levels.highest >= 3
    solver.control.chosen_at = solver.control.choose_again = np.inf
    run_until(solver, solver.time + 0.1 * 2.0 * np.pi / frequency)
    first, before = energy(solver), momentum(solver)
    largest = 0.0
    for _ in range(24):
        run_until(solver, solver.time + 2.0 * np.pi / frequency)
        largest = max(largest, abs(energy(solver) / first - 1.0))
    assert largest < 3e-3
    assert solver.steps > 1000
    sizes = np.abs(solver.fields.mass * solver.fields.nodes.velocity[:, 0]).sum()
    assert abs(momentum(solver) - before) < 1e-12 * sizes


@pytest.fixture(scope="module")
def finely_stepped():
    """End (s) and displacements (nodes, 3) of the same mesh stepped with a fortieth of the stable step."""
    reference, frequency = standing_wave(subcycling=False, cfl=0.02)
    end = 2.3 * 2.0 * np.pi / frequency
    run_until(reference, end)
    return end, reference.fields.nodes.position - reference.fields.start


@pytest.mark.parametrize("subcycling", [False, True])
def test_the_error_falls_with_the_square_of_the_step(finely_stepped, subcycling):
    """Against the finely stepped motion: rate and level, with and without own steps."""
    end, exact = finely_stepped
    errors = []
    for cfl in (0.8, 0.4, 0.2):
        solver, _ = standing_wave(subcycling, cfl)
        run_until(solver, end)
        moved = solver.fields.nodes.position - solver.fields.start
        errors.append(np.abs(moved - exact).max() / np.abs(exact).max())
    rates = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert rates[-1] > 1.9, (errors, rates)
    assert errors[0] < 0.01, errors


def test_far_fewer_steps_of_cells_are_made():
    own, frequency = standing_wave(subcycling=True)
    every, _ = standing_wave(subcycling=False)
    for solver in (own, every):
        run_until(solver, 2.0 * np.pi / frequency)
    assert own.cell_steps < 0.5 * every.cell_steps


def test_contacts_step_is_a_share_of_the_steps_of_the_cells():
    """Seven tenths of the step that the smallest cell takes: in proportion to its edge and to the share of CFL."""
    found = {}
    for size, cfl in ((0.01, 0.8), (0.02, 0.8), (0.01, 0.4)):
        solver = burst(box((2, 2, 2), (size, size, size)), replace(BARE, time_step=TimeStep(cfl=cfl)))
        found[size, cfl] = solver.control.contact_step
        assert solver.control.contact_step == pytest.approx(0.7 * cfl * solver.control.stable_step, rel=1e-12)
        assert solver.control.stable_step > 0.0
    assert found[0.02, 0.8] == pytest.approx(2.0 * found[0.01, 0.8], rel=1e-9)
    assert found[0.01, 0.4] == pytest.approx(0.5 * found[0.01, 0.8], rel=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_levels_are_raised_until_neighbours_differ_by_one_and_no_farther(seed):
    """The lowest levels not below the given ones: the highest of those of all cells less the cells between."""
    solver = burst(box((4, 3, 2), (4.0, 3.0, 2.0)), BARE, casing=ELASTIC)
    given = np.random.default_rng(seed).integers(0, 6, 24).astype(np.int8)
    level = solver.levels._graded(given.copy())
    index = np.array(list(itertools.product(range(4), range(3), range(2))))[solver.fields.mesh.cell]
    apart = np.abs(index[:, None] - index[None]).max(axis=2)  # cells that share a node are one apart
    np.testing.assert_array_equal(level, (given[None] - apart).max(axis=1))


def test_a_block_holds_cells_of_one_material_and_one_level():
    """Every cell once, in 2,000 cells of six materials and three levels at random."""
    random, count = np.random.default_rng(5), 2000
    dofmap = np.arange(count, dtype=np.int32)[:, None] + np.arange(2, dtype=np.int32)
    material, level = random.integers(0, 6, count).astype(np.int32), random.integers(0, 3, count).astype(np.int8)
    blocks = Chunks(dofmap, material, np.array([False, True, False] * 2)).blocks(level, 2)
    np.testing.assert_array_equal(np.sort(blocks.slots[1]), np.arange(count))
    np.testing.assert_array_equal(material[blocks.cells], np.repeat(blocks.material[:, None], blocks.cells.shape[1], 1))
    np.testing.assert_array_equal(level[blocks.cells], np.repeat(blocks.level[:, None], blocks.cells.shape[1], 1))
