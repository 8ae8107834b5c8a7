"""What the map of the site shows of a draft, which may still have faults, and where a dragged mark is written."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

import fragfield
from fragfield.app.fields import shown
from fragfield.case.conversion.exposed_sites import exposed_sites_of, outline_of
from fragfield.errors import InputError
from fragfield_base.units import UnitError, read_measure

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from fragfield.app.document import CaseDocument
    from fragfield.case import CaseTable
    from fragfield.places.site import Site


_POINTS = {"exposed": ("points", "points_on_earth"), "obstacle": ("start", "end", "position")}


def _value(text: object, unit: str) -> float | None:
    try:
        measure = read_measure(shown(text))
    except UnitError:
        return None
    return measure.value if measure.is_of(unit) and math.isfinite(measure.value) else None


def _pair(entry: object, unit: str = "m") -> tuple[float, float] | None:
    if not isinstance(entry, list) or len(entry) != 2:
        return None
    first, second = (_value(one, unit) for one in entry)
    return None if first is None or second is None else (first, second)


def site_in(case: CaseDocument) -> Site | None:
    """Where on Earth the draft stands; None where it does not say, or not soundly."""
    from flight.errors import InputError as FlightInputError
    from fragfield.places.site import Site

    values = [_value(case.get(("site", name)), "rad") for name in ("latitude", "longitude", "bearing")]
    try:
        return Site(*(math.degrees(one) for one in values)) if None not in values else None  # type: ignore[arg-type]
    except FlightInputError:
        return None


def _origin(case: CaseDocument) -> tuple[float, float]:
    return _pair(case.get(("flight", "origin"))) or (0.0, 0.0)


def _here(case: CaseDocument, latitude: float, longitude: float) -> tuple[float, float] | None:
    site = site_in(case)
    if site is None:
        return None
    x, y = site.offsets(math.degrees(longitude), math.degrees(latitude))[0]
    origin = _origin(case)
    return round(float(x) + origin[0], 3), round(float(y) + origin[1], 3)


def _on_earth(case: CaseDocument, x: float, y: float) -> tuple[float, float] | None:
    site = site_in(case)
    if site is None:
        return None
    origin = _origin(case)
    away, along = x - origin[0], y - origin[1]
    longitude, latitude = site.coordinates(math.degrees(math.atan2(along, away)), math.hypot(away, along))[0]
    return float(latitude), float(longitude)


Handle = tuple[tuple[str | int, ...], tuple[float, float]]
"""Place in the case, and where it is drawn (m)."""


def _handles(case: CaseDocument, table: str, index: int, entry: dict[str, Any]) -> Iterator[Handle]:
    at = (table, index)
    if table == "obstacle":
        for name in _POINTS["obstacle"]:
            if (pair := _pair(entry.get(name))) is not None:
                yield (*at, name), pair
        return
    if (pair := _pair(entry.get("position"))) is not None:
        yield (*at, "position"), pair
    latitude, longitude = (_value(entry.get(name), "rad") for name in ("latitude", "longitude"))
    if latitude is not None and longitude is not None and (found := _here(case, latitude, longitude)):
        yield (*at, "latitude"), found
    for name, unit in (("points", "m"), ("points_on_earth", "rad")):
        points = entry.get(name)
        for number, point in enumerate(points if isinstance(points, list) else []):
            pair = _pair(point, unit)
            here = _here(case, *pair) if pair is not None and unit == "rad" else pair
            if here is not None:
                yield (*at, name, number), here


def move(case: CaseDocument, path: Sequence[str | int], x: float, y: float) -> None:
    """Write where a mark was dragged to, in metres or on Earth, as the case had it.

    Raises InputError: the case has no such place any more.
    """
    here = [f"{x:.2f} m", f"{y:.2f} m"]
    name = path[2] if len(path) > 2 else ""
    if case.get(path) is None or not (math.isfinite(x) and math.isfinite(y)):
        raise InputError("the place was changed in another window meanwhile")
    if name in ("latitude", "points_on_earth"):
        earth = _on_earth(case, x, y)
        if earth is None:
            raise InputError("site: needed to move a place that is given by latitude and longitude")
        words = [f"{degrees:.7f} deg" for degrees in earth]
        if name == "latitude":
            case.set(path, words[0])
            case.set((*path[:2], "longitude"), words[1])
            return
        here = words
    case.set(path, here)


def plan_of(case: CaseDocument, shapes: Sequence[dict[str, Any]], circles: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """What the map draws: shapes, marks to drag, circles about the origin, north (degrees from +x).

    `shapes`: of the case as it last was without faults.
    """
    tables, handles = case.tables, []
    for table in ("obstacle", "exposed"):
        entries = tables.get(table)
        for index, entry in enumerate(entries if isinstance(entries, list) else []):
            if isinstance(entry, dict):
                name = str(entry.get("name", f"{table} {index + 1}"))
                marks = _handles(case, table, index, entry)
                handles += [{"path": list(path), "at": list(at), "name": name, "table": table} for path, at in marks]
    site = site_in(case)
    return {
        "shapes": list(shapes), "handles": handles, "circles": list(circles), "origin": list(_origin(case)),
        "north": None if site is None else site.bearing,
    }  # fmt: skip


def shapes_of(case: CaseTable) -> list[dict[str, Any]]:
    """Terrain, obstacles, exposed sites and rounds of a resolved case, as the map draws them."""
    from fragfield.case.conversion.surroundings import ground_of
    from fragfield.hazard.site_map import Shape, extent_of, terrain_lines

    shapes = [Shape("obstacle", one.name, outline_of(one)) for one in case.obstacle]
    shapes += [Shape("exposed", one.table.name, one.outline) for one in exposed_sites_of(case)]
    shapes += [Shape("round", one.name, np.array([one.position[:2]])) for one in case.round]
    if not isinstance(ground := ground_of(case), float):
        reach = Shape("round", "", np.array([[-150.0, -150.0], [150.0, 150.0]]))
        shapes = [*terrain_lines(ground, extent_of([*shapes, reach])), *shapes]
    return [
        {"kind": one.kind, "name": one.name, "points": one.points.round(2).tolist(), "closed": one.closed}
        for one in shapes
    ]


def imported(case: CaseDocument, path: Path) -> tuple[dict[str, list[dict[str, Any]]], list[str]]:
    """Tables [[exposed]] and [[obstacle]] of a map (GeoJSON, KML, KMZ), and how it was read, as `fragfield convert`.

    Raises InputError: the map cannot be read, or the draft has no place on Earth.
    """
    site = {name: case.get(("site", name)) for name in ("latitude", "longitude", "bearing")}
    found = fragfield.convert(path, set={name: value for name, value in site.items() if value is not None})
    tables = {name: entries for name, entries in found.tables.items() if name in ("exposed", "obstacle")}
    return tables, found.notes
