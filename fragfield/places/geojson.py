"""Features of a GeoJSON file (RFC 7946), and of older ones that name a coordinate system."""

from __future__ import annotations

import json
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.files.raster import INSTALL
from fragfield.errors import InputError
from fragfield.places.feature import MOST_BYTES, Feature, positions
from fragfield_base.reading import read_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from fragfield.places.feature import Shape

    Array = NDArray[np.float64]

__all__ = ["read_geojson"]

_SHAPES: dict[str, tuple[Shape, int]] = {
    "Point": ("Point", 0), "MultiPoint": ("Point", 1), "LineString": ("LineString", 0),
    "MultiLineString": ("LineString", 1), "Polygon": ("Polygon", 0), "MultiPolygon": ("Polygon", 1),
}  # fmt: skip
"""Shape of a geometry's parts, and whether it has several."""
_WGS84 = ("CRS84", "EPSG:4326", "EPSG::4326", "EPSG:6.6:4326", "WGS84")
_NAMES = ("name", "Name", "NAME", "title", "label")
_DEEPEST = 8


def read_geojson(path: Path) -> tuple[list[Feature], list[str]]:
    """Features of a GeoJSON file, and what was left out or done to them, in words.

    Raises
    ------
    InputError
        No GeoJSON, a coordinate system that is not known, positions that are none, no features.
    """
    try:
        found = json.loads(read_text(path, InputError, most=MOST_BYTES), parse_constant=_no_constant)
    except RecursionError:
        raise InputError(f"{path}: not a GeoJSON: nested too deep") from None
    except json.JSONDecodeError as fault:
        several = (
            "; one feature a line is no GeoJSON: put them into a FeatureCollection" if fault.msg == "Extra data" else ""
        )
        raise InputError(f"{path}: not JSON ({fault.msg} at line {fault.lineno}){several}") from None
    except ValueError as fault:
        raise InputError(f"{path}: not a GeoJSON ({fault})") from None
    if not isinstance(found, dict) or not isinstance(found.get("type"), str):
        raise InputError(f"{path}: found JSON without a type; allowed: a FeatureCollection of GeoJSON")
    to_earth, words = _coordinates(path, found)
    left_out: Counter[str] = Counter()
    features = list(_features(path, found, to_earth, left_out))
    if not features:
        raise InputError(f"{path}: found no feature with a place in it")
    notes = [words] if words else []
    notes += [f"{number} {what} left out" for what, number in left_out.items()]
    return features, notes


def _no_constant(name: str) -> None:
    raise ValueError(f"{name} is not JSON")


def _coordinates(path: Path, found: dict[str, Any]) -> tuple[Callable[[Array], Array], str]:
    """What turns the file's positions into longitudes and latitudes on WGS 84, and which system it names."""
    if "crs" not in found:
        return _as_they_are, ""
    crs = found["crs"]
    name = (
        crs.get("properties", {}).get("name")
        if isinstance(crs, dict) and isinstance(crs.get("properties"), dict)
        else None
    )
    if not isinstance(name, str):
        raise InputError(
            f"{path}: crs: found {json.dumps(crs)[:80]}; allowed: the name of a coordinate system, or no crs: WGS 84"
        )
    if any(name.upper().endswith(known) for known in _WGS84):
        return _as_they_are, ""
    try:
        import pyproj
    except ImportError:
        raise InputError(f"{path}: crs: found {name}, which needs pyproj: {INSTALL}; or a file in WGS 84") from None
    try:
        system = pyproj.CRS.from_user_input(name)
        # A name alone is searched for, and a part of another name is found.
        if ":" not in name and system.name.casefold() != name.casefold():
            raise pyproj.exceptions.CRSError(name)
        turn = pyproj.Transformer.from_crs(system, "EPSG:4326", always_xy=True)
    except pyproj.exceptions.CRSError:
        raise InputError(
            f'{path}: crs: found "{name}"; allowed: a coordinate system that pyproj knows, such as EPSG:25832'
        ) from None

    def to_earth(points: Array) -> Array:
        return np.column_stack(turn.transform(points[:, 0], points[:, 1]))

    return to_earth, f"positions turned from {name} to WGS 84"


def _as_they_are(points: Array) -> Array:
    return points


def _features(
    path: Path, found: dict[str, Any], to_earth: Callable[[Array], Array], left_out: Counter[str]
) -> Iterator[Feature]:
    kind = found["type"]
    if kind == "FeatureCollection":
        members = found.get("features")
        if not isinstance(members, list):
            raise InputError(f"{path}: features: found {type(members).__name__}; allowed: a list")
    elif kind == "Feature":
        members = [found]
    elif kind in _SHAPES or kind == "GeometryCollection":
        members = [{"type": "Feature", "geometry": found, "properties": None}]
    else:
        raise InputError(
            f'{path}: found the type "{kind}"; allowed: a FeatureCollection, a Feature or a geometry of GeoJSON'
        )
    for number, member in enumerate(members, start=1):
        where = f"{path}: feature {number}"
        if not isinstance(member, dict) or member.get("type") != "Feature":
            raise InputError(f"{where}: found no Feature; allowed: an object of that type")
        known = member.get("properties") or {}
        if not isinstance(known, dict):
            raise InputError(f"{where}: properties: found {type(known).__name__}; allowed: an object or null")
        name = next((str(known[key]) for key in _NAMES if known.get(key) not in (None, "")), "")
        where += f' ("{name}")' if name else ""
        geometry = member.get("geometry")
        if geometry is None:
            left_out["features without a place"] += 1
            continue
        for shape, rings in _geometries(geometry, where, 0):
            yield Feature(name, shape, tuple(map(to_earth, rings)), known, (), where)


def _geometries(geometry: Any, where: str, depth: int) -> Iterator[tuple[Shape, tuple[Array, ...]]]:  # noqa: ANN401
    kind = geometry.get("type") if isinstance(geometry, dict) else None
    if kind == "GeometryCollection" and depth < _DEEPEST:
        for part in geometry.get("geometries") or []:
            yield from _geometries(part, where, depth + 1)
        return
    if kind not in _SHAPES:
        raise InputError(
            f'{where}: found a geometry of the type "{kind}"; allowed: {", ".join([*_SHAPES, "GeometryCollection"])}'
        )
    shape, several = _SHAPES[kind]
    given = geometry.get("coordinates")
    if not isinstance(given, list) or not given:
        raise InputError(f"{where}: found a {kind} without coordinates; allowed: longitude, latitude")
    for part in given if several else [given]:
        if shape == "Point":
            yield shape, (positions([part], shape, where),)
        elif shape == "LineString":
            yield shape, (positions(part, shape, where),)
        elif isinstance(part, list):
            yield shape, tuple(positions(ring, shape, where) for ring in part)
        else:
            raise InputError(f"{where}: found a Polygon without rings; allowed: a list of rings")
