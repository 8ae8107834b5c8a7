"""Tables of a run as pandas frames, and all of them with the results in numbers in one workbook (XLSX).

They are those of the CSV files, with the same columns, but from the HDF5 files: no digit is lost. Where the case has a
site, the bearing stands beside every azimuth.
"""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError, nearest
from fragfield.quantities import QUANTITIES
from fragfield_base.writing import harmless, replacing

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray
    from pandas import DataFrame

    from fragfield.results.run import StoredRun
    from fragfield.results.summary import Summary


_SINGLE = "first realisation"
TABLES = {
    "history": ("burst_snapshot.h5", "energies, speed and diameter of the casings over time"),
    "along": ("burst_snapshot.h5", "casing along each round, by axial station"),
    "fragments": ("fragments.h5", "fragments of the first realisation at launch"),
    "arena": ("arena.csv", "fragments of one round by polar zone and mass group"),
    "landing": ("landing.h5", f"end of every fragment's flight, {_SINGLE}"),
    "witness": ("hits.h5", f"crossings of witness surfaces, {_SINGLE}"),
    "obstacle_hits": ("obstacle_hits.h5", f"impacts on obstacles, {_SINGLE}"),
    "contacts": ("contacts.h5", f"contacts between fragments, {_SINGLE}"),
    "ensemble": ("ensemble.h5", "distance, throw and numbers of every realisation alone"),
    "hazard_by_distance": ("ensemble.h5", "expected density and probability of a hit by distance"),
    "hazard_by_sector": ("ensemble.h5", "distances, throws and numbers by azimuth"),
}
"""By name: the file of the run that holds it, and what it is."""


def read_table(run: StoredRun, name: str) -> DataFrame:
    """A table of a run; raises InputError for another name, or where the run lacks its file."""
    if name not in TABLES:
        raise InputError(f"table: found {name!r}{nearest(str(name), TABLES)}; allowed: {', '.join(TABLES)}")
    file, what = TABLES[name]
    if not (run.path / file).is_file():
        raise InputError(f"{run.path / file}: no such file, which holds the table {name} ({what})")
    from pandas import DataFrame

    from fragfield.case.conversion.surroundings import site_of

    site = None if run.values is None else site_of(run.values)
    columns: dict[str, NDArray[Any]] = {}
    for key, column in _columns(run, name).items():
        columns[key] = values = _values(column)
        if site is not None and key in ("azimuth", "azimuth_deg"):
            columns[key.replace("azimuth", "bearing")] = site.bearing_of(values)
    return DataFrame(columns)


def _columns(run: StoredRun, name: str) -> Mapping[str, Any]:
    from flight.files.ensemble import ensemble_columns
    from flight.files.hdf5 import csv_columns
    from flight.files.hdf5 import read_table as read_rows
    from flight.files.text_tables import read_columns
    from flight.fragments import ARRAYS, fragment_columns

    if name == "history":
        return run.history
    if name == "along":
        joined = np.concatenate([one.along for one in run.rounds])
        rounds = np.concatenate([np.full(len(one.along), one.name) for one in run.rounds])
        return {"round": rounds, **{key: joined[key] for key in joined.dtype.names}}
    if name == "fragments":
        return fragment_columns({key: getattr(run.fragments, key) for key in ARRAYS})
    if name == "arena":
        return read_columns(run.path / "arena.csv")
    if run.ensemble is not None and TABLES[name][0] == "ensemble.h5":
        return ensemble_columns(run.ensemble)[f"{name}.csv"]
    file = run.path / TABLES[name][0]
    rows, names = read_rows(file, file.stem)
    return csv_columns(rows, {"witness": "witness", "obstacle_hits": "obstacle"}.get(name, ""), names)


def _values(column: Any) -> NDArray[Any]:  # noqa: ANN401 - an array, or labels
    from flight.files.text_tables import Labels

    if isinstance(column, Labels):
        return np.array(list(column.texts), dtype=str)[column.which] if len(column) else np.zeros(0, dtype="U1")
    return np.ascontiguousarray(column)


_MOST_ROWS = 1_048_576 - 1  # of a sheet, below the names


def write_workbook(
    path: Path, run_directory: Path, title: str, summary: Summary, tables: Mapping[str, DataFrame]
) -> Path:
    """Write every table of a run (by its name) as a sheet of one workbook, after the results; returns its path.

    Raises InputError: another ending than .xlsx, openpyxl is not installed, or the file cannot be written.
    """
    if path.suffix.lower() != ".xlsx":
        raise InputError(f"{path}: tables are written as .xlsx; name it so")
    if find_spec("openpyxl") is None:
        raise InputError(f"{path}: XLSX needs openpyxl, which is not installed: pip install fragfield[tables]")
    if not tables:
        raise InputError(f"{run_directory}: holds no table yet; run a stage first")
    from pandas import DataFrame, ExcelWriter

    listed = (one for one in QUANTITIES.values() if "[]" not in one.path and not one.path.startswith("case"))
    rows = [(one.path, one.of(summary), one.unit, one.label) for one in listed]
    results = [("title", title, "", str(run_directory))]
    results += [row for row in rows if row[0] != "title" and isinstance(row[1], str | int | float)]
    sheets = {
        "summary": DataFrame(results, columns=["key", "value", "unit", "meaning"], dtype=object),
        **{name: table.head(_MOST_ROWS) for name, table in tables.items()},
    }
    with replacing(path, InputError) as file, ExcelWriter(file, engine="openpyxl") as book:
        for name, sheet in sheets.items():
            texts = {
                key: column.map(lambda value: harmless(value) if isinstance(value, str) else value)
                for key, column in sheet.items()
                if column.dtype.kind not in "iufb"
            }
            sheet.assign(**texts).to_excel(book, sheet_name=name, index=False, freeze_panes=(1, 0))
    return path
