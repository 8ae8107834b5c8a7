"""Maps of heights from files, through rasterio (GDAL): metres on the plane of a case."""

from __future__ import annotations

import math
import os
import re
import sys
import warnings
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from flight import FlightWarning, HeightMap, InputError
from fragfield.places.map_plane import SURVEY_FOOT, Earth, Place, Plane, plane_of, refuse_other_units, unit_words
from fragfield_base.reading import read_text
from fragfield_base.units import UnitError, read_measure

INSTALL = (
    "apt-get install python3-rasterio python3-pyproj proj-bin, or conda install -c conda-forge rasterio pyproj, or pip "
    "install rasterio pyproj: from where dolfinx comes from (any of them without dolfinx)"
)
"""How the libraries of the extra `terrain` are installed: those of PyPI go with PyPI's dolfinx alone."""
DRIVERS = {
    ".asc": ("AAIGrid", "ESRI ASCII grid"), ".tif": ("GTiff", "GeoTIFF"), ".tiff": ("GTiff", "GeoTIFF"),
    ".hgt": ("SRTMHGT", "SRTM tile"), ".dt0": ("DTED", "DTED"), ".dt1": ("DTED", "DTED"), ".dt2": ("DTED", "DTED"),
    ".img": ("HFA", "Erdas Imagine"),
}  # fmt: skip
"""GDAL's drivers and names by the ends of files' names."""
_SETTINGS = {  # above the user's environment: a map has one meaning
    "AAIGRID_DATATYPE": "Float64", "GDAL_PAM_ENABLED": "YES", "GDAL_GEOREF_SOURCES": "PAM,INTERNAL,WORLDFILE",
    "GDAL_DISABLE_READDIR_ON_OPEN": "FALSE", "GTIFF_POINT_GEO_IGNORE": "FALSE", "GTIFF_REPORT_COMPD_CS": "YES",
}  # fmt: skip
_OF_BANDS = (
    ("nodatavals", "nodata value", None), ("scales", "scale", 1.0), ("offsets", "offset", 0.0),
    ("units", "unit of heights", None),
)  # fmt: skip
_WORLD_FILES = (".tfw", ".tifw", ".tiffw", ".wld", ".TFW", ".WLD")
_FARTHEST = 25_000.0  # m from x = y = 0 along x and y, to which a map is read; no fragment flies farther
_MOST_NODES, _MOST_PACKED = 200_000_000, 8000  # nodes, and those in a byte of a packed file
_NARROW, _NARROW_NODES = 30.0, 4  # m, and nodes: a hole as wide as one of them is known by its rim
HEIGHT_UNITS = {"m": 1.0, "ft": 0.3048, "us_ft": SURVEY_FOOT}
"""Units of height by the names that a case may give, in metres."""
_NUMBER = r"(?:[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:e[-+]?\d+)?|nan|null|none)"
_NO_NUMBER = re.compile(rf"(?<!\S)(?!{_NUMBER}(?!\S))\S+", re.IGNORECASE)


