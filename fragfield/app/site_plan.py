"""What the map of the site shows of a draft, which may still have faults, and where a dragged mark is written."""

from __future__ import annotations

import json
import math
import re
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

import fragfield
from fragfield.app.fields import shown
from fragfield.case.conversion.exposed_sites import outline_of, rectangle
from fragfield.case.tables.surroundings import ObstacleTable
from fragfield.errors import InputError
from fragfield_base.units import UnitError, read_measure

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from flight.hazard.site import Site
    from fragfield.app.document import CaseDocument


_OBSTACLES: TypeAdapter[Any] = TypeAdapter(ObstacleTable)
_LINES = ("road", "wall", "barricade")
_PLACED = ("latitude", "longitude", "length", "width", "azimuth")
"""What the shape on the map says of a building; of a road its width is kept."""
_POINTS = {"exposed": ("points", "points_on_earth"), "obstacle": ("start", "end", "position")}


def _value(text: object, unit: str) -> float | None:
    """A value of the draft in SI; None for what is none."""
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
    from flight.hazard.site import Site

    values = [_value(case.get(("site", name)), "rad") for name in ("latitude", "longitude", "bearing")]
    try:
        return Site(*(math.degrees(one) for one in values)) if None not in values else None  # type: ignore[arg-type]
    except FlightInputError:
        return None


def _origin(case: CaseDocument) -> tuple[float, float]:
    return _pair(case.get(("flight", "origin"))) or (0.0, 0.0)


def _here(case: CaseDocument, latitude: float, longitude: float) -> tuple[float, float] | None:
    """X and y of a place on Earth (radians)."""
    site = site_in(case)
    if site is None:
        return None
    x, y = site.offsets(math.degrees(longitude), math.degrees(latitude))[0]
    origin = _origin(case)
    return round(float(x) + origin[0], 3), round(float(y) + origin[1], 3)


def _on_earth(case: CaseDocument, x: float, y: float) -> tuple[float, float] | None:
    """Latitude and longitude (degrees) of a place."""
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
    """The marks of an entry: its position, or the points of its line."""
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


def background_of(case: CaseDocument, given: Mapping[str, str]) -> dict[str, Any]:
    """Where a picture lies below the map: `low` and `high`, its corners (m), or its `width` (m) about the origin.

    `case`: with its place on Earth, where corners are given by latitude and longitude; `given`: texts: "low" and
    "high", two lengths or angles each with a comma between; else "width". Numbers are in metres. Raises InputError: a
    text is no such value, or the corners are not lower left and upper right.
    """
    if not given.get("low") and not given.get("high"):
        width = _value(_metres(given.get("width") or "500 m"), "m")
        if width is None or width <= 0.0:
            raise InputError(f'width: found "{given["width"]}"; allowed: a length above 0 m, for example "500 m"')
        return {"width": width}
    low, high = (_corner(case, key, given.get(key, "")) for key in ("low", "high"))
    if not (low[0] < high[0] and low[1] < high[1]):
        raise InputError(f"corners: found {low} and {high} m; allowed: lower left, then upper right")
    return {"low": low, "high": high}


def _metres(text: str) -> str:
    return f"{text} m" if re.fullmatch(r"\s*[-+]?[\d.]+\s*", text) else text


def _corner(case: CaseDocument, key: str, text: str) -> tuple[float, float]:
    parts = [_metres(part) for part in text.split(",")]
    corner = _pair(parts) or ((pair := _pair(parts, "rad")) and _here(case, *pair))
    if not corner:
        raise InputError(
            f'{key}: found "{text}"; allowed: x and y, for example "-250, -180", or with [site] latitude and '
            'longitude, for example "51.5 deg, 7.25 deg"'
        )
    return corner


def plan_of(
    case: CaseDocument, circles: Sequence[dict[str, Any]], resolved: Sequence[dict[str, Any]] | None = None
) -> dict[str, Any]:
    """What the map draws: shapes, marks to drag, circles about the origin, terrain, north (degrees from +x).

    `resolved`: the rounds as the case places them, those of a stack one by one; None: as the draft has them.
    """
    tables, shapes, handles = case.tables, [], []
    for table in ("obstacle", "exposed"):
        entries = tables.get(table)
        for index, entry in enumerate(entries if isinstance(entries, list) else []):
            if not isinstance(entry, dict):
                continue
            marks = list(_handles(case, table, index, entry))
            name = str(entry.get("name", f"{table} {index + 1}"))
            handles += [{"path": list(path), "at": list(at), "name": name, "table": table} for path, at in marks]
            shapes += _shape(table, entry, name, [at for _, at in marks])
    rounds = tables.get("round")
    shapes += resolved or []
    for index, entry in enumerate(rounds if resolved is None and isinstance(rounds, list) else []):
        position = entry.get("position") if isinstance(entry, dict) else None
        place = _pair(position[:2]) if isinstance(position, list) and len(position) == 3 else (0.0, 0.0)
        if place is not None:
            shapes.append({"kind": "round", "name": str(entry.get("name", index + 1)), "points": [list(place)]})
    site = site_in(case)
    return {
        "shapes": [*_terrain(case, shapes), *shapes], "handles": handles, "circles": list(circles),
        "origin": list(_origin(case)), "north": None if site is None else site.bearing,
    }  # fmt: skip


