"""Released cells of products press on nothing: neither on their nodes nor, through contact, on the casing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.kernels.cells.erosion import BEFORE
from burst_fenicsx.kernels.constants import CRUSHED
from burst_fenicsx.problem import ContactSettings, Part
from burst_fenicsx.simulation import Simulation
from tests.burst_fenicsx.boxes import TNT, run_until
from tests.burst_fenicsx.test_sliding import gas_column
from tests.burst_fenicsx.tubes import SETTINGS, tube

pytestmark = pytest.mark.dolfinx


def release(fields, cells):
    """Put burnt cells of the charge into the state of released ones, crushed to the volume at which that happens."""
    assert (fields.charge.burn_fraction[cells] == 1.0).all()
    eroded, volume = (fields.blocks.by_cell(values) for values in (fields.solid.eroded, fields.grid.volume))
    eroded[cells], volume[cells] = BEFORE, CRUSHED * fields.cell_mass[cells] / TNT.density
    fields.solid.eroded[:], fields.grid.volume[:] = (fields.blocks.by_slot(values) for values in (eroded, volume))


def at_the_wall(run):
    """Cells of the charge that lie on the casing, those nearest to the middle of the round first."""
    fields = run.fields
    of_casing = np.unique(fields.mesh.dofmap[fields.mesh.part == Part.CASING])
    places = {tuple(np.round(point, 9)) for point in fields.start[of_casing]}
    at_casing = np.array([tuple(np.round(point, 9)) in places for point in fields.start])
    charge = np.flatnonzero(fields.mesh.part == Part.CHARGE)
    cells = charge[at_casing[fields.mesh.dofmap[charge]].any(axis=1)]
    centre = fields.start[fields.mesh.dofmap[cells]].mean(axis=1)
    middle = 0.5 * (fields.start[:, 2].min() + fields.start[:, 2].max())
    return cells[np.argsort(np.abs(centre[:, 2] - middle) + 1e-3 * np.abs(centre[:, 1]))]


def released_at_30(tmp_path, count):
    """The tube with `count` cells at its wall released after 30 us, to 60 us: the run, and the fastest node (m/s)."""
    folder = tmp_path / str(count)
    folder.mkdir()
    settings = replace(SETTINGS, end_time=60e-6, energy_tolerance=np.inf)
    run = Simulation([tube()], settings, folder, MPI.COMM_SELF, {})
    run_until(run.solver, 30e-6)
    cells = at_the_wall(run)[:count]
    release(run.fields, cells)
    fastest = 0.0
    while run.solver.time < 60e-6 * (1.0 - 1e-12):
        run.solver.step(60e-6)
        fastest = max(fastest, float(np.linalg.norm(run.fields.nodes.velocity, axis=1).max()))
    run._record()
    return run, cells, fastest


def test_released_products_of_a_tube_drive_no_casing(tmp_path):
    """3 of 384 cells at the wall: no pressure is left in them, no node gets faster, and contact makes no energy."""
    whole, _, fastest = released_at_30(tmp_path, 0)
    run, cells, also = released_at_30(tmp_path, 3)
    assert (run.fields.charge.pressure[cells] == 0.0).all()
    assert also < 1.01 * fastest
    before, after = whole.ledger.entries[-1], run.ledger.entries[-1]
    assert after.products_work < before.products_work
    assert after.mean_casing_speed < before.mean_casing_speed
    assert abs(after.contact_gain - before.contact_gain) < 5e-3 * before.products_work
    assert after.energy_error < 0.01


def test_a_node_of_released_products_leaves_the_wall_and_others_lose_their_share():
    """Gas at rest on a rigid wall: a row of cells is released; half of the pressure at its ends, none between."""
    solver, _ = gas_column(1, 2, ContactSettings(), held=True)
    fields, contacts = solver.fields, solver.contact.interface.contacts
    own = contacts.contact
    node, place = contacts.slave[own], fields.start[contacts.slave[own], 0]
    before = np.linalg.norm(contacts.force[own], axis=1)
    on_wall = np.isin(fields.mesh.dofmap, node).any(axis=1) & (fields.mesh.part == Part.CHARGE)
    cells = np.flatnonzero(on_wall)
    centre = fields.start[fields.mesh.dofmap[cells]].mean(axis=1)[:, 0]
    gone = cells[(centre > 0.05) & (centre < 0.10)]
    assert len(gone) == 10
    release(fields, gone)
    solver.add_forces(0.0)
    after = np.linalg.norm(contacts.force[own], axis=1)
    within, edge = (place > 0.0501) & (place < 0.0999), (np.abs(place - 0.05) < 1e-9) | (np.abs(place - 0.1) < 1e-9)
    assert (within.sum(), edge.sum()) == (18, 4)
    assert (after[within] == 0.0).all()
    assert (contacts.off[own][within] == 1).all()
    np.testing.assert_allclose(after[edge], 0.5 * before[edge], rtol=1e-9)
    np.testing.assert_allclose(after[~within & ~edge], before[~within & ~edge], rtol=1e-12)
