"""Features of a map as tables [[exposed]] and [[obstacle]]: kinds mapped, properties taken over, distances checked."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from fragfield.case.conversion.exposed_sites import FARTHEST
from fragfield.case.keys import mark_of
from fragfield.case.tables.round import length_of
from fragfield.case.tables.surroundings import (
    AreaTable,
    BarricadeTable,
    ExposedBuildingTable,
    PersonTable,
    PlacesTable,
    RoadTable,
    WallTable,
)
from fragfield.errors import InputError, nearest
from fragfield.places.features import READERS, Feature
from fragfield.places.site import Site
from fragfield_base.errors import show
from fragfield_base.inputs import Quantity
from fragfield_base.units import UnitError, read_measure

if TYPE_CHECKING:
    from shapely import Polygon


Array = NDArray[np.float64]

_BEYOND = 5e3  # m: no fragment flies farther
_LOOSE_BOX = 0.15  # by which the box around a building may be larger than its outline, unsaid
_KINDS: dict[str, tuple[type[BaseModel], str, str]] = {
    "person": (PersonTable, "Point", "exposed"),
    "road": (RoadTable, "LineString", "exposed"),
    "area": (AreaTable, "Polygon", "exposed"),
    "building": (ExposedBuildingTable, "Polygon", "exposed"),
    "barricade": (BarricadeTable, "LineString", "obstacle"),
    "wall": (WallTable, "LineString", "obstacle"),
}
"""Table, shape on the map and list of the case of every kind."""
_PLURALS = {"people": "person", "persons": "person"} | {f"{kind}s": kind for kind in _KINDS}
_PLACED = {"name", "kind", "position", "latitude", "longitude", "points", "points_on_earth", "start", "end", "length",
           "azimuth", "obstacle", "wall", "roof"}  # fmt: skip
"""Keys that the map itself gives, or that are tables."""
_SUFFIX = re.compile(r"^(.*?)[_ ]*[\[(]?\s*(mm|cm|km|m|ft|in|m2|m\^2|ft2|J|kJ)\s*[\])]?$")


def tables_of_places(
    table: PlacesTable, path: Path, site: Site, origin: tuple[float, float] = (0.0, 0.0)
) -> tuple[dict[str, list[dict[str, Any]]], list[str]]:
    """Tables `exposed` and `obstacle` of a file of places, as the case file has them, and what was done, in words.

    `site` says where on Earth `origin`, x and y (m), lies and how the axes are turned. Raises InputError: faults of the
    file, kinds that are not known, shapes that a kind cannot have, sizes that are missing or have no unit, places
    farther than 100 km, or at positions whose latitude and longitude are exchanged.
    """
    if (ending := path.suffix.casefold()) not in READERS:
        raise InputError(f"{path}: found a file that ends in {ending or 'nothing'}; allowed: {', '.join(READERS)}")
    features, notes = READERS[ending](path)
    kinds = _kinds(path, features, table)
    _check_distances(path, [one for one, kind in zip(features, kinds, strict=True) if kind != "ignore"], site)
    made: dict[str, list[dict[str, Any]]] = {"exposed": [], "obstacle": []}
    names: Counter[str] = Counter()
    ignored = 0
    for feature, kind in zip(features, kinds, strict=True):
        if kind == "ignore":
            ignored += 1
            continue
        model, shape, where = _KINDS[kind]
        if feature.shape != shape:
            raise InputError(
                f'{feature.where}: found a {feature.shape} as "{kind}"; allowed: a {shape}'
                f"{'; a place that has an outline is an area or a building' if kind == 'person' else ''}"
            )
        outline = feature.geometry.exterior if shape == "Polygon" else feature.geometry
        line = np.round(site.offsets(*np.array(outline.coords).T) + origin, 3)
        line = line[np.concatenate([[True], (np.diff(line, axis=0) != 0.0).any(axis=1)])]
        if shape == "LineString" and len(line) < 2:
            raise InputError(f"{feature.where}: found a LineString of 1 different position; allowed: 2 or more")
        if shape == "Polygon" and feature.geometry.interiors:
            notes.append(f"{_title(feature)}: its {len(feature.geometry.interiors)} holes count as part of it")
        known = _values(feature, kind, model, table)
        try:
            placed = list(_placed(feature, kind, line, table, known, notes))
        except InputError as fault:
            raise InputError(f"{feature.where}: {fault}") from None
        for place in placed:
            name = feature.name or kind
            names[name] += 1
            own = name if feature.name and names[name] == 1 else f"{name} {names[name]}"
            made[where].append({"name": own, "kind": kind, **place, **known})
    if ignored:
        notes.append(f"{ignored} places ignored by their kind")
    return {key: entries for key, entries in made.items() if entries}, notes


def _title(feature: Feature) -> str:
    return feature.where.rpartition(": ")[2]


def _kinds(path: Path, features: Sequence[Feature], table: PlacesTable) -> list[str]:
    mapped = {key.casefold(): value for key, value in (table.kinds or {}).items()}
    for key, kind in (table.kinds or {}).items():
        if kind not in _KINDS and kind != "ignore":
            hint = nearest(kind, [*_KINDS, "ignore"])
            raise InputError(f'{path}: kinds."{key}": found "{kind}"{hint}; allowed: {", ".join([*_KINDS, "ignore"])}')
    found: list[str] = []
    unknown: Counter[str] = Counter()
    for feature in features:
        value = feature.properties.get(table.kind)
        words = [str(value)] if value not in (None, "") else [*reversed(feature.folders), feature.shape]
        kind = next((known for word in words if (known := _known(word.casefold(), mapped))), "")
        if not kind:
            unknown[words[0] if value not in (None, "") or feature.folders else feature.shape] += 1
        found.append(kind)
    if unknown:
        listed = ", ".join(f'"{word}" ({number})' for word, number in unknown.most_common(8))
        first = next(iter(unknown))
        raise InputError(
            f'{path}: found places of no known kind by the property "{table.kind}", their folder or shape: {listed}; '
            f'allowed: {", ".join([*_KINDS, "ignore"])}; map them, as by kinds = {{ "{first}" = "person" }}, or name '
            "another property as kind"
        )
    return found


def _known(word: str, mapped: Mapping[str, str]) -> str:
    if word in mapped:
        return mapped[word]
    return word if word in _KINDS else _PLURALS.get(word, "")


def _check_distances(path: Path, features: Sequence[Feature], site: Site) -> None:
    """Refuse what is no position on Earth, what lies far from the site, and exchanged latitudes and longitudes."""
    if not features:
        raise InputError(f"{path}: found only places that are ignored")
    import shapely

    every, owners = shapely.get_coordinates([one.geometry for one in features], return_index=True)
    longitude, latitude = every.T
    if np.abs(every).max() > 360.0:
        at = int(np.argmax(np.abs(every).max(axis=1)))
        raise InputError(
            f"{features[owners[at]].where}: found {longitude[at]:g}, {latitude[at]:g}, as of a grid; allowed: "
            "longitude and latitude in degrees (WGS 84), or the name of the grid as crs of a GeoJSON"
        )
    on_earth = np.abs(latitude) <= 90.0
    away = _distances(site, longitude[on_earth], latitude[on_earth])
    swapped = _distances(site, latitude, longitude) if np.abs(longitude).max() <= 90.0 else np.array([np.inf])
    nearest = away.min(initial=np.inf)
    if (not on_earth.all() or nearest > _BEYOND) and swapped.max() < min(FARTHEST, 0.1 * nearest):
        raise InputError(
            f"{path}: its positions {_away(nearest)} as longitude, latitude, and {_away(float(swapped.min()))} as "
            "latitude, longitude: they, or those of [site], are exchanged; allowed: longitude first"
        )
    if not on_earth.all():
        at = int(np.flatnonzero(~on_earth)[0])
        raise InputError(
            f"{features[owners[at]].where}: found the latitude {latitude[at]:g}; allowed: -90 to 90, longitude first"
        )
    if away.max() > FARTHEST:
        at = int(np.argmax(away))
        raise InputError(
            f"{features[owners[at]].where}: lies {_km(away[at])} from the site, at longitude {longitude[at]:g}, "
            f"latitude {latitude[at]:g}; allowed: up to {_km(FARTHEST)}"
        )


def _distances(site: Site, longitude: Array, latitude: Array) -> Array:
    return np.hypot(*site.offsets(longitude, latitude).T) if len(longitude) else np.zeros(0)


def _away(distance: float) -> str:
    return f"lie {_km(distance)} from the site" if math.isfinite(distance) else "are not on Earth"


def _km(distance: float) -> str:
    return f"{1e-3 * distance:.3g} km"


def _placed(
    feature: Feature, kind: str, line: Array, table: PlacesTable, known: dict[str, Any], notes: list[str]
) -> Iterator[dict[str, Any]]:
    if kind == "person":
        yield {"position": _metres(line[0])}
    elif kind == "road":
        yield {"points": [_metres(point) for point in line]}
    elif kind == "area":
        parts = convex_parts(line)
        if len(parts) > 1:
            notes.append(f"{_title(feature)}: not convex, in {len(parts)} parts")
        yield from ({"points": [_metres(point) for point in part]} for part in parts)
    elif kind == "building":
        if "height" not in known and table.building_height is not None:
            known["height"] = f"{table.building_height:.10g} m"
        if "height" not in known:
            raise InputError(
                'height: missing; needed: a property height with its unit, such as "6 m", or places.building_height'
            )
        (centre, length, width, turn), more = box_around(line)
        if more > _LOOSE_BOX:
            notes.append(f"{_title(feature)}: no rectangle; its box is {100.0 * more:.0f} % larger")
        yield {
            "position": _metres(centre),
            "length": f"{length:.3f} m",
            "width": f"{width:.3f} m",
            "azimuth": f"{turn:.3f} deg",
        }
    else:
        if "height" not in known:
            raise InputError('height: missing; needed: a property height with its unit, such as "3 m"')
        yield from ({"start": _metres(start), "end": _metres(end)} for start, end in pairwise(line))


def _metres(point: Sequence[float] | Array) -> list[str]:
    return [f"{round(float(value), 3) + 0.0:g} m" if abs(value) < 1e3 else f"{float(value):.3f} m" for value in point]


def _values(feature: Feature, kind: str, model: type[BaseModel], table: PlacesTable) -> dict[str, Any]:
    made = {}
    for name, value in feature.properties.items():
        if value in (None, "") or isinstance(value, (dict, list, bool)):
            continue
        key, unit = _key_of(name, model)
        if key is None or (key == "width" and kind == "building"):
            continue
        quantity = mark_of(model.model_fields[key], Quantity)
        where = f"{feature.where}: {name}"
        if quantity is None:
            made[key] = _plain(value, where, show_text=key == "ricochet")
        else:
            made[key] = _measure(value, unit, quantity, table, where)
    return made


def _key_of(name: str, model: type[BaseModel]) -> tuple[str | None, str | None]:
    plain = name.strip().casefold().replace(" ", "_")
    keys = [key for key in model.model_fields if key not in _PLACED]
    if plain in keys:
        return plain, None
    found = _SUFFIX.match(name.strip())
    if found is not None and (key := found[1].casefold().replace(" ", "_")) in keys:
        return key, found[2].replace("m2", "m^2").replace("ft2", "ft^2")
    return None, None


def _plain(value: object, where: str, *, show_text: bool) -> object:
    if show_text:
        return str(value)
    try:
        return float(str(value))
    except ValueError:
        raise InputError(f"{where}: found {show(value)}; allowed: a number") from None


def _measure(value: object, unit: str | None, quantity: Quantity, table: PlacesTable, where: str) -> str:
    """A value with its unit: its own, that of the property's name, or for lengths the one asked for."""
    text = str(value).strip()
    try:
        number = float(text)
    except ValueError:
        try:
            read_measure(text)
        except UnitError as fault:
            raise InputError(f'{where}: found "{text}", {fault}') from None
        return text
    length = length_of(table.unit)
    if unit is None and quantity.symbol == "m" and length is not None:
        return f"{number * length:.10g} m"
    if unit is None:
        name = f"{where.rpartition(': ')[2]}_{quantity.symbol.replace('^', '')}"
        raise InputError(
            f'{where}: found {text}, without a unit; allowed: such as "{quantity.example}"; give it there, in the name '
            f"of the property as {name}, or for lengths as places.unit"
        )
    return f"{number:.10g} {unit}"