def read_map(
    path: str | Path, *, site: Place | None = None, earth: Earth | None = None, datum: float | Literal["site"] = "site",
    holes: Literal["refuse", "neighbours"] = "refuse", band: int | None = None, height_unit: str | None = None,
) -> HeightMap:  # fmt: skip
    """Read an ESRI ASCII grid (.asc), GeoTIFF (.tif), .hgt, .dt0 to .dt2 or .img; needs rasterio and pyproj.

    A map is read up to 25 km from x = y = 0 along x and y. Its own nodes are kept where x and y are its own
    coordinates, else heights are interpolated at nodes as far apart.

    Parameters
    ----------
    path : path
        The file; what it says of units, scale, masks and coordinates is followed, or refused by name.
    site : (2,) floats, optional
        Easting and northing, in the map's grid, of x = y = 0 (m). Left out: by `earth`, else (0, 0), of a map in
        degrees its centre.
    earth : (3,) floats, optional
        Latitude and longitude (WGS 84) of x = y = 0, and bearing of +x (degrees): x and y are then metres on the ground
        from there. Without it +x is the map's grid east.
    datum : float or "site"
        The map's height of z = 0 (m); "site": its height at the site, so that the ground there is z = 0.
    holes : "refuse" or "neighbours"
        What becomes of nodes without a height: an error, or values interpolated from the rim (`rasterio.fill`), where
        holes wider than 30 m and four nodes, and those that reach the edge, count as beyond the map.
    band : int, optional
        Of a file with several.
    height_unit : "m", "ft" or "us_ft", optional
        Of a file that does not state it.

    Returns
    -------
    HeightMap
        With `facts`, in words: `format`, `crs`, `plan_unit`, `height_unit`, `vertical`, `north`, `position`, a list of
        `notes`, and the number of nodes `filled`.

    Raises
    ------
    InputError
        The file cannot be read as heights in metres, or has holes that are refused.
    """
    path = Path(path)
    if path.suffix.lower() not in DRIVERS:
        raise InputError(
            f"{path}: a height map is an ESRI ASCII grid (.asc), a GeoTIFF (.tif, .tiff), an SRTM tile (.hgt), DTED "
            "(.dt0, .dt1, .dt2) or Erdas Imagine (.img); gdal_translate makes a GeoTIFF of others"
        )
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    apart = "dolfinx" in sys.modules and "rasterio" not in sys.modules and find_spec("dolfinx_solver") is None
    found = find_spec("rasterio") if apart else None
    if found is not None and found.origin and Path(found.origin).parent.with_name("rasterio.libs").is_dir():
        raise InputError(
            f"{path}: found rasterio from PyPI beside dolfinx, whose libraries do not go together; needed: both from "
            f"one place: pip uninstall rasterio pyproj, then {INSTALL}"
        )
    # Where the caller has imported Debian 12's dolfinx RTLD_GLOBAL is set: rasterio's GEOS would stand for shapely's.
    sys.setdlopenflags(os.RTLD_NOW)
    try:
        import pyproj  # noqa: F401
        import rasterio
        from scipy.ndimage import map_coordinates
    except ModuleNotFoundError:
        raise InputError(f"{path}: reading maps needs rasterio and pyproj; install them by: {INSTALL}") from None
    driver, form = DRIVERS[path.suffix.lower()]
    if driver == "AAIGrid":
        _refuse_words(path)
    with warnings.catch_warnings(), rasterio.Env(**_SETTINGS):
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)  # refused below
        try:
            with rasterio.open(path, driver=driver) as dataset:
                _refuse_contradictions(path, driver, dataset)
                heights, step, corner, facts = _read(path, form, dataset, site, earth, band, height_unit)
        except InputError:
            raise
        except Exception as error:  # noqa: BLE001 - GDAL's classes of errors are many, and follow the file
            raise InputError(
                f"{path}: cannot be read as {form} ({' '.join(str(error.__cause__ or error).split())})"
            ) from None
    if datum == "site":
        node = [[-corner[1] / step[1]], [-corner[0] / step[0]]]
        datum = float(map_coordinates(heights, node, order=1, mode="nearest")[0])
        if not math.isfinite(datum):
            raise InputError(f"{path}: the map has a hole at the site; give datum as a height (m)")
    facts["filled"], beyond = _fill(path, heights, step) if holes == "neighbours" else (0, None)
    return HeightMap(heights - datum, step, corner, datum=datum, name=str(path), beyond=beyond, facts=facts)


def _refuse_words(path: Path) -> None:
    """Refuse an ESRI grid with a word in place of a number, which GDAL reads as zero."""
    values = re.sub(
        r"^[ \t]*[a-z]\w*[ \t]+(?=\S+[ \t\r]*$)", "", read_text(path, InputError), flags=re.MULTILINE | re.IGNORECASE
    )
    if wrong := _NO_NUMBER.search(values):
        raise InputError(f"{path}: holds {wrong[0][:40]!r}, needed: a number")


def _refuse_contradictions(path: Path, driver: str, dataset: Any) -> None:  # noqa: ANN401 - rasterio has no types
    """Refuse what lies beside a map and says otherwise than the map itself; it may say what the map does not."""
    import rasterio

    if path.with_suffix(".tfwx").is_file():
        raise InputError(
            f"{path}: {path.stem}.tfwx beside it: the map was fitted, not rectified; rectify and export it"
        )
    added = Path(f"{path}.aux.xml")
    world = next((one for one in map(path.with_suffix, _WORLD_FILES) if one.is_file()), None)
    if world is None and not added.is_file():
        return
    apart = None
    with rasterio.Env(GDAL_PAM_ENABLED="NO", GDAL_GEOREF_SOURCES="INTERNAL"), rasterio.open(path, driver=driver) as own:
        place = own.transform
        on_earth = own.crs and (own.crs.is_geographic or own.crs.is_projected)
        if on_earth and own.crs != dataset.crs:
            apart = "coordinate system", added
        for attribute, what, nothing in _OF_BANDS:
            stated = getattr(own, attribute)
            if any(one != nothing for one in stated) and stated != getattr(dataset, attribute):
                apart = what, added
    if not place.is_identity:
        if place != dataset.transform:
            apart = "position", added
        if world is not None:
            with rasterio.Env(GDAL_PAM_ENABLED="NO", GDAL_GEOREF_SOURCES="WORLDFILE"), rasterio.open(path) as other:
                if not place.almost_equals(other.transform, 0.05 * abs(place.determinant) ** 0.5):
                    apart = "position", world
    if apart is not None:
        what, beside = apart
        raise InputError(f"{path}: its {what} differs from that in {beside.name} beside it; remove one of the two")


