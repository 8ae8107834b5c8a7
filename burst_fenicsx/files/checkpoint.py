"""The state of every rank in one HDF5 file, to go on from after an interruption on as many ranks.

A group for each rank holds its arrays and numbers as they stand. What follows from the levels of the cells is made
again from them first, so that the arrays of the blocks fit.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.contact.charge_contacts import BOND_STATE, PAIR_STATE
from burst_fenicsx.errors import InputError
from burst_fenicsx.mechanics.ledger import Entry
from fragfield_base.hdf5_files import creating, reading

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    import h5py

    from burst_fenicsx.mechanics.solver import BurstSolver


FORMAT = "fragfield burst checkpoint 14"  # 14: numbering of the cells


def _kept(solver: BurstSolver) -> Iterator[tuple[str, Any, tuple[str, ...]]]:
    """Name, owner and attributes (arrays or numbers) of what a rank goes on from besides the levels of its cells."""
    state, contact, control = solver.fields, solver.contact, solver.control
    yield "nodes", state.nodes, ("position", "velocity", "force")  # the first, see `_restore`
    yield "solver", solver, ("time", "time_step", "steps", "cell_steps")
    yield "control", control, ("stable_step", "uncut_step", "chosen_at", "choose_again", "contact_step")
    yield "grid", state.grid, ("volume", "viscous", "stable")
    yield "solid", state.solid, ("stress", "shear_strain", "volume_strain", "hourglass", "eroded")
    yield "charge", state.charge, ("pressure", "burn_fraction", "energy", "ignition_time", "compression_from")
    yield "leakage", solver.leakage, ("factor", "widest")
    yield "ledger", solver.ledger, ("sums", "released", "external_work", "damping")
    if contact is None:
        return
    yield "contact", contact, ("friction", "work", "eroded", "plane_force", "impulse")
    yield "contact_rows", contact.nodes.rows, ("sums",)
    if contact.interface is not None:
        yield "interface", contact.interface.pairs, PAIR_STATE
        yield "bonds", contact.interface.bonds, BOND_STATE
    yield "penetrations", contact.penetrations, tuple(item.name for item in fields(contact.penetrations))
    for number, plane in enumerate(contact.planes):
        yield f"plane_{number}", plane.pairs, PAIR_STATE


def _arrays(solver: BurstSolver) -> dict[str, np.ndarray]:
    contact, levels = solver.contact, solver.levels
    found = {
        "longest_step": np.array(levels.step),
        "contact_level": np.array(levels.contact_level),
        "level": solver.fields.blocks.cell_levels,
        **{f"{name}/{key}": np.asarray(getattr(owner, key)) for name, owner, keys in _kept(solver) for key in keys},
    }
    if solver.initiation is not None:
        found |= _named("initiation", solver.initiation.arrays())
    if contact is not None and contact.collisions is not None:
        found |= _named("search", contact.collisions.arrays())
    return found


def _named(group: str, arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {f"{group}/{name}": values for name, values in arrays.items()}


def _numbering(solver: BurstSolver) -> str:
    """Digest of the nodes of every cell, on all ranks: another dolfinx may share out and number a mesh otherwise."""
    mesh = solver.fields.mesh
    digests = mesh.comm.allgather(hashlib.sha256(mesh.dofmap.astype(np.int64).tobytes()).digest())
    return hashlib.sha256(b"".join(digests)).hexdigest()


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
    comm = solver.fields.mesh.comm
    ranks, numbering = comm.gather({**_arrays(solver), **_named("records", records or {})}), _numbering(solver)
    if ranks is None:
        return
    with creating(path, InputError) as file:
        file.attrs.update({**provenance, "format": FORMAT, "mesh_key": mesh_key, "ranks": comm.size})
        file.attrs["numbering"] = numbering
        file.attrs.update({"time": solver.time, "steps": solver.steps})
        for name, column in solver.ledger.columns().items():
            file[f"history/{name}"] = column
        for rank, arrays in enumerate(ranks):
            for name, values in arrays.items():
                file[f"ranks/{rank}/{name}"] = values


def read_checkpoint(
    path: Path, solver: BurstSolver, mesh_key: str, provenance: Mapping[str, str] | None = None
) -> dict[str, np.ndarray]:
    """Put the solver where the checkpoint was taken; give back the driver's records. Collective.

    Other versions of libraries continue from it where they number the cells alike; `provenance`, of this run, names
    them where they do not.

    Raises
    ------
    InputError
        The file is cut off, is no checkpoint, belongs to another case, or was written on another number of ranks or
        with other libraries, by which the cells have other numbers.
    """
    comm, numbering = solver.fields.mesh.comm, _numbering(solver)
    with reading(path, InputError, "delete it to start the burst again") as file:
        if file.attrs.get("format") != FORMAT:
            raise InputError(f"{path} is not a checkpoint of a burst (format {file.attrs.get('format')!r})")
        if file.attrs["mesh_key"] != mesh_key:
            raise InputError(
                f"{path} belongs to another case: {file.attrs['mesh_key']}; this one is {mesh_key}; "
                "run without resuming"
            )
        if file.attrs["ranks"] != comm.size:
            raise InputError(
                f"{path} was written on {file.attrs['ranks']} ranks, and this run has {comm.size}; resume it on as "
                "many, or delete it to start the burst again"
            )
        if file.attrs["numbering"] != numbering:
            raise InputError(
                f"{path} was written where dolfinx or gmsh numbers the cells of this mesh otherwise "
                f"({_differences(file.attrs, provenance or {})}); resume it there, or delete it to start the burst "
                "again"
            )
        arrays = file[f"ranks/{comm.rank}"]
        _restore(arrays, solver)
        columns = {name: values[()] for name, values in file["history"].items()}
        solver.ledger.entries = [
            Entry(**{name: float(values[row]) for name, values in columns.items()})
            for row in range(len(columns["time"]))
        ]
        return _group(arrays, "records")


def _differences(there: Mapping[str, str], here: Mapping[str, str]) -> str:
    first, second = (json.loads(one.get("versions", "{}")) for one in (there, here))
    named = (name for name in sorted({*first, *second}) if first.get(name) != second.get(name))
    texts = [f"{name} {first.get(name, 'unknown')} there, {second.get(name, 'unknown')} here" for name in named]
    return "; ".join(texts) or "by the same versions"


def _group(arrays: h5py.Group, name: str) -> dict[str, np.ndarray]:
    return {key: values[()] for key, values in arrays[name].items()} if name in arrays else {}


def _restore(arrays: h5py.Group, solver: BurstSolver) -> None:
    state, contact, levels = solver.fields, solver.contact, solver.levels
    kept = _kept(solver)
    _put(arrays, *next(kept))
    levels.step, levels.contact_level = float(arrays["longest_step"][()]), int(arrays["contact_level"][()])
    level = arrays["level"][()]
    levels.set_levels(level)
    state.grid = state.grid._replace(longest=levels.step)
    if contact is not None:
        contact.set_level(levels.contact_level)
        contact.restore_eroded(arrays["contact/eroded"][()])
    for name, owner, keys in kept:  # arrays of the blocks as they are now
        _put(arrays, name, owner, keys)
    # Padded lanes must hold what the cells do: earlier versions left older numbers in them.
    state.regroup(level, levels.highest)
    if solver.initiation is not None:
        solver.initiation.restore(_group(arrays, "initiation"))
        solver.burning.update()
    if contact is None:
        return
    if contact.collisions is not None:
        contact.collisions.restore(_group(arrays, "search"))
    contact.look_again()


def _put(arrays: h5py.Group, name: str, owner: Any, keys: tuple[str, ...]) -> None:  # noqa: ANN401 - any object
    """Put arrays in place, and numbers, where `_kept` found them."""
    for key in keys:
        values, now = arrays[f"{name}/{key}"][()], getattr(owner, key)
        if not isinstance(now, np.ndarray):
            setattr(owner, key, type(now)(values))
        elif now.shape == values.shape:
            now[...] = values
        else:
            raise ValueError(f"{name}/{key} has the shape {values.shape}, not {now.shape}")
