"""Maps of one slope, in every form in which they come."""

from __future__ import annotations

import struct
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

UTM, SITE = "EPSG:32632", (500_000.0, 5_500_000.0)  # on the central meridian: grid north is true north
EARTH = (49.6537, 9.0)  # latitude and longitude of a place 130 m north of SITE
SURVEY_FOOT = 1200.0 / 3937.0
HEIGHT, SLOPE_X, SLOPE_Y = 300.0, 0.06, -0.03  # of the slope at the site (m), and along x and y
HALF, CELL = 1500.0, 20.0
Heights = np.ndarray


def slope(x: np.ndarray, y: np.ndarray) -> Heights:
    """The slope, with a wave of some metres across it that a map turned over would show."""
    return HEIGHT + SLOPE_X * x + SLOPE_Y * y + 3.0 * np.sin(x / 150.0) + 2.0 * np.cos(y / 90.0) - 2.0


def north_up(cell: float = CELL, half: float = HALF) -> tuple[np.ndarray, np.ndarray]:
    """X and y of the centres of pixels, the northernmost row first."""
    along = np.arange(-half, half + 0.5 * cell, cell)
    x, y = np.meshgrid(along, along[::-1])
    return x, y


def metres(unit: float = 1.0, site: tuple[float, float] = SITE, cell: float = CELL, half: float = HALF) -> Any:
    """Transform of north_up in units of so many metres, of a site in metres."""
    from rasterio.transform import Affine

    west, north = site[0] - half - 0.5 * cell, site[1] + half + 0.5 * cell
    return Affine(cell / unit, 0.0, west / unit, 0.0, -cell / unit, north / unit)


def write(
    path: Path, heights: Heights, transform: Any = None, crs: str | None = UTM, mask: Heights | None = None, **more: Any
) -> Path:
    """Write a raster by rasterio; scales, offsets, units, tags and overviews are set after it is written."""
    import rasterio

    after = {name: more.pop(name) for name in ("scales", "offsets", "units", "tags", "overviews") if name in more}
    heights = np.asarray(heights)
    bands = heights if heights.ndim == 3 else heights[None]
    profile = {"driver": "GTiff", "crs": crs, "transform": metres() if transform is None else transform, **more}
    if transform == "none":
        del profile["transform"]
    with (
        warnings.catch_warnings(action="ignore"),  # of rasterio, that a file is not placed
        rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True),
        rasterio.open(
            path, "w", count=len(bands), height=bands.shape[1], width=bands.shape[2], dtype=bands.dtype, **profile
        ) as file,
    ):
        file.write(bands)
        if mask is not None:
            file.write_mask(mask)
        for name in ("scales", "offsets", "units"):
            if name in after:
                setattr(file, name, after[name])
        file.update_tags(**after.get("tags", {}))
    if "overviews" in after:
        with rasterio.open(path, "r+") as file:
            file.build_overviews(after["overviews"])
    return path


def degrees(
    step: float = CELL / 111_000.0, half: float = HALF, turned: float = 0.0
) -> tuple[np.ndarray, np.ndarray, Any]:
    """X and y of the pixels of a map in degrees about EARTH, by geodesics, and its transform, `turned` in longitude."""
    from pyproj import Geod
    from rasterio.transform import Affine

    number = int(half / 111_000.0 / step)
    lat = EARTH[0] + step * np.arange(number, -number - 1, -1)
    lon = EARTH[1] + 1.5 * step * np.arange(-number, number + 1)
    lon, lat = np.meshgrid(lon, lat)
    turn, _, distance = Geod(ellps="WGS84").inv(np.full_like(lon, EARTH[1]), np.full_like(lat, EARTH[0]), lon, lat)
    transform = Affine(1.5 * step, 0.0, lon[0, 0] - 0.75 * step + turned, 0.0, -step, lat[0, 0] + 0.5 * step)
    return distance * np.sin(np.radians(turn)), distance * np.cos(np.radians(turn)), transform


def esri(path: Path, heights: Heights, *, west: float, south: float, cell: float = CELL, nodata: str = "-9999") -> Path:
    """Write an ESRI grid, of the centre of its lower left cell."""
    head = (
        f"ncols {heights.shape[1]}\nnrows {heights.shape[0]}\nxllcenter {float(west)!r}\nyllcenter {float(south)!r}\n"
    )
    rows = "\n".join(" ".join(f"{value:.4f}" for value in row) for row in heights)
    path.write_text(f"{head}cellsize {cell!r}\nNODATA_value {nodata}\n{rows}\n")
    return path