def _read(
    path: Path, form: str, dataset: Any, site: Place | None, earth: Earth | None, band: int | None,  # noqa: ANN401
    height_unit: str | None,
) -> tuple[NDArray[np.float64], Place, Place, dict[str, Any]]:  # fmt: skip
    """Heights (m) at nodes, southernmost row first, not a number in holes; step, corner, and what was read in words."""
    number = _band(path, dataset, band)
    nodes, size = dataset.height * dataset.width, path.stat().st_size
    if nodes > 1_000_000 and nodes > _MOST_PACKED * size:
        raise InputError(f"{path}: declares {dataset.shape} heights, more than a file of {size} bytes can hold")
    whole = dataset.transform
    if whole.is_identity or whole.is_degenerate or not all(map(math.isfinite, whole)):
        what = "control points alone" if dataset.gcps[0] else "no position and scale"
        raise InputError(f"{path}: has {what}; needed: a map with coordinates (gdalwarp makes one of control points)")
    if dataset.driver == "AAIGrid" and whole.a <= 0.0:
        raise InputError(f"{path}: cells of {whole.a:g}; needed: a cellsize above 0")
    _refuse_missing_blocks(path, dataset, number)
    crs = _crs(path, dataset)
    factor, words = _height_unit(path, crs, dataset.units[number - 1], height_unit)
    if dataset.driver == "GTiff" and crs is not None:
        flat = not crs.is_geographic and bool(crs.axis_info)
        unit = dataset.units[number - 1]
        refuse_other_units(
            path, crs.axis_info[0].unit_conversion_factor if flat else None, _metres_of(path, unit) if unit else 1.0
        )
    affine, plane = plane_of(path, dataset, crs, site, earth)
    facts: dict[str, Any] = {"format": form, **plane.words, **words, "notes": []}
    scale, offset = dataset.scales[number - 1], dataset.offsets[number - 1]
    if (scale, offset) != (1.0, 0.0):
        plus = f" plus {offset:g}" if offset else ""
        facts["notes"].append(f"heights are the stored numbers times {scale:g}{plus}")
    if dataset.dtypes[number - 1] == "uint8":
        facts["notes"].append("stored in 8 bits, whole steps from 0 to 255: is it a shaded picture?")
    if Path(f"{path}.aux.xml").is_file():
        facts["notes"].append(f"read with {path.name}.aux.xml")
    down, across = _window(path, dataset, affine, plane)
    if (down.stop - down.start, across.stop - across.start) != dataset.shape:
        facts["notes"].append(
            f"of {dataset.width} x {dataset.height} nodes those within {_FARTHEST / 1e3:g} km of x = y = 0 are read"
        )
    heights = factor * (_values(dataset, number, (down, across)) * scale + offset)
    affine = affine * affine.translation(across.start, down.start)
    if plane.grid is None and affine.b == affine.d == 0.0:
        ends = np.array([0, heights.shape[1] - 1]), np.array([0, heights.shape[0] - 1])
        x, y = plane.places(affine, *ends)
        heights = np.ascontiguousarray(heights[:: 1 if y[0] < y[1] else -1, :: 1 if x[0] < x[1] else -1])
        step = float(np.ptp(x)) / ends[0][1], float(np.ptp(y)) / ends[1][1]
        return heights, step, (float(x.min()), float(y.min())), facts
    facts["notes"].append("heights at the nodes are interpolated between those of the map")
    return *_resampled(path, heights, affine, crs, plane), facts


