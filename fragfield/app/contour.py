"""Contour tables as a drawing has them, radii or diameters, stations from nose or base, and as the case file has them.

What is typed is converted digit by digit (decimal numbers), so that going there and back changes nothing. What is no
number goes into the case as it is, and the loader says so.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal, DecimalException
from typing import Any

Row = list[str]
"""Station, radius or diameter, and the radius of the arc from the point before it."""
_DIGITS = 15


@dataclass
class ContourTable:
    """What stands in the table of a drawing."""

    unit: str = "mm"
    """"mm", "cm", "m" or "in"."""
    diameters: bool = False
    from_base: bool = False
    """How the drawing gives its numbers."""
    outer: list[Row] = field(default_factory=list)
    cavity: list[Row] = field(default_factory=list)
    """Points of the two contours, in the order of the stations as they are counted."""
    front: str = ""
    """Station of the charge's front; empty: the charge fills the cavity."""
    fill: str = ""
    """Of the cavity before it: "", "inert" or "void"."""
    mass: str = ""
    """Of the inert fuze (kg)."""


def number_of(text: str) -> int | float | str:
    """The number that a text is; the text itself where it is none."""
    exact = _decimal(text)
    if exact is None:
        return text
    return int(exact) if exact == exact.to_integral_value() and abs(exact) < 10**_DIGITS else float(exact)


def text_of(value: object) -> str:
    """A number of the case as the table shows it."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return "" if value is None else str(value)
    return _plain(Decimal(str(value)))


def from_case(profile: dict[str, Any], *, diameters: bool = False, from_base: bool = False) -> ContourTable:
    """The table of a profile's tables, as a drawing would give them."""
    table = ContourTable(str(profile.get("unit", "mm")), diameters, from_base)
    length = _length(profile)
    for name in ("outer", "cavity"):
        contour = profile.get(name)
        rows = _rows(contour if isinstance(contour, dict) else {})
        setattr(table, name, [_turned(row, table, length) for row in rows])
        if from_base:
            turned = getattr(table, name)[::-1]
            arcs = [row[2] for row in rows][:0:-1]
            setattr(table, name, [[*row[:2], arc] for row, arc in zip(turned, ["", *arcs], strict=True)])
    charge, fuze = profile.get("charge"), profile.get("fuze")
    if isinstance(charge, dict) and "front" in charge:
        table.front = _station(text_of(charge["front"]), length, turned=from_base)
    if isinstance(fuze, dict):
        table.fill, table.mass = str(fuze.get("fill", "")), text_of(fuze.get("mass"))
    return table


def to_case(table: ContourTable, before: dict[str, Any]) -> dict[str, Any]:
    """The profile's tables of a table; what it does not show, such as sources and segments, stays as before."""
    made = {key: value for key, value in before.items() if key not in ("outer", "cavity", "charge", "fuze")}
    made["unit"] = table.unit
    stations = [exact for row in table.outer if (exact := _decimal(row[0])) is not None]
    length = max(stations, default=Decimal(0))
    for name in ("outer", "cavity"):
        rows: list[Row] = [row for row in getattr(table, name) if any(cell.strip() for cell in row[:2])]
        arcs = [row[2] for row in rows[1:]]
        if table.from_base:
            rows, arcs = rows[::-1], arcs[::-1]
        points = [
            [number_of(_station(row[0], length, turned=table.from_base)), number_of(_radius(row[1], table))]
            for row in rows
        ]
        made[name] = {"points": points}
        if any(arc.strip() for arc in arcs):
            made[name]["arcs"] = [number_of(arc) if arc.strip() else 0 for arc in arcs]
    if table.front.strip():
        made["charge"] = {"front": number_of(_station(table.front, length, turned=table.from_base))}
    else:
        made["charge"] = {}
    if table.fill:
        made["fuze"] = {"fill": table.fill}
        if table.mass.strip():
            made["fuze"]["mass"] = number_of(table.mass)
    return made


def _rows(contour: dict[str, Any]) -> list[Row]:
    points = contour.get("points")
    arcs = contour.get("arcs")
    radii = [0, *arcs] if isinstance(arcs, list) else []
    rows: list[Row] = []
    for number, point in enumerate(points if isinstance(points, list) else []):
        station, radius = (*point, "", "")[:2] if isinstance(point, list) else (point, "")
        arc = radii[number] if number < len(radii) else 0
        rows.append([text_of(station), text_of(radius), "" if arc == 0 else text_of(arc)])
    return rows


def _turned(row: Row, table: ContourTable, length: Decimal) -> Row:
    """A row of the case as the drawing counts."""
    exact = _decimal(row[1])
    across = row[1] if exact is None or not table.diameters else _plain(2 * exact)
    return [_station(row[0], length, turned=table.from_base), across, row[2]]


def _station(text: str, length: Decimal, *, turned: bool) -> str:
    exact = _decimal(text)
    return text if exact is None or not turned else _plain(length - exact)


def _radius(text: str, table: ContourTable) -> str:
    exact = _decimal(text)
    return text if exact is None or not table.diameters else _plain(exact / 2)


def _length(profile: dict[str, Any]) -> Decimal:
    contour = profile.get("outer")
    rows = _rows(contour if isinstance(contour, dict) else {})
    return max((exact for row in rows if (exact := _decimal(row[0])) is not None), default=Decimal(0))


def _decimal(text: str) -> Decimal | None:
    text = text.strip()
    try:
        exact = Decimal(text)
    except DecimalException:
        return None
    return exact if exact.is_finite() and abs(exact) < Decimal("1e12") and len(text) < 40 else None


def _plain(exact: Decimal) -> str:
    text = format(exact, "f")
    return text.rstrip("0").rstrip(".") if "." in text else text
