"""Coordinate systems of maps: metres on the plane of a case, whatever the map's units, projection and north.

Without a place on Earth x and y are the map's own coordinates in metres, +x to its grid east. With one, of a map in
degrees, and where the map's metres are not metres on the ground (Web Mercator), they are true metres: the azimuthal
equidistant projection about x = y = 0, in which distances and bearings from there are those on the ellipsoid.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
from flight.files.raster import INSTALL, unit_words

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from flight.files.raster import Raster


_FALSE_METRES = 0.002  # relative error of a grid's metres, beyond which the map is projected again
_APART = 10.0  # m, by which a site's two positions may differ
_EAST = 90.0  # degrees, bearing of +x on a map's own grid
_LIKE_DEGREES = 0.1  # cells without a unit that are smaller, between -360 and 360, are taken for degrees


@dataclass(frozen=True)
class Plane:
    """How x and y belong to a raster."""

    to_pixels: Callable[[Any, Any], tuple[Any, Any]]
    from_pixels: Callable[[Any, Any], tuple[Any, Any]]
    """Columns and rows of x and y (m), and back."""
    own_grid: bool
    """Whether x and y are the map's own coordinates in metres, moved to the site."""
    words: dict[str, str]
    """`crs`, `plan_unit`, `north`, `position`: what was read and taken."""


@dataclass(frozen=True)
class Vertical:
    """Datum of heights in words, and the unit (m) that the coordinate system states for them."""

    words: str
    unit: float | None


def read_projection(path: Path) -> Any:  # noqa: ANN401 - pyproj's CRS, None without a file
    """The coordinate system of a .prj file beside a map."""
    from fragfield_base.reading import read_text

    for beside in (path.with_suffix(".prj"), path.with_suffix(".PRJ")):
        if beside.is_file():
            text = read_text(beside, InputError, most=1 << 20)
            pyproj = _pyproj(path)
            try:
                return pyproj.CRS.from_wkt(text.strip())  # other forms are searched for by parts of names
            except pyproj.exceptions.CRSError:
                raise InputError(
                    f"{path}: {beside.name} beside it is not understood as a coordinate system; write it as WKT: "
                    "gdalsrsinfo -o wkt_esri"
                ) from None
    return None


def _pyproj(path: Path) -> Any:  # noqa: ANN401
    try:
        import pyproj
    except ModuleNotFoundError:
        raise InputError(f"{path}: its coordinate system needs pyproj; install it by: {INSTALL}") from None
    return pyproj


def vertical_of(path: Path, crs: Any) -> Vertical:  # noqa: ANN401
    """Datum and unit of heights by the coordinate system; raises InputError for depths."""
    if crs is None:
        return Vertical("not stated in the file", None)
    if crs.is_bound:
        return vertical_of(path, crs.source_crs)
    axis = next((one for one in crs.axis_info if one.direction in ("up", "down")), None)
    if axis is None:
        return Vertical("not stated in the file", None)
    if axis.direction == "down":
        raise InputError(f"{path}: holds depths ({crs.name}), no heights")
    if crs.is_compound:
        return Vertical(crs.sub_crs_list[-1].name, axis.unit_conversion_factor)
    return Vertical("above the ellipsoid, which lies up to 110 m off sea level", axis.unit_conversion_factor)


def _horizontal(path: Path, crs: Any) -> Any:  # noqa: ANN401
    if crs.is_bound:
        return _horizontal(path, crs.source_crs)
    if crs.is_compound:
        return _horizontal(path, crs.sub_crs_list[0])
    if not (crs.is_projected or crs.is_geographic or crs.is_engineering):
        raise InputError(f"{path}: coordinate system {crs.name} ({crs.type_name}), needed: a projected one or degrees")
    return crs.to_2d() if hasattr(crs, "to_2d") else crs  # pyproj before 3.6


