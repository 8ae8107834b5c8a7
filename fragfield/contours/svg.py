"""Curves of an SVG drawing: transformations applied, its scale by width and viewBox; texts and images are counted."""

from __future__ import annotations

import re
from collections import Counter
from functools import partial
from io import BytesIO
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import numpy as np

from fragfield.contours.curves import FINE, Curve, Sheet, folded, is_axis_name, sampled
from fragfield.errors import InputError
from fragfield_base.reading import parsed_xml, read_bytes

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path


_LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
_LENGTH = re.compile(r"^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([a-zA-Z%]*)\s*$")
_METRES = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "pt": 0.0254 / 72.0, "pc": 0.0254 / 6.0, "q": 0.25e-3}
_PIXELS = (("CSS and Inkscape since 0.92", 96.0), ("older Inkscape", 90.0), ("Illustrator", 72.0))
_MOST_BYTES = 1 << 26
_ALIKE = 2e-3  # of the scales along x and y


def read_svg(path: Path, *, unit: float | None, layers: Sequence[str] | None, tolerance: float) -> Sheet:
    """Curves of an SVG file.

    `unit` is the length (m) of a number in the coordinates of its outermost element; None: as its `width`, `height` and
    `viewBox` say, in mm, cm, in, pt or pc; pixels have no length. `layers` are labels or names (id) of the groups or
    shapes of the contour, None all; `tolerance` is that by which it may be off (m). Raises InputError: no SVG,
    svgelements missing, no scale, an unknown layer, nothing that could be a contour.
    """
    try:
        from svgelements import SVG
    except ImportError:
        raise InputError(
            f"{path}: drawings need svgelements: pip install 'fragfield[drawings]', or pip install svgelements"
        ) from None
    root = parsed_xml(read_bytes(path, InputError, most=_MOST_BYTES), str(path), InputError)
    if root.tag.rpartition("}")[2] != "svg":
        raise InputError(f"{path}: found XML whose outermost element is {root.tag!r}; allowed: an SVG")
    scale, note = _scale(path, root, unit)
    for name in ("width", "height", "viewBox"):  # one user unit is then one pixel of the library
        root.attrib.pop(name, None)
    try:
        drawing = SVG.parse(BytesIO(ET.tostring(root)), reify=True)
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, ZeroDivisionError, RecursionError) as fault:
        raise InputError(f"{path}: not an SVG that can be read ({type(fault).__name__}: {fault})") from None
    ignored: Counter[str] = Counter()
    present: Counter[str] = Counter()
    curves: list[Curve] = []
    axes: list[Curve] = []
    wanted = None if layers is None else {name.casefold() for name in layers}
    known: set[str] = set()
    for shape, names in _shapes(drawing, (), ignored):
        known.update(names)
        layer = names[-1] if names else ""
        pieces = [Curve(points, layer) for points in _points(shape, scale, FINE * tolerance)]
        if any(is_axis_name(name) for name in names):
            axes += [piece for piece in pieces if piece.is_straight]
            continue
        present[layer] += len(pieces)
        if wanted is None or any(name.casefold() in wanted for name in names):
            curves += pieces
    folded(path, layers or (), known)
    if not curves:
        listed = ", ".join(f"{number} {kind}" for kind, number in sorted(ignored.items())) or "nothing"
        raise InputError(f"{path}: found no path, line, polygon, rectangle, circle or ellipse, only {listed}")
    return Sheet(curves, axes, scale, dict(present), dict(ignored), [note], up=-1.0)


def _scale(path: Path, root: ET.Element, asked: float | None) -> tuple[float, str]:
    """Metres of a user unit, and how that is known."""
    if asked is not None:
        return asked, f"one user unit is {1e3 * asked:.6g} mm, as asked for"
    width, height = root.get("width", ""), root.get("height", "")
    box = [_number(part) for part in re.split(r"[\s,]+", root.get("viewBox", "").strip()) if part]
    lengths = [_LENGTH.match(text) for text in (width, height)]
    units = [found[2].casefold() if found else "" for found in lengths]
    if not any(unit in _METRES for unit in units) or len(box) != 4 or not min(box[2:]) > 0.0:
        raise InputError(f"{path}: {_no_scale(width, height, box, units)}")
    scales = [
        float(found[1]) * _METRES[unit] / extent
        for found, unit, extent in zip(lengths, units, box[2:], strict=True)
        if found and unit in _METRES
    ]
    stretched = "none" in root.get("preserveAspectRatio", "")
    if len(scales) == 2 and abs(scales[0] / scales[1] - 1.0) > _ALIKE and stretched:
        raise InputError(
            f"{path}: found a drawing that is stretched, {1e3 * scales[0]:.4g} mm a unit along x and "
            f"{1e3 * scales[1]:.4g} mm along y; allowed: one scale"
        )
    scale = max(scales) if "slice" in root.get("preserveAspectRatio", "") else min(scales)
    if not 0.0 < scale < np.inf:
        raise InputError(f"{path}: found width = {width!r}, height = {height!r}; allowed: lengths above 0")
    return scale, f"one user unit is {1e3 * scale:.6g} mm, by width {width} and viewBox"


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _no_scale(width: str, height: str, box: list[float], units: list[str]) -> str:
    """Why a drawing has no scale, and what its user unit is by the usual pixels."""
    shown = f"width = {width or 'none'}, height = {height or 'none'}, viewBox of {len(box)} numbers"
    guesses = ", ".join(f"{25.4 / dots:.6g} mm ({who}, {dots:g} to the inch)" for who, dots in _PIXELS)
    why = (
        "whose pixels have no length"
        if not any(unit in _METRES for unit in units)
        else "without the viewBox they scale"
    )
    return f'found {shown}, {why}; needed: unit, the length of one user unit, such as "1 mm"; of pixels it is {guesses}'


def _shapes(drawing: Any, names: tuple[str, ...], ignored: Counter[str]) -> Iterator[tuple[Any, tuple[str, ...]]]:  # noqa: ANN401
    """Shapes of a group, with the names of the groups they lie in and their own."""
    from svgelements import Group, Path, Shape, Use

    for element in drawing:
        here = (*names, *_names(element))
        if isinstance(element, (Group, Use)):
            yield from _shapes(element, here, ignored)
        elif not isinstance(element, Shape):
            ignored[str(type(element).__name__).replace("SVG", "").casefold() or "element"] += 1
        elif str(element.values.get("visibility", "")).casefold() in ("hidden", "collapse"):
            ignored["hidden"] += 1
        else:
            yield Path(element), here


def _names(element: Any) -> tuple[str, ...]:  # noqa: ANN401
    own = element.values.get("attributes", {})
    return tuple(str(own[key]) for key in ("id", _LABEL) if own.get(key))


def _points(shape: Any, scale: float, deviation: float) -> Iterator[np.ndarray[Any, Any]]:  # noqa: ANN401
    """Points of every segment of a path (m), y up."""
    from svgelements import Close, Line, Move

    for segment in shape:
        if isinstance(segment, Move) or segment.start is None or segment.end is None:
            continue
        if isinstance(segment, (Line, Close)):
            points = np.array([tuple(segment.start), tuple(segment.end)], dtype=np.float64)
        else:
            points = sampled(partial(_along, segment), deviation / scale)
        points = points * (scale, -scale)
        points = points[np.concatenate([[True], (np.diff(points, axis=0) != 0.0).any(axis=1)])]
        if len(points) > 1 and np.isfinite(points).all():
            yield points


def _along(segment: Any, share: np.ndarray[Any, Any]) -> list[tuple[float, float]]:  # noqa: ANN401
    return [tuple(segment.point(float(t))) for t in share]
