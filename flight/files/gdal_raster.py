"""GeoTIFF and other rasters through rasterio (GDAL): bands, masks, scale and offset, units, what stands beside."""

from __future__ import annotations

import contextlib
import math
import os
import struct
import sys
import warnings
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
from flight.files.raster import DIGITS, INSTALL, Raster, holes_filled_with_nan, metres_of
from fragfield_base.reading import read_text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray


_DIRECTORY = 34735  # the TIFF tag of the keys, of short integers
PLAN_UNIT, HEIGHT_UNIT = 3076, 4099  # ProjLinearUnitsGeoKey, VerticalUnitsGeoKey
DRIVERS = {
    ".tif": ("GTiff", "GeoTIFF"), ".tiff": ("GTiff", "GeoTIFF"), ".hgt": ("SRTMHGT", "SRTM tile"),
    ".dt0": ("DTED", "DTED"), ".dt1": ("DTED", "DTED"), ".dt2": ("DTED", "DTED"), ".img": ("HFA", "Erdas Imagine"),
}  # fmt: skip
"""GDAL's drivers and names by the ends of files' names."""
_PREFIXES = ("GDAL_", "GTIFF_", "CPL_", "OGR_", "OSR_", "PROJ_", "VSI_", "TIFF_", "SRTMHGT_", "DTED_", "HFA_", "RIO_")
_WORLD_FILES = (".tfw", ".tifw", ".tiffw", ".wld", ".TFW", ".WLD")
_FEW, _MOST_PACKED = 1_000_000, 8000  # nodes that any file may have, and those in a byte of a packed one
_MOST_BANDS = 1000
_APART = 0.05  # of a pixel, by which two positions of one map differ


@contextlib.contextmanager
def own_environment() -> Iterator[None]:
    """Without variables and settings of the user's that change what GDAL and PROJ read: a map has one meaning.

    GDAL asks the environment at every use. A file of settings (~/.gdal/gdalrc) is not read, nothing is fetched.
    """
    kept = {name: value for name, value in os.environ.items() if name.startswith(_PREFIXES)}
    ours = {"GDAL_CONFIG_FILE": os.devnull, "PROJ_NETWORK": "OFF", "PROJ_SKIP_READ_USER_WRITABLE_DIRECTORY": "YES"}
    for name in kept:
        del os.environ[name]
    os.environ.update(ours)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # NotGeoreferencedWarning: refused below
            yield
    finally:
        for name in [name for name in os.environ if name.startswith(_PREFIXES)]:
            del os.environ[name]  # also what rasterio sets when it is imported
        os.environ.update(kept)


def _refuse_second_libraries(path: Path) -> None:
    """Refuse PyPI's rasterio once another dolfinx than PyPI's is loaded: the libraries of both break each other."""
    apart = "dolfinx" in sys.modules and "rasterio" not in sys.modules and find_spec("dolfinx_solver") is None
    found = find_spec("rasterio") if apart else None
    if found is not None and found.origin and Path(found.origin).parent.with_name("rasterio.libs").is_dir():
        raise InputError(
            f"{path}: found rasterio from PyPI beside dolfinx, whose libraries do not go together; needed: both from "
            f"one place: pip uninstall rasterio pyproj, then {INSTALL}"
        )


def read_gdal_raster(path: Path, band: int | None) -> Raster:
    """One band of a raster.

    Raises InputError: rasterio is not installed, or the file is no single band of heights with a position.
    """
    with own_environment():
        _refuse_second_libraries(path)
        try:
            import rasterio
        except ModuleNotFoundError:
            raise InputError(
                f"{path}: reading {DRIVERS[path.suffix.lower()][1]} needs rasterio and pyproj; install them by: "
                f"{INSTALL}; or convert the file to .asc"
            ) from None
        driver, form = DRIVERS[path.suffix.lower()]
        try:
            with rasterio.Env(GDAL_PAM_ENABLED="NO"), rasterio.open(path, driver=driver) as dataset:
                _refuse_too_many(path, dataset)
                inside = _described(dataset, band)
            with rasterio.Env(GDAL_PAM_ENABLED="YES"), rasterio.open(path, driver=driver) as dataset:
                number = _band(path, dataset, band)
                _refuse_pictures(path, dataset, number)
                described = _described(dataset, number)
                _refuse_contradictions(path, inside, described)
                raster = _raster(path, form, dataset, number, described)
                _refuse_missing_blocks(path, dataset, number)
        except InputError:
            raise
        except Exception as error:  # noqa: BLE001 - GDAL's classes of errors are many, and follow the file
            raise InputError(f"{path}: cannot be read as {form} ({_last(error)})") from None
    return raster


def _refuse_too_many(path: Path, dataset: Any) -> None:  # noqa: ANN401
    """Refuse a broken file that declares more heights or bands than it can hold, before they are looked for."""
    if dataset.count > _MOST_BANDS:
        raise InputError(f"{path}: has {dataset.count} bands; allowed: {_MOST_BANDS}")
    number, size = dataset.height * dataset.width, path.stat().st_size
    if number > _FEW and number > _MOST_PACKED * size:
        raise InputError(
            f"{path}: declares {dataset.height} x {dataset.width} heights, more than a file of {size} bytes can hold"
        )


