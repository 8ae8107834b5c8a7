"""Tables of a run as pandas frames, and all of them in one workbook (XLSX).

They are those of the CSV files, with the same columns, but from the HDF5 files: no digit is lost. Where the case has a
site, the bearing stands beside every azimuth.
"""

from __future__ import annotations

import datetime as dt
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError, nearest
from fragfield.files.provenance import describe
from fragfield.quantities import QUANTITIES
from fragfield_base.writing import harmless, replacing

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from numpy.typing import NDArray
    from pandas import DataFrame

    from fragfield.results.run import StoredRun
    from fragfield.results.summary import Summary


_UNITS = {"kg": "kg", "m": "m", "m_s": "m/s", "s": "s", "J": "J", "deg": "degrees", "1_m2": "1/m2", "kg_m3": "kg/m3"}
"""What names of columns end with, and the unit."""


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


_STAMPED = ("landing.h5", "fragments.h5", "burst_snapshot.h5")  # of one run; the latest stage's is taken
_MOST_ROWS = 1_048_576 - 1  # of a sheet, below the names


def write_workbook(
    path: Path, run_directory: Path, title: str, summary: Summary, tables: Mapping[str, DataFrame]
) -> Path:
    """Write every table of a run (by its name) as a sheet of one workbook, after what they are; returns its path.

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
    results = [row for row in rows if isinstance(row[1], str | int | float)]
    sheets = {
        "about": DataFrame(_about(run_directory, title, tables), columns=list("abcd")),
        "summary": DataFrame(results, columns=["key", "value", "unit", "meaning"], dtype=object),
        **{name: table.head(_MOST_ROWS) for name, table in tables.items()},
    }
    with replacing(path, InputError) as file, ExcelWriter(file, engine="openpyxl") as book:
        for name, sheet in sheets.items():
            texts = {key: column.map(_harmless) for key, column in sheet.items() if column.dtype.kind not in "iufb"}
            head = name != "about"
            sheet.assign(**texts).to_excel(book, sheet_name=name, index=False, header=head, freeze_panes=(int(head), 0))
    return path


def _harmless(value: object) -> object:
    return harmless(value) if isinstance(value, str) else value


def _about(run_directory: Path, title: str, tables: Mapping[str, DataFrame]) -> Iterator[list[Any]]:
    """What the workbook is, its sheets, units, and the provenance of the run."""
    yield [title]
    yield ["directory", str(run_directory)]
    yield ["written", dt.datetime.now(dt.UTC).isoformat(timespec="seconds")]
    yield []
    yield ["sheet", "what it holds", "rows", "units in the names of its columns"]
    yield ["summary", "results in numbers, as in summary.json", "", "column unit"]
    for name, table in tables.items():
        ends = [unit for unit in _UNITS if any(one.endswith(f"_{unit}") for one in table.columns)]
        cut = f" (the first {_MOST_ROWS} rows; all are in {name}.csv)" if len(table) > _MOST_ROWS else ""
        legend = ", ".join(f"_{unit} in {_UNITS[unit]}" for unit in ends)
        yield [name, TABLES[name][1] + cut, len(table), legend or "pure numbers, or SI"]
    yield []
    yield ["of the run", ""]
    file = next(name for name in _STAMPED if (run_directory / name).is_file())
    stamp = dict(describe(run_directory / file)["attributes"])
    case = str(stamp.pop("case", ""))
    for key, value in stamp.items():
        yield [key, str(value)]
    yield []
    yield ["case", ""]
    for line in case.splitlines():
        yield ["", line]