def plain_tiff(path: Path, heights: Heights, *keys: tuple[int, int], hole: str | None = None) -> Path:
    """A TIFF of float32 in one strip with GeoTIFF's keys (number, value), byte by byte, as GDAL itself writes none."""
    data, (rows, columns) = np.asarray(heights, dtype="<f4").tobytes(), heights.shape
    flat = [number for key, value in keys for number in (key, 0, 1, value)]
    short = [(256, columns), (257, rows), (258, 32), (259, 1), (262, 1), (277, 1), (278, rows), (339, 3)]
    tags = [(tag, 3, 1, struct.pack("<H", value)) for tag, value in short]
    tags += [(273, 4, 1, struct.pack("<I", 8)), (279, 4, 1, struct.pack("<I", len(data)))]
    tags.append((33550, 12, 3, struct.pack("<3d", CELL, CELL, 0.0)))
    corner = SITE[0] - HALF - 0.5 * CELL, SITE[1] + HALF + 0.5 * CELL
    tags.append((33922, 12, 6, struct.pack("<6d", 0.0, 0.0, 0.0, *corner, 0.0)))
    tags.append((34735, 3, 4 + len(flat), struct.pack(f"<{4 + len(flat)}H", 1, 1, 0, len(keys), *flat)))
    if hole is not None:
        tags.append((42113, 2, len(hole) + 1, hole.encode() + b"\0"))
    start, directory, tail = 8 + len(data), b"", b""
    for tag, kind, count, value in sorted(tags):
        place = value.ljust(4, b"\0") if len(value) <= 4 else struct.pack("<I", start + 6 + 12 * len(tags) + len(tail))
        directory += struct.pack("<HHI", tag, kind, count) + place
        tail += value + b"\0" * (len(value) % 2) if len(value) > 4 else b""
    head = b"II*\0" + struct.pack("<I", start)
    path.write_bytes(head + data + struct.pack("<H", len(tags)) + directory + b"\0" * 4 + tail)
    return path


def scattered_holes(shape: tuple[int, int]) -> np.ndarray:
    """Nodes without a height, away from the site: a block of four, and one in two hundred."""
    holes = np.random.default_rng(5).random(shape) < 0.005
    holes[20:22, 30:32] = True
    middle = shape[0] // 2
    holes[middle - 2 : middle + 3, middle - 2 : middle + 3] = False
    holes[[0, -1]] = holes[:, [0, -1]] = False
    return holes


FORMS: dict[str, Callable[[Path], tuple[Path, dict[str, Any]]]] = {}
"""By name: writes the slope into a folder, and returns the file and the arguments of `read_map`."""


def _form(function: Callable[[Path], tuple[Path, dict[str, Any]]]) -> Callable[[Path], tuple[Path, dict[str, Any]]]:
    FORMS[function.__name__.strip("_").replace("_", " ")] = function
    return function


ON_GRID = {"site": SITE}


@_form
def float32_metres(folder: Path):
    return write(folder / "m.tif", slope(*north_up()).astype("f4")), ON_GRID


@_form
def uint16_with_scale_and_offset(folder: Path):
    stored = np.rint((slope(*north_up()) + 500.0) / 0.05).astype("u2")
    return write(folder / "s.tif", stored, scales=(0.05,), offsets=(-500.0,)), ON_GRID


@_form
def feet_by_the_band(folder: Path):
    return write(folder / "f.tif", (slope(*north_up()) / 0.3048).astype("f4"), units=("ft",)), ON_GRID


NEW_YORK = (300_000.0, 60_000.0)  # easting and northing in the grid of Long Island (m)


@_form
def plan_and_heights_in_us_survey_feet(folder: Path):
    heights = (slope(*north_up()) / SURVEY_FOOT).astype("f4")
    crs = "EPSG:2263+6360"  # NAD83 / New York Long Island (ftUS), NAVD88 height (ftUS)
    return write(folder / "us.tif", heights, metres(SURVEY_FOOT, NEW_YORK), crs), {"site": NEW_YORK}


@_form
def plan_in_us_survey_feet_heights_in_metres(folder: Path):
    path = write(folder / "us.tif", slope(*north_up()).astype("f4"), metres(SURVEY_FOOT, NEW_YORK), "EPSG:2263")
    return path, {"site": NEW_YORK, "height_unit": "m"}


@_form
def south_up(folder: Path):
    from rasterio.transform import Affine

    whole = metres()
    transform = Affine(whole.a, 0.0, whole.c, 0.0, CELL, SITE[1] - HALF - 0.5 * CELL)
    return write(folder / "up.tif", slope(*north_up())[::-1].astype("f4"), transform), ON_GRID


@_form
def turned_by_thirty_degrees(folder: Path):
    from rasterio.transform import Affine

    along = np.arange(-2.0 * HALF, 2.0 * HALF + 1.0, CELL)
    u, v = np.meshgrid(along, along[::-1])
    cos, sin = np.cos(np.pi / 6), np.sin(np.pi / 6)
    west, north = along[0] - 0.5 * CELL, along[-1] + 0.5 * CELL
    corner = SITE[0] + cos * west - sin * north, SITE[1] + sin * west + cos * north
    turned = Affine(cos * CELL, sin * CELL, corner[0], sin * CELL, -cos * CELL, corner[1])
    heights = slope(cos * u - sin * v, sin * u + cos * v).astype("f4")
    return write(folder / "t.tif", heights, turned), ON_GRID


@_form
def degrees_about_a_place(folder: Path):
    x, y, transform = degrees()
    return write(folder / "d.tif", slope(x, y).astype("f4"), transform, "EPSG:4326"), {"earth": (*EARTH, 90.0)}


