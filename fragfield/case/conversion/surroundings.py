"""From a resolved case to the ground and the obstacles of the flight."""

from __future__ import annotations

import math
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from flight import HeightMap, InputError, Ricochet
from flight.scene.scene import Scene
from fragfield.case.schema import CaseTable
from fragfield.case.tables.base import degrees_of
from fragfield.case.tables.surroundings import GroundTable
from fragfield.places.site import Site, compass_point

_ADIABATIC, _GAS_CONSTANT = 1.4, 287.053  # of air: ratio of its heats, J/(kg K)


def surroundings(case: CaseTable) -> dict[str, Any]:
    """Ground, ricochet and obstacles, as keyword arguments of `flight.fly`; raises flight's InputError."""
    table = case.flight.ground
    law = Ricochet.of(table.ricochet)
    factors = (table.critical_angle_factor, table.speed_kept_factor, table.departure_factor, table.roughness_factor)
    return {
        "ground": ground_of(case),
        "ricochet": law and law.scaled(*factors),
        "obstacles": [entry.made() for entry in case.obstacle],
    }


def ground_of(case: CaseTable) -> float | HeightMap:
    """Height of the flat ground (m), or the map of heights."""
    table = case.flight.ground
    if table.map is None:
        return table.height
    path = Path(table.map)
    # with the file's time, so that a new file is read again
    changed = path.stat().st_mtime_ns if path.is_file() else 0
    return _read_map(path, table, _earth(case), changed)


def _earth(case: CaseTable) -> tuple[float, float, float] | None:
    """Latitude and longitude of x = y = 0, and bearing of +x (degrees); None without [site]."""
    site = site_of(case)
    if site is None:
        return None
    x, y = case.flight.origin
    if (x, y) == (0.0, 0.0):
        return site.latitude, site.longitude, site.bearing
    longitude, latitude = site.coordinates(math.degrees(math.atan2(-y, -x)), math.hypot(x, y))[0]
    return float(latitude), float(longitude), site.bearing


def altitude_of(case: CaseTable) -> float:
    """Altitude of z = 0 above sea level (m), of the standard atmosphere: as given, else by the map, else 0."""
    if case.flight.air.altitude is not None:
        return case.flight.air.altitude
    ground = ground_of(case)
    return 0.0 if isinstance(ground, float) else float(ground.datum or 0.0)


def ground_height(case: CaseTable, x: float, y: float) -> float:
    """Height of the ground at a place (m)."""
    ground = ground_of(case)
    return ground if isinstance(ground, float) else float(ground.at(x, y))


def check_surroundings(case: CaseTable) -> None:
    """Refuse rounds off the map or in an obstacle, and an origin in one; raises flight's InputError."""
    found = surroundings(case)
    scene = Scene(found["ground"], found["ricochet"], tuple(found["obstacles"]))
    rounds = np.array([entry.position for entry in case.round], dtype=np.float64).reshape(-1, 3)
    scene.check_places(rounds, case.flight.origin, "rounds")


@lru_cache(maxsize=2)
def _read_map(
    path: Path,
    table: GroundTable,
    earth: tuple[float, float, float] | None,
    changed: int,  # noqa: ARG001
) -> HeightMap:
    from fragfield.places.maps import read_map

    datum: float | Literal["site"] = "site" if isinstance(table.datum, str) else table.datum
    try:
        return read_map(
            path, site=table.site, earth=earth, datum=datum, holes=table.holes, band=table.band,
            height_unit=table.height_unit,
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"ground.map: {error}") from None


def site_of(case: CaseTable) -> Site | None:
    """The case's site in degrees, free of what the way over radians adds in the last digits."""
    if case.site is None:
        return None
    return Site(*map(degrees_of, (case.site.latitude, case.site.longitude, case.site.bearing)))


def bearing_of(case: CaseTable, azimuth: float | None) -> float | None:
    """Bearing (degrees clockwise from north) of an azimuth (degrees from +x); None without [site] or an azimuth."""
    site = site_of(case)
    return None if site is None or azimuth is None else float(site.bearing_of(azimuth))


def wind_words(case: CaseTable) -> str:
    """The wind, and where it blows, by bearing where the case has a site."""
    wind = case.flight.wind

    def blows(speed: float, towards: float) -> str:
        turn = math.degrees(towards)
        return f"{speed:g} m/s towards {direction_words(turn, bearing_of(case, turn))}"

    if wind.model == "profile":
        column = zip(wind.heights or [], wind.speeds or [], wind.directions or [], strict=True)
        levels = [f"{blows(speed, towards)} at z = {height:g} m" for height, speed, towards in column]
        return "; ".join(levels if len(levels) <= 3 else [levels[0], f"{len(levels) - 2} levels between", levels[-1]])
    if wind.speed == 0.0:
        return "none"
    if wind.model == "power_law":
        return f"{blows(wind.speed, wind.towards)} at {wind.reference_height:g} m, power law"
    return f"{blows(wind.speed, wind.towards)} at all heights"


def air_words(case: CaseTable) -> str:
    """The air at the origin's ground: density and temperature, of constant air that of its speed of sound."""
    air, ground = case.flight.air.air(), ground_height(case, *case.flight.origin)
    density, sound = float(air.density(ground)), float(air.sound_speed(ground))
    celsius = sound**2 / (_ADIABATIC * _GAS_CONSTANT) - 273.15
    if case.flight.air.model == "standard":
        there = f"on the ground, {altitude_of(case) + ground:.0f} m above sea level"
        return f"standard atmosphere, {celsius:.0f} °C and {density:.4g} kg/m³ {there}"
    return f"{density:.4g} kg/m³ everywhere, speed of sound {sound:.4g} m/s (air of {celsius:.0f} °C)"


def direction_words(azimuth: float, bearing: float | None, *, whole: bool = False) -> str:
    """A direction as every text gives it: bearing and point of the compass where the case has a site, else azimuth.

    `azimuth` counts from +x, counter-clockwise, `bearing` (`bearing_of`) from north, clockwise (degrees). `whole`: in
    whole degrees, for places; else in four digits.
    """
    angle = azimuth if bearing is None else bearing
    words = f"{round(angle) % 360}°" if whole else f"{float(f'{angle:.4g}') % 360.0:g}°"
    return f"azimuth {words}" if bearing is None else f"bearing {words} ({compass_point(bearing)})"