def _band(path: Path, dataset: Any, chosen: int | None) -> int:  # noqa: ANN401 - rasterio has no types
    from rasterio.enums import ColorInterp

    numbers = [number for number, kind in enumerate(dataset.colorinterp, 1) if kind != ColorInterp.alpha]
    if chosen is not None and chosen not in numbers:
        raise InputError(f"{path}: band {chosen} is chosen; allowed: {', '.join(map(str, numbers)) or 'none'}")
    if chosen is None and dataset.subdatasets:
        raise InputError(
            f"{path}: holds {len(dataset.subdatasets)} images; write the one with the heights to a file of its own: "
            f"gdal_translate GTIFF_DIR:1:{path.name} heights.tif"
        )
    if chosen is None and len(numbers) != 1:
        names = [f"{number} {dataset.descriptions[number - 1] or ''}".strip() for number in numbers[:8]]
        raise InputError(f"{path}: has {len(numbers)} bands ({', '.join(names)}); choose that of the heights: band = 1")
    number = chosen or numbers[0]
    kind = dataset.colorinterp[number - 1]
    if kind in (ColorInterp.palette, ColorInterp.red, ColorInterp.green, ColorInterp.blue):
        raise InputError(f"{path}: band {number} is a picture ({kind.name} of its colours), no heights")
    if dataset.dtypes[number - 1].startswith("complex"):
        raise InputError(f"{path}: band {number} holds complex numbers, no heights")
    return number


def _refuse_missing_blocks(path: Path, dataset: Any, number: int) -> None:  # noqa: ANN401
    """Refuse parts that the file leaves out without a mask or a nodata value: GDAL reads them as zero heights."""
    from rasterio.enums import MaskFlags

    if dataset.driver != "GTiff" or dataset.mask_flag_enums[number - 1] != [MaskFlags.all_valid]:
        return
    for (row, column), window in dataset.block_windows(number):
        if dataset.get_tag_item(f"BLOCK_OFFSET_{column}_{row}", "TIFF", bidx=number) is None:
            raise InputError(
                f"{path}: leaves out the part from row {window.row_off}, column {window.col_off}, without a nodata "
                "value; set one: gdal_edit.py -a_nodata"
            )


def _values(dataset: Any, number: int, window: tuple[slice, slice]) -> NDArray[np.float64]:  # noqa: ANN401
    """Stored numbers of rows and columns, not a number where the file masks them or they are its sentinel."""
    from rasterio.enums import ColorInterp
    from rasterio.windows import Window

    inside = Window.from_slices(*window)
    values = dataset.read(number, window=inside, masked=True).astype(np.float64).filled(np.nan)
    for index, kind in enumerate(dataset.colorinterp, 1):
        if kind == ColorInterp.alpha:  # GDAL makes a mask of transparency of 8-bit bands alone
            values[dataset.read(index, window=inside) == 0] = np.nan
    if (nodata := dataset.nodatavals[number - 1]) is not None:  # stored in single precision, written with seven digits
        values[np.isclose(values, nodata, rtol=1e-6, atol=0.0) | (np.abs(values) >= 1e30)] = np.nan
    return values


def _crs(path: Path, dataset: Any) -> Any:  # noqa: ANN401
    import pyproj

    crs = pyproj.CRS.from_wkt(dataset.crs.to_wkt(version="WKT2_2019")) if dataset.crs else None
    beside = path.with_suffix(".prj")
    if beside.is_file() and (crs is None or crs.is_engineering):
        try:
            return pyproj.CRS.from_wkt(read_text(beside, InputError, most=1 << 20).strip())
        except pyproj.exceptions.CRSError:
            raise InputError(
                f"{path}: {beside.name} beside it is not understood as a coordinate system; write it as WKT: "
                "gdalsrsinfo -o wkt_esri"
            ) from None
    return crs


def _metres_of(path: Path, unit: str) -> float:
    """A unit of length in metres, by any of its usual names."""
    plain = re.sub("[^a-z]", "", unit.lower())
    if plain.startswith(("usf", "ussurvey")) or plain in ("ftus", "footus"):
        return SURVEY_FOOT
    try:
        measure = read_measure(f"1 {unit.strip().lower()}")
    except UnitError:
        measure = None
    if measure is None or not measure.is_of("m"):
        raise InputError(
            f"{path}: heights in the unit {unit!r}, which is not known; allowed: m, ft, US survey foot, cm"
        )
    return measure.value


