"""The burst stage's last state, as its file hands it over: read with plain h5py and checked."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield_base.arrays import group_of, numbers, text_of
from fragfield_base.burst_snapshot import (
    CASING,
    FORMAT,
    FORMAT_VERSION,
    FUZE,
    GEOMETRIES,
    NODE_ARRAYS,
    SEGMENT_COLUMNS,
    SEGMENT_KINDS,
    SegmentRecord,
)
from fragfield_base.hdf5_files import reading
from transition.cells import HalfPlane, check_meridian, node_shares
from transition.errors import InputError
from transition.motion import SymmetryPlane

if TYPE_CHECKING:
    import h5py
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


_TOUCHING = 1e-6  # of the rounds' extent


@dataclass(frozen=True)
class RoundData:
    """A round as the burst stage describes it. SI units; `position` is the centre of the base plane.

    `casing_yield` (yield strength, Pa) is None where a snapshot does not hold it.
    """

    name: str
    length: float
    casing_density: float
    explosive: str
    explosive_density: float
    detonation_velocity: float
    position: tuple[float, float, float]
    axis: tuple[float, float, float]
    segments: tuple[SegmentRecord, ...]
    casing_yield: float | None = None

    @property
    def along(self) -> Array:
        """Unit axis from the base to the nose (3,)."""
        return np.asarray(self.axis) / np.linalg.norm(self.axis)


ARRAYS = {
    **{name: f"nodes/{name}" for name in NODE_ARRAYS}, "cells": "cells/nodes",
    **{name: f"cells/{name}" for name in ("part", "round", "segment", "station", "mass")},
}  # fmt: skip
"""Arrays of a snapshot, and where its file has them."""
_WHOLE = ("cells", "part", "round", "segment")


@dataclass(frozen=True, eq=False)
class Snapshot:
    """State of the mesh at the end of the burst stage.

    Attributes
    ----------
    source : str
        Where it came from, for messages.
    time : float
        Simulated time (s).
    provenance : dict
        What the file says of its making (text by key).
    reference, position : (n, 3) float64
        Nodes before the burst and now (m).
    velocity : (n, 3) float64
        Velocity of the nodes (m/s).
    cells : (m, 8) or (m, 4) int64
        Nodes of the hexahedra in VTK's order; of an axisymmetric burst those of the quadrilaterals of its meridian,
        counter-clockwise in (r, z), which stand for rings around the round's axis.
    part, round, segment : (m,) int64
        Material (0 casing, 1 charge, 2 fuze), round, and segment within the round (-1: none).
    station : (m,) float64
        Place of the cell's centre along its round, from the nose end (m).
    mass : (m,) float64
        Mass of the cell, or of the whole ring (kg).
    rounds : tuple of RoundData
        The rounds and their segments.
    planes : tuple of SymmetryPlane
        Planes of symmetry, behind which the images of the rounds stand.
    geometry : str
        "3d" or "axisymmetric". An axisymmetric snapshot has one round, and all its nodes lie in one half plane through
        the round's axis.

    Raises
    ------
    InputError
        On arrays that do not fit each other, are not finite, or name nodes, rounds or segments that do not exist.
    """

    source: str
    time: float
    provenance: dict[str, str]
    reference: Array
    position: Array
    velocity: Array
    cells: NDArray[np.int64]
    part: NDArray[np.int64]
    round: NDArray[np.int64]
    segment: NDArray[np.int64]
    station: Array
    mass: Array
    rounds: tuple[RoundData, ...]
    planes: tuple[SymmetryPlane, ...] = ()
    geometry: str = "3d"

    def __post_init__(self) -> None:
        for name in ARRAYS:
            kind = np.int64 if name in _WHOLE else np.float64
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=kind))
        _check(self)

    @cached_property
    def casing(self) -> NDArray[np.int64]:
        """Indices of the casing's cells."""
        return np.flatnonzero(self.part == CASING)

    @property
    def is_axisymmetric(self) -> bool:
        """Whether cells are quadrilaterals of a meridian."""
        return self.geometry == "axisymmetric"

    @cached_property
    def half_plane(self) -> HalfPlane:
        """The half plane of an axisymmetric burst."""
        data = self.rounds[0]
        return HalfPlane.of(data.position, data.axis, self.reference, f"{self.source}: round {data.name!r}")

    @cached_property
    def ring_shares(self) -> Array:
        """Shares (c, 4) of each casing ring's mass at its nodes, as the axisymmetric burst lumps them."""
        return node_shares(self.half_plane.coordinates(self.reference[self.cells[self.casing]]))

    def casing_means(self, values: Array, cells: NDArray[np.int64]) -> Array:
        """Means by mass (k, 3) of nodal vectors (n, 3) over casing cells, given as indices of `casing`.

        Of a ring it is the mean over its cross-section, which lies in the half plane.
        """
        at_nodes = values[self.cells[self.casing[cells]]]
        if not self.is_axisymmetric:
            return np.asarray(at_nodes.mean(axis=1))
        return np.asarray(np.einsum("ca,caj->cj", self.ring_shares[cells], at_nodes))

    @classmethod
    def read(cls, path: str | Path) -> Snapshot:
        """Read burst_snapshot.h5.

        Raises
        ------
        InputError
            The file is missing, cut off, foreign, of another version or incomplete; the message says which.
        """
        path = Path(path)
        if not path.is_file():
            raise InputError(f"{path}: no such file; the burst stage writes burst_snapshot.h5")
        with reading(path, InputError) as file:
            return _read(file, str(path))