def _last(error: BaseException) -> str:
    """The words of GDAL behind an error of rasterio, in one line."""
    while error.__cause__ is not None:
        error = error.__cause__
    return " ".join(str(error).split()) or type(error).__name__


def _band(path: Path, dataset: Any, chosen: int | None) -> int:  # noqa: ANN401 - rasterio has no types
    """Number of the band with the heights; a band of transparency is none."""
    from rasterio.enums import ColorInterp

    numbers = [number for number, kind in enumerate(dataset.colorinterp, 1) if kind != ColorInterp.alpha]
    if chosen is not None:
        if chosen not in numbers:
            raise InputError(f"{path}: band {chosen} is chosen; allowed: {', '.join(map(str, numbers)) or 'none'}")
        return chosen
    if dataset.subdatasets:
        raise InputError(
            f"{path}: holds {len(dataset.subdatasets)} images; write the one with the heights to a file of its own: "
            f"gdal_translate GTIFF_DIR:1:{path.name} heights.tif"
        )
    if len(numbers) != 1:
        names = [f"{number} {dataset.descriptions[number - 1] or ''}".strip() for number in numbers[:8]]
        raise InputError(f"{path}: has {len(numbers)} bands ({', '.join(names)}); choose that of the heights: band = 1")
    return numbers[0]


def _refuse_pictures(path: Path, dataset: Any, number: int) -> None:  # noqa: ANN401
    from rasterio.enums import ColorInterp

    kind = dataset.colorinterp[number - 1]
    if kind in (ColorInterp.palette, ColorInterp.red, ColorInterp.green, ColorInterp.blue):
        raise InputError(f"{path}: band {number} is a picture ({kind.name} of its colours), no heights")
    if dataset.dtypes[number - 1].startswith("complex"):
        raise InputError(f"{path}: band {number} holds complex numbers, no heights")


def _described(dataset: Any, band: int | None) -> dict[str, Any]:  # noqa: ANN401
    """What says how values and position are read; None where nothing is stated."""
    index = (band or 1) - 1
    whole = dataset.transform
    placed = not whole.is_identity and math.isfinite(whole.determinant) and whole.determinant != 0.0
    nodata = dataset.nodatavals[index] if index < dataset.count else None
    many = index < dataset.count
    return {
        "transform": tuple(whole[:6]) if placed else None,
        "coordinate system": dataset.crs.to_wkt() if _on_earth(dataset.crs) else None,
        "nodata": None if nodata is None else float(nodata),
        "scale": dataset.scales[index] if many and dataset.scales[index] != 1.0 else None,
        "offset": dataset.offsets[index] if many and dataset.offsets[index] != 0.0 else None,
        "unit": (dataset.units[index] or "").strip() or None if many else None,
    }


def _on_earth(crs: Any) -> bool:  # noqa: ANN401
    """Whether a coordinate system says more than that there are coordinates: GDAL makes one of a file without any."""
    return bool(crs) and not crs.to_wkt().startswith(("LOCAL_CS", "ENGCRS"))


def _refuse_contradictions(path: Path, inside: dict[str, Any], whole: dict[str, Any]) -> None:
    """Refuse a file beside the map that says otherwise than the map itself; it may say what the map does not."""
    for name, stated in inside.items():
        if stated is not None and whole[name] != stated and not (stated != stated and whole[name] != whole[name]):
            raise InputError(
                f"{path}: its {name} differs from that in {path.name}.aux.xml beside it; remove one of the two"
            )


