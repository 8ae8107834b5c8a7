"""Trajectories of a flight as files for ParaView, and the columns of its CSV tables of hits."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
from flight.files.hdf5 import write_attributes
from flight.files.text_tables import Labels
from flight.rows import Status, flat_columns
from fragfield_base.hdf5_files import creating
from fragfield_base.writing import write_text
from fragfield_base.xdmf import quoted

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from flight.rows import Trajectories


FORMAT_VERSION = 1
PATHS_FORMAT = "fragfield trajectories"
POLYLINE = 2  # XDMF's number of the cell type in a mixed topology


_UNITS = {
    "mass": "kg", "time": "s", "position": "m", "velocity": "m_s", "speed": "m_s", "energy": "J", "distance": "m",
    "azimuth": "deg", "elevation": "deg", "angle": "deg", "before": "m_s", "after": "m_s", "lost": "J",
}  # fmt: skip
"""Unit in the name of a column, by the last word of the field."""
_WORDS = {
    "status": {one.value: one.name.lower().replace("_", " ") for one in Status},
    "direction": {1: "outward or along the normal", -1: "inward or against the normal"},
}
"""Codes in words, by the last word of the field; their column follows that of the code."""


def csv_columns(
    table: NDArray[Any], what: str = "", names: Sequence[str] = (), faces: Labels | None = None
) -> dict[str, NDArray[Any] | Labels]:
    """Columns of a table of a flight, units in their names, codes followed by a column of words.

    Of hits, `what` is "witness" or "obstacle", the field that counts what was hit: its name, of `names`, becomes the
    first column; `faces`, the name of the face that each row hit, the second.
    """
    columns: dict[str, NDArray[Any] | Labels] = {"name": Labels(names, table[what])} if what else {}
    if faces is not None:
        columns["face_name"] = faces
    for field in table.dtype.names or ():
        kind = field.rpartition("_")[2]
        unit = f"_{_UNITS[kind]}" if kind in _UNITS else ""
        columns |= {f"{name}{unit}": values for name, values in flat_columns(table[[field]]).items()}
        if kind in _WORDS:
            codes = list(_WORDS[kind])
            which = np.searchsorted(np.sort(codes), table[field])
            columns[f"{field}_text"] = Labels([_WORDS[kind][code] for code in sorted(codes)], which)
    return columns


def write_trajectories(
    paths: Trajectories, landing: NDArray[Any], path: str | Path, provenance: Mapping[str, str] | None = None
) -> list[Path]:
    """Write polylines as XDMF with the arrays in an HDF5 file beside it, as VTK and ParaView open them.

    At the points: time (s), velocity (m/s), speed (m/s); on the lines: fragment, mass (kg), initial_speed (m/s),
    status.
    """
    path = Path(path)
    data = path.with_suffix(".h5")
    lengths = np.diff(paths.start)
    topology = np.empty(len(paths.time) + 2 * len(paths), dtype=np.int64)
    place = paths.start[:-1] + 2 * np.arange(len(paths))
    topology[place], topology[place + 1] = POLYLINE, lengths
    inside = np.ones(topology.size, dtype=bool)
    inside[place] = inside[place + 1] = False
    topology[inside] = np.arange(len(paths.time))
    rows = landing[paths.fragment]
    at_points = {"time": paths.time, "velocity": paths.velocity, "speed": np.linalg.norm(paths.velocity, axis=1)}
    on_lines = {name: np.ascontiguousarray(rows[name]) for name in ("fragment", "mass", "initial_speed", "round")}
    on_lines["status"] = rows["status"].astype(np.int32)
    with creating(data, InputError) as file:
        write_attributes(file, PATHS_FORMAT, FORMAT_VERSION, provenance or {})
        for name, array in {"topology": topology, "position": paths.position, **at_points, **on_lines}.items():
            file.create_dataset(name, data=array)
    write_text(path, _xdmf(data.name, topology, paths, at_points, on_lines, provenance or {}), InputError)
    return [path, data]


def _xdmf(
    data: str, topology: NDArray[Any], paths: Trajectories, at_points: Mapping[str, NDArray[Any]],
    on_lines: Mapping[str, NDArray[Any]], provenance: Mapping[str, str],
) -> str:  # fmt: skip
    def item(name: str, array: NDArray[Any]) -> str:
        kind = "Float" if array.dtype.kind == "f" else "Int"
        shape = " ".join(str(n) for n in array.shape)
        return (
            f'<DataItem Dimensions="{shape}" NumberType="{kind}" Precision="{array.dtype.itemsize}" Format="HDF">'
            f"{data}:/{name}</DataItem>"
        )

    def attribute(name: str, array: NDArray[Any], centre: str) -> str:
        kind = "Vector" if array.ndim == 2 else "Scalar"
        return f'<Attribute Name="{name}" AttributeType="{kind}" Center="{centre}">{item(name, array)}</Attribute>'

    lines = ['<?xml version="1.0" encoding="utf-8"?>', '<Xdmf Version="3.0">', "<Domain>", '<Grid Name="trajectories">']
    lines.append('<Time Value="0"/>')  # VTK needs one
    lines += [f"<Information Name={quoted(key)} Value={quoted(str(text))}/>" for key, text in provenance.items()]
    lines.append(
        f'<Topology TopologyType="Mixed" NumberOfElements="{len(paths)}">{item("topology", topology)}</Topology>'
    )
    lines.append(f'<Geometry GeometryType="XYZ">{item("position", paths.position)}</Geometry>')
    lines += [attribute(name, array, "Node") for name, array in at_points.items()]
    lines += [attribute(name, array, "Cell") for name, array in on_lines.items()]
    return "\n".join([*lines, "</Grid>", "</Domain>", "</Xdmf>", ""])
