"""Features of GeoJSON (RFC 7946), KML and KMZ files."""

from __future__ import annotations

import json
import zipfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree.ElementTree import Element, ParseError, fromstring

import numpy as np

from fragfield.errors import InputError
from fragfield_base.reading import read_bytes, read_text

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

MOST_BYTES = 1 << 26
"""Of a file that is read."""
SHAPES = ("Point", "LineString", "Polygon")


@dataclass(frozen=True, eq=False)
class Feature:
    """One point, line or polygon."""

    name: str
    """Empty where it has none."""
    geometry: BaseGeometry
    """A Point, LineString or Polygon in longitude and latitude (degrees)."""
    properties: dict[str, Any] = field(default_factory=dict)
    """By name."""
    folders: tuple[str, ...] = ()
    """Those of a KML that it lies in, the innermost last."""
    where: str = ""
    """For messages: 'feature 3 ("school")'."""

    @property
    def shape(self) -> str:
        """One of `SHAPES`."""
        return str(self.geometry.geom_type)


def _parts(geometry: BaseGeometry) -> Iterator[BaseGeometry]:
    if geometry.geom_type in SHAPES:
        yield geometry
    else:
        for part in geometry.geoms:
            yield from _parts(part)


_WGS84 = ("CRS84", "EPSG:4326", "EPSG::4326", "WGS84")
_NAMES = ("name", "Name", "NAME", "title", "label")


def read_geojson(path: Path) -> tuple[list[Feature], list[str]]:
    """Features of a GeoJSON file, and what was left out or done to them, in words.

    Raises InputError: no GeoJSON, a coordinate system other than WGS 84, positions that are none, no features.
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
    if "crs" in found and not _name_of(found["crs"]).upper().endswith(_WGS84):
        raise InputError(
            f"{path}: crs: found {json.dumps(found['crs'])[:80]}; allowed: longitude and latitude on WGS 84 "
            "(EPSG:4326), as which every program exports GeoJSON"
        )
    left_out: Counter[str] = Counter()
    features = list(_features(path, found, left_out))
    if not features:
        raise InputError(f"{path}: found no feature with a place in it")
    return features, [f"{number} {what} left out" for what, number in left_out.items()]


def _name_of(crs: object) -> str:
    properties = crs.get("properties") if isinstance(crs, dict) else None
    return str(properties.get("name", "")) if isinstance(properties, dict) else ""


def _no_constant(name: str) -> None:
    raise ValueError(f"{name} is not JSON")


def _features(path: Path, found: dict[str, Any], left_out: Counter[str]) -> Iterator[Feature]:
    import shapely
    from shapely.geometry import shape

    members = [found] if found["type"] == "Feature" else found.get("features")
    if found["type"] not in ("Feature", "FeatureCollection"):
        if "coordinates" not in found and "geometries" not in found:
            kind = found["type"]
            raise InputError(
                f'{path}: found the type "{kind}"; allowed: a FeatureCollection, a Feature or a geometry of GeoJSON'
            )
        members = [{"type": "Feature", "geometry": found}]
    if not isinstance(members, list):
        raise InputError(f"{path}: features: found {type(members).__name__}; allowed: a list")
    for number, member in enumerate(members, start=1):
        where = f"{path}: feature {number}"
        known = (member.get("properties") or {}) if isinstance(member, dict) else None
        if not isinstance(member, dict) or not isinstance(known, dict) or member.get("type") != "Feature":
            raise InputError(
                f"{where}: found no Feature; allowed: an object of that type, with an object of properties"
            )
        name = next((str(known[key]) for key in _NAMES if known.get(key) not in (None, "")), "")
        where += f' ("{name}")' if name else ""
        if member.get("geometry") is None:
            left_out["features without a place"] += 1
            continue
        try:
            whole = shapely.force_2d(shape(member["geometry"]))
            if whole.is_empty or not np.isfinite(shapely.get_coordinates(whole)).all():
                raise ValueError("without finite coordinates")
        except (ValueError, TypeError, KeyError, IndexError, AttributeError, shapely.errors.ShapelyError) as fault:
            raise InputError(
                f"{where}: found no geometry that can be read ({fault}); allowed: a Point, LineString or Polygon of "
                "longitude, latitude, or several"
            ) from None
        for part in _parts(whole):
            yield Feature(name, part, known, (), where)


_FOLDERS = ("kml", "Document", "Folder")
_NOT_READ = ("NetworkLink", "GroundOverlay", "ScreenOverlay", "PhotoOverlay", "Tour", "Model", "Track", "MultiTrack")


def read_kml(path: Path) -> tuple[list[Feature], list[str]]:
    """Features of a KML file, of a KMZ those of its main document, and what was left out, in words.

    What is switched off (visibility 0, of the placemark or of a folder that it lies in) is left out. Heights play no
    part: sites stand on the ground of the case. Raises InputError: no KML, positions that are none, no placemarks.
    """
    left_out: Counter[str] = Counter()
    try:
        root = fromstring(_document(path, read_bytes(path, InputError, most=MOST_BYTES), left_out))
    except (ParseError, LookupError, ValueError) as fault:
        raise InputError(f"{path}: not well-formed XML ({fault})") from None
    if _tag(root) != "kml":
        raise InputError(f"{path}: found XML whose outermost element is {_tag(root)!r}; allowed: a KML")
    features: list[Feature] = []
    try:
        for number, (placemark, folders, is_shown) in enumerate(_placemarks(root, (), left_out), start=1):
            if is_shown:
                features += _of_placemark(path, placemark, folders, number, left_out)
            else:
                left_out["placemarks switched off in the file (visibility 0)"] += 1
    except RecursionError:
        raise InputError(f"{path}: found folders or geometries nested too deep; allowed: fewer") from None
    if not features:
        listed = ", ".join(f"{number} {what}" for what, number in left_out.items()) or "nothing"
        raise InputError(f"{path}: found no placemark with a point, a line or a polygon, only {listed}")
    return features, [f"{number} {what} left out" for what, number in left_out.items()]


def _document(path: Path, data: bytes, left_out: Counter[str]) -> bytes:
    """The KML of a file, of a KMZ that of its archive's first .kml, the one in its root before others."""
    if not data.startswith(b"PK"):
        return data
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            names = [one for one in archive.infolist() if one.filename.casefold().endswith(".kml")]
            if not names:
                raise InputError(f"{path}: found an archive without a .kml; allowed: a KMZ")
            chosen = min(names, key=lambda one: one.filename.count("/"))
            if chosen.file_size > MOST_BYTES:
                raise InputError(
                    f"{path}: {chosen.filename} has {chosen.file_size} bytes; allowed: at most {MOST_BYTES}"
                )
            if len(names) > 1:
                left_out[f"further .kml of the archive (beside {chosen.filename})"] = len(names) - 1
            with archive.open(chosen) as stream:
                return stream.read(MOST_BYTES)
    except (zipfile.BadZipFile, RuntimeError, NotImplementedError, EOFError, OSError) as fault:
        raise InputError(f"{path}: not a KMZ that can be read ({fault})") from None