def _raster(path: Path, form: str, dataset: Any, number: int, found: dict[str, Any]) -> Raster:  # noqa: ANN401
    affine = found["transform"]
    _check_world_file(path, affine)
    if affine is None:
        what = "control points alone" if dataset.gcps[0] else "no position and scale"
        raise InputError(f"{path}: has {what}; needed: a map with coordinates (gdalwarp makes one of control points)")
    a, b, c, d, e, f = affine
    centres = (a, b, c + 0.5 * (a + b), d, e, f + 0.5 * (d + e))
    scale, offset, nodata = found["scale"] or 1.0, found["offset"] or 0.0, found["nodata"]
    if not (math.isfinite(scale) and math.isfinite(offset)):
        raise InputError(f"{path}: scale {scale} and offset {offset} of its heights; needed: finite numbers")
    notes = []
    if (scale, offset) != (1.0, 0.0):
        notes.append(f"heights are the stored numbers times {scale:g}" + (f" plus {offset:g}" if offset else ""))
    if dataset.dtypes[number - 1] == "uint8":
        notes.append("stored in 8 bits, whole steps from 0 to 255: is it a shaded picture?")
    if Path(f"{path}.aux.xml").is_file():
        notes.append(f"read with {path.name}.aux.xml")

    from rasterio.enums import ColorInterp

    # GDAL makes single numbers of shorter floats, or before that half ones.
    bits = "16" if dataset.dtypes[number - 1] == "float16" else dataset.tags(number, ns="IMAGE_STRUCTURE").get("NBITS")
    digits = DIGITS.get(bits) if dataset.dtypes[number - 1].startswith("float") else None
    clear = [index for index, kind in enumerate(dataset.colorinterp, 1) if kind == ColorInterp.alpha]

    def read(rows: slice, columns: slice) -> NDArray[np.float64]:
        import rasterio
        from rasterio.windows import Window

        window = Window(columns.start, rows.start, columns.stop - columns.start, rows.stop - rows.start)
        with own_environment(), rasterio.Env(GDAL_PAM_ENABLED="YES"):
            try:
                with rasterio.open(path, driver=DRIVERS[path.suffix.lower()][0]) as again:
                    values, mask = again.read(number, window=window), again.read_masks(number, window=window) != 0
                    for index in clear:  # GDAL makes a mask of transparency of 8-bit bands alone
                        mask &= again.read(index, window=window) != 0
            except Exception as error:  # noqa: BLE001 - as above
                raise InputError(f"{path}: cannot be read as {form} ({_last(error)})") from None
        heights = holes_filled_with_nan(values, nodata, digits)
        heights[~mask] = np.nan
        return heights * scale + offset

    crs, unit = _crs(dataset), found["unit"]
    if dataset.driver == "GTiff" and crs is not None:
        flat = not crs.is_geographic and bool(crs.axis_info)
        plan = crs.axis_info[0].unit_conversion_factor if flat else None
        refuse_other_units(path, plan, 1.0 if unit is None else metres_of(path, unit))
    return Raster(path, form, dataset.shape, centres, read, crs, unit, notes)


def _crs(dataset: Any) -> Any:  # noqa: ANN401
    """The file's coordinate system as pyproj's."""
    if not dataset.crs:
        return None
    import pyproj

    return pyproj.CRS.from_wkt(dataset.crs.to_wkt(version="WKT2_2019"))


def _check_world_file(path: Path, affine: tuple[float, ...] | None) -> None:
    """Refuse a world file that lies elsewhere than the map; of a map without a position GDAL takes the file's."""
    if path.with_suffix(".tfwx").is_file():
        raise InputError(
            f"{path}: {path.stem}.tfwx beside it: the map was fitted, not rectified; rectify and export it"
        )
    for beside in (path.with_suffix(suffix) for suffix in _WORLD_FILES):
        if not beside.is_file() or affine is None:
            continue
        try:
            a, d, b, e, c, f = (float(word) for word in read_text(beside, InputError, most=4096).split())
        except ValueError:
            raise InputError(f"{path}: {beside.name} beside it is no world file of six numbers") from None
        corner = (a, b, c - 0.5 * (a + b), d, e, f - 0.5 * (d + e))
        size = math.sqrt(abs(affine[0] * affine[4] - affine[1] * affine[3]))
        if max(abs(one - other) for one, other in zip(corner, affine, strict=True)) > _APART * size:
            raise InputError(
                f"{path}: its position differs from that in {beside.name} beside it; remove one of the two"
            )


def _refuse_missing_blocks(path: Path, dataset: Any, number: int) -> None:  # noqa: ANN401
    """Refuse parts that the file leaves out without a mask or a nodata value: GDAL reads them as zero heights."""
    from rasterio.enums import MaskFlags

    if dataset.driver != "GTiff" or dataset.mask_flag_enums[number - 1] != [MaskFlags.all_valid]:
        return
    height, width = dataset.block_shapes[number - 1]
    for row in range(-(-dataset.height // height)):
        for column in range(-(-dataset.width // width)):
            if dataset.get_tag_item(f"BLOCK_OFFSET_{column}_{row}", "TIFF", bidx=number) is None:
                raise InputError(
                    f"{path}: leaves out the part from row {row * height}, column {column * width}, without a nodata "
                    "value; set one: gdal_edit.py -a_nodata"
                )


def read_geo_keys(path: Path) -> dict[int, int]:
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


def refuse_other_units(path: Path, plan: float | None, height: float | None) -> None:
    """Refuse a GeoTIFF whose own keys state other units than GDAL, which drops some of them and then says metres.

    `plan` and `height` are the units that GDAL reports (m); None: not a unit of length, or none.
    """
    keys = read_geo_keys(path)
    if not keys.keys() & {PLAN_UNIT, HEIGHT_UNIT}:
        return
    from pyproj.database import get_units_map

    sizes = {int(unit.code): unit.conv_factor for unit in get_units_map(auth_name="EPSG", category="linear").values()}
    for key, reported, what in ((PLAN_UNIT, plan, "coordinates"), (HEIGHT_UNIT, height, "heights")):
        stated = keys.get(key)
        if stated is None or reported is None:
            continue
        if stated not in sizes or abs(sizes[stated] / reported - 1.0) > 1e-9:
            raise InputError(
                f"{path}: its {what} are in the unit EPSG:{stated} by its GeoTIFF keys, and in units of "
                f"{reported:.9g} m by its coordinate system; set it right: gdal_edit.py -a_srs"
            )
