"""Reading and writing fragments.h5 and fragments.csv."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
from flight.files.hdf5 import open_checked, put_texts, write_attributes
from flight.files.text_tables import import_hint, in_columns_of, read_columns, write_columns
from fragfield_base.arrays import group_of, numbers, texts
from fragfield_base.errors import names_allowed, nearest_name
from fragfield_base.hdf5_files import creating

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray


FORMAT_NAME = "fragfield fragments"
FORMAT_VERSION = 1
ARRAYS = ("mass", "position", "velocity", "shape_factor", "round", "segment")

REQUIRED_COLUMNS = ("mass_kg", "vx_m_s", "vy_m_s", "vz_m_s")
CSV_COLUMNS = (
    "id", "round", "segment", "mass_kg", "x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s", "speed_m_s",
    "shape_factor_kg_m3",
)  # fmt: skip


def write(
    arrays: Mapping[str, NDArray[Any]], round_names: Sequence[str], path: Path, provenance: Mapping[str, str]
) -> Path:
    """Write the `ARRAYS` of fragments as HDF5, or as CSV where the name ends so."""
    if path.suffix.lower() == ".csv":
        return write_columns(path, fragment_columns(arrays))
    with creating(path, InputError) as file:
        write_attributes(file, FORMAT_NAME, FORMAT_VERSION, provenance)
        group = file.create_group("fragments")
        for name in ARRAYS:
            group.create_dataset(name, data=arrays[name])
        if round_names:
            put_texts(file, "round_names", round_names)
    return path


def read(path: Path) -> tuple[dict[str, NDArray[np.float64]], list[str]]:
    """Arrays by name and the rounds' names from HDF5, or from CSV where the name ends so; not yet checked as fragments.

    A CSV file need not have all `ARRAYS`.
    """
    if path.suffix.lower() == ".csv":
        return _read_csv(path), []
    if path.suffix.lower() not in (".h5", ".hdf5") and path.is_file() and not _is_hdf5(path):
        raise InputError(f"{path}: neither fragments in HDF5 (.h5) nor a .csv file{import_hint(path)}")
    with open_checked(path, FORMAT_NAME, FORMAT_VERSION) as file:
        group = group_of(file, "fragments")
        missing = [f"/fragments/{name}" for name in ARRAYS if group is None or name not in group]
        if missing:
            raise InputError(f"{path}: {', '.join(missing)} missing; the file is cut off or not a fragments file")
        arrays = {name: numbers(group, name, InputError, str(path)) for name in ARRAYS}
        names = texts(file, "round_names", InputError, str(path)) if "round_names" in file else []
    return arrays, names


def _is_hdf5(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(8) == b"\x89HDF\r\n\x1a\n"


def fragment_columns(arrays: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Columns of fragments.csv by their names, which hold the units, from the `ARRAYS` of fragments."""
    velocity = arrays["velocity"]
    columns = [
        np.arange(len(arrays["mass"])),
        arrays["round"],
        arrays["segment"],
        arrays["mass"],
        *arrays["position"].T,
        *velocity.T,
        np.sqrt(np.einsum("ij,ij->i", velocity, velocity)),
        arrays["shape_factor"],
    ]
    return dict(zip(CSV_COLUMNS, columns, strict=True))


def _read_csv(path: Path) -> dict[str, NDArray[np.float64]]:
    columns = in_columns_of(path, read_columns(path), CSV_COLUMNS)
    missing = [name for name in REQUIRED_COLUMNS if name not in columns]
    if len(missing) == len(REQUIRED_COLUMNS) and not any(nearest_name(name, REQUIRED_COLUMNS) for name in columns):
        raise InputError(
            f"{path}: found the columns {', '.join(columns)}; needed: of fragments one by one "
            f"{', '.join(REQUIRED_COLUMNS)}, of an arena table zone_from_deg, zone_to_deg and others"
            f"{import_hint(path)}"
        )
    for name in columns:
        if name not in CSV_COLUMNS:
            raise InputError(f"{path}: unknown column {name!r}{names_allowed(name, CSV_COLUMNS)}")
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
    return arrays
