"""Curves of a DXF drawing: blocks exploded, its unit, its centre lines; what is no contour is counted."""

from __future__ import annotations

import re
import struct
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.contours.section import FINE, Curve, Sheet, folded, is_axis_name, sampled
from fragfield.errors import InputError
from fragfield_base.reading import read_bytes

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.entities.dxfgfx import DXFGraphic


# $INSUNITS of the DXF reference in which a round may be drawn: name and metres.
_UNITS = {
    1: ("inches", 0.0254), 2: ("feet", 0.3048), 4: ("millimetres", 1e-3), 5: ("centimetres", 1e-2), 6: ("metres", 1.0),
    8: ("microinches", 2.54e-8), 9: ("mils", 2.54e-5), 10: ("yards", 0.9144), 13: ("microns", 1e-6),
    14: ("decimetres", 0.1), 21: ("US survey feet", 1200.0 / 3937.0), 22: ("US survey inches", 100.0 / 3937.0),
}  # fmt: skip
_CURVES = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE", "LWPOLYLINE", "POLYLINE")
_CENTRE = re.compile(r"CENT(ER|RE)|DASHDOT|STRICHPUNKT|MITTE|ACAD_ISO0[48]W|ACAD_ISO10W|AXES", re.IGNORECASE)
_HIDDEN = re.compile(r"^(HIDDEN|DASHED|ACAD_ISO0[23]W|VERDECKT|PHANTOM)", re.IGNORECASE)
_MOST_BYTES = 1 << 27
_MOST_ENTITIES = 200_000
_DEEPEST = 16
_BINARY = b"AutoCAD Binary DXF\r\n\x1a\x00"
_RELEASE_2000 = b"  0\nSECTION\n  2\nHEADER\n  9\n$ACADVER\n  1\nAC1015\n  0\nENDSEC\n"
_FLAT = 1e-6  # z over the extent that still is the plane of the sheet


def read_dxf(path: Path, *, unit: float | None, layers: Sequence[str] | None, tolerance: float) -> Sheet:
    """Curves of the model space of a DXF file, text or binary of any release.

    `unit` is the length of one unit of the file (m), None as its header says; `layers` those of the contour, None all;
    `tolerance` that by which the contour may be off (m). Raises InputError: no DXF, ezdxf missing, an unknown unit or
    layer, nothing that could be a contour, curves off the plane.
    """
    document = _opened(path)
    found, notes = _unit(path, document, unit)
    wanted = None if layers is None else _layers(path, document, layers)
    ignored: Counter[str] = Counter()
    present: Counter[str] = Counter()
    curves: list[Curve] = []
    axes: list[Curve] = []
    for entity, layer in _entities(document, ignored, notes):
        kind = entity.dxftype()
        if kind not in _CURVES:
            ignored[kind] += 1
            continue
        known = document.layers.get(layer) if layer in document.layers else None
        if entity.dxf.get("invisible", 0) or (known is not None and (known.is_off() or known.is_frozen())):
            ignored["on a layer that is off or frozen, or invisible"] += 1
            continue
        line = str(entity.dxf.get("linetype", "BYLAYER"))
        if line.upper() in ("BYLAYER", "BYBLOCK"):
            line = "" if known is None else str(known.dxf.linetype)
        pieces = [Curve(points * found, layer) for points in _points(path, entity, FINE * tolerance / found)]
        if not pieces:
            ignored[f"{kind} of no length"] += 1
            continue
        if _CENTRE.search(line) or (is_axis_name(layer) and kind == "LINE"):
            axes += [piece for piece in pieces if len(piece.points) == 2]
            continue
        if _HIDDEN.search(line):
            ignored[f"{kind} of line type {line}"] += 1
            continue
        present[layer] += len(pieces)
        if wanted is None or layer.casefold() in wanted:
            curves += pieces
    if not curves:
        raise InputError(f"{path}: {_nothing(document, present, ignored, layers)}")
    return Sheet(curves, axes, found, dict(present), dict(ignored), notes)


