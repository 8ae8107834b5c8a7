"""All tables of a run in one workbook (XLSX), with a first sheet that says what each is and where it comes from."""

from __future__ import annotations

import datetime as dt
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError
from fragfield.files.info import describe
from fragfield.quantities import QUANTITIES
from fragfield_base.writing import harmless, replacing

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from fragfield.interface.tables import Table

__all__ = ["write_workbook"]

_STAMPED = ("landing.h5", "fragments.h5", "burst_snapshot.h5")  # of one run; the latest stage's is taken
_MOST_ROWS = 1_048_576 - 1  # of a sheet, below the names
_UNITS = {"kg": "kg", "m": "m", "m_s": "m/s", "s": "s", "J": "J", "deg": "degrees", "1_m2": "1/m2", "kg_m3": "kg/m3"}


def write_workbook(
    path: Path, run_directory: Path, title: str, summary: Mapping[str, Any], tables: Mapping[str, Table]
) -> Path:
    """Write every table of a run as a sheet of one workbook; returns its path.

    Parameters
    ----------
    path : Path
        The workbook.
    run_directory : Path
        The run's, whose files have its provenance.
    title : str
        Of its case.
    summary : mapping
        Its summary.json.
    tables : mapping
        Its tables by name.

    Raises
    ------
    InputError
        Another ending than .xlsx, openpyxl is not installed, or the file cannot be written.
    """
    if path.suffix.lower() != ".xlsx":
        raise InputError(f"{path}: tables are written as .xlsx; name it so")
    try:
        from openpyxl import Workbook
    except ModuleNotFoundError:
        raise InputError(
            f"{path}: XLSX needs openpyxl, which is not installed: pip install fragfield[tables]"
        ) from None
    book = Workbook(write_only=True)
    front = book.create_sheet("about")
    front.column_dimensions["A"].width, front.column_dimensions["B"].width = 24, 90
    if not tables:
        raise InputError(f"{run_directory}: holds no table yet; run a stage first")
    for row in _about(run_directory, title, tables):
        front.append(row)
    results = book.create_sheet("summary")
    for row in _summary_rows(summary):
        results.append(row)
    for name, table in tables.items():
        sheet = book.create_sheet(name)
        sheet.freeze_panes = "A2"
        sheet.append(list(table.columns))
        for row in _rows(table):
            sheet.append(row)
    with replacing(path, InputError) as file:
        book.save(file)
    return path


def _about(run_directory: Path, title: str, tables: Mapping[str, Table]) -> Iterator[list[Any]]:
    """What the workbook is, its sheets, units, and the provenance of the run."""
    from fragfield.interface.tables import TABLES

    yield [harmless(title)]
    yield ["directory", harmless(str(run_directory))]
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
        yield [key, harmless(str(value))]
    yield []
    yield ["case", ""]
    for line in case.splitlines():
        yield ["", harmless(line)]


def _summary_rows(summary: Mapping[str, Any]) -> Iterator[list[Any]]:
    yield ["key", "value", "unit", "meaning"]
    for one in QUANTITIES.values():
        value = None if "[]" in one.path or one.path.startswith("case") else one.of(summary)
        if value is not None and not isinstance(value, dict | list):
            yield [one.path, _cell(value), one.unit, harmless(one.label)]


def _rows(table: Table) -> Iterator[list[Any]]:
    columns = [np.asarray(table[name][:_MOST_ROWS]) for name in table.columns]
    for at in range(min(len(table), _MOST_ROWS)):
        yield [_cell(column[at]) for column in columns]


def _cell(value: Any) -> Any:  # noqa: ANN401 - of an array or of JSON
    """A value as a sheet holds it: an empty cell for NaN, infinity as a word, texts that are no formulas."""
    value = value.item() if hasattr(value, "item") else value
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else "inf" if value > 0.0 else "-inf"
    return harmless(value) if isinstance(value, str) else value