def _height_unit(path: Path, crs: Any, of_band: str | None, given: str | None) -> tuple[float, dict[str, str]]:  # noqa: ANN401
    """Metres in a unit of height, and in words that and the datum; raises InputError where it is not certain."""
    while crs is not None and crs.is_bound:
        crs = crs.source_crs
    axes = [] if crs is None else crs.axis_info
    up = next((axis for axis in axes if axis.direction in ("up", "down")), None)
    if up is not None and up.direction == "down":
        raise InputError(f"{path}: holds depths ({crs.name}), no heights")
    vertical = "not stated in the file"
    if up is not None:
        ellipsoid = "above the ellipsoid, which lies up to 110 m off sea level"
        vertical = crs.sub_crs_list[-1].name if crs.is_compound else ellipsoid
    stated = {
        "the case": HEIGHT_UNITS[given] if given else None,
        "its band": _metres_of(path, of_band) if of_band and of_band.strip() else None,
        "its datum": up and up.unit_conversion_factor,
    }
    sizes = {source: size for source, size in stated.items() if size is not None}
    if sizes and max(sizes.values()) > min(sizes.values()) * 1.00001:  # feet and US survey feet are one for heights
        words = " and ".join(f"{unit_words(size)} by {source}" for source, size in sizes.items())
        raise InputError(f"{path}: the unit of its heights is {words}; one of them must go")
    for source, size in sizes.items():
        return size, {"height_unit": f"{unit_words(size)}, by {source}", "vertical": vertical}
    if axes and not crs.is_geographic and axes[0].unit_conversion_factor != 1.0:
        raise InputError(
            f"{path}: the unit of its heights is not stated, and its plan is in "
            f'{unit_words(axes[0].unit_conversion_factor)}; say which: height_unit = "m", "ft" or "us_ft"'
        )
    return 1.0, {"height_unit": "metres, which the file does not state", "vertical": vertical}


def _window(path: Path, dataset: Any, affine: Any, plane: Plane) -> tuple[slice, slice]:  # noqa: ANN401
    """Rows and columns within `_FARTHEST` of x = y = 0; raises InputError where that lies off the map."""
    column, row = plane.pixels(affine, 0.0, 0.0)
    ends = np.array([dataset.width, dataset.height]) - 1.0
    if not ((np.array([column, row]) >= -1e-6) & (np.array([column, row]) <= ends + 1e-6)).all():
        corners = affine * (0.5, 0.5), affine * tuple(ends + 0.5)
        (x0, x1), (y0, y1) = (sorted(pair) for pair in zip(*corners, strict=True))
        raise InputError(
            f"{path}: {plane.words['position']} ({plane.words['crs']}) lies off the map, which reaches from "
            f"{x0:.10g} to {x1:.10g} and from {y0:.10g} to {y1:.10g} in its own coordinates"
        )
    edge = np.meshgrid(np.linspace(-_FARTHEST, _FARTHEST, 33), np.linspace(-_FARTHEST, _FARTHEST, 33))
    slices = []
    for size, values in zip((dataset.width, dataset.height), plane.pixels(affine, *edge), strict=True):
        values = values[np.isfinite(values)]
        slices.append(slice(max(0, math.floor(values.min()) - 1), min(size, math.ceil(values.max()) + 2)))
    across, down = slices
    columns, rows = across.stop - across.start, down.stop - down.start
    if rows * columns > _MOST_NODES:
        raise InputError(
            f"{path}: {rows * columns} nodes within {_FARTHEST / 1e3:g} km of x = y = 0; allowed: {_MOST_NODES}; cut "
            "the map (gdal_translate -projwin) or make it coarser"
        )
    if min(rows, columns) < 2:
        raise InputError(f"{path}: {rows} x {columns} nodes; needed: two rows and two columns or more")
    return down, across


