"""Tables and paths of a flight as files: HDF5, columns of CSV tables, XDMF for ParaView."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
from flight.files.text_tables import Labels
from flight.rows import CONTACTS, HITS, LANDING, OBSTACLE_HITS, Status, flat_columns
from fragfield_base.arrays import number_of, text_of, texts
from fragfield_base.hdf5_files import creating, reading
from fragfield_base.writing import write_text
from fragfield_base.xdmf import quoted

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    import h5py
    from numpy.typing import NDArray

    from flight.rows import Trajectories


TABLES = {
    "landing": (LANDING, ""),
    "hits": (HITS, "witnesses"),
    "obstacle_hits": (OBSTACLE_HITS, "obstacles"),
    "contacts": (CONTACTS, ""),
}
"""Rows of each table of a flight, and the dataset of the names that its rows refer to by number."""
TABLE_VERSION = 2


def write_table(
    table: NDArray[Any], path: Path, kind: str, names: Sequence[str] = (), provenance: Mapping[str, str] | None = None
) -> Path:
    """Write a table of `TABLES` as a dataset of its rows under its name, and the names."""
    with creating(path, InputError) as file:
        write_attributes(file, _format(kind), TABLE_VERSION, provenance or {})
        file.create_dataset(kind, data=table)
        if TABLES[kind][1]:
            put_texts(file, TABLES[kind][1], names)
    return path


def read_table(path: str | Path, kind: str) -> tuple[NDArray[Any], list[str]]:
    """Read a table of `TABLES` back, with the names that its rows refer to.

    Raises InputError: no such file, another table, or data cut off.
    """
    path, (dtype, names) = Path(path), TABLES[kind]
    with open_checked(path, _format(kind), TABLE_VERSION) as file:
        if getattr(file.get(kind), "dtype", None) != dtype:
            raise InputError(f"{path}: /{kind} does not hold the rows of this table; fly the fragments again")
        return file[kind][...], texts(file, names, InputError, str(path)) if names else []


def _format(kind: str) -> str:
    return f"fragfield {kind.replace('_', ' ')}"


def put(file: h5py.File | h5py.Group, name: str, values: NDArray[Any]) -> None:
    """Write an array, packed where it has several axes."""
    options = {"compression": "gzip", "compression_opts": 4} if values.ndim > 1 and values.size else {}
    file.create_dataset(name, data=values, **options)


def put_texts(file: h5py.File, name: str, texts: Sequence[str]) -> None:
    """Write a list of texts."""
    import h5py

    file.create_dataset(name, data=list(texts), dtype=h5py.string_dtype(), shape=(len(texts),))


def write_attributes(file: h5py.File, name: str, version: int, provenance: Mapping[str, str]) -> None:
    """Stamp the format's name and version and every provenance entry on the root of an open file."""
    for key, text in provenance.items():
        file.attrs[key] = str(text)
    file.attrs["format"] = name
    file.attrs["format_version"] = version


@contextmanager
def open_checked(path: Path, name: str, version: int, advice: str = "") -> Iterator[h5py.File]:
    """Open a file of a known format for reading, or raise InputError saying what it is instead.

    Faults that h5py meets within the block end in one message too, with `advice` behind it.
    """
    with reading(path, InputError, advice) as file:
        found = file.attrs.get("format")
        found = None if found is None else text_of(found)
        if found != name:
            raise InputError(f"{path}: attribute format is {found!r}, needed {name!r}")
        if number_of(file.attrs.get("format_version")) != version:
            raise InputError(
                f"{path}: format_version is {file.attrs.get('format_version')}, this program reads {version}"
            )
        yield file


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
