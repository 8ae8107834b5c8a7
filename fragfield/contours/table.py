"""A table of outer and inner diameters or radii at stations, as the outer contour and the cavity of a casing."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fragfield.contours.section import Section, chords, with_cones
from fragfield.errors import InputError
from fragfield.importing.columns import NotANumberError, decimal_of, number_of
from fragfield.importing.sheet import Cell, QuestionError, Row, read_sheet
from fragfield_base.units import UnitError, read_measure

if TYPE_CHECKING:
    from fragfield.case.tables.round import ContourTable

Array = NDArray[np.float64]

_WHAT = {
    "outer": re.compile(r"out(er|side)|ext|^od\b"),
    "inner": re.compile(r"inner|inside|cavity|bore|int|^id\b"),
    "station": re.compile(r"station|position|distance|length|^(z|x|s)\b|from"),
}  # the first that a name fits
_DIAMETER = re.compile(r"diam|⌀|ø|^[oi]d\b|dia\b")
_RADIUS = re.compile(r"radi|\br\b")
_BASE = re.compile(r"base|rear|tail")
_NOSE = re.compile(r"nose|front|tip")
_UNIT = re.compile(r"[\[(]\s*([a-zA-Zµ.\"']+)\s*[\])]\s*$|[_ ](mm|cm|m|in|inch|inches|ft)$")
_NARROW = 0.8  # of the other end's radius: then it is the nose


class _Column(NamedTuple):
    number: int
    name: str
    factor: float  # of its numbers, to metres; to radii where they are diameters
    words: str


def section_of_table(table: ContourTable, path: Path) -> tuple[Section, list[str], float]:
    """Outer contour and cavity of a table, how it was read, in words, and the unit of its stations (m).

    Rows hold a station with outer and inner diameter or radius; an empty inner cell where the casing is solid, two rows
    of one station for a step. Of `table` the `unit` and the `nose` ("first" or "last" station) are used. Raises
    InputError: columns that are missing or do not say what they are, a cell that is not a number, stations that do not
    rise or fall throughout, ends that do not say which is the nose.
    """
    names, rows, decimal, concluded = _rows(path)
    columns = _columns(path, names, table)
    station, outer, inner = (
        np.array([_number(path, row, columns[what], decimal) for row in rows]) * columns[what].factor
        for what in ("station", "outer", "inner")
    )
    ways = np.sign(np.diff(station))
    if not ((ways >= 0.0).all() or (ways <= 0.0).all()):
        turn = int(np.flatnonzero(ways != (1.0 if ways.sum() > 0.0 else -1.0))[0])
        raise InputError(
            f"{path}: line {rows[turn + 1].line}: the station turns back; allowed: stations that rise, or that fall"
        )
    if ways.sum() < 0.0:
        station, outer, inner = station[::-1], outer[::-1], inner[::-1]
    first, words = _nose(path, table, columns["station"].name, outer)
    station = station - station[0] if first else (station[-1] - station)[::-1]
    if not first:
        outer, inner = outer[::-1], inner[::-1]
    contours = []
    for name, radius in (("outer", outer), ("inner", inner)):
        line = np.column_stack([station, radius])[np.isfinite(radius)]
        if name == "inner":
            line = line[_hollow(line[:, 1])]
            line = line[1:] if len(line) > 2 and line[0, 0] == line[1, 0] else line  # without the faces at its ends
            line = line[:-1] if len(line) > 2 and line[-1, 0] == line[-2, 0] else line
        if len(line) < 2 or not line[-1, 0] > line[0, 0]:
            raise InputError(
                f"{path}: found {len(line)} rows of an {name} diameter or radius; allowed: two stations or more"
            )
        parts = with_cones([np.array(pair) for pair in pairwise(line)], table.tolerance)
        contours.append(chords(parts, table.tolerance))
    read = "; ".join(column.words for column in columns.values())
    return Section(contours[0], contours[1], concluded), [read, words], columns["station"].factor


def _hollow(radius: Array) -> NDArray[np.bool_]:
    """Rows of a cavity: zeros before its first and after its last radius are solid, but for one that closes it."""
    there = np.flatnonzero(radius > 0.0)
    kept = np.zeros(len(radius), dtype=bool)
    if len(there):
        kept[max(there[0] - 1, 0) : there[-1] + 2] = True
    return kept


def _rows(path: Path) -> tuple[list[str], list[Row], str, list[str]]:
    sheet = read_sheet(path)
    if len(sheet.rows) < 3:
        raise InputError(f"{path}: found {len(sheet.rows)} lines; needed: a line of column names and two rows or more")
    names = [str(cell).strip() for cell in sheet.rows[0].cells]
    rows = [row for row in sheet.rows[1:] if any(not _is_empty(cell) for cell in row.cells)]
    try:
        decimal, guesses = decimal_of(sheet, rows, None)
    except QuestionError:  # "146.800" throughout: no round has 146 thousand of any unit
        points = any("." in cell for row in rows for cell in row.cells if isinstance(cell, str))
        decimal, guesses = "point" if points else "comma", []
    words = [str(one) for one in [*sheet.guesses, *guesses] if "utf-8" not in one.value]
    return names, rows, decimal, words


def _is_empty(cell: Cell) -> bool:
    return isinstance(cell, str) and cell.strip() in ("", "-", "–")


def _columns(path: Path, names: Sequence[str], table: ContourTable) -> dict[str, _Column]:
    found: dict[str, _Column] = {}
    for number, name in enumerate(names):
        plain = re.sub(r"[_\s]+", " ", name.casefold()).strip()
        what = next((what for what, pattern in _WHAT.items() if pattern.search(plain)), "")
        if what in found:
            raise InputError(
                f"{path}: found two columns that may be the {what}: {found[what].name}, {name}; allowed: one"
            )
        if what:
            unit, kind = _unit(path, name, table), ""
            if what != "station":
                if bool(_DIAMETER.search(plain)) == bool(_RADIUS.search(plain)):
                    raise InputError(
                        f'{path}: column "{name}" says neither diameter nor radius; needed: one of the two in its name'
                    )
                kind = " diameter" if _DIAMETER.search(plain) else " radius"
            words = f'"{name}" as {what}{kind} in units of {1e3 * unit:g} mm'
            found[what] = _Column(number, name, 0.5 * unit if kind == " diameter" else unit, words)
    for what in ("station", "outer", "inner"):
        if what not in found:
            raise InputError(
                f"{path}: found no column of the {what} among {', '.join(names)}; needed: such as station_mm, "
                "outer_diameter_mm, inner_diameter_mm"
            )
    return found


def _unit(path: Path, name: str, table: ContourTable) -> float:
    named, unit = _UNIT.search(name.strip()), table.unit_length
    if named is None and unit is None:
        raise InputError(
            f'{path}: column "{name}" names no unit; needed: one in its name, such as "{name} [mm]", or unit = "1 mm"'
        )
    if named is None:
        return float(unit or 0.0)
    try:
        own = read_measure(next(filter(None, named.groups()))).value
    except UnitError as fault:
        raise InputError(f"{path}: column {name}: {fault}") from None
    if unit is not None and abs(unit / own - 1.0) > 1e-6:
        raise InputError(
            f'{path}: unit: found {1e3 * unit:g} mm, and column "{name}" says {1e3 * own:g} mm; allowed: one'
        )
    return own


def _number(path: Path, row: Row, column: _Column, decimal: str) -> float:
    cell: Cell = row.cells[column.number] if column.number < len(row.cells) else ""
    if _is_empty(cell):
        return float("nan")
    try:
        return number_of(cell, decimal)
    except NotANumberError as fault:
        raise InputError(
            f"{path}: line {row.line}, column {column.name}: {fault}; allowed: a number, or nothing where it is solid"
        ) from None


def _nose(path: Path, table: ContourTable, name: str, outer: Array) -> tuple[bool, str]:
    if table.nose is not None:
        if table.nose not in ("first", "last"):
            raise InputError(
                f'{path}: nose: found "{table.nose}" for a table; allowed: first or last, of its stations as they rise'
            )
        return table.nose == "first", f"nose at the {table.nose} station, as asked for"
    plain = name.casefold()
    if bool(_NOSE.search(plain)) != bool(_BASE.search(plain)):
        nose = _NOSE.search(plain) is not None
        return nose, f"stations from the {'nose' if nose else 'base'}, as the column says"
    ends = outer[np.isfinite(outer)][[0, -1]]
    if ends.min() > _NARROW * ends.max():
        raise InputError(
            f"{path}: both ends are about as wide, {2e3 * ends[0]:.4g} and {2e3 * ends[1]:.4g} mm; needed: "
            'nose = "first" or "last", of its stations as they rise, or a column station_from_nose or station_from_base'
        )
    return bool(ends[0] < ends[1]), f"nose at the narrower end, {2e3 * ends.min():.4g} mm in diameter"