def plane_of(raster: Raster, site: tuple[float, float] | None, earth: tuple[float, float, float] | None) -> Plane:
    """The plane of a case on a raster.

    `site` is the easting and northing of x = y = 0 in the map's grid (m); `earth` its latitude and longitude (WGS 84)
    and the bearing of +x (degrees). Raises InputError for a coordinate system that is not understood, or does not go
    with them.
    """
    path = raster.path
    crs = None if raster.crs is None else _horizontal(path, raster.crs)
    if crs is None or crs.is_engineering:
        return _without_earth(raster, crs, site, earth)
    unit = 1.0 if crs.is_geographic else crs.axis_info[0].unit_conversion_factor
    if crs.is_geographic and site is not None:
        raise InputError(
            f"{path}: its coordinates are degrees, and site = {site} is in metres; leave it out, and give the place by "
            "latitude and longitude ([site]), else x = y = 0 is the centre of the map"
        )
    position = _position(raster, crs, unit, site, earth)
    lon, lat = _transformer(crs.geodetic_crs, crs).transform(*position.xy, direction="INVERSE")
    if not (math.isfinite(lon) and abs(lat) < 89.5):
        raise InputError(f"{path}: x = y = 0 at {position.xy[0]:.10g}, {position.xy[1]:.10g} is nowhere in {crs.name}")
    local = _local(crs.geodetic_crs, lat, lon)
    grid = _transformer(local, crs)
    east, north, mirrored, scale = _axes(grid, unit)
    turned = f"grid north lies {abs(north):.2f} degrees {'east' if north >= 0.0 else 'west'} of true north there"
    words = {"crs": crs.name, "plan_unit": "degrees" if crs.is_geographic else unit_words(unit)}
    words["position"] = position.words
    if mirrored:
        raise InputError(f"{path}: the axes of {crs.name} make a mirrored map; project it (gdalwarp -t_srs)")
    if earth is None and not crs.is_geographic and abs(scale - 1.0) <= _FALSE_METRES:
        words["north"] = f"+x is the map's grid east, {turned}; its metres are {scale:.5f} of those on the ground"
        return _own_grid(raster, unit, position.xy, words)
    bearing = earth[2] if earth is not None else _EAST if crs.is_geographic else east
    words["north"] = f"+x points to {bearing % 360.0:.6g} degrees from true north"
    if not crs.is_geographic:
        words["north"] += f"; {turned}, and its metres are {scale:.5f} of those on the ground: projected again"
    turn = math.radians(90.0 - bearing)
    cos, sin = math.cos(turn), math.sin(turn)
    middle, _ = raster.coordinates(0.5 * (raster.shape[1] - 1), 0.5 * (raster.shape[0] - 1))

    def to_pixels(x: Any, y: Any) -> tuple[Any, Any]:  # noqa: ANN401
        e, n = grid.transform(cos * x - sin * y, sin * x + cos * y)
        if crs.is_geographic:
            e = e + 360.0 * np.round((middle - e) / 360.0)  # maps from 0 to 360 degrees, or across 180
        return raster.pixels(e, n)

    def from_pixels(column: Any, row: Any) -> tuple[Any, Any]:  # noqa: ANN401
        e, n = grid.transform(*raster.coordinates(column, row), direction="INVERSE")
        return cos * e + sin * n, -sin * e + cos * n

    return Plane(to_pixels, from_pixels, False, words)


def _own_grid(raster: Raster, unit: float, zero: tuple[float, float], words: dict[str, str]) -> Plane:
    """Coordinates of the map in metres, from the position of x = y = 0 in its units."""

    def to_pixels(x: Any, y: Any) -> tuple[Any, Any]:  # noqa: ANN401
        return raster.pixels(x / unit + zero[0], y / unit + zero[1])

    def from_pixels(column: Any, row: Any) -> tuple[Any, Any]:  # noqa: ANN401
        x, y = raster.coordinates(column, row)
        return (x - zero[0]) * unit, (y - zero[1]) * unit

    return Plane(to_pixels, from_pixels, True, words)


def _without_earth(
    raster: Raster,
    crs: Any,  # noqa: ANN401
    site: tuple[float, float] | None,
    earth: tuple[float, float, float] | None,
) -> Plane:
    if earth is not None and abs(math.remainder(earth[2] - _EAST, 360.0)) > 1e-6:
        raise InputError(
            f"{raster.path}: the bearing of +x is {earth[2]:g} degrees; allowed: {_EAST:g}, since the map has no "
            "coordinate system with a place on Earth and +x points to its grid east; put its .prj file beside it"
        )
    name = "none in the file or beside it" if crs is None else crs.name
    unit = 1.0 if crs is None else crs.axis_info[0].unit_conversion_factor
    words = {"crs": name, "plan_unit": unit_words(unit) if crs is not None else "metres, which the file does not state"}
    words["north"] = "+x is the map's grid east" + ("" if earth is None else ", taken as true east")
    (rows, columns), (a, *_) = raster.shape, raster.affine
    corners = np.array([raster.coordinates(i, j) for i in (0, columns - 1) for j in (0, rows - 1)])
    if (
        crs is None
        and abs(a) < _LIKE_DEGREES
        and np.abs(corners).max() <= 360.0
        and np.ptp(corners, axis=0).max() < 20.0
    ):
        raise InputError(
            f"{raster.path}: cells of {abs(a):g} without a coordinate system, which look like degrees; put the map's "
            ".prj file beside it"
        )
    site = (0.0, 0.0) if site is None else site
    words["position"] = f"x = y = 0 at {site[0]:.10g}, {site[1]:.10g} m"
    return _own_grid(raster, unit, (site[0] / unit, site[1] / unit), words)


