"""From a drawing or a table of diameters to the tables of a profile, with all that was found, guessed and left out."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.contours.axis import find_axis, find_nose, turned
from fragfield.contours.section import Section, casing_section
from fragfield.contours.sheet import counted
from fragfield.errors import InputError
from fragfield_base.reading import read_bytes

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from fragfield.case.tables.round import ContourTable
    from fragfield.contours.pieces import Pieces

__all__ = ["KINDS", "casing_volume", "is_of_file", "profile_of_contour"]

KINDS = (".dxf", ".svg", ".csv", ".tsv", ".txt", ".xlsx", ".ods")
"""Endings of the files that are read."""
_MARK = "(SHA-256 "
_DIGITS = 6  # of a millimetre
_MOST_POINTS = 2000


def profile_of_contour(table: ContourTable, path: Path) -> tuple[dict[str, Any], float]:
    """The profile's tables, in millimetres, of a contour file, and the unit of its numbers (m).

    Parameters
    ----------
    table : ContourTable
        How it is to be read; `file` itself is not looked at.
    path : Path
        The file.

    Raises
    ------
    InputError
        The file cannot be read, or holds no contour that is clear; the message says where, and what is needed.
    """
    kind = path.suffix.casefold()
    if kind not in KINDS:
        raise InputError(f"{path}: found a file that ends in {kind or 'nothing'}; allowed: {', '.join(KINDS)}")
    digest = hashlib.sha256(read_bytes(path, InputError)).hexdigest()[:16]
    if kind in (".dxf", ".svg"):
        section, words, unit = _of_drawing(table, path)
    else:
        from fragfield.contours.table import section_of_table

        section, words, unit = section_of_table(table, path)
    length = float(section.outer.stations[-1])
    if not 1e-3 <= length <= 20.0:
        raise InputError(f"{path}: the round is {length:.4g} m long; allowed: 1 mm to 20 m; give its unit")
    outer, cavity = _points(path, section.outer, "outer contour"), _points(path, section.cavity, "cavity")
    shift = outer["points"][0][0]
    if shift:  # rounding alone
        outer["points"][0][0] = 0.0
    made: dict[str, Any] = {
        "name": path.stem,
        "unit": "mm",
        "source": f"{path.name} {_MARK}{digest}...): {'; '.join(words)}",
        "notes": "; ".join(section.notes),
        "outer": outer,
        "cavity": cavity,
    }
    if table.charge_front is None and cavity["points"][0][0] == 0.0:
        made["notes"] = "; ".join(
            [*section.notes, "the charge fills the cavity up to the open nose: give charge_front"]
        )
    front = cavity["points"][0][0] if table.charge_front is None else round(1e3 * table.charge_front, _DIGITS)
    made["charge"] = {"front": front}
    if isinstance(table.fuze, str):
        made["fuze"] = {"fill": "void"}
    elif table.fuze is not None:
        made["fuze"] = {"fill": "inert", "mass": table.fuze}
    if not made["notes"]:
        del made["notes"]
    return made, unit


def casing_volume(profile: Mapping[str, Any]) -> float:
    """Volume of the casing (m3) of a profile's tables of `profile_of_contour`."""
    from burst_fenicsx.geometry import Contour

    outer, cavity = (
        Contour.from_points(profile[key]["points"], profile[key].get("arcs", ()), key) for key in ("outer", "cavity")
    )
    return 1e-9 * (outer.volume() - cavity.volume())  # of mm3


def is_of_file(profile: Mapping[str, Any]) -> bool:
    """Whether a profile's tables are from a file that was read here."""
    return _MARK in str(profile.get("source", ""))


def _of_drawing(table: ContourTable, path: Path) -> tuple[Section, list[str], float]:
    from fragfield.contours.dxf import read_dxf
    from fragfield.contours.svg import read_svg

    read = read_dxf if path.suffix.casefold() == ".dxf" else read_svg
    sheet = read(path, unit=table.unit_length, layers=table.layers, tolerance=table.tolerance)
    near = table.gap
    extent = float(np.ptp(sheet.points, axis=0).max())
    if not 1e-3 <= extent <= 20.0:
        raise InputError(
            f"{path}: the drawing is {extent:.4g} m large with a unit of {1e3 * sheet.unit:.6g} mm; "
            "allowed: 1 mm to 20 m; give unit"
        )
    axis = find_axis(path, sheet, table.axis, near)
    curves = turned(sheet.curves, axis)
    nose, sign, nose_words = find_nose(path, curves, axis, table.nose)

    def place(at: np.ndarray[Any, Any]) -> str:
        x, y = (at[0], at[1] + axis.offset) if axis.along == 0 else (at[1] + axis.offset, at[0])
        return sheet.place(float(x), float(y))

    try:
        section = casing_section(curves, nose=nose, sign=sign, tolerance=table.tolerance, near=near, place=place)
    except InputError as fault:
        others = (
            f" (layers with curves: {counted(sheet.layers)})"
            if len(sheet.layers) > 1 and "layers" in str(fault)
            else ""
        )
        raise InputError(f"{path}: {fault}{others}") from None
    words = [
        *sheet.notes,
        f"axis {axis.words(sheet)}, {axis.why}",
        nose_words,
        f"lines and arcs within {1e3 * table.tolerance:g} mm",
    ]
    if sheet.ignored:
        section.notes.append(f"no contour: {counted(sheet.ignored)}")
    return section, words, sheet.unit


def _points(path: Path, pieces: Pieces, name: str) -> dict[str, Any]:
    """Points and arcs as a profile has them, in rounded millimetres."""
    if len(pieces.stations) > _MOST_POINTS:
        raise InputError(
            f"{path}: the {name} has {len(pieces.stations)} points; allowed: {_MOST_POINTS}; give a larger tolerance"
        )
    points = np.round(1e3 * np.column_stack([pieces.stations, pieces.radii]), _DIGITS) + 0.0
    made: dict[str, Any] = {"points": points.tolist()}
    if pieces.arcs.any():
        made["arcs"] = _rounded_arcs(points, 1e3 * pieces.arcs)
    return made


def _rounded_arcs(points: np.ndarray[Any, Any], arcs: np.ndarray[Any, Any]) -> list[float]:
    """Radii that are not too small for their chords by the rounding of the points."""
    way = np.diff(points, axis=0)
    smallest = (way**2).sum(axis=1) / (2.0 * way[:, 0])  # with one end upright
    size = np.round(np.abs(arcs), _DIGITS)
    size = np.where(size < smallest, smallest * (1.0 + 1e-9), size)
    return (np.where(arcs == 0.0, 0.0, np.sign(arcs) * size)).tolist()
