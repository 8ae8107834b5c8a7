"""The whole state in one HDF5 file, to go on from after an interruption; independent of ranks and threads."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.contact.restart import contact_arrays, own_sums, restore_contact, sums_of_ranks
from burst_fenicsx.errors import InputError
from burst_fenicsx.kernels.lanes import LANES
from burst_fenicsx.mechanics.ledger import Entry
from fragfield_base.hdf5_files import creating, reading

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    import h5py

    from burst_fenicsx.mechanics.detonation import LeakageParts
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.mechanics.solver import BurstSolver

__all__ = ["FORMAT", "read_checkpoint", "write_checkpoint"]

FORMAT = "fragfield burst checkpoint 6"  # 6: the forces and the work of contact

_NUMBERS = (
    "time",
    "time_step",
    "steps",
    "stable_step",
    "free_step",
    "chosen_at",
    "choose_again",
    "contact_step",
)


def _cell_arrays(state: BurstFields) -> dict[str, np.ndarray]:
    """Everything that is kept by cell, (owned cells, ...), as it must be read back."""
    count = state.mesh.cells
    shaped = {name: values.reshape(count, -1) for name, values in state.of_cells.items()}
    grid, blocks = state.grid, state.blocks
    return {
        **shaped,
        "volume": blocks.by_cell(grid.volume),
        "viscous_pressure": blocks.by_cell(grid.viscous),
        "stable_step": blocks.by_cell(grid.stable),
        "level": blocks.cell_levels,
        "hourglass": blocks.by_cell(_hourglass_by_slot(state.solid.hourglass)),
        **state.element_arrays(),
    }


def write_checkpoint(
    path: Path,
    solver: BurstSolver,
    provenance: Mapping[str, str],
    mesh_key: str,
    records: Mapping[str, np.ndarray] | None = None,
) -> None:
    """Write the state; collective. The file is replaced only when the new one is whole.

    `mesh_key` names the mesh and settings; a resumed run must show the same. `records` are arrays of the driver's
    own, which `read_checkpoint` gives back.
    """
    state, mesh = solver.fields, solver.fields.mesh
    cells = {name: mesh.gather_cells(values) for name, values in _cell_arrays(state).items()}
    nodes = {
        name: mesh.gather_nodes(values)
        for name, values in (
            ("position", state.nodes.position),
            ("velocity", state.nodes.velocity),
            ("force", state.nodes.force),
        )
    }
    sums = sums_of_ranks(
        np.concatenate([solver.ledger.released.ravel(), solver.ledger.sums, [solver.ledger.external_work]]), mesh.comm
    )
    cell_steps = mesh.comm.allreduce(solver.cell_steps)
    contact = contact_arrays(solver.contact) if solver.contact is not None else {}
    initiation = solver.initiation.arrays() if solver.initiation is not None else {}
    if mesh.comm.rank != 0:
        return
    groups: dict[str, Mapping[str, np.ndarray | None]] = {
        "cells": cells,
        "nodes": nodes,
        "contact": contact,
        "initiation": initiation,
        "records": records or {},
    }
    _write(path, solver, provenance, mesh_key, sums, cell_steps, groups)


def _write(
    path: Path,
    solver: BurstSolver,
    provenance: Mapping[str, str],
    mesh_key: str,
    sums: np.ndarray,
    cell_steps: int,
    groups: Mapping[str, Mapping[str, np.ndarray | None]],
) -> None:
    with creating(path, InputError) as file:
        file.attrs["format"] = FORMAT
        file.attrs["mesh_key"] = mesh_key
        for key, text in provenance.items():
            file.attrs[key] = text
        for name in _NUMBERS:
            file.attrs[name] = getattr(solver, name)
        file.attrs["cell_steps"] = cell_steps
        file.attrs["longest_step"] = solver.subcycling.step
        file.attrs["contact_level"] = solver.subcycling.contact_level
        file["ledger/released"] = sums[:, :-6].reshape(len(sums), -1, 2)  # of every rank, as all in this group
        file["ledger/sums"] = sums[:, -6:-1]
        file["ledger/external_work"] = sums[:, -1]
        file["ledger/damping"] = solver.ledger.damping
        for name, column in solver.ledger.columns().items():
            file[f"history/{name}"] = column
        file["leakage/factor"] = solver.leakage.factor
        file["leakage/rupture_time"] = solver.leakage.rupture_time
        for group, arrays in groups.items():
            file.create_group(group)
            for name, values in arrays.items():
                file[f"{group}/{name}"] = values


def read_checkpoint(path: Path, solver: BurstSolver, mesh_key: str) -> dict[str, np.ndarray]:
    """Put the solver where the checkpoint was taken; give back the driver's records.

    Raises
    ------
    InputError
        The file is cut off, is no checkpoint, or belongs to another case.
    """
    with reading(path, InputError, "delete it to start the burst again") as file:
        if file.attrs.get("format") != FORMAT:
            raise InputError(f"{path} is not a checkpoint of a burst (format {file.attrs.get('format')!r})")
        if file.attrs["mesh_key"] != mesh_key:
            raise InputError(
                f"{path} belongs to another case: {file.attrs['mesh_key']}; this one is {mesh_key}; "
                "run without resuming"
            )
        _restore(file, solver)
        return {name: values[()] for name, values in file["records"].items()}


def _restore(file: h5py.File, solver: BurstSolver) -> None:
    state, mesh = solver.fields, solver.fields.mesh
    for name, array in (
        ("position", state.nodes.position),
        ("velocity", state.nodes.velocity),
        ("force", state.nodes.force),
    ):
        array[:] = file[f"nodes/{name}"][()][mesh.node]
    for name, values in state.of_cells.items():
        values[...] = file[f"cells/{name}"][()][mesh.cell].reshape(values.shape)
    solver.subcycling.step = float(file.attrs["longest_step"])
    solver.subcycling.contact_level = int(file.attrs["contact_level"])
    solver.subcycling.set_levels(file["cells/level"][()][mesh.cell].astype(np.int8))
    state.grid = state.grid._replace(longest=solver.subcycling.step)
    blocks, grid = state.blocks, state.grid
    grid.volume[:] = blocks.by_slot(file["cells/volume"][()][mesh.cell])
    grid.viscous[:] = blocks.by_slot(file["cells/viscous_pressure"][()][mesh.cell])
    grid.stable[:] = blocks.by_slot(file["cells/stable_step"][()][mesh.cell])
    state.solid.hourglass[:] = _hourglass_by_block(blocks.by_slot(file["cells/hourglass"][()][mesh.cell]))
    state.restore_element_arrays({name: file[f"cells/{name}"][()][mesh.cell] for name in state.element_arrays()})
    if solver.contact is not None:
        solver.contact.set_level(solver.subcycling.contact_level)
        kept: dict[str, np.ndarray] = {}
        file["contact"].visititems(lambda name, item: kept.update({name: item[()]} if hasattr(item, "shape") else {}))
        restore_contact(solver.contact, kept)
    if solver.initiation is not None:
        solver.initiation.restore(file["initiation"])
        solver.burning.update()
    leakage: LeakageParts = solver.leakage
    leakage.factor[:] = file["leakage/factor"][()]
    leakage.rupture_time[:] = file["leakage/rupture_time"][()]
    for name in _NUMBERS:
        setattr(solver, name, float(file.attrs[name]))
    solver.steps = int(file.attrs["steps"])
    # A number of all ranks: one goes on from it, the others from nothing.
    solver.cell_steps = int(file.attrs["cell_steps"]) if mesh.comm.rank == 0 else 0
    ledger, comm = solver.ledger, mesh.comm
    ledger.released[:] = own_sums(file["ledger/released"][()], comm, ledger.released.shape)
    ledger.sums[:] = own_sums(file["ledger/sums"][()], comm, ledger.sums.shape)
    ledger.external_work = float(own_sums(file["ledger/external_work"][()], comm, ()))
    solver.ledger.damping = float(file["ledger/damping"][()])
    columns = {name: values[()] for name, values in file["history"].items()}
    rows_count = len(columns["time"])
    solver.ledger.entries = [
        Entry(**{name: float(values[row]) for name, values in columns.items()}) for row in range(rows_count)
    ]


def _hourglass_by_slot(values: np.ndarray) -> np.ndarray:
    """Stored hourglass forces (slots, 12) from those of the blocks, (blocks, 12 LANES)."""
    return values.reshape(-1, 12, LANES).transpose(0, 2, 1).reshape(-1, 12)


def _hourglass_by_block(values: np.ndarray) -> np.ndarray:
    """The way back from `_hourglass_by_slot`."""
    return np.ascontiguousarray(values.reshape(-1, LANES, 12).transpose(0, 2, 1)).reshape(-1, 12 * LANES)
