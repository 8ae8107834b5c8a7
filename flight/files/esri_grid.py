"""ESRI ASCII grids (.asc): header and heights as text."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flight.errors import InputError
from flight.files.raster import MOST_NODES, Raster, holes_filled_with_nan
from fragfield_base.errors import names_allowed
from fragfield_base.reading import read_text

if TYPE_CHECKING:
    from numpy.typing import NDArray


_HEADER = ("ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "dx", "dy", "nodata_value")
_NO_SENTINEL = ("null", "none")  # as 12D writes where every node has a height
_USUAL_NODATA = -9999.0
_AUXILIARY = ("SRS", "GeoTransform", "NoDataValue", "Scale", "Offset", "UnitType")


def read_esri_grid(path: Path) -> Raster:
    """Read the grid; raises InputError where it cannot be read as numbers at equal steps."""
    _refuse_auxiliary(path)
    lines = read_text(path, InputError).splitlines()
    header, start = _header(path, lines)
    position = "center" if "xllcenter" in header else "corner"
    step = header.get("dx", header.get("cellsize", 0.0)), header.get("dy", header.get("cellsize", 0.0))
    _check(path, header, step, position)
    shape = int(header["nrows"]), int(header["ncols"])
    try:
        heights = np.array(" ".join(lines[start:]).split(), dtype=np.float64)
    except ValueError as error:
        raise InputError(f"{path}: the heights are not all numbers ({error}); decimals need a point") from None
    if heights.size != shape[0] * shape[1]:
        raise InputError(
            f"{path}: {heights.size} heights, nrows x ncols is {shape[0]} x {shape[1]}; the file is cut off"
        )
    heights = holes_filled_with_nan(heights.reshape(shape), header.get("nodata_value", _USUAL_NODATA))
    half = 0.0 if position == "center" else 0.5  # values belong to the cells' centres
    west, south = header[f"xll{position}"] + half * step[0], header[f"yll{position}"] + half * step[1]

    def read(rows: slice, columns: slice) -> NDArray[np.float64]:
        return heights[rows, columns]

    north = south + (shape[0] - 1) * step[1]  # the file begins in the north
    return Raster(path, "ESRI ASCII grid", shape, (step[0], 0.0, west, 0.0, -step[1], north), read)


def _header(path: Path, lines: list[str]) -> tuple[dict[str, float], int]:
    header: dict[str, float] = {}
    start = 0
    for start, line in enumerate(lines):
        words = line.split()
        if len(words) != 2 or not words[0][0].isalpha() or words[0].lower() == "nan":
            break
        key = words[0].lower()
        if key not in _HEADER:
            raise InputError(f"{path}: line {start + 1}: unknown key {words[0]!r}{names_allowed(key, _HEADER)}")
        if key == "nodata_value" and words[1].lower() in _NO_SENTINEL:
            words[1] = "nan"
        try:
            header[key] = float(words[1])
        except ValueError:
            raise InputError(f"{path}: line {start + 1}: {key} is {words[1]!r}, needed: a number") from None
    return header, start


def _check(path: Path, header: dict[str, float], step: tuple[float, float], position: str) -> None:
    """Refuse a header that lacks a key, or holds a value that no grid has."""
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


def _refuse_auxiliary(path: Path) -> None:
    """Refuse what a program of maps has put beside the grid to say how it is read, since it is not read here."""
    beside = Path(f"{path}.aux.xml")
    if not beside.is_file():
        return
    text = read_text(beside, InputError)
    if held := [name for name in _AUXILIARY if f"<{name}" in text]:
        raise InputError(
            f"{path}: {beside.name} beside it sets {', '.join(held)}, which is not read with an ESRI grid; write both "
            f"as one GeoTIFF: gdal_translate {path.name} {path.stem}.tif"
        )
