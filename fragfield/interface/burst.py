"""The end of a burst as burst_snapshot.h5 holds it: checked arrays of the casings, rounds, histories."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError
from fragfield_base.arrays import numbers
from fragfield_base.burst_snapshot import FUZE, GEOMETRIES, NODE_ARRAYS
from fragfield_base.hdf5_files import reading

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    import h5py
    from numpy.typing import NDArray

    from fragfield.results.burst import Burst as BurstPart
    from transition.placement.mirroring import SymmetryPlane


@dataclass(frozen=True, kw_only=True)
class RoundTables:
    """One round at the end of the burst: what it is, and its tables as structured arrays (SI).

    `attributes` holds all that the file says of it.
    """

    name: str
    length: float
    position: NDArray[np.float64]
    axis: NDArray[np.float64]
    casing_mass: float
    charge_mass: float
    explosive: str
    profile: str
    segments: NDArray[Any]
    along: NDArray[Any]
    attributes: dict[str, Any]


@dataclass(frozen=True, repr=False, kw_only=True)
class Burst:
    """The end of a burst, from burst_snapshot.h5, and what led to it.

    Attributes
    ----------
    time : float
        Time at its end (s).
    nodes : dict
        `reference` and `position` (m), `velocity` (m/s) of the casings' nodes, (n, 3), or (n, 2) of a meridian.
    cells : dict
        Of the casings' cells (c,): `nodes` (c, 8), or (c, 4) of a meridian, and their state.
    history : dict
        Over `time` (s): `mean_casing_speed` (m/s), `outer_diameter` (m), energies (J) and `energy_error`.
    rounds : list of RoundTables
        By round: `name`, `attributes`, and `segments` and `along` as structured arrays.
    planes : list of SymmetryPlane
        Planes of symmetry, behind which mirrored rounds stand.
    is_axisymmetric : bool
        Whether the cells are those of a meridian.
    """

    part: BurstPart | None
    time: float
    nodes: dict[str, NDArray[np.float64]]
    cells: dict[str, NDArray[Any]]
    history: dict[str, NDArray[np.float64]]
    rounds: list[RoundTables]
    planes: list[SymmetryPlane]
    is_axisymmetric: bool

    @property
    def summary(self) -> BurstPart:
        """The part of the summary: cells, steps, masses, speeds, energy and momentum errors."""
        if self.part is None:
            raise InputError("summary.json has no burst; run `fragfield burst` again")
        return self.part

    def __repr__(self) -> str:
        return f"<fragfield.Burst to {self.time * 1e6:.4g} us: {self.summary.cells} cells>"


def read_burst(path: Path, summary: BurstPart | None) -> Burst:
    """Read burst_snapshot.h5; raises InputError where it is damaged or incomplete."""
    with reading(path, InputError, "run the stage that writes it again") as file:
        try:
            geometry = str(_plain(file.attrs.get("geometry", "3d")))
            nodes, cells = _mesh(file, str(path), GEOMETRIES.get(geometry, 4))
            groups = [file["rounds"][name] for name in sorted(file["rounds"], key=int)]
            return Burst(
                part=summary,
                time=float(file.attrs["time"]),
                nodes=nodes,
                cells=cells,
                history={name: data[()] for name, data in file.get("history", {}).items()},
                rounds=[_round(group) for group in groups],
                planes=[_plane(group) for group in file.get("planes", {}).values()],
                is_axisymmetric=geometry == "axisymmetric",
            )
        except (KeyError, OSError) as error:
            raise InputError(f"{path}: not a complete burst snapshot: {error}; run `fragfield burst` again") from error


def _round(group: h5py.Group) -> RoundTables:
    of = {key: _plain(value) for key, value in group.attrs.items()}
    length, casing, charge = (float(of[key]) for key in ("length", "casing_mass", "charge_mass"))
    return RoundTables(
        name=str(of.get("name", "")), length=length, position=np.asarray(of["position"], dtype=np.float64),
        axis=np.asarray(of["axis"], dtype=np.float64), casing_mass=casing, charge_mass=charge,
        explosive=str(of["explosive"]), profile=str(of.get("profile") or ""),
        segments=_strings(group["segments"][()]), along=group["along"][()], attributes=of,
    )  # fmt: skip


def _mesh(file: h5py.File, where: str, corners: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Arrays of nodes and of cells: one length each, and no cell that names a node, part or round that is not there."""
    for name in (*(f"nodes/{name}" for name in NODE_ARRAYS), "cells/nodes", "rounds"):
        if name not in file:
            raise KeyError(f"{name} is missing")
    first = numbers(file, f"nodes/{NODE_ARRAYS[0]}", InputError, where, shape=(None, 3), finite=True)
    nodes = {NODE_ARRAYS[0]: first}
    for name in NODE_ARRAYS[1:]:
        nodes[name] = numbers(file, f"nodes/{name}", InputError, where, shape=first.shape, finite=True)

    def whole(name: str, shape: tuple[int | None, ...], most: int) -> NDArray[Any]:
        key, kind = f"cells/{name}", "whole numbers"
        return numbers(file, key, InputError, where, kind=kind, shape=shape, minimum=0, maximum=most)

    cells = {"nodes": whole("nodes", (None, corners), len(first) - 1)}
    most: Mapping[str, int] = {"part": FUZE, "round": len(file["rounds"]) - 1}
    number = len(cells["nodes"])
    for name, data in file["cells"].items():
        if name in most:
            cells[name] = whole(name, (number,), most[name])
        elif name != "nodes":
            if getattr(data, "shape", ())[:1] != (number,):
                raise InputError(f"{where}: /cells/{name} has not one value for each of {number} cells")
            cells[name] = data[()]
    return nodes, cells


def _plane(group: h5py.Group) -> SymmetryPlane:
    from transition.placement.mirroring import SymmetryPlane

    x, y, z = np.asarray(group.attrs["point"], dtype=float).tolist()
    normal = np.asarray(group.attrs["normal"], dtype=float)
    along_x, along_y, along_z = (normal / np.linalg.norm(normal)).tolist()
    return SymmetryPlane(str(_plain(group.attrs["name"])), (x, y, z), (along_x, along_y, along_z))


def _plain(value: object) -> Any:  # noqa: ANN401 - of HDF5
    if isinstance(value, bytes):
        return value.decode()
    return value.item() if isinstance(value, np.generic) else value


def _strings(table: NDArray[Any]) -> NDArray[Any]:
    for name in table.dtype.names or ():
        if table.dtype[name].kind == "O":
            table[name] = [item.decode() if isinstance(item, bytes) else item for item in table[name]]
    return table
