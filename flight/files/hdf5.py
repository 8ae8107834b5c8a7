"""Opening HDF5 files and writing their attributes, with messages that say what to do."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from flight.errors import InputError
from fragfield_base.arrays import number_of, text_of
from fragfield_base.hdf5_files import reading

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    import h5py

__all__ = ["open_checked", "write_attributes"]


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
