"""The snapshot handed to the break-up: nodes, cells, rounds, segments and history in one HDF5 file.

Cells and nodes stand in the order of the mesh that was given, whatever the number of ranks.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.errors import InputError
from fragfield_base.burst_snapshot import (
    ALONG,
    ALONG_COLUMNS,
    FORMAT,
    FORMAT_VERSION,
    ROUND_ATTRIBUTES,
    SEGMENT_COLUMNS,
    SEGMENTS,
)
from fragfield_base.hdf5_files import creating

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    import h5py

    from burst_fenicsx.problem import Mirror
    from burst_fenicsx.records.measures import RoundMeasures
    from fragfield_base.burst_snapshot import SegmentRecord


@dataclass(frozen=True)
class RoundRecord:
    """A round: what the break-up needs of it, in SI units."""

    name: str
    length: float
    casing_density: float
    casing_yield: float
    casing_mass: float
    charge_mass: float
    fuze_mass: float
    explosive: str
    explosive_density: float
    detonation_velocity: float
    gurney_velocity: float
    position: tuple[float, ...]
    axis: tuple[float, ...]
    segments: tuple[SegmentRecord, ...]


@dataclass(frozen=True, eq=False)
class EndState:
    """The end of a burst, as its snapshot holds it.

    Attributes
    ----------
    time : s.
    nodes, cells, history : arrays by name. Cells are hexahedra (m, 8), or of an axisymmetric burst quadrilaterals
        (m, 4) of one round's half plane, with the masses of whole rings.
    rounds, along : of every round.
    planes : behind which mirrored rounds stand, for the break-up to add.
    geometry : "3d" or "axisymmetric".
    """

    time: float
    nodes: Mapping[str, np.ndarray]
    cells: Mapping[str, np.ndarray]
    rounds: Sequence[RoundRecord]
    along: Sequence[RoundMeasures]
    history: Mapping[str, np.ndarray]
    planes: Sequence[Mirror] = ()
    geometry: str = "3d"


def write_snapshot(path: Path, end: EndState, provenance: Mapping[str, str]) -> None:
    """Write the snapshot; an older one of the same name is replaced only when the new one is whole.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    with creating(path, InputError) as file:
        file.attrs["format"] = FORMAT
        file.attrs["format_version"] = FORMAT_VERSION
        file.attrs["time"] = end.time
        file.attrs["geometry"] = end.geometry
        for key, text in provenance.items():
            file.attrs[key] = text
        for folder in ("nodes", "cells", "history"):
            for name, values in getattr(end, folder).items():
                file[f"{folder}/{name}"] = values
        for index, (record, measure) in enumerate(zip(end.rounds, end.along, strict=True)):
            _write_round(file.create_group(f"rounds/{index}"), record, measure)
        for index, plane in enumerate(end.planes):
            group = file.create_group(f"planes/{index}")
            for name in ("name", "point", "normal"):
                group.attrs[name] = getattr(plane, name)


def _write_round(group: h5py.Group, record: RoundRecord, measure: RoundMeasures) -> None:
    for name in ROUND_ATTRIBUTES:
        group.attrs[name] = getattr(record, name)
    table = np.zeros(len(record.segments), dtype=SEGMENTS)
    for row, segment in enumerate(record.segments):
        for name in SEGMENT_COLUMNS:
            table[name][row] = getattr(segment, name)
    group["segments"] = table
    along = np.zeros(len(measure.station), dtype=ALONG)
    for name in ALONG_COLUMNS:
        along[name] = getattr(measure, name)
    group["along"] = along