def _opened(path: Path) -> Drawing:
    try:
        from ezdxf import recover
        from ezdxf.document import Drawing
        from ezdxf.lldxf.const import DXFError
        from ezdxf.lldxf.tagger import binary_tags_loader
    except ImportError:
        raise InputError(
            f"{path}: drawings need ezdxf: pip install 'fragfield[drawings]', or pip install ezdxf"
        ) from None
    data = read_bytes(path, InputError, most=_MOST_BYTES)
    if re.match(rb"AC10\d\d", data):
        raise InputError(f"{path}: found a DWG; allowed: a DXF, as which every program that writes DWG can save it")
    try:
        if data.startswith(_BINARY):
            return Drawing.load(binary_tags_loader(data))
        if b"$ACADVER" not in data and b"AcDb" in data:  # else taken for a release without AcDb
            data = _RELEASE_2000 + data
        document, _ = recover.read(BytesIO(data))
    except (DXFError, struct.error, OSError, ValueError, LookupError, AttributeError, TypeError, EOFError) as fault:
        words = " ".join(str(fault).split())[:200] or type(fault).__name__
        raise InputError(f"{path}: not a DXF that can be read ({words})") from None
    return document


def _unit(path: Path, document: Drawing, asked: float | None) -> tuple[float, list[str]]:
    """Metres of a unit of the file, and how that is known."""
    code = int(document.header.get("$INSUNITS", 0))
    name, metres = _UNITS.get(code, ("", 0.0))
    if asked is None and not name:
        from ezdxf import bbox

        box = bbox.extents(document.modelspace(), fast=True)
        extent = f"{box.size.x:.6g} x {box.size.y:.6g}" if box.has_data else "nothing"
        metric = document.header.get("$MEASUREMENT", None)
        hint = {0: "; its $MEASUREMENT is imperial", 1: "; its $MEASUREMENT is metric"}.get(metric, "")
        raise InputError(
            f"{path}: the file names no unit ($INSUNITS is {code}{hint}), and its extent is {extent}; "
            'needed: unit, the length of one unit of the file, such as "1 mm" or "1 in"'
        )
    if asked is None:
        return metres, [f"unit {name}, by $INSUNITS"]
    if name and abs(asked / metres - 1.0) > 1e-6:
        return asked, [f"unit {1e3 * asked:g} mm as asked for, though $INSUNITS says {name}"]
    return asked, [f"unit {1e3 * asked:g} mm"]


def _layers(path: Path, document: Drawing, names: Sequence[str]) -> set[str]:
    known = {layer.dxf.name for layer in document.layers} | {entity.dxf.layer for entity in document.modelspace()}
    return folded(path, names, known)


def _entities(document: Drawing, ignored: Counter[str], notes: list[str]) -> Iterator[tuple[DXFGraphic, str]]:
    """Entities of the model space with their layers, those of blocks in place of their references."""
    from ezdxf.xclip import XClip

    waiting: list[tuple[Any, str, int]] = [(one, one.dxf.layer, 0) for one in document.modelspace()]
    waiting.reverse()
    number = 0
    while waiting:
        entity, layer, depth = waiting.pop()
        number += 1
        if number > _MOST_ENTITIES:
            raise InputError(f"more than {_MOST_ENTITIES} entities; allowed: a drawing of a round's contour")
        if entity.dxftype() != "INSERT":
            yield entity, layer
            continue
        block = entity.block()
        if block is None or block.block.is_xref or depth >= _DEEPEST:
            ignored["reference to a drawing or block that is not there"] += 1
            continue
        if entity.dxf.get("invisible", 0) or (layer in document.layers and document.layers.get(layer).is_frozen()):
            ignored["reference to a block on a frozen layer, or invisible"] += 1
            continue
        clip = XClip(entity)
        if clip.has_clipping_path and clip.is_clipping_enabled:
            notes.append(f"block {entity.dxf.name} is clipped in the drawing, and was taken whole")
        for single in entity.multi_insert() if entity.mcount > 1 else [entity]:
            inner = list(
                single.virtual_entities(skipped_entity_callback=lambda one, _: ignored.update([one.dxftype()]))
            )
            # What a block holds on layer 0 lies on the layer of its reference.
            waiting += [(one, layer if one.dxf.layer == "0" else one.dxf.layer, depth + 1) for one in reversed(inner)]