@dataclass(frozen=True)
class _Position:
    """x = y = 0 in the map's coordinates, and how it was found."""

    xy: tuple[float, float]
    words: str


def _position(
    raster: Raster,
    crs: Any,  # noqa: ANN401
    unit: float,
    site: tuple[float, float] | None,
    earth: tuple[float, float, float] | None,
) -> _Position:
    """Where x = y = 0 lies on a map with a coordinate system; two positions must agree."""
    given = None if site is None else (site[0] / unit, site[1] / unit)
    if earth is None:
        if given is None and crs.is_geographic:
            rows, columns = raster.shape
            x, y = raster.coordinates(0.5 * (columns - 1), 0.5 * (rows - 1))
            return _Position(
                (x, y), f"x = y = 0 is the centre of the map, {y:.6f}, {x:.6f} degrees, no place was given"
            )
        x, y = given or (0.0, 0.0)
        return _Position((x, y), f"x = y = 0 at {x * unit:.10g}, {y * unit:.10g} m of the map's grid")
    moved = _from_wgs84(raster.path, crs, earth, needed=given is None)
    if moved is None:
        assert given is not None
        return _Position(given, "x = y = 0 by the map's grid; its datum has no known relation to WGS 84")
    if given is None:
        return moved
    apart = math.dist(given, moved.xy) * unit
    if apart > _APART:
        raise InputError(
            f"{raster.path}: the place by latitude and longitude lies {apart:.4g} m from site = {site[0]:.10g}, "  # type: ignore[index]
            f"{site[1]:.10g} m on this map ({crs.name}); leave one of the two out"  # type: ignore[index]
        )
    return _Position(given, f"x = y = 0 by the map's grid, {apart:.2g} m from the place by latitude and longitude")


def _from_wgs84(path: Path, crs: Any, earth: tuple[float, float, float], *, needed: bool) -> _Position | None:  # noqa: ANN401
    """A place on WGS 84 in the map's coordinates, by the most accurate transformation that is installed."""
    from pyproj.transformer import TransformerGroup

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that a better one would need a grid: its accuracy is said
        ways = TransformerGroup("EPSG:4326", crs.geodetic_crs, always_xy=True, allow_ballpark=False).transformers
    if not ways:
        if needed:
            raise InputError(
                f"{path}: the datum of {crs.name} has no known relation to WGS 84; give the position on the map's grid "
                "(site) beside latitude and longitude"
            )
        return None
    lon, lat = ways[0].transform(earth[1], earth[0])
    x, y = _transformer(crs.geodetic_crs, crs).transform(lon, lat)
    good = f" ({ways[0].description}, good to {ways[0].accuracy:g} m)" if ways[0].accuracy > 0.0 else ""
    return _Position((x, y), f"x = y = 0 at {earth[0]:.6f}, {earth[1]:.6f} degrees on WGS 84{good}")


def _axes(grid: Any, unit: float) -> tuple[float, float, bool, float]:  # noqa: ANN401
    """Bearings of a map's grid east and north at x = y = 0 (degrees), whether it is mirrored, and its scale."""
    x, y = grid.transform(np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    to_grid = unit * np.array([[x[1] - x[0], x[2] - x[0]], [y[1] - y[0], y[2] - y[0]]])
    east, north = np.linalg.inv(to_grid).T
    turned = [math.degrees(math.atan2(one[0], one[1])) for one in (east, north)]
    return turned[0], turned[1], bool(np.linalg.det(to_grid) < 0.0), math.sqrt(abs(float(np.linalg.det(to_grid))))


def _local(geodetic: Any, latitude: float, longitude: float) -> Any:  # noqa: ANN401
    """Azimuthal equidistant projection about a place, on the ellipsoid of a coordinate system."""
    from pyproj.crs.coordinate_operation import AzimuthalEquidistantConversion
    from pyproj.crs.crs import ProjectedCRS

    return ProjectedCRS(AzimuthalEquidistantConversion(latitude, longitude), geodetic_crs=geodetic)


def _transformer(source: Any, target: Any) -> Any:  # noqa: ANN401
    from pyproj import Transformer

    return Transformer.from_crs(source, target, always_xy=True)
