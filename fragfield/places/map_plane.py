"""Coordinate systems of maps: metres on the plane of a case, whatever the map's units, projection and north."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flight import InputError

_FALSE_METRES = 0.002  # relative error of a grid's metres, beyond which the map is projected again
_APART = 10.0  # m, by which a site's two positions may differ
_EAST = 90.0  # degrees, bearing of +x on a map's own grid
_LIKE_DEGREES = 0.1  # cells without a coordinate system that are smaller are taken for degrees
SURVEY_FOOT = 1200.0 / 3937.0
_DIRECTORY = 34735  # the TIFF tag of a GeoTIFF's keys, of short integers
_UNIT_KEYS = {3076: "coordinates", 4099: "heights"}  # ProjLinearUnitsGeoKey, VerticalUnitsGeoKey

Place = tuple[float, float]
Earth = tuple[float, float, float]


def unit_words(metres: float) -> str:
    """A unit of length by its size."""
    names = {1.0: "metres", 0.3048: "feet", SURVEY_FOOT: "US survey feet", 0.01: "centimetres", 0.1: "decimetres"}
    return next((name for size, name in names.items() if abs(metres / size - 1.0) < 1e-9), f"units of {metres:.9g} m")


@dataclass(frozen=True)
class Plane:
    """How x and y belong to a map's coordinates: `to_plane` leads from x and y (m) to those of the system `crs`."""

    crs: Any
    to_plane: Any
    grid: Any
    """Transformer from `crs` to the map's own system; None: they are one."""
    words: dict[str, str]

    def pixels(self, affine: Any, x: Any, y: Any) -> tuple[Any, Any]:  # noqa: ANN401 - numbers or arrays
        """Columns and rows of x and y, whole at the centres of pixels."""
        east, north = self.to_plane * (x, y)
        if self.grid is not None:
            east, north = self.grid.transform(east, north)
        column, row = ~affine * (east, north)
        return column - 0.5, row - 0.5

    def places(self, affine: Any, column: Any, row: Any) -> tuple[Any, Any]:  # noqa: ANN401
        """X and y (m) of columns and rows."""
        east, north = affine * (column + 0.5, row + 0.5)
        if self.grid is not None:
            east, north = self.grid.transform(east, north, direction="INVERSE")
        return ~self.to_plane * (east, north)