def _points(path: Path, entity: Any, deviation: float) -> Iterator[np.ndarray[Any, Any]]:  # noqa: ANN401 - ezdxf's
    """Points of every smooth piece of an entity, in the file's units."""
    kind = entity.dxftype()
    if kind in ("LWPOLYLINE", "POLYLINE"):
        if kind == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline):
            raise InputError(
                f"{path}: found a POLYLINE that is a mesh of faces on layer {entity.dxf.layer}; allowed: curves"
            )
        _straighten(entity, deviation)
        for piece in entity.virtual_entities():
            yield from _points(path, piece, deviation)
        return
    where = f"{path}: found a {kind} on layer {entity.dxf.layer}"
    try:
        if kind == "LINE":
            pieces = [[entity.dxf.start, entity.dxf.end]]
        elif kind == "SPLINE":
            pieces = list(_spline(entity, deviation))
        else:
            pieces = [list(entity.flattening(deviation))]
    except (ValueError, ZeroDivisionError, IndexError) as fault:
        raise InputError(f"{where} that cannot be computed ({fault})") from None
    for points in pieces:
        if len(points) < 2:  # of no length
            continue
        placed = np.array([tuple(point) for point in points], dtype=np.float64)
        if not np.isfinite(placed).all():
            raise InputError(f"{where} with coordinates that are no numbers")
        placed = placed[np.concatenate([[True], (np.diff(placed, axis=0) != 0.0).any(axis=1)])]
        if len(placed) < 2:
            continue
        z = (
            placed[:, 2]
            if kind != "SPLINE"
            else np.array([point[2] for point in entity.construction_tool().control_points])
        )
        if np.ptp(z) > _FLAT * np.ptp(placed, axis=0).max():
            raise InputError(
                f"{where} that leaves the plane of the sheet, z {z.min():g} to {z.max():g}; "
                "allowed: a section drawn in x and y"
            )
        yield placed[:, :2]


def _straighten(entity: Any, deviation: float) -> None:  # noqa: ANN401 - ezdxf's
    """Make lines of a polyline's arcs that are flatter than `deviation`: their centres would be too far to compute."""
    if entity.dxftype() == "LWPOLYLINE":
        corners = [list(one) for one in entity.get_points("xyseb")]
    else:
        corners = [[*one.dxf.location.vec2, 0.0, 0.0, one.dxf.bulge] for one in entity.vertices]
    for corner, after in zip(corners, corners[1:] + corners[:1], strict=True):
        if abs(corner[4]) * np.hypot(after[0] - corner[0], after[1] - corner[1]) <= 2.0 * deviation:
            corner[4] = 0.0
    if entity.dxftype() == "LWPOLYLINE":
        entity.set_points(corners, format="xyseb")
    else:
        for vertex, corner in zip(entity.vertices, corners, strict=True):
            vertex.dxf.bulge = corner[4]


def _spline(entity: Any, deviation: float) -> Iterator[Any]:  # noqa: ANN401 - ezdxf's
    """Points of a spline between its corners: knots as many together as its degree.

    The curve is defined between the knots that have as many before and behind them as the degree. The library draws it
    from the first knot to the last: of a closed curve with uniform knots, as modellers write it, that adds two ends
    off the curve.
    """
    from scipy.interpolate import BSpline

    tool = entity.construction_tool()
    knots, degree = np.asarray(tool.knots(), dtype=np.float64), tool.degree
    weights = np.asarray(tool.weights() or np.ones(tool.count), dtype=np.float64)[:, None]
    control = np.array([tuple(point) for point in tool.control_points])
    curve = BSpline(knots, np.hstack([weights * control, weights]), degree)
    first, last = knots[degree], knots[-degree - 1]
    found, many = np.unique(knots, return_counts=True)
    ends = np.unique([first, *found[(many >= degree) & (found > first) & (found < last)], last])

    def at(start: float, end: float, share: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        placed = curve(start + (end - start) * share)
        return np.asarray(placed[:, :3] / placed[:, 3:])

    for start, end in pairwise(ends.tolist()):
        yield sampled(partial(at, start, end), deviation)


def _nothing(document: Drawing, present: Counter[str], ignored: Counter[str], layers: Sequence[str] | None) -> str:
    listed = ", ".join(f"{number} {kind}" for kind, number in sorted(ignored.items())) or "nothing"
    if present and layers is not None:
        others = ", ".join(f"{name} ({number})" for name, number in sorted(present.items()))
        return f"found no curve on the layers {', '.join(layers)}; allowed: layers with curves, {others}"
    paper = sum(len(layout) for layout in document.layouts if layout.name != "Model")
    hint = f"; {paper} entities lie in paper space, which is not read" if paper > 2 else ""
    return f"found no line, arc, circle, ellipse, spline or polyline in the model space, only {listed}{hint}"
