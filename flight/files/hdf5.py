"""Tables of a flight in HDF5 files, one dataset a field; opening them with messages that say what to do."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
from flight.rows import CONTACTS, HITS, LANDING, OBSTACLE_HITS
from fragfield_base.arrays import number_of, text_of, texts
from fragfield_base.hdf5_files import creating, reading

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    import h5py
    from numpy.typing import NDArray


TABLES = {
    "landing": (LANDING, ""),
    "hits": (HITS, "witnesses"),
    "obstacle_hits": (OBSTACLE_HITS, "obstacles"),
    "contacts": (CONTACTS, ""),
}
"""Rows of each table of a flight, and the dataset of the names that its rows refer to by number."""
TABLE_VERSION = 1
ROWS_AT_ONCE = 1 << 16  # of a column, which is not contiguous in the table: the copy stays below 2 MB


def write_table(
    table: NDArray[Any], path: Path, kind: str, names: Sequence[str] = (), provenance: Mapping[str, str] | None = None
) -> Path:
    """Write a table of `TABLES`: one dataset a field under a group of its name, and the names."""
    with creating(path, InputError) as file:
        write_attributes(file, _format(kind), TABLE_VERSION, provenance or {})
        columns = file.create_group(kind)
        for field in table.dtype.names or ():
            column = table[field]
            data = columns.create_dataset(field, shape=column.shape, dtype=column.dtype)
            for start in range(0, len(column), ROWS_AT_ONCE):
                data[start : start + ROWS_AT_ONCE] = column[start : start + ROWS_AT_ONCE]
        if TABLES[kind][1]:
            put_texts(file, TABLES[kind][1], names)
    return path


def read_table(path: str | Path, kind: str) -> tuple[NDArray[Any], list[str]]:
    """Read a table of `TABLES` back, with the names that its rows refer to.

    Raises InputError: no such file, another table, or data cut off.
    """
    path, (dtype, names) = Path(path), TABLES[kind]
    fields = dtype.names or ()
    with open_checked(path, _format(kind), TABLE_VERSION) as file:
        missing = [field for field in fields if f"{kind}/{field}" not in file]
        if missing:
            raise InputError(f"{path}: /{kind}/{', '.join(missing)} missing; the file is cut off")
        table = np.zeros(len(file[f"{kind}/{fields[0]}"]), dtype=dtype)
        for field in fields:
            table[field] = file[f"{kind}/{field}"][...]
        return table, texts(file, names, InputError, str(path)) if names else []


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