def _tag(element: Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _text(element: Element, child: str) -> str:
    return element.findtext(f"{{*}}{child}", "").strip()


def _placemarks(
    element: Element, folders: tuple[str, ...], left_out: Counter[str], is_shown: bool = True
) -> Iterator[tuple[Element, tuple[str, ...], bool]]:
    """Placemarks, the folders that they lie in, and whether both are switched on."""
    for child in element:
        tag = _tag(child)
        is_on = is_shown and _text(child, "visibility") not in ("0", "false")
        if tag == "Placemark":
            yield child, folders, is_on
        elif tag in _FOLDERS:
            name = _text(child, "name")
            yield from _placemarks(child, (*folders, name) if name else folders, left_out, is_on)
        elif tag in _NOT_READ:
            left_out[tag] += 1


def _of_placemark(
    path: Path, placemark: Element, folders: tuple[str, ...], number: int, left_out: Counter[str]
) -> Iterator[Feature]:
    name = _text(placemark, "name")
    where = f"{path}: placemark {number}" + (f' ("{name}")' if name else "")
    known = dict(_properties(placemark))
    found = list(_elements(placemark, where, left_out))
    if not found:
        left_out["placemarks without a place"] += 1
    for geometry in found:
        yield Feature(name, geometry, known, folders, where)


def _properties(placemark: Element) -> Iterator[tuple[str, str]]:
    extended = placemark.find("{*}ExtendedData")
    for element in () if extended is None else extended.iter():
        if _tag(element) == "Data" and element.get("name"):
            yield element.get("name", ""), _text(element, "value")
        elif _tag(element) == "SimpleData" and element.get("name"):
            yield element.get("name", ""), (element.text or "").strip()


def _elements(element: Element, where: str, left_out: Counter[str]) -> Iterator[BaseGeometry]:
    import shapely

    for child in element:
        tag = _tag(child)
        if tag == "MultiGeometry":
            yield from _elements(child, where, left_out)
        elif tag in _NOT_READ:
            left_out[tag] += 1
        elif tag in ("Point", "LineString", "LinearRing", "Polygon"):
            rings = [child]
            if tag == "Polygon":
                bounds = [one for name in ("outer", "inner") for one in child if _tag(one) == f"{name}BoundaryIs"]
                rings = [ring for one in bounds for ring in one if _tag(ring) == "LinearRing"]
                if not rings:
                    raise InputError(
                        f"{where}: found a Polygon without an outerBoundaryIs; allowed: one LinearRing in it"
                    )
            placed = [_positions(ring, where) for ring in rings]
            try:
                if tag == "Point":
                    yield shapely.Point(placed[0][0])
                elif tag == "LineString":
                    yield shapely.LineString(placed[0])
                else:
                    yield shapely.Polygon(placed[0], placed[1:])
            except (ValueError, shapely.errors.ShapelyError) as fault:
                raise InputError(f"{where}: found a {tag} that cannot be read ({fault})") from None


def _positions(element: Element, where: str) -> list[tuple[float, float]]:
    tuples = [part.split(",") for part in _text(element, "coordinates").split()]
    try:
        if not all(2 <= len(one) <= 3 for one in tuples):
            raise ValueError
        placed = [(float(one[0]), float(one[1])) for one in tuples]
        if not placed or not np.isfinite(placed).all():
            raise ValueError
    except ValueError:
        shown = " ".join(map(",".join, tuples))[:40] or "nothing"
        raise InputError(
            f'{where}: coordinates: found "{shown}"; allowed: longitude,latitude or longitude,latitude,altitude '
            "without blanks in it, with decimal points"
        ) from None
    return placed


READERS = {".geojson": read_geojson, ".json": read_geojson, ".kml": read_kml, ".kmz": read_kml}
"""By the ends of files' names."""