Box = tuple[tuple[float, float], float, float, float]
"""Centre, length, width (m) and direction of the length from +x (degrees)."""
_ALIKE = 1e-3  # of the area: by which a convex hull may be larger
_NEAR = 0.02  # m: a corner nearer to the line between its neighbours is none
_MOST = 500  # corners


def _outline(corners: Array) -> Polygon:
    import shapely

    outline = shapely.Polygon(corners) if len(corners) > 2 else shapely.Polygon()
    if not outline.convex_hull.area > 0.0:
        raise InputError("found an outline without area; allowed: three corners or more that are not on a line")
    return outline


def box_around(corners: Array) -> tuple[Box, float]:
    """The smallest box around corners (n, 2) in m, and how much larger than the outline it is, as a fraction."""
    outline = _outline(corners)
    hull = np.array(outline.convex_hull.exterior.coords)
    # One of its sides lies along one of the hull's.
    along = np.diff(hull, axis=0) / np.hypot(*np.diff(hull, axis=0).T)[:, None]
    across = np.column_stack([-along[:, 1], along[:, 0]])
    low, high = (np.stack([edge(hull @ way.T, axis=0) for way in (along, across)]) for edge in (np.min, np.max))
    sides = high - low
    best = int(np.argmin(np.round(sides.prod(axis=0), 9)))
    centre = 0.5 * (low + high)[:, best] @ np.array([along[best], across[best]])
    turn = math.degrees(math.atan2(along[best, 1], along[best, 0])) + (90.0 if sides[1, best] > sides[0, best] else 0.0)
    width, length = sorted(sides[:, best].tolist())
    return ((float(centre[0]), float(centre[1])), length, width, turn % 180.0), length * width / outline.area - 1.0


def convex_parts(corners: Array) -> list[Array]:
    """Convex polygons, counter-clockwise, that make up an outline: triangles joined while they stay convex.

    Raises InputError: the outline has no area or crosses itself.
    """
    import shapely

    outline = _outline(corners)
    parts = [outline]
    if outline.convex_hull.area > outline.area * (1.0 + _ALIKE):
        if not outline.is_valid:
            raise InputError("found an outline that crosses itself; allowed: a simple one")
        outline = outline.simplify(_NEAR)
        if len(outline.exterior.coords) > _MOST:
            raise InputError(f"found an outline of more than {_MOST} corners that is not convex; allowed: {_MOST}")
        parts = list(shapely.get_parts(shapely.constrained_delaunay_triangles(outline)))
    first = 0
    while first < len(parts):
        for other in range(first + 1, len(parts)):
            whole = parts[first].union(parts[other])
            if whole.convex_hull.area <= whole.area * (1.0 + 1e-9):
                parts[first] = whole
                del parts[other]
                break
        else:
            first += 1
    return [np.array(shapely.geometry.polygon.orient(one.convex_hull).exterior.coords)[:-1] for one in parts]