_OF_FORMAT = ("format", "format_version", "time", "geometry")


def _read(file: h5py.Group, source: str) -> Snapshot:
    attributes = {key: text_of(value) for key, value in file.attrs.items()}
    if attributes.get("format") != FORMAT:
        raise InputError(f"{source}: attribute format is {attributes.get('format')!r}, needed {FORMAT!r}")
    if attributes.get("format_version") != str(FORMAT_VERSION):
        found = attributes.get("format_version")
        raise InputError(f"{source}: format_version is {found}, this program reads {FORMAT_VERSION}")
    time, rounds = _number(file, "time", source), group_of(file, "rounds")
    if rounds is None:
        raise InputError(f"{source}: rounds is missing, or no group")
    arrays = {}
    for name, place in ARRAYS.items():
        _child(file, place, source)
        kind = "whole numbers" if name in _WHOLE else "numbers"
        low, high = (0, FUZE) if name == "part" else (None, None)
        arrays[name] = numbers(file, place, InputError, source, kind=kind, minimum=low, maximum=high)
    names = [f"rounds/{index}" for index in range(len(rounds))]
    return Snapshot(
        source=source, time=time,
        provenance={k: v for k, v in attributes.items() if k not in _OF_FORMAT},
        rounds=tuple(_round(_child(file, name, source), f"{source}: {name}") for name in names),
        planes=tuple(_plane(group, f"{source}: planes/{key}") for key, group in file.get("planes", {}).items()),
        geometry=attributes.get("geometry", "3d"), **arrays,
    )  # fmt: skip


def _round(group: h5py.Group, where: str) -> RoundData:
    table = _child(group, "segments", where)[()]
    missing = [name for name in SEGMENT_COLUMNS if name not in (table.dtype.names or ())]
    if missing:
        raise InputError(f"{where}/segments: no column {', '.join(missing)}")
    segments = []
    for row in table:
        name, kind = text_of(row["name"]), text_of(row["kind"])
        if kind not in SEGMENT_KINDS:
            raise InputError(f"{where}/segments: kind is {kind!r}; allowed: {', '.join(SEGMENT_KINDS)}")
        segments.append(SegmentRecord(name, kind, *(float(row[column]) for column in SEGMENT_COLUMNS[2:])))
    values = ("length", "casing_density", "explosive_density", "detonation_velocity")
    return RoundData(
        name=text_of(_attribute(group, "name", where).item()),
        explosive=text_of(_attribute(group, "explosive", where).item()),
        position=_vector(group, "position", where),
        axis=_vector(group, "axis", where),
        **{key: _number(group, key, where) for key in values},
        segments=tuple(segments),
        casing_yield=_number(group, "casing_yield", where) if "casing_yield" in group.attrs else None,
    )


def _plane(group: h5py.Group, where: str) -> SymmetryPlane:
    normal = np.array(_vector(group, "normal", where))
    length = float(np.linalg.norm(normal))
    if not length > 0.0:
        raise InputError(f"{where}: attribute normal is {normal.tolist()}; it has no direction")
    x, y, z = (normal / length).tolist()
    return SymmetryPlane(text_of(_attribute(group, "name", where).item()), _vector(group, "point", where), (x, y, z))