def _shape(table: str, entry: dict[str, Any], name: str, marks: list[tuple[float, float]]) -> list[dict[str, Any]]:
    kind, points, closed = str(entry.get("kind", "person")), [list(at) for at in marks], False
    if table == "obstacle":
        with suppress(ValidationError):
            points, closed = outline_of(_OBSTACLES.validate_python(entry)).tolist(), True
    elif kind == "building" and marks:
        length, width = (_value(entry.get(key), "m") for key in ("length", "width"))
        turn = _value(entry.get("azimuth", "0 deg"), "rad") or 0.0
        if length and width:
            points, closed = rectangle(marks[0], length, width, turn).tolist(), True
    elif kind == "area":
        closed = True
    width = (_value(entry.get("width", "6 m"), "m") or 6.0) if kind == "road" else 0.0
    shape = {"kind": table, "sort": kind, "name": name, "points": points, "closed": closed, "width": width}
    return [shape] if points else []


def _terrain(case: CaseDocument, shapes: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Lines of equal height around what is drawn, of a case without faults."""
    from fragfield.case.conversion.surroundings import ground_of
    from fragfield.hazard.site_map import Shape, extent_of, terrain_lines

    resolved = case.resolved() if case.get(("flight", "ground", "map")) else None
    ground = ground_of(resolved) if resolved is not None else 0.0
    if isinstance(ground, float):
        return []
    seen = [Shape(one["kind"], "", np.array(one["points"])) for one in shapes]
    reach = np.array([[-150.0, -150.0], [150.0, 150.0]])
    lines = terrain_lines(ground, extent_of([*seen, Shape("round", "", reach)]))
    return [
        {"kind": "terrain", "name": one.name, "points": np.round(one.points, 1).tolist(), "closed": False}
        for one in lines
    ]


def exported(case: CaseDocument) -> str:
    """The places of the draft as GeoJSON (RFC 7946), in the form that `imported` takes; raises InputError off Earth."""
    if site_in(case) is None:
        raise InputError("site: missing; GeoJSON needs latitude, longitude and bearing")
    features = []
    for table in ("obstacle", "exposed"):
        entries = case.get((table,), [])
        for index, entry in enumerate(entries if isinstance(entries, list) else []):
            marks = [at for _, at in _handles(case, table, index, entry)] if isinstance(entry, dict) else []
            if not marks:  # without a place of its own, such as the box of an obstacle
                continue
            kind = str(entry.get("kind", "wall" if table == "obstacle" else "person"))
            shape = "Point" if kind == "person" else "LineString" if kind in _LINES else "Polygon"
            drawn = marks if shape != "Polygon" else _shape(table, entry, "", marks)[0]["points"]
            ring = [[round(pair[1], 8), round(pair[0], 8)] for x, y in drawn if (pair := _on_earth(case, x, y))]
            places: Any = ring[0] if shape == "Point" else [[*ring, ring[0]]] if shape == "Polygon" else ring
            known = {key: value for key, value in entry.items()
                     if not isinstance(value, (list, dict)) and (kind in _LINES or key not in _PLACED)}  # fmt: skip
            geometry = {"type": shape, "coordinates": places}
            features.append({"type": "Feature", "geometry": geometry, "properties": {**known, "kind": kind}})
    return json.dumps({"type": "FeatureCollection", "features": features}, indent=1)


def imported(case: CaseDocument, path: Path) -> tuple[dict[str, list[dict[str, Any]]], list[str]]:
    """Tables [[exposed]] and [[obstacle]] of a map (GeoJSON, KML, KMZ), and how it was read, as `fragfield convert`.

    Raises InputError: the map cannot be read, or the draft has no place on Earth.
    """
    site = {name: case.get(("site", name)) for name in ("latitude", "longitude", "bearing")}
    found = fragfield.convert(path, set={name: value for name, value in site.items() if value is not None})
    tables = {name: entries for name, entries in found.tables.items() if name in ("exposed", "obstacle")}
    return tables, found.notes
