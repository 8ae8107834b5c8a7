"""Metal without strength that folds after it was blown up is released: its mass flies on, the ledger stays closed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from burst_fenicsx.errors import NumericalStop
from tests.burst_fenicsx.axisymmetric.meridians import rectangle, ring_burst
from tests.burst_fenicsx.boxes import BARE, STEEL, run_until, turned_inside_out

pytestmark = pytest.mark.dolfinx

FOLDED = 4  # of 9 cells, the middle one


def torn(growth=2.8, strain=1.0, *, step=False):
    """Nine rings of steel that share their nodes; the middle one has been blown up and a corner drawn across it."""
    casing = replace(STEEL, shear_softening_strain=0.5, tensile_softening_strain=0.5)
    solver = ring_burst(rectangle((3, 3), (0.02, 0.023), 3e-3), BARE, casing=casing)
    state = solver.fields
    cell = int(np.flatnonzero(state.mesh.cell == FOLDED)[0])
    position, nodes = state.nodes.position, state.mesh.dofmap[cell]
    centre = position[nodes].mean(axis=0)
    position[nodes] = centre + growth * (position[nodes] - centre)
    # The lower left corner beyond the diagonal of its neighbours.
    position[nodes[0]] = centre + 0.1 * (position[nodes[2]] - centre)
    state.solid.shear_strain[cell] = state.solid.volume_strain[cell] = strain
    state.solid.stress[cell, 0, :3] = -2e8
    if step:
        solver.add_forces(0.0)
    return solver, cell


def test_it_is_released_with_its_mass_and_its_energy():
    solver, cell = torn()
    state = solver.fields
    mass, volume = state.mass.copy(), state.blocks.by_cell(state.grid.volume)[cell]
    strain = state.solid_sums()[0]
    assert strain > 0.0
    assert state.folded()[cell]
    solver.add_forces(0.0)
    assert state.released.sum() == 1
    assert state.released[cell]
    assert not state.folded()[cell]
    assert (state.solid.stress[cell] == 0.0).all()
    np.testing.assert_array_equal(state.mass, mass)
    assert state.volumes()[cell] == volume
    # All that this cell held elastically is in the plastic work now; the others have borne nothing yet.
    own = state.solid_sums()[0]
    assert own == pytest.approx(0.0, abs=1e-9 * strain)
    assert solver.ledger.sums[0] == pytest.approx(strain, rel=1e-12)
    momentum = float(state.mass @ state.nodes.velocity[:, 2])
    state.nodes.velocity[:, 2] = 300.0
    run_until(solver, 2e-6)
    assert float(state.mass @ state.nodes.velocity[:, 2]) - momentum == pytest.approx(
        300.0 * state.mass.sum(), rel=1e-12
    )
    assert state.released[cell]
    assert np.isfinite(state.nodes.position).all()


def test_metal_that_has_strength_or_was_not_blown_up_is_not_released():
    """A folded cell with strength stays a cell; one at its old size as well; one without volume left is torn."""
    for growth, strain, released in ((2.8, 0.2, False), (1.2, 1.0, False), (2.8, 1.0, True)):
        solver, cell = torn(growth, strain, step=True)
        assert bool(solver.fields.released[cell]) is released, (growth, strain)
        assert bool(solver.fields.folded()[cell]) is not released


@pytest.mark.parametrize(("strain", "released"), [(1.0, True), (0.2, False)])
def test_at_the_end_folded_metal_without_strength_is_released_at_any_size(strain, released):
    solver, cell = torn(1.2, strain, step=True)
    state = solver.fields
    solver.release_folded_metal()
    assert np.flatnonzero(state.released).tolist() == [cell] * released
    assert bool(state.folded()[cell]) is not released
    assert (state.solid.stress[cell] == 0.0).all() == released
    solver.add_forces(0.0)
    assert np.flatnonzero(state.released).tolist() == [cell] * released


def test_a_cell_with_strength_that_turns_inside_out_still_stops_the_run():
    solver, cell = torn(1.0, 0.0)
    state = solver.fields
    nodes = state.mesh.dofmap[cell]
    state.nodes.position[nodes] = state.nodes.position[nodes[::-1]]
    solver.add_forces(0.0)
    with pytest.raises(NumericalStop, match=r"lost cell: cell \d of the casing of round 0, .* has turned inside out"):
        solver.check_cells()


def test_a_cell_with_strength_that_its_nodes_carry_through_itself_stops_the_run():
    """Its state is NaN after the step; what it had before decides."""
    solver, cell = torn(1.0, 0.0)
    state = solver.fields
    turned_inside_out(solver, cell)
    assert not state.released.any()
    with pytest.raises(NumericalStop, match=r"lost cell"):
        solver.check_cells()
