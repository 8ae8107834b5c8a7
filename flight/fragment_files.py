"""fragments.h5 and fragments.csv, written and read."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flight.errors import InputError, nearest
from flight.fragments import ARRAYS, FORMAT_NAME, FORMAT_VERSION, Fragments, check_possible
from flight.hdf5 import open_checked, write_attributes
from flight.text_tables import read_columns, write_columns
from fragfield_base.arrays import group_of, numbers, texts
from fragfield_base.hdf5_files import creating

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["CSV_COLUMNS", "fragment_columns", "read", "write"]

REQUIRED_COLUMNS = ("mass_kg", "vx_m_s", "vy_m_s", "vz_m_s")
CSV_COLUMNS = (
    "id",
    "round",
    "segment",
    "mass_kg",
    "x_m",
    "y_m",
    "z_m",
    "vx_m_s",
    "vy_m_s",
    "vz_m_s",
    "speed_m_s",
    "shape_factor_kg_m3",
)


def write(fragments: Fragments, path: Path, provenance: Mapping[str, str]) -> Path:
    """Write HDF5, or CSV where the name ends so."""
    if path.suffix.lower() == ".csv":
        return write_columns(path, fragment_columns(fragments), provenance)
    import h5py

    with creating(path, InputError) as file:
        write_attributes(file, FORMAT_NAME, FORMAT_VERSION, provenance)
        group = file.create_group("fragments")
        for name in ARRAYS:
            group.create_dataset(name, data=getattr(fragments, name))
        if names := fragments.round_names:
            file.create_dataset("round_names", data=names, dtype=h5py.string_dtype(), shape=(len(names),))
    return path


def read(path: Path) -> Fragments:
    """Read HDF5, or CSV where the name ends so."""
    if path.suffix.lower() == ".csv":
        return _read_csv(path)
    with open_checked(path, FORMAT_NAME, FORMAT_VERSION) as file:
        group = group_of(file, "fragments")
        missing = [f"/fragments/{name}" for name in ARRAYS if group is None or name not in group]
        if missing:
            raise InputError(f"{path}: {', '.join(missing)} missing; the file is cut off or not a fragments file")
        arrays = {name: numbers(group, name, InputError, str(path)) for name in ARRAYS}
        names = texts(file, "round_names", InputError, str(path)) if "round_names" in file else []
    return _named(path, arrays, names)


def _named(path: Path, arrays: dict[str, NDArray[np.float64]], names: Sequence[str] = ()) -> Fragments:
    try:
        found = Fragments.from_arrays(**arrays, round_names=names)
        check_possible(found, "fragments")
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return found


def fragment_columns(fragments: Fragments) -> dict[str, NDArray[np.generic]]:
    """Columns of fragments.csv by their names, which hold the units."""
    columns = [
        np.arange(len(fragments)),
        fragments.round,
        fragments.segment,
        fragments.mass,
        *fragments.position.T,
        *fragments.velocity.T,
        fragments.speed,
        fragments.shape_factor,
    ]
    return dict(zip(CSV_COLUMNS, columns, strict=True))


def _read_csv(path: Path) -> Fragments:
    columns = read_columns(path)
    for name in columns:
        if name not in CSV_COLUMNS:
            raise InputError(f"{path}: unknown column {name!r}{nearest(name, CSV_COLUMNS)}")
    missing = [name for name in REQUIRED_COLUMNS if name not in columns]
    if missing:
        raise InputError(f"{path}: column {', '.join(missing)} missing; found {', '.join(columns)}")
    zero = np.zeros_like(columns["mass_kg"])
    arrays = {
        "mass": columns["mass_kg"],
        "position": np.stack([columns.get(name, zero) for name in ("x_m", "y_m", "z_m")], axis=1),
        "velocity": np.stack([columns[name] for name in ("vx_m_s", "vy_m_s", "vz_m_s")], axis=1),
    }
    for name, column in (("shape_factor", "shape_factor_kg_m3"), ("round", "round"), ("segment", "segment")):
        if column in columns:
            arrays[name] = columns[column]
    return _named(path, arrays)
