"""From a drawing or a table of diameters to the tables of a profile, with all that was found, guessed and left out."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from burst_fenicsx.geometry import Contour
from fragfield.contours.dxf import read_dxf
from fragfield.contours.section import Curve, Section, Sheet, casing_section, counted
from fragfield.contours.table import section_of_table
from fragfield.errors import InputError
from fragfield_base.reading import read_bytes

if TYPE_CHECKING:
    from fragfield.case.tables.round import ContourTable

Array = NDArray[np.float64]

_LINE = re.compile(r"^\s*([xy])\s*=\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*$")
_LONG = 0.3  # of the drawing's extent: a shorter centre line is that of a hole
_SLENDER = 1.5  # length over width from which the longer of two possible axes is taken
_NARROW = 0.8  # of the other end's radius: then it is the nose
_AT_END = 0.01  # of the length over which the radius of an end is looked for


@dataclass(frozen=True)
class Axis:
    """A horizontal (y = offset) or an upright (x = offset) axis (m), and how it is known."""

    direction: Literal["horizontal", "upright"]
    offset: float
    why: str

    @property
    def along(self) -> int:
        """Index of the coordinate along it."""
        return 0 if self.direction == "horizontal" else 1

    def words(self, sheet: Sheet) -> str:
        """As it is asked for, in units of the file."""
        return f"{'y' if self.direction == 'horizontal' else 'x'} = {self.offset / sheet.unit + 0.0:.6g}"


def turned(curves: Sequence[Curve], axis: Axis) -> list[Curve]:
    """Curves in positions along the axis and distances from it, on one side positive."""
    along = axis.along
    return [
        Curve(np.column_stack([one.points[:, along], one.points[:, 1 - along] - axis.offset]), one.layer)
        for one in curves
    ]


def find_axis(path: object, sheet: Sheet, asked: str | None, near: float) -> Axis:
    """The axis of a section: asked for as "y = 0" or "x = 12.5" in units of the file, or that of its centre lines.

    Points within `near` (m) are one. Raises InputError for another form, a centre line that is inclined, or none or
    several that may be it.
    """
    points = sheet.points
    if asked is not None:
        found = _LINE.match(asked)
        if found is None:
            raise InputError(
                f'{path}: axis: found "{asked}"; allowed: a line such as "y = 0" or "x = 12.5", in units of the file'
            )
        offset = float(found[2]) * sheet.unit
        if found[1] == "y":
            return Axis("horizontal", offset, "as asked for")
        return Axis("upright", offset, "as asked for")
    possible = _centre_lines(path, sheet, points, near) or list(_possible(points, near))
    best = _longer(points, possible)
    if best is not None:
        return best
    words = " or ".join(f'axis = "{one.words(sheet)}" ({one.why})' for one in possible)
    if not words:
        x, y = (0.5 * (points.min(axis=0) + points.max(axis=0))).tolist()
        middles = [Axis("horizontal", y, ""), Axis("upright", x, "")]
        words = " or ".join(f'axis = "{one.words(sheet)}"' for one in middles) + ", the middles of the drawing"
    why = (
        "several lines may be the axis"
        if possible
        else "no centre line is drawn, and neither x = 0 nor y = 0 bounds the section"
    )
    raise InputError(f"{path}: {why}; needed: axis, a line in units of the file, such as {words}")


def _centre_lines(path: object, sheet: Sheet, points: Array, near: float) -> list[Axis]:
    extent = float(np.ptp(points, axis=0).max())
    found: dict[tuple[str, int], Axis] = {}
    for line in sheet.axes:
        (x0, y0), (x1, y1) = line.points[[0, -1]].tolist()
        if line.length < _LONG * extent:
            continue
        if abs(y1 - y0) <= near:
            axis = Axis("horizontal", 0.5 * (y0 + y1), "a centre line")
        elif abs(x1 - x0) <= near:
            axis = Axis("upright", 0.5 * (x0 + x1), "a centre line")
        else:
            raise InputError(
                f"{path}: found a centre line inclined from {sheet.place(x0, y0)} to {sheet.place(x1, y1)}; "
                "allowed: a round drawn along x or y; turn the drawing"
            )
        across = points[:, 1 - axis.along]
        # A centre line far from the section is that of another view.
        if len(sheet.axes) == 1 or across.min() - near <= axis.offset <= across.max() + near:
            found.setdefault((axis.direction, round(axis.offset / near)), axis)
    return list(found.values())


def _possible(points: Array, near: float) -> Iterator[Axis]:
    """X = 0 and y = 0 where the section begins there, and lines about which it is symmetric."""
    from scipy.spatial import cKDTree

    directions: tuple[Literal["horizontal", "upright"], ...] = ("horizontal", "upright")
    for along, direction in enumerate(directions):
        across = points[:, 1 - along]
        low, high = float(across.min()), float(across.max())
        middle = 0.5 * (low + high)
        if abs(low) <= near or abs(high) <= near:
            yield Axis(direction, 0.0, f"the section begins at {'yx'[along]} = 0")
            continue
        mirrored = points.copy()
        mirrored[:, 1 - along] = 2.0 * middle - mirrored[:, 1 - along]
        if cKDTree(points).query(mirrored)[0].max() <= near:
            yield Axis(direction, 0.0 if abs(middle) <= near else middle, "the section is symmetric about it")


def _longer(points: Array, possible: Sequence[Axis]) -> Axis | None:
    if len(possible) == 1:
        return possible[0]
    if len(possible) != 2 or possible[0].direction == possible[1].direction:
        return None
    for one in possible:  # length over the diameter about it, or over the width where the section begins there
        diameter = 2.0 * np.abs(points[:, 1 - one.along] - one.offset).max()
        if np.ptp(points[:, one.along]) >= _SLENDER * diameter:
            return Axis(one.direction, one.offset, f"{one.why}, and it is the longer way")
    return None


def find_nose(path: object, curves: Sequence[Curve], axis: Axis, asked: str | None) -> tuple[float, float, str]:
    """Position of the nose end along the axis (m), the sign with which stations run from there, and how it is known.

    `curves` are those of `turned`. Raises InputError where both ends are about as wide, or the side is not an end.
    """
    # with further points between, so that a long line has some near its ends
    refined = ([np.linspace(*ends, 201) for ends in pairwise(one.points)] for one in curves if len(one.points) < 100)
    points = np.concatenate([*(one.points for one in curves), *(part for parts in refined for part in parts)])
    low, high = float(points[:, 0].min()), float(points[:, 0].max())
    words = ("left", "right") if axis.direction == "horizontal" else ("bottom", "top")
    if asked is not None:
        if asked not in words:
            raise InputError(
                f'{path}: nose: found "{asked}" with an axis that is {axis.direction}; allowed: {" or ".join(words)}'
            )
        return (
            (low, 1.0, f"nose {asked}, as asked for")
            if asked == words[0]
            else (high, -1.0, f"nose {asked}, as asked for")
        )
    reach = _AT_END * (high - low)
    first = float(np.abs(points[points[:, 0] <= low + reach, 1]).max())
    last = float(np.abs(points[points[:, 0] >= high - reach, 1]).max())
    if min(first, last) > _NARROW * max(first, last):
        raise InputError(
            f"{path}: both ends are about as wide, radii {1e3 * first:.4g} and {1e3 * last:.4g} mm; needed: nose, "
            f'the side of the nose: "{words[0]}" or "{words[1]}"'
        )
    nose, base = 2e3 * min(first, last), 2e3 * max(first, last)
    side = words[0] if first < last else words[1]
    why = f"nose {side}, the narrower end ({nose:.4g} mm in diameter, the other {base:.4g} mm)"
    return (low, 1.0, why) if first < last else (high, -1.0, why)


KINDS = (".dxf", ".csv", ".tsv", ".txt", ".xlsx")
"""Endings of the files that are read."""
_MARK = "(SHA-256 "
_DIGITS = 6  # of a millimetre
_MOST_POINTS = 2000


def profile_of_contour(table: ContourTable, path: Path) -> tuple[dict[str, Any], float]:
    """The profile's tables, in millimetres, of a contour file, and the unit of its numbers (m).

    `table`: how it is to be read; `file` itself is not looked at; `path`: the file. Raises InputError: the file cannot
    be read, or holds no contour that is clear; the message says where, and what is needed.
    """
    kind = path.suffix.casefold()
    if kind not in KINDS:
        raise InputError(f"{path}: found a file that ends in {kind or 'nothing'}; allowed: {', '.join(KINDS)}")
    digest = hashlib.sha256(read_bytes(path, InputError)).hexdigest()[:16]
    if kind == ".dxf":
        section, words, unit = _of_drawing(table, path)
    else:
        section, words, unit = section_of_table(table, path)
    length = float(section.outer[-1, 0])
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
    outer, cavity = (Contour.from_points(profile[key]["points"], (), key) for key in ("outer", "cavity"))
    return 1e-9 * (outer.volume() - cavity.volume())  # of mm3


def is_of_file(profile: Mapping[str, Any]) -> bool:
    """Whether a profile's tables are from a file that was read here."""
    return _MARK in str(profile.get("source", ""))


def _of_drawing(table: ContourTable, path: Path) -> tuple[Section, list[str], float]:
    sheet = read_dxf(path, unit=table.unit_length, layers=table.layers, tolerance=table.tolerance)
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
        f"chords within {1e3 * table.tolerance:g} mm",
    ]
    if sheet.ignored:
        section.notes.append(f"no contour: {counted(sheet.ignored)}")
    return section, words, sheet.unit


def _points(path: Path, line: Array, name: str) -> dict[str, Any]:
    if len(line) > _MOST_POINTS:
        raise InputError(f"{path}: the {name} has {len(line)} points; allowed: {_MOST_POINTS}; give a larger tolerance")
    return {"points": (np.round(1e3 * line, _DIGITS) + 0.0).tolist()}
