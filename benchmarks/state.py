"""The states that are timed: the 155 mm round of case 3.1 just initiated, half-way expanded, and made by hand.

How a run is stepped and how its element forces are computed alone stands here and nowhere else.
"""

from __future__ import annotations

import logging
import tempfile
from contextlib import contextmanager
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
from fragfield.case.conversion.stages import burst_rounds, burst_settings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from burst_fenicsx.problem import Quadrature

__all__ = [
    "CASE",
    "MIDDLE",
    "begun",
    "expanding",
    "forces_alone",
    "in_the_middle",
    "in_the_middle_full",
    "new_run",
    "one_step",
    "shares",
]

CASE = Path(__file__).resolve().parent.parent / "cases" / "grenade_155_tnt.toml"
MIDDLE = 80e-6
"""Time (s) at which all of the charge is burnt and the casing flows nearly everywhere."""

_FEW_STEPS = 10
_EXPANSION_RATE = 1.6e4  # 1/s: 1 km/s at the widest bore
_SMALL = 1e-3  # of a step, by which forces computed at fixed places advance the stresses
_POINTS = 8


def one_step(run: Simulation) -> None:
    """Advance by one step in which every cell is evaluated once: without local time stepping here."""
    run.solver.step()


@contextmanager
def forces_alone(run: Simulation) -> Iterator[Callable[[], None]]:
    """Give a function that computes the element forces of all cells, without contact, where the nodes now are.

    The prescribed step is so small that stresses stay as they are, yet cells that flow still return to the limit.
    """
    solver, contact = run.solver, run.solver.contact
    step = _SMALL * solver.time_step
    solver.contact = None
    try:
        yield lambda: solver.add_forces(step)
    finally:
        solver.contact = contact
        solver.add_forces(0.0)


def new_run(
    cell_size: float,
    quadrature: Quadrature = "one_point",
    end_time: float | None = None,
    *,
    subcycling: bool = False,
) -> Simulation:
    """The case with cells of this size (m), at rest and unreacted; its folder goes when the process ends.

    With `subcycling` cells are stepped locally, as they are by default.
    """
    logging.getLogger("burst_fenicsx").setLevel(logging.ERROR)
    case = load_case(CASE, cell_size=f"{1e3 * cell_size:g} mm")
    settings = burst_settings(case, geometry="3d")
    settings = replace(
        settings, symmetry="off", quadrature=quadrature, time_step=replace(settings.time_step, subcycling=subcycling)
    )
    if end_time is not None:
        settings = replace(settings, end_time=end_time)
    folder = Path(tempfile.mkdtemp(dir=_scratch().name))
    return Simulation(burst_rounds(case), settings, folder, MPI.COMM_SELF, {})


@cache
def _scratch() -> tempfile.TemporaryDirectory[str]:
    """A folder for the runs of this process."""
    return tempfile.TemporaryDirectory(prefix="fragfield-bench-")


@cache
def begun(cell_size: float) -> Simulation:
    """A few steps after ignition: casing at rest and elastic but for the first cells; made once."""
    run = new_run(cell_size)
    for _ in range(_FEW_STEPS):
        one_step(run)
    return run


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
        for name in ("stress", "plastic_shear_strain", "plastic_volumetric_strain"):
            values = np.tile(file[f"cells/{name}"][()], (1, _POINTS))
            del file[f"cells/{name}"]
            file[f"cells/{name}"] = values
    read_checkpoint(path, full.solver, full.key)
    for _ in range(_FEW_STEPS):
        one_step(full)
    return full


def expanding(cell_size: float) -> Simulation:
    """A round made to expand at once, so that cells of any size are at work after a few steps.

    All charge is burnt, and speeds are in proportion to the distance from the axis.
    """
    run = new_run(cell_size)
    run.fields.charge.ignition_time[:] = -np.inf
    run.solver.burning.update()
    run.fields.nodes.velocity[:, :2] = _EXPANSION_RATE * run.fields.start[:, :2]
    for _ in range(_FEW_STEPS):
        one_step(run)
    return run


def shares(run: Simulation) -> dict[str, float]:
    """Shares of the cells: of the charge in all, of burnt ones in the charge, of yielded ones in the casing."""
    charge = run.fields.mesh.part == Part.CHARGE
    burnt = run.fields.charge.burn_fraction[: len(charge)][charge] >= 1.0
    yielded = (run.fields.solid.shear_strain[: len(charge)][~charge] > 0.0).any(axis=1)
    return {"charge": float(charge.mean()), "burnt": float(burnt.mean()), "yielded": float(yielded.mean())}
