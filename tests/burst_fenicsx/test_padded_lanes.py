"""Lanes beyond the cells of a block change nothing: in other blocks, and after a checkpoint with anything in them."""

from __future__ import annotations

from dataclasses import replace

import h5py
import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.files.checkpoint import read_checkpoint, write_checkpoint
from burst_fenicsx.kernels.lanes import LANES
from burst_fenicsx.mechanics import schedule
from burst_fenicsx.problem import Part
from burst_fenicsx.simulation import Simulation
from tests.burst_fenicsx.boxes import run_until
from tests.burst_fenicsx.tubes import SETTINGS, tube

pytestmark = pytest.mark.dolfinx

READ_AT, END = 4e-6, 30e-6
OVER_SLOTS = ("grid/volume", "grid/viscous", "grid/stable", "solid/eroded", "solid/hourglass")


def by_slots(fields):
    """Every array over slots, (slots, ...)."""
    grid, solid = fields.grid, fields.solid
    over = {name: getattr(grid, name) for name in ("mass", "volume", "viscous", "stable")}
    over |= {name: getattr(solid, name) for name in ("eroded", "softening_scale")}
    lanes = {"hourglass": solid.hourglass} | (
        {"inverse_share": fields.inverse_share} if fields.inverse_share.size else {}
    )
    for name, values in lanes.items():
        over[name] = values.reshape(len(values), -1, LANES).transpose(0, 2, 1).reshape(fields.blocks.cells.size, -1)
    return over


def same_state(one, two):
    """Bit by bit: of cells, points, nodes and sums; and the padded lanes hold what the cells' do."""
    padding = two.fields.blocks.slot_of_cell[two.fields.blocks.cells.ravel()]
    for name, values in by_slots(two.fields).items():
        np.testing.assert_array_equal(values, values[padding], err_msg=f"{name} of padded lanes")
        own = one.fields.blocks.by_cell(by_slots(one.fields)[name])
        np.testing.assert_array_equal(two.fields.blocks.by_cell(values), own, err_msg=name)
    for group in ("nodes", "solid", "charge"):
        for name, values in getattr(one.fields, group)._asdict().items():
            if name not in ("eroded", "softening_scale", "hourglass", "mean"):  # the last one: within a step
                np.testing.assert_array_equal(getattr(getattr(two.fields, group), name), values, err_msg=name)
    for name in ("time", "time_step", "steps"):
        assert getattr(one.solver, name) == getattr(two.solver, name), name
    for name in ("sums", "released"):
        np.testing.assert_array_equal(getattr(two.solver.ledger, name), getattr(one.solver.ledger, name))


def spoil_padded_lanes(path, blocks):
    """Put into the padded lanes of a checkpoint what no cell can hold; how many of metal and of charge."""
    padded = np.arange(LANES)[None, :] >= blocks.count[:, None]
    with h5py.File(path, "a") as file:
        for name in OVER_SLOTS:
            item = file[f"ranks/0/{name}"]
            values = item[()].reshape(len(padded), -1, LANES)
            values.transpose(0, 2, 1)[padded] = 1 if name == "solid/eroded" else np.nan
            item[...] = values.reshape(item.shape)
    charge = blocks.material % len(Part) == Part.CHARGE
    return int(padded[~charge].sum()), int(padded[charge].sum())


@pytest.mark.parametrize(
    "changes", [{}, {"quadrature": "full"}, {"geometry": "axisymmetric", "cell_size": 12e-3}], ids=str
)
def test_blocks_that_are_not_full_do_what_others_do(tmp_path, monkeypatch, changes):
    """In the usual chunks, and in many small ones that go on from a checkpoint and are arranged again."""
    settings = replace(SETTINGS, end_time=END, **changes)

    def run(name):
        folder = tmp_path / name
        folder.mkdir()
        return Simulation([tube()], settings, folder, MPI.COMM_SELF, {})

    whole = run("whole")
    run_until(whole.solver, READ_AT)
    monkeypatch.setattr(schedule, "chunk_size", lambda cells: 37)
    first, second = run("first"), run("second")
    run_until(first.solver, READ_AT)
    same_state(whole, first)
    path = tmp_path / "checkpoint.h5"
    write_checkpoint(path, first.solver, {}, first.key)
    assert min(spoil_padded_lanes(path, first.fields.blocks)) > 0
    read_checkpoint(path, second.solver, second.key)
    same_state(whole, second)
    level = second.fields.blocks.cell_levels
    second.fields.regroup(np.random.default_rng(1).integers(0, 3, len(level)), 2)
    same_state(whole, second)
    second.solver.levels.set_levels(level)
    for simulation in (whole, second):
        run_until(simulation.solver, END)
    same_state(whole, second)
