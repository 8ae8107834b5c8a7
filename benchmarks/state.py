"""The state that is timed: the 155 mm round of case 3.1 half-way expanded, with one point and with all of them."""

from __future__ import annotations

import logging
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np
from mpi4py import MPI

from burst_fenicsx.files.checkpoint import read_checkpoint, write_checkpoint
from burst_fenicsx.problem import Part
from burst_fenicsx.simulation import Simulation
from fragfield.case import load_case
from fragfield.case.conversion.rounds import burst_rounds
from fragfield.case.problem import burst_settings

if TYPE_CHECKING:
    from burst_fenicsx.problem import Quadrature

__all__ = ["CASE", "MIDDLE", "in_the_middle", "in_the_middle_full", "new_run", "one_step", "shares"]

CASE = Path(__file__).resolve().parent.parent / "cases" / "grenade_155_tnt.toml"
MIDDLE = 80e-6
"""Time (s) at which all of the charge is burnt and the casing flows nearly everywhere."""

_FEW_STEPS = 10
_POINTS = 8


def one_step(run: Simulation) -> None:
    """Advance by one step in which every cell is evaluated once: without local time stepping here."""
    run.solver.step()


def new_run(cell_size: float, quadrature: Quadrature = "one_point") -> Simulation:
    """The case with cells of this size (m), at rest and unreacted; its folder is removed when the process ends."""
    logging.getLogger("burst_fenicsx").setLevel(logging.ERROR)
    case = load_case(CASE, {"burst.cell_size": f"{1e3 * cell_size:g} mm"})
    settings = burst_settings(case, geometry="3d")
    settings = replace(
        settings, symmetry="off", quadrature=quadrature, time_step=replace(settings.time_step, subcycling=False)
    )
    folder = Path(tempfile.mkdtemp(dir=_scratch().name))
    return Simulation(burst_rounds(case), settings, folder, MPI.COMM_SELF, {})


@cache
def _scratch() -> tempfile.TemporaryDirectory[str]:
    """A folder for the runs of this process."""
    return tempfile.TemporaryDirectory(prefix="fragfield-bench-")


@cache
def in_the_middle(cell_size: float, time: float = MIDDLE) -> Simulation:
    """The run at mid-expansion, stepped there from ignition; made once."""
    run = new_run(cell_size)
    while run.solver.time < time:
        run.solver.step(time)
    return run


@cache
def in_the_middle_full(cell_size: float, time: float = MIDDLE) -> Simulation:
    """The same with 2x2x2 points: each takes over the state of the cell's one point, then a few steps are made."""
    one, full = in_the_middle(cell_size, time), new_run(cell_size, "full")
    path = full.checkpoint_path
    write_checkpoint(path, one.solver, {}, full.key)
    with h5py.File(path, "r+") as file:
        solid = file["ranks/0/solid"]
        for name in ("stress", "shear_strain", "volume_strain"):
            values = np.repeat(solid[name][()], _POINTS, axis=1)
            del solid[name]
            solid[name] = values
    read_checkpoint(path, full.solver, full.key)
    for _ in range(_FEW_STEPS):
        one_step(full)
    return full


def shares(run: Simulation) -> dict[str, float]:
    """Shares of the cells: of the charge in all, of burnt ones in the charge, of yielded ones in the casing."""
    charge = run.fields.mesh.part == Part.CHARGE
    burnt = run.fields.charge.burn_fraction[: len(charge)][charge] >= 1.0
    yielded = (run.fields.solid.shear_strain[: len(charge)][~charge] > 0.0).any(axis=1)
    return {"charge": float(charge.mean()), "burnt": float(burnt.mean()), "yielded": float(yielded.mean())}
