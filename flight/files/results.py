"""The files of a flight: landing.h5, hits.h5 and others, their CSV copies, and trajectories for ParaView."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
from flight.files.hdf5 import open_checked, write_attributes
from flight.files.text_tables import Labels
from flight.integrate.contact import CONTACTS
from flight.rows import HITS, LANDING, OBSTACLE_HITS, flat_columns
from fragfield_base.hdf5_files import creating
from fragfield_base.writing import write_text
from fragfield_base.xdmf import quoted

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from flight.rows import Trajectories

__all__ = [
    "named_columns", "read_contacts", "read_hits", "read_landing", "read_obstacle_hits", "write_contacts", "write_hits",
    "write_landing", "write_obstacle_hits", "write_trajectories",
]  # fmt: skip

FORMAT_VERSION = 1
LANDING_FORMAT, HITS_FORMAT, PATHS_FORMAT = "fragfield landing", "fragfield hits", "fragfield trajectories"
OBSTACLE_HITS_FORMAT, CONTACTS_FORMAT = "fragfield obstacle hits", "fragfield contacts"
# fields that older files lack, and the one whose value they had; -1 or 0 where that is a number
_LATER = {
    "ricochets": 0,
    "last_status": "status",
    "obstacle": -1,
    "face": -1,
    "last_time": "time",
    "last_position": "position",
    "last_distance": "distance",
    "last_azimuth": "azimuth",
}
ROWS_AT_ONCE = 1 << 16  # of a column, which is not contiguous in the table: the copy stays below 2 MB
POLYLINE = 2  # XDMF's number of the cell type in a mixed topology


def named_columns(hits: NDArray[Any], what: str, names: Sequence[str]) -> dict[str, NDArray[Any] | Labels]:
    """Columns of a table of hits, first the name of what was hit: of the "witness" or "obstacle" of every row."""
    return {"name": Labels(names, hits[what]), **flat_columns(hits)}


def write_landing(landing: NDArray[Any], path: str | Path, provenance: Mapping[str, str] | None = None) -> Path:
    """Write landing.h5: one dataset a field of `LANDING` under /landing."""
    return _write_table(landing, Path(path), "landing", LANDING_FORMAT, provenance or {}, {})


def write_hits(
    hits: NDArray[Any], witnesses: list[str], path: str | Path, provenance: Mapping[str, str] | None = None
) -> Path:
    """Write hits.h5: one dataset a field of `HITS` under /hits, and the names of the surfaces in /witnesses."""
    return _write_table(hits, Path(path), "hits", HITS_FORMAT, provenance or {}, {"witnesses": witnesses})


def write_obstacle_hits(
    hits: NDArray[Any], obstacles: list[str], path: str | Path, provenance: Mapping[str, str] | None = None
) -> Path:
    """Write obstacle_hits.h5: one dataset a field of `OBSTACLE_HITS` under /obstacle_hits, names in /obstacles."""
    names = {"obstacles": obstacles}
    return _write_table(hits, Path(path), "obstacle_hits", OBSTACLE_HITS_FORMAT, provenance or {}, names)


def read_obstacle_hits(path: str | Path) -> tuple[NDArray[Any], list[str]]:
    """Read obstacle_hits.h5 back as a structured array of dtype `OBSTACLE_HITS` and the names of the obstacles."""
    return _read_table(Path(path), "obstacle_hits", OBSTACLE_HITS_FORMAT, OBSTACLE_HITS)


def write_contacts(contacts: NDArray[Any], path: str | Path, provenance: Mapping[str, str] | None = None) -> Path:
    """Write contacts.h5: one dataset a field of `CONTACTS` under /contacts."""
    return _write_table(contacts, Path(path), "contacts", CONTACTS_FORMAT, provenance or {}, {})


def read_contacts(path: str | Path) -> NDArray[Any]:
    """Read contacts.h5 back as a structured array of dtype `CONTACTS`."""
    return _read_table(Path(path), "contacts", CONTACTS_FORMAT, CONTACTS)[0]


def read_landing(path: str | Path) -> NDArray[Any]:
    """Read landing.h5 back as a structured array of dtype `LANDING`."""
    return _read_table(Path(path), "landing", LANDING_FORMAT, LANDING)[0]


def read_hits(path: str | Path) -> tuple[NDArray[Any], list[str]]:
    """Read hits.h5 back as a structured array of dtype `HITS` and the names of the surfaces."""
    return _read_table(Path(path), "hits", HITS_FORMAT, HITS)


def _write_table(
    table: NDArray[Any],
    path: Path,
    group: str,
    name: str,
    provenance: Mapping[str, str],
    texts: Mapping[str, list[str]],
) -> Path:
    import h5py

    with creating(path, InputError) as file:
        write_attributes(file, name, FORMAT_VERSION, provenance)
        columns = file.create_group(group)
        for field in table.dtype.names or ():
            column = table[field]
            data = columns.create_dataset(field, shape=column.shape, dtype=column.dtype)
            for start in range(0, len(column), ROWS_AT_ONCE):
                data[start : start + ROWS_AT_ONCE] = column[start : start + ROWS_AT_ONCE]
        for key, lines in texts.items():
            file.create_dataset(key, data=lines, dtype=h5py.string_dtype(), shape=(len(lines),))
    return path


def _read_table(path: Path, group: str, name: str, dtype: np.dtype[Any]) -> tuple[NDArray[Any], list[str]]:
    with open_checked(path, name, FORMAT_VERSION) as file:
        later = {field: value for field, value in _LATER.items() if dtype is LANDING and f"{group}/{field}" not in file}
        missing = [field for field in dtype.names or () if f"{group}/{field}" not in file and field not in later]
        if missing:
            raise InputError(f"{path}: /{group}/{', '.join(missing)} missing; the file is cut off")
        table = np.zeros(len(file[f"{group}/{(dtype.names or ('',))[0]}"]), dtype=dtype)
        try:
            for field in dtype.names or ():
                value = later.get(field)
                source = value if isinstance(value, str) else field
                table[field] = value if isinstance(value, int) else file[f"{group}/{source}"][...]
            names = []
            for key in ("witnesses", "obstacles"):
                names += [str(text) for text in file[key].asstr()[...]] if key in file else []
        except (OSError, ValueError) as error:
            raise InputError(f"{path}: data cut off or damaged ({error})") from None
    return table, names


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