def _vector(group: h5py.Group, key: str, where: str) -> tuple[float, float, float]:
    values = np.asarray(_attribute(group, key, where), dtype=np.float64).ravel().tolist()
    if len(values) != 3 or not np.isfinite(values).all():
        raise InputError(f"{where}: attribute {key} is {values}; three finite numbers are needed")
    return values[0], values[1], values[2]


def _number(group: h5py.Group, key: str, where: str) -> float:
    value = _attribute(group, key, where)
    try:
        return float(value.item())
    except (TypeError, ValueError):
        raise InputError(f"{where}: attribute {key} is {group.attrs[key]!r}; a number is needed") from None


def _attribute(group: h5py.Group, key: str, where: str) -> NDArray[Any]:
    if key not in group.attrs:
        raise InputError(f"{where}: attribute {key} is missing")
    return np.asarray(group.attrs[key])


def _child(group: h5py.Group, path: str, where: str) -> h5py.Group:
    if path not in group:
        raise InputError(f"{where}: {path} is missing")
    return group[path]


def _check(snapshot: Snapshot) -> None:
    where = snapshot.source
    nodes, cells = len(snapshot.reference), len(snapshot.cells)
    if snapshot.geometry not in GEOMETRIES:
        raise InputError(f"{where}: geometry is {snapshot.geometry!r}; allowed: {', '.join(GEOMETRIES)}")
    for name in ARRAYS:
        shape: tuple[int, ...] = (nodes, 3) if name in NODE_ARRAYS else (cells,)
        shape = (cells, GEOMETRIES[snapshot.geometry]) if name == "cells" else shape
        array = getattr(snapshot, name)
        if array.shape != shape:
            raise InputError(f"{where}: {name} has shape {array.shape}, needed {shape}")
        if not np.isfinite(array).all():
            raise InputError(f"{where}: {name} holds a value that is not finite")
    casing = snapshot.part == CASING
    if not casing.any():
        raise InputError(f"{where}: no casing cell (part {CASING}); there is nothing to break up")
    if snapshot.cells.min() < 0 or snapshot.cells.max() >= nodes:
        raise InputError(f"{where}: cells name nodes outside 0..{nodes - 1}")
    if snapshot.round.min() < 0 or snapshot.round.max() >= len(snapshot.rounds):
        raise InputError(f"{where}: cells name rounds outside 0..{len(snapshot.rounds) - 1}")
    if not (snapshot.mass[casing] > 0.0).all():
        first = int(np.flatnonzero(casing & ~(snapshot.mass > 0.0))[0])
        raise InputError(f"{where}: casing cell {first} has the mass {snapshot.mass[first]:g} kg; above zero is needed")
    listed = np.array([len(data.segments) for data in snapshot.rounds])
    segment, of_round = snapshot.segment[casing], snapshot.round[casing]
    if (segment < 0).any() or (segment >= listed[of_round]).any():
        raise InputError(f"{where}: casing cells name segments that /rounds/<i>/segments does not list")
    if snapshot.is_axisymmetric:
        if len(snapshot.rounds) != 1:
            raise InputError(f"{where}: {len(snapshot.rounds)} rounds; an axisymmetric burst has one")
        states = {name: getattr(snapshot, name) for name in NODE_ARRAYS}
        check_meridian(
            where, snapshot.half_plane, states, snapshot.cells, snapshot.mass, casing, snapshot.rounds[0].casing_density
        )
    _check_planes(snapshot)


def _check_planes(snapshot: Snapshot) -> None:
    names = [plane.name for plane in snapshot.planes]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{snapshot.source}: {names.count(name)} planes of symmetry are called {name!r}")
    nodes = snapshot.reference[np.unique(snapshot.cells[snapshot.casing])]
    for plane in snapshot.planes:
        height = (nodes - plane.point) @ plane.normal
        if snapshot.is_axisymmetric:
            # The lowest point of each node's circle around the axis
            half = snapshot.half_plane
            radius = half.coordinates(nodes)[:, 0]
            height -= radius * (half.frame[0] @ plane.normal)
            height -= radius * np.linalg.norm(half.frame[:2] @ plane.normal)
        if height.min() < -_TOUCHING * float(np.ptp(nodes, axis=0).max()):
            raise InputError(
                f"{snapshot.source}: casing nodes stand {-height.min():.3g} m behind the plane of symmetry "
                f"{plane.name!r} before the burst; its normal must point to the rounds, and they must stand clear of it"
            )