def plane_of(path: Path, dataset: Any, crs: Any, site: Place | None, earth: Earth | None) -> tuple[Any, Plane]:  # noqa: ANN401
    """The map's affine transformation, and how x and y belong to its coordinates.

    Without a place on Earth x and y are the map's own coordinates in metres, +x to its grid east. With one, of a map in
    degrees, and where the map's metres are not metres on the ground (Web Mercator), they are true metres: the azimuthal
    equidistant projection about x = y = 0, in which distances and bearings from there are those on the ellipsoid.
    """
    from affine import Affine
    from pyproj import Transformer
    from pyproj.crs.coordinate_operation import AzimuthalEquidistantConversion
    from pyproj.crs.crs import ProjectedCRS

    affine = dataset.transform
    while crs is not None and (crs.is_bound or crs.is_compound):
        crs = crs.source_crs if crs.is_bound else crs.sub_crs_list[0]
    if crs is None or crs.is_engineering:
        return affine, _without_earth(path, dataset, crs, site, earth)
    if not (crs.is_projected or crs.is_geographic):
        raise InputError(f"{path}: coordinate system {crs.name} ({crs.type_name}), needed: a projected one or degrees")
    crs = crs.to_2d() if hasattr(crs, "to_2d") else crs  # pyproj before 3.6
    degrees = crs.is_geographic
    unit = 1.0 if degrees else crs.axis_info[0].unit_conversion_factor
    if degrees and site is not None:
        raise InputError(
            f"{path}: its coordinates are degrees, and site = {site} is in metres; leave it out, and give the place by "
            "latitude and longitude ([site]), else x = y = 0 is the centre of the map"
        )
    (x0, y0), position = _position(path, dataset, crs, unit, site, earth)
    lon, lat = Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True).transform(x0, y0, direction="INVERSE")
    if not (math.isfinite(lon) and abs(lat) < 89.5):
        raise InputError(f"{path}: x = y = 0 at {x0:.10g}, {y0:.10g} is nowhere in {crs.name}")
    if degrees:  # maps from 0 to 360 degrees
        middle = (affine * (0.5 * dataset.width, 0.0))[0]
        affine = affine.translation(360.0 * round((lon - middle) / 360.0), 0.0) * affine
    local = ProjectedCRS(AzimuthalEquidistantConversion(lat, lon), geodetic_crs=crs.geodetic_crs)
    grid = Transformer.from_crs(local, crs, always_xy=True)
    x, y = grid.transform(np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    to_grid = unit * np.array([[x[1] - x[0], x[2] - x[0]], [y[1] - y[0], y[2] - y[0]]])
    scale = math.sqrt(abs(float(np.linalg.det(to_grid))))
    if np.linalg.det(to_grid) < 0.0:
        raise InputError(f"{path}: the axes of {crs.name} make a mirrored map; project it (gdalwarp -t_srs)")
    east, north = (math.degrees(math.atan2(*axis)) for axis in np.linalg.inv(to_grid).T)
    turned = f"grid north lies {abs(north):.2f} degrees {'east' if north >= 0.0 else 'west'} of true north there"
    words = {"crs": crs.name, "plan_unit": "degrees" if degrees else unit_words(unit), "position": position}
    if earth is None and not degrees and abs(scale - 1.0) <= _FALSE_METRES:
        words["north"] = f"+x is the map's grid east, {turned}; its metres are {scale:.5f} of those on the ground"
        return affine, Plane(crs, Affine(1.0 / unit, 0.0, x0, 0.0, 1.0 / unit, y0), None, words)
    bearing = earth[2] if earth is not None else _EAST if degrees else east
    words["north"] = f"+x points to {bearing % 360.0:.6g} degrees from true north"
    if not degrees:
        words["north"] += f"; {turned}, and its metres are {scale:.5f} of those on the ground: projected again"
    return affine, Plane(local, Affine.rotation(90.0 - bearing), grid, words)


def _without_earth(path: Path, dataset: Any, crs: Any, site: Place | None, earth: Earth | None) -> Plane:  # noqa: ANN401
    from affine import Affine

    if earth is not None and abs(math.remainder(earth[2] - _EAST, 360.0)) > 1e-6:
        raise InputError(
            f"{path}: the bearing of +x is {earth[2]:g} degrees; allowed: {_EAST:g}, since the map has no coordinate "
            "system with a place on Earth and +x points to its grid east; put its .prj file beside it"
        )
    cell = abs(dataset.transform.a)
    if crs is None and cell < _LIKE_DEGREES and np.abs(dataset.bounds).max() <= 361.0:
        raise InputError(
            f"{path}: cells of {cell:g} without a coordinate system, which look like degrees; put the map's .prj file "
            "beside it"
        )
    unit = 1.0 if crs is None else crs.axis_info[0].unit_conversion_factor
    x0, y0 = site or (0.0, 0.0)
    words = {
        "crs": "none in the file or beside it" if crs is None else crs.name,
        "plan_unit": "metres, which the file does not state" if crs is None else unit_words(unit),
        "north": "+x is the map's grid east" + ("" if earth is None else ", taken as true east"),
        "position": f"x = y = 0 at {x0:.10g}, {y0:.10g} m",
    }
    return Plane("EPSG:32631", Affine(1.0 / unit, 0.0, x0 / unit, 0.0, 1.0 / unit, y0 / unit), None, words)


def _position(
    path: Path, dataset: Any, crs: Any, unit: float, site: Place | None, earth: Earth | None  # noqa: ANN401
) -> tuple[Place, str]:  # fmt: skip
    """Where x = y = 0 lies on a map with a coordinate system, and how that is known; two positions must agree."""
    from pyproj import Transformer
    from pyproj.exceptions import ProjError

    given = None if site is None else (site[0] / unit, site[1] / unit)
    if earth is None:
        if given is None and crs.is_geographic:
            x, y = dataset.transform * (0.5 * dataset.width, 0.5 * dataset.height)
            return (x, y), f"x = y = 0 is the centre of the map, {y:.6f}, {x:.6f} degrees, no place was given"
        x, y = given or (0.0, 0.0)
        return (x, y), f"x = y = 0 at {x * unit:.10g}, {y * unit:.10g} m of the map's grid"
    try:
        to_grid = Transformer.from_crs("EPSG:4326", crs, always_xy=True, allow_ballpark=False)
        moved = to_grid.transform(earth[1], earth[0], errcheck=True)
    except ProjError:
        if given is not None:
            return given, "x = y = 0 by the map's grid; its datum has no known relation to WGS 84"
        raise InputError(
            f"{path}: the datum of {crs.name} has no known relation to WGS 84; give the position on the map's grid "
            "(site) beside latitude and longitude"
        ) from None
    if given is None:
        return moved, f"x = y = 0 at {earth[0]:.6f}, {earth[1]:.6f} degrees on WGS 84"
    apart = math.dist(given, moved) * unit
    if apart > _APART:
        raise InputError(
            f"{path}: the place by latitude and longitude lies {apart:.4g} m from site = {given[0] * unit:.10g}, "
            f"{given[1] * unit:.10g} m on this map ({crs.name}); leave one of the two out"
        )
    return given, f"x = y = 0 by the map's grid, {apart:.2g} m from the place by latitude and longitude"


def refuse_other_units(path: Path, plan: float | None, height: float) -> None:
    """Refuse a GeoTIFF whose own keys state other units than GDAL, which drops some of them and then says metres.

    `plan` (None: degrees) and `height` are the units that GDAL reports (m).
    """
    keys = _geo_keys(path)
    if not keys.keys() & _UNIT_KEYS.keys():
        return
    from pyproj.database import get_units_map

    sizes = {int(unit.code): unit.conv_factor for unit in get_units_map(auth_name="EPSG", category="linear").values()}
    for (key, what), reported in zip(_UNIT_KEYS.items(), (plan, height), strict=True):
        stated = keys.get(key)
        if stated is None or reported is None:
            continue
        if stated not in sizes or abs(sizes[stated] / reported - 1.0) > 1e-9:
            raise InputError(
                f"{path}: its {what} are in the unit EPSG:{stated} by its GeoTIFF keys, and in units of "
                f"{reported:.9g} m by its coordinate system; set it right: gdal_edit.py -a_srs"
            )


def _geo_keys(path: Path) -> dict[int, int]:
    """Keys that hold a short integer, of the first image; none where the file cannot be followed.

    OGC GeoTIFF 1.1, section 7: a directory of four short integers a key, its value in the fourth where the second is 0.
    """
    with path.open("rb") as file:
        head = file.read(16)
        order = {b"II": "<", b"MM": ">"}.get(head[:2])
        if order is None:
            return {}
        big = struct.unpack(f"{order}H", head[2:4])[0] == 43
        count, entry, offset = ("Q", "HHQQ", head[8:16]) if big else ("H", "HHII", head[4:8])
        try:
            file.seek(struct.unpack(f"{order}{entry[-1]}", offset)[0])
            (number,) = struct.unpack(f"{order}{count}", file.read(struct.calcsize(f"{order}{count}")))
            size = struct.calcsize(f"{order}{entry}")
            for _ in range(min(number, 1000)):
                tag, _, length, place = struct.unpack(f"{order}{entry}", file.read(size))
                if tag == _DIRECTORY and length >= 4:
                    file.seek(place)
                    values = struct.unpack(f"{order}{min(length, 4000)}H", file.read(2 * min(length, 4000)))
                    keys = zip(*(values[start::4] for start in (4, 5, 7)), strict=False)
                    return {key: value for key, inside, value in keys if inside == 0}
        except (struct.error, OSError, ValueError, OverflowError):
            return {}  # GDAL says what is wrong with it
    return {}
