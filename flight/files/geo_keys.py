"""Units that a GeoTIFF's own keys state, byte by byte: GDAL drops some of them, and then says metres."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from flight.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["read_geo_keys", "refuse_other_units"]

_DIRECTORY = 34735  # the TIFF tag of the keys, of short integers
PLAN_UNIT, HEIGHT_UNIT = 3076, 4099  # ProjLinearUnitsGeoKey, VerticalUnitsGeoKey


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
    """Refuse a GeoTIFF whose keys state other units than what GDAL made of them.

    Parameters
    ----------
    path : Path
        The file.
    plan, height : float or None
        Units that GDAL reports (m); None: not a unit of length, or none.
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