def _resampled(
    path: Path, heights: NDArray[np.float64], affine: Any, crs: Any, plane: Plane  # noqa: ANN401
) -> tuple[NDArray[np.float64], Place, Place]:  # fmt: skip
    """Heights at nodes along x and y, as far apart as the map's; the rectangle that the map fills."""
    from affine import Affine
    from rasterio.warp import Resampling, reproject

    column, row = plane.pixels(affine, 0.0, 0.0)
    x, y = plane.places(affine, column + np.array([0.0, 1.0, 0.0]), row + np.array([0.0, 0.0, 1.0]))
    steps = np.hypot(x[1:] - x[0], y[1:] - y[0])[:: 1 if abs(x[1] - x[0]) > abs(y[1] - y[0]) else -1]
    edges = np.meshgrid(*(np.linspace(0, size - 1, 33) for size in heights.shape[::-1]))
    firsts, numbers = [], []
    for values, step in zip(plane.places(affine, *edges), steps, strict=True):
        first = math.floor(max(np.nanmin(values), -_FARTHEST) / step)  # a node lies at x = y = 0
        firsts.append(first)
        numbers.append(math.ceil(min(np.nanmax(values), _FARTHEST) / step) - first + 1)
    if math.prod(numbers) > min(_MOST_NODES, 4 * heights.size + 10_000):  # a turned map fills half of its rectangle
        raise InputError(f"{path}: {heights.size} nodes would become {numbers[0]} x {numbers[1]} along x and y")
    to_nodes = plane.to_plane * Affine.scale(*steps) * Affine.translation(firsts[0] - 0.5, firsts[1] - 0.5)
    found = []
    for values in (heights, np.ones_like(heights)):
        into = np.full(numbers[::-1], np.nan)
        reproject(
            values, into, src_transform=affine, src_crs=plane.crs if plane.grid is None else crs, src_nodata=np.nan,
            dst_transform=to_nodes, dst_crs=plane.crs, dst_nodata=np.nan, resampling=Resampling.bilinear,
            XSCALE="1", YSCALE="1",  # else GDAL smooths a turned map, whose rectangle has other numbers of nodes
        )  # fmt: skip
        found.append(into)
    rows, columns = _filled_rectangle(np.isfinite(found[1]), -firsts[1], -firsts[0])
    if min(rows.stop - rows.start, columns.stop - columns.start) < 2:
        raise InputError(f"{path}: {plane.words['position']} lies on the edge of the map")
    corner = steps * (firsts[0] + columns.start, firsts[1] + rows.start)
    return np.ascontiguousarray(found[0][rows, columns]), tuple(steps.tolist()), tuple(corner.tolist())


def _filled_rectangle(inside: NDArray[np.bool_], row: int, column: int) -> tuple[slice, slice]:
    """Rows and columns about a node, all of whose nodes are inside: the edge with most nodes outside goes first."""
    top, left, bottom, right = 0, 0, inside.shape[0] - 1, inside.shape[1] - 1
    while not inside[top : bottom + 1, left : right + 1].all():
        outside = [
            (~inside[top, left : right + 1]).mean() * (top < row),
            (~inside[bottom, left : right + 1]).mean() * (bottom > row),
            (~inside[top : bottom + 1, left]).mean() * (left < column),
            (~inside[top : bottom + 1, right]).mean() * (right > column),
        ]
        worst = int(np.argmax(outside))
        if outside[worst] == 0.0:
            return slice(0, 0), slice(0, 0)
        top, bottom = top + (worst == 0), bottom - (worst == 1)
        left, right = left + (worst == 2), right - (worst == 3)
    return slice(top, bottom + 1), slice(left, right + 1)


def _fill(path: Path, heights: NDArray[np.float64], step: Place) -> tuple[int, NDArray[np.bool_] | None]:
    """Fill the holes in place; returns their number, and which nodes belong to holes that end the map."""
    from rasterio.fill import fillnodata
    from scipy import ndimage

    missing = ~np.isfinite(heights)
    number = int(missing.sum())
    if number == heights.size:
        raise InputError(f"{path}: no node has a height")
    if number == 0:
        return 0, None
    hole, _ = ndimage.label(missing, np.ones((3, 3)))
    boxes = ndimage.find_objects(hole)
    reach = max(sum(side.stop - side.start for side in box) for box in boxes)
    heights[missing] = fillnodata(np.where(missing, 0.0, heights), ~missing, max_search_distance=reach)[missing]
    beyond = np.isin(hole, [index for index, box in enumerate(boxes, 1) if _is_wide(box, heights.shape, step)])
    share = f"{number} of {heights.size} nodes have no height ({100.0 * number / heights.size:.3g} %)"
    words = f"{path}: {share}; they were filled from their neighbours"
    if beyond.any():
        words += f"; {int(beyond.sum())} of them, in wide holes or at the map's edge, count as beyond the map"
    warnings.warn(words, FlightWarning, stacklevel=3)
    return number, beyond if beyond.any() else None


def _is_wide(box: tuple[slice, slice], shape: tuple[int, ...], step: Place) -> bool:
    return any(
        side.start == 0 or side.stop == size or side.stop - side.start > max(_NARROW_NODES, _NARROW / length)
        for side, size, length in zip(box, shape, reversed(step), strict=True)
    )
