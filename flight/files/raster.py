"""A raster of heights as its file holds it: values, position of its pixels, coordinate system, units."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
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
