"""Placemarks of a KML or KMZ file: points, lines and polygons with their folders, names and extended data."""

from __future__ import annotations

import zipfile
from collections import Counter
from io import BytesIO
from typing import TYPE_CHECKING

from fragfield.errors import InputError
from fragfield.files.xml_text import parsed_xml
from fragfield.places.feature import MOST_BYTES, Feature, positions
from fragfield_base.reading import read_bytes

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from xml.etree.ElementTree import Element

    from fragfield.places.feature import Array, Shape

__all__ = ["read_kml"]

_FOLDERS = ("kml", "Document", "Folder")
_DEEPEST = 64
_NOT_READ = ("NetworkLink", "GroundOverlay", "ScreenOverlay", "PhotoOverlay", "Tour", "Model", "Track", "MultiTrack")


def read_kml(path: Path) -> tuple[list[Feature], list[str]]:
    """Features of a KML file, of a KMZ those of its main document, and what was left out, in words.

    Heights play no part: sites stand on the ground of the case. That is said where a placemark stands above it.

    Raises
    ------
    InputError
        No KML, an XML entity that is not harmless, positions that are none, no placemarks.
    """
    root = parsed_xml(_document(path, read_bytes(path, InputError, most=MOST_BYTES)), str(path))
    if _tag(root) != "kml":
        raise InputError(f"{path}: found XML whose outermost element is {_tag(root)!r}; allowed: a KML")
    left_out: Counter[str] = Counter()
    features: list[Feature] = []
    for number, (placemark, folders) in enumerate(_placemarks(root, (), left_out, 0), start=1):
        features += _of_placemark(path, placemark, folders, number, left_out)
    if not features:
        listed = ", ".join(f"{number} {what}" for what, number in left_out.items()) or "nothing"
        raise InputError(f"{path}: found no placemark with a point, a line or a polygon, only {listed}")
    high = left_out.pop("above the ground", 0)
    notes = [f"{number} {what} left out" for what, number in left_out.items()]
    if high:
        notes.append(f"{high} placemarks stand above the ground in the file; their heights are not used")
    return features, notes


def _document(path: Path, data: bytes) -> bytes:
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
            with archive.open(chosen) as stream:
                return stream.read(MOST_BYTES)
    except (zipfile.BadZipFile, RuntimeError, NotImplementedError, EOFError, OSError) as fault:
        raise InputError(f"{path}: not a KMZ that can be read ({fault})") from None


def _tag(element: Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _child(element: Element, name: str) -> Element | None:
    return next((one for one in element if _tag(one) == name), None)


def _text(element: Element | None) -> str:
    return "" if element is None else (element.text or "").strip()


def _placemarks(
    element: Element, folders: tuple[str, ...], left_out: Counter[str], depth: int
) -> Iterator[tuple[Element, tuple[str, ...]]]:
    if depth > _DEEPEST:
        raise InputError(f"found folders nested deeper than {_DEEPEST}; allowed: fewer")
    for child in element:
        tag = _tag(child)
        if tag == "Placemark":
            yield child, folders
        elif tag in _FOLDERS:
            name = _text(_child(child, "name"))
            yield from _placemarks(child, (*folders, name) if name else folders, left_out, depth + 1)
        elif tag in _NOT_READ:
            left_out[tag] += 1


def _of_placemark(
    path: Path, placemark: Element, folders: tuple[str, ...], number: int, left_out: Counter[str]
) -> Iterator[Feature]:
    name = _text(_child(placemark, "name"))
    where = f"{path}: placemark {number}" + (f' ("{name}")' if name else "")
    known = dict(_properties(placemark))
    found = list(_geometries(placemark, where, left_out, 0))
    if not found:
        left_out["placemarks without a place"] += 1
    for shape, rings in found:
        yield Feature(name, shape, rings, known, folders, where)


def _properties(placemark: Element) -> Iterator[tuple[str, str]]:
    """Extended data: <Data name><value>, and <SimpleData name> of a schema."""
    extended = _child(placemark, "ExtendedData")
    for element in () if extended is None else extended.iter():
        if _tag(element) == "Data" and element.get("name"):
            yield element.get("name", ""), _text(_child(element, "value"))
        elif _tag(element) == "SimpleData" and element.get("name"):
            yield element.get("name", ""), _text(element)


def _geometries(
    element: Element, where: str, left_out: Counter[str], depth: int
) -> Iterator[tuple[Shape, tuple[Array, ...]]]:
    for child in element:
        tag = _tag(child)
        if tag == "MultiGeometry" and depth < _DEEPEST:
            yield from _geometries(child, where, left_out, depth + 1)
        elif tag == "Point":
            yield "Point", (_positions(child, "Point", where, left_out),)
        elif tag == "LineString":
            yield "LineString", (_positions(child, "LineString", where, left_out),)
        elif tag == "LinearRing":
            yield "Polygon", (_positions(child, "Polygon", where, left_out),)
        elif tag == "Polygon":
            rings = [
                _positions(ring, "Polygon", where, left_out)
                for boundary in ("outerBoundaryIs", "innerBoundaryIs")
                for held in child
                if _tag(held) == boundary
                for ring in held
                if _tag(ring) == "LinearRing"
            ]
            if not rings:
                raise InputError(f"{where}: found a Polygon without an outerBoundaryIs; allowed: one LinearRing in it")
            yield "Polygon", tuple(rings)
        elif tag in _NOT_READ:
            left_out[tag] += 1


def _positions(element: Element, shape: Shape, where: str, left_out: Counter[str]) -> Array:
    text = _text(_child(element, "coordinates"))
    tuples = [part.split(",") for part in text.split()]
    if not tuples or any(not 2 <= len(one) <= 3 or "" in one for one in tuples):
        bad = next((",".join(one) for one in tuples if not 2 <= len(one) <= 3 or "" in one), "nothing")
        raise InputError(
            f'{where}: coordinates: found "{bad[:40]}"; allowed: longitude,latitude or longitude,latitude,altitude '
            "without blanks in it, with decimal points"
        )
    mode = _text(_child(element, "altitudeMode"))
    if mode not in ("", "clampToGround", "clampToSeaFloor") and any(
        len(one) == 3 and one[2].strip("0.-+") for one in tuples
    ):
        left_out["above the ground"] += 1
    return positions(tuples, shape, where)
