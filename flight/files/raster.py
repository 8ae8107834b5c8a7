"""A raster of heights as its file holds it: values, position, coordinate system, units; and ESRI ASCII grids (.asc)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
from fragfield_base.errors import names_allowed
from fragfield_base.reading import read_text
from fragfield_base.units import UnitError, read_measure

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray


INSTALL = (
    "apt-get install python3-rasterio python3-pyproj proj-bin, or conda install -c conda-forge rasterio pyproj, or pip "
    "install rasterio pyproj: from where dolfinx comes from (any of them without dolfinx)"
)
"""How the libraries of the extra `terrain` are installed: those of PyPI go with PyPI's dolfinx alone."""
MOST_NODES = 200_000_000
_HUGE = 1e30  # no height; what is beyond is a sentinel, of which programs print 6 to 18 digits
_SINGLE = 1e-6  # relative: sentinels are stored in single precision and written with seven digits or more
DIGITS = {"16": 10, "24": 16}
"""Binary digits, after the first, of floats stored in so many bits."""

_SURVEY_FOOT = 1200.0 / 3937.0
HEIGHT_UNITS = {"m": 1.0, "ft": 0.3048, "us_ft": _SURVEY_FOOT}
"""Units of height by the names that a case may give, in metres."""
_SURVEY_FEET = ("ussurveyfoot", "ussurveyfeet", "usft", "ftus", "footus", "usfoot", "usfeet")
_METRES = ("metre", "metres", "meter", "meters", "m")


@dataclass
class Raster:
    """What a file holds."""

    path: Path
    """The file."""
    form: str
    """Its format, in words."""
    shape: tuple[int, int]
    """(2,) ints: rows and columns."""
    affine: tuple[float, float, float, float, float, float]
    """(a, b, c, d, e, f): coordinates of a pixel's centre, in the coordinate system's units: x = a column + b row + c,
    y = d column + e row + f."""
    read: Callable[[slice, slice], NDArray[np.float64]]
    """Heights of rows and columns (slices), as the file scales them, not a number in holes."""
    crs: Any = None
    """Coordinate system, in the file or beside it."""
    unit: str | None = None
    """Unit of the heights that the file states."""
    notes: list[str] = field(default_factory=list)
    """What else decides how the values are read."""

    def coordinates(self, column: Any, row: Any) -> tuple[Any, Any]:  # noqa: ANN401 - numbers or arrays
        """X and y of the centres of pixels."""
        a, b, c, d, e, f = self.affine
        return a * column + b * row + c, d * column + e * row + f

    def pixels(self, x: Any, y: Any) -> tuple[Any, Any]:  # noqa: ANN401
        """Columns and rows, with fractions, of coordinates."""
        a, b, c, d, e, f = self.affine
        det = a * e - b * d
        return (e * (x - c) - b * (y - f)) / det, (a * (y - f) - d * (x - c)) / det


def holes_filled_with_nan(values: NDArray[Any], nodata: float | None, digits: int | None = None) -> NDArray[np.float64]:
    """Values as float64, NaN where they are the sentinel; of floats compared as they are stored.

    `digits` are the binary ones of floats shorter than single precision; programs round the sentinel to them or cut it.
    """
    found = values.astype(np.float64)
    if nodata is None or np.isnan(nodata):
        holes = ~np.isfinite(found)
    elif abs(nodata) >= _HUGE:
        holes = ~np.isfinite(found) | ((np.abs(found) >= _HUGE) & (np.sign(found) == np.sign(nodata)))
    elif values.dtype.kind in "iu":
        holes = found == nodata
    else:
        step = 0.0 if digits is None else np.ldexp(1.0, int(np.frexp(nodata)[1]) - 1 - digits)
        holes = (
            ~np.isfinite(found) | (np.abs(found - nodata) <= _SINGLE * abs(nodata)) | (np.abs(found - nodata) < step)
        )
    found[holes] = np.nan
    return found


def metres_of(path: Path, unit: str) -> float:
    """A unit of length in metres, by any of its usual names; raises InputError for one that is not known."""
    plain = "".join(sign for sign in unit.lower() if sign.isalpha())
    if plain in _SURVEY_FEET:
        return _SURVEY_FOOT
    if plain in _METRES:
        return 1.0
    try:
        measure = read_measure(f"1 {unit.strip().lower()}")
    except UnitError:
        measure = None
    if measure is None or not measure.is_of("m"):
        raise InputError(
            f"{path}: heights in the unit {unit!r}, which is not known; allowed: m, ft, US survey foot, cm"
        )
    return measure.value


def unit_words(metres: float) -> str:
    """A unit of length by its size."""
    names = {1.0: "metres", 0.3048: "feet", _SURVEY_FOOT: "US survey feet", 0.01: "centimetres", 0.1: "decimetres"}
    close = [name for size, name in names.items() if abs(metres / size - 1.0) < 1e-9]
    return close[0] if close else f"units of {metres:.9g} m"


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
