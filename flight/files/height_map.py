"""Grids of heights from files: ESRI ASCII grids, and GeoTIFF through tifffile."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError, nearest
from fragfield_base.reading import read_text

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["Grid", "read_grid"]

MOST_NODES = 200_000_000
MOST_PACKED = 8000  # nodes of one byte in a byte of a packed file
METRE = 9001  # EPSG's code of the unit
_HEADER = ("ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "dx", "dy", "nodata_value")


@dataclass(frozen=True, eq=False)
class Grid:
    """Heights at nodes (rows, columns), southernmost row first, not a number in holes; step and corner (m)."""

    heights: NDArray[np.float64]
    step: tuple[float, float]
    corner: tuple[float, float]


def read_grid(path: Path) -> Grid:
    """Read a .asc, .tif or .tiff file; raises InputError where it cannot be read as heights in metres."""
    suffix = path.suffix.lower()
    if suffix not in (".asc", ".tif", ".tiff"):
        raise InputError(f"{path}: a height map is an ESRI ASCII grid (.asc) or a GeoTIFF (.tif, .tiff)")
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    return _read_ascii(path) if suffix == ".asc" else _read_geotiff(path)


def _read_ascii(path: Path) -> Grid:
    lines = read_text(path, InputError).splitlines()
    header: dict[str, float] = {}
    start = 0
    for start, line in enumerate(lines):
        words = line.split()
        if len(words) != 2 or not words[0][0].isalpha() or words[0].lower() == "nan":
            break
        key = words[0].lower()
        if key not in _HEADER:
            raise InputError(f"{path}: line {start + 1}: unknown key {words[0]!r}{nearest(key, _HEADER)}")
        try:
            header[key] = float(words[1])
        except ValueError:
            raise InputError(f"{path}: line {start + 1}: {key} is {words[1]!r}, needed: a number") from None
    position = "center" if "xllcenter" in header else "corner"
    step = header.get("dx", header.get("cellsize", 0.0)), header.get("dy", header.get("cellsize", 0.0))
    for key in ("ncols", "nrows", f"xll{position}", f"yll{position}", *(() if "dx" in header else ("cellsize",))):
        if key not in header:
            raise InputError(
                f"{path}: {key} missing; an ESRI grid begins with ncols, nrows, xllcorner, yllcorner, cellsize"
            )
    for key, value in header.items():
        if not math.isfinite(value) and key != "nodata_value":
            raise InputError(f"{path}: {key} is {value}, needed: a finite number")
    for key in ("ncols", "nrows"):
        if not 2 <= header[key] <= MOST_NODES or header[key] != int(header[key]):
            raise InputError(f"{path}: {key} is {header[key]:g}, needed: a whole number from 2 to {MOST_NODES}")
    if not min(step) > 0.0:
        raise InputError(f"{path}: cellsize is {min(step):g}, needed: above zero (m)")
    shape = int(header["nrows"]), int(header["ncols"])
    try:
        heights = np.array(" ".join(lines[start:]).split(), dtype=np.float64)
    except ValueError as error:
        raise InputError(f"{path}: the heights are not all numbers ({error})") from None
    if heights.size != shape[0] * shape[1]:
        raise InputError(
            f"{path}: {heights.size} heights, nrows x ncols is {shape[0]} x {shape[1]}; the file is cut off"
        )
    heights = heights.reshape(shape)[::-1].copy()  # the file begins in the north
    heights[heights == header.get("nodata_value", -9999.0)] = np.nan
    half = 0.0 if position == "center" else 0.5  # values belong to the cells' centres
    return Grid(heights, step, (header[f"xll{position}"] + half * step[0], header[f"yll{position}"] + half * step[1]))


def _read_geotiff(path: Path) -> Grid:
    try:
        import tifffile
    except ModuleNotFoundError:
        raise InputError(
            f"{path}: reading GeoTIFF needs tifffile; install it by: pip install 'fragfield[terrain]' (flight alone: "
            "pip install 'fragfield-flight[terrain]'), or convert the file to .asc"
        ) from None
    try:
        with tifffile.TiffFile(path) as file:
            page = file.pages[0]
            geo: dict[str, Any] = dict(page.geotiff_tags or {})  # type: ignore[union-attr,unused-ignore]
            hole = page.tags.get("GDAL_NODATA")  # type: ignore[union-attr,unused-ignore]
            if math.prod(page.shape) > min(MOST_NODES, MOST_PACKED * path.stat().st_size):
                raise InputError(
                    f"{path}: declares {' x '.join(map(str, page.shape))} heights, more than a file of "
                    f"{path.stat().st_size} bytes can hold, or than {MOST_NODES}"
                )
            values = page.asarray()
    except InputError:
        raise
    except Exception as error:  # noqa: BLE001 - tifffile raises whatever a broken file leads it into
        # also a compression that needs another package, which the message names
        raise InputError(f"{path}: cannot be read as a TIFF file ({type(error).__name__}: {error})") from None
    if values.ndim != 2 or values.dtype.kind not in "iuf":
        raise InputError(f"{path}: {values.shape} values of {values.dtype}; a height map is one band of numbers")
    _check_metres(path, geo)
    heights = values.astype(np.float64)
    if hole is not None:
        try:
            heights[heights == float(str(hole.value).strip("\0 "))] = np.nan
        except ValueError:
            raise InputError(f"{path}: GDAL_NODATA is {hole.value!r}, needed: a number") from None
    (west, step_x), (north, step_y) = _placed(path, geo)
    # a pixel is an area about its centre, unless the file says that it is a point
    half = 0.0 if int(geo.get("GTRasterTypeGeoKey", 1)) == 2 else 0.5
    south = north - (len(heights) - 1 + half) * step_y
    return Grid(heights[::-1].copy(), (step_x, step_y), (west + half * step_x, south))


def _check_metres(path: Path, geo: dict[str, Any]) -> None:
    if int(geo.get("GTModelTypeGeoKey", 1)) != 1:
        raise InputError(f"{path}: coordinates in degrees; project the map to metres first (UTM, a national grid)")
    for key, what in (("ProjLinearUnitsGeoKey", "coordinates"), ("VerticalUnitsGeoKey", "heights")):
        if int(geo.get(key, METRE)) != METRE:
            raise InputError(f"{path}: {what} in unit EPSG:{int(geo[key])}, needed: metres (EPSG:{METRE})")


def _placed(path: Path, geo: dict[str, Any]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Find x of the first pixel's western edge (or point) and its step, y of its northern edge and its step."""
    if "ModelTransformation" in geo:
        m = np.asarray(geo["ModelTransformation"], dtype=np.float64).reshape(4, 4)
        x, step_x, y, step_y, turned = m[0, 3], m[0, 0], m[1, 3], -m[1, 1], m[0, 1] != 0.0 or m[1, 0] != 0.0
    elif "ModelPixelScale" in geo and "ModelTiepoint" in geo:
        step_x, step_y = (float(value) for value in geo["ModelPixelScale"][:2])
        column, row, _, x, y, _ = np.asarray(geo["ModelTiepoint"], dtype=np.float64).ravel()[:6]
        x, y, turned = x - column * step_x, y + row * step_y, False
    else:
        raise InputError(
            f"{path}: no position and scale in it; needed: a GeoTIFF with ModelPixelScale and ModelTiepoint"
        )
    if turned or not (step_x > 0.0 and step_y > 0.0):
        raise InputError(f"{path}: the map is turned or mirrored; resample it to north up first")
    return (float(x), float(step_x)), (float(y), float(step_y))