@_form
def degrees_about_their_centre(folder: Path):
    x, y, transform = degrees()
    return write(folder / "d.tif", slope(x, y).astype("f4"), transform, "EPSG:4326"), {}


@_form
def degrees_from_0_to_360_in_an_esri_grid(folder: Path):
    x, y, transform = degrees(turned=360.0)
    path = folder / "d.asc"
    esri(path, slope(x, y), west=transform.c + 0.5 * transform.a, south=EARTH[0] - (len(y) // 2) * -transform.e)
    path.write_text(
        path.read_text().replace(f"cellsize {CELL!r}", f"dx {float(transform.a)!r}\ndy {float(-transform.e)!r}")
    )
    import pyproj

    (folder / "d.prj").write_text(pyproj.CRS("EPSG:4326").to_wkt("WKT1_ESRI"))
    return path, {"earth": (*EARTH, 90.0)}


@_form
def projected_about_a_place(folder: Path):
    from pyproj import Geod, Transformer
    from rasterio.transform import Affine

    x, y = north_up(half=1.2 * HALF)
    to_earth = Transformer.from_crs("EPSG:32633", "EPSG:4326", always_xy=True)  # a zone off: north is 4.6 degrees aside
    e0, n0 = to_earth.transform(EARTH[1], EARTH[0], direction="INVERSE")
    lon, lat = to_earth.transform(e0 + x, n0 + y)
    turn, _, far = Geod(ellps="WGS84").inv(np.full_like(lon, EARTH[1]), np.full_like(lat, EARTH[0]), lon, lat)
    heights = slope(far * np.sin(np.radians(turn)), far * np.cos(np.radians(turn))).astype("f4")
    transform = Affine(CELL, 0.0, e0 + x[0, 0] - 0.5 * CELL, 0.0, -CELL, n0 + y[0, 0] + 0.5 * CELL)
    return write(folder / "p.tif", heights, transform, "EPSG:32633"), {"earth": (*EARTH, 90.0)}


@_form
def web_mercator(folder: Path):
    from pyproj import Geod, Transformer
    from rasterio.transform import Affine

    x, y = north_up(half=1.6 * HALF)
    to_earth = Transformer.from_crs("EPSG:3857", "EPSG:4326", always_xy=True)
    e0, n0 = to_earth.transform(EARTH[1], EARTH[0], direction="INVERSE")
    lon, lat = to_earth.transform(e0 + x, n0 + y)
    turn, _, far = Geod(ellps="WGS84").inv(np.full_like(lon, EARTH[1]), np.full_like(lat, EARTH[0]), lon, lat)
    heights = slope(far * np.sin(np.radians(turn)), far * np.cos(np.radians(turn))).astype("f4")
    transform = Affine(CELL, 0.0, e0 + x[0, 0] - 0.5 * CELL, 0.0, -CELL, n0 + y[0, 0] + 0.5 * CELL)
    return write(folder / "w.tif", heights, transform, "EPSG:3857"), {"site": (e0, n0)}


@_form
def holes_by_value(folder: Path):
    heights = slope(*north_up()).astype("f4")
    heights[scattered_holes(heights.shape)] = -9999.9
    return write(folder / "h.tif", heights, nodata=-9999.9), {**ON_GRID, "holes": "neighbours"}


@_form
def holes_by_the_lowest_number(folder: Path):
    heights = slope(*north_up()).astype("f4")
    heights[scattered_holes(heights.shape)] = np.finfo("f4").min
    keys = (1024, 1), (1025, 1), (3072, 32632)
    return plain_tiff(folder / "h.tif", heights, *keys, hole="-3.40282346638529e+38"), {
        **ON_GRID,
        "holes": "neighbours",
    }


@_form
def holes_by_mask(folder: Path):
    heights = slope(*north_up()).astype("f4")
    holes = scattered_holes(heights.shape)
    heights[holes] = 0.0
    path = write(folder / "h.tif", heights, mask=np.where(holes, 0, 255).astype("u1"))
    return path, {**ON_GRID, "holes": "neighbours"}


@_form
def esri_grid(folder: Path):
    return esri(folder / "e.asc", slope(*north_up()), west=SITE[0] - HALF, south=SITE[1] - HALF), ON_GRID


@_form
def pixel_is_point(folder: Path):
    return write(folder / "p.tif", slope(*north_up()).astype("f4"), tags={"AREA_OR_POINT": "Point"}), ON_GRID


@_form
def world_file_and_prj(folder: Path):
    path = write(folder / "w.tif", slope(*north_up()).astype("f4"), "none", None)
    corner = SITE[0] - HALF, SITE[1] + HALF
    (folder / "w.tfw").write_text(f"{CELL}\n0\n0\n{-CELL}\n{corner[0]}\n{corner[1]}\n")
    import pyproj

    (folder / "w.prj").write_text(pyproj.CRS(UTM).to_wkt("WKT1_ESRI"))
    return path, ON_GRID
