"""From the tables [[exposed]] to positions in metres and to the prisms in which fragments are counted."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flight.errors import InputError
from flight.hazard.exposed import Prism
from flight.scene.targets import contains
from fragfield.case.conversion.surroundings import ground_height, site_of
from fragfield.case.faults import Fault
from fragfield.case.schema import CaseTable
from fragfield.case.tables.surroundings import (
    AreaTable,
    BuildingTable,
    ExposedBuildingTable,
    ExposedTable,
    ObstacleTable,
    PersonTable,
    RoadTable,
    WallTable,
)
from fragfield_base.errors import show

Array = NDArray[np.float64]


DEPTH = 1.0  # m by which prisms reach below the lowest ground
FARTHEST = 100e3  # m of a place from the rounds


@dataclass(frozen=True, eq=False)
class ExposedSite:
    """An exposed site."""

    table: ExposedTable
    """As in the case, resolved."""
    outline: Array
    """(k, 2) float64: of its plan (m)."""
    pieces: tuple[Array, ...]
    """(k, 2) float64: convex polygons that make up its plan (m)."""
    energy: float
    """From which a fragment is hazardous (J)."""
    height: float
    """Below which fragments count (m)."""
    area: float
    """That one person or vehicle presents (m2); of no meaning for a building."""
    prism: Prism | None = None
    """In which hits are counted: of a building."""

    @property
    def centre(self) -> tuple[float, float]:
        """Where its name stands on a map (m)."""
        if isinstance(self.table, RoadTable) and self.table.points:
            return self.table.points[len(self.table.points) // 2]
        x, y = self.outline.mean(axis=0).tolist()
        return x, y

    def edge(self, spacing: float = 1.0) -> Array:
        """Points along the outline (n, 2), no farther apart than `spacing` (m), at most 10,000 a side."""
        parts = []
        for start, end in zip(self.outline, np.roll(self.outline, -1, axis=0), strict=True):
            count = min(10_000, max(1, math.ceil(float(np.hypot(*(end - start))) / spacing)))
            parts.append(start + (end - start) * (np.arange(count) / count)[:, None])
        return np.concatenate(parts)

    def nearest(self, origin: tuple[float, float]) -> tuple[float, float]:
        """Distance (m) and azimuth (degrees, 0 to 360) of the nearest point of its edge."""
        away = self.edge() - np.asarray(origin)
        distance = np.hypot(away[:, 0], away[:, 1])
        at = int(np.argmin(distance))
        return float(distance[at]), math.degrees(math.atan2(away[at, 1], away[at, 0])) % 360.0


def check_exposed(case: CaseTable) -> Iterator[Fault]:
    """Faults of the tables [[exposed]] as read."""
    for number, entry in enumerate(case.exposed, start=1):
        key = f"exposed[{number}]"
        limits = [k for k in ("max_density", "max_probability", "max_hits") if getattr(entry, k) is not None]
        if len(limits) > 1:
            yield Fault(
                f"{key}.{limits[1]}", f"found together with {limits[0]}; allowed: one criterion for an exposed site"
            )
        yield from _placing(case, key, entry)
        if isinstance(entry, AreaTable) and entry.points is not None and not is_convex(np.array(entry.points)):
            yield Fault(
                f"{key}.points", "found a polygon that is not convex; allowed: a convex one; split it into several"
            )
        if isinstance(entry, RoadTable) and entry.max_probability is not None and entry.target_area is None:
            yield Fault(
                f"{key}.target_area", 'missing; a probability on a road needs the area of a vehicle, such as "10 m^2"'
            )
        if isinstance(entry, RoadTable) and entry.max_hits is not None and entry.target_area is None:
            yield Fault(f"{key}.target_area", 'missing; hits on a road need the area of a vehicle, such as "10 m^2"')


def _placing(case: CaseTable, key: str, entry: ExposedTable) -> Iterator[Fault]:
    if isinstance(entry, ExposedBuildingTable) and entry.obstacle is not None:
        names = [one.name for one in case.obstacle if isinstance(one, BuildingTable)]
        if entry.obstacle not in names:
            words = ", ".join(show(name) for name in names) or 'no [[obstacle]] of kind "building" is there'
            yield Fault(f"{key}.obstacle", f"found {show(entry.obstacle)}; allowed: {words}")
        own = [k for k in ("position", "latitude", "length", "width", "height") if getattr(entry, k) is not None]
        if own:
            yield Fault(
                f"{key}.{own[0]}", "found together with obstacle, which says where the building stands; leave one out"
            )
        return
    if isinstance(entry, ExposedBuildingTable):
        for missing in (k for k in ("length", "width", "height") if getattr(entry, k) is None):
            yield Fault(
                f"{key}.{missing}", "missing; a building needs length, width and height, or the name of an obstacle"
            )
    if isinstance(entry, PersonTable | ExposedBuildingTable):
        parts = [entry.latitude is not None, entry.longitude is not None]
        yield from _one_of(case, key, ("position", "latitude"), entry.position is not None, any(parts))
        if sum(parts) == 1:
            yield Fault(f"{key}.latitude", "found one of latitude and longitude; needed: both")
    else:
        here, on_earth = entry.points is not None, entry.points_on_earth is not None
        yield from _one_of(case, key, ("points", "points_on_earth"), here, on_earth)


def _one_of(case: CaseTable, key: str, names: tuple[str, str], here: bool, on_earth: bool) -> Iterator[Fault]:
    second = "latitude and longitude" if names[1] == "latitude" else names[1]
    if here == on_earth:
        found = "both" if here else "neither"
        yield Fault(f"{key}.{names[0]}", f"found {found} {names[0]} and {second}; allowed: one of the two")
    elif on_earth and case.site is None:
        yield Fault(f"{key}.{names[1]}", "found without a table [site], which says where the rounds stand")


def resolved_exposed(case: CaseTable) -> list[ExposedTable]:
    """The tables with x and y instead of latitude and longitude."""
    site, origin = site_of(case), case.flight.origin

    def turned(latitude: float, longitude: float) -> tuple[float, float]:
        assert site is not None  # checked
        x, y = site.offsets(math.degrees(longitude), math.degrees(latitude))[0]
        return round(float(x) + origin[0], 4), round(float(y) + origin[1], 4)

    made: list[ExposedTable] = []
    for entry in case.exposed:
        changes: dict[str, Any] = {}
        if isinstance(entry, PersonTable | ExposedBuildingTable):
            if entry.latitude is not None and entry.longitude is not None:
                changes = {"position": turned(entry.latitude, entry.longitude), "latitude": None, "longitude": None}
        elif entry.points_on_earth is not None:
            changes = {"points": [turned(*pair) for pair in entry.points_on_earth], "points_on_earth": None}
        made.append(entry.model_copy(update=changes))
    return made


def exposed_sites_of(case: CaseTable) -> list[ExposedSite]:
    """The exposed sites of a resolved case; raises flight's InputError for one that cannot be counted."""
    sites = []
    for entry in case.exposed:
        try:
            sites.append(_exposed_site(case, entry))
        except InputError as error:
            raise InputError(f"exposed {show(entry.name)}: {error}") from None
    return sites


def _exposed_site(case: CaseTable, entry: ExposedTable) -> ExposedSite:
    energy = case.hazard.energy if entry.energy is None else entry.energy
    if isinstance(entry, ExposedBuildingTable):
        outline, prism = _building(case, entry, energy)
        exposed = ExposedSite(entry, outline, (outline,), energy, prism.height, 0.0, prism)
    else:
        height = case.hazard.person_height if entry.height is None else entry.height
        if not height > 0.0:
            raise InputError("no height to count fragments in; give it a height, hazard.person_height is zero")
        area = case.hazard.person_area if entry.target_area is None else entry.target_area
        outline, pieces = _open(case, entry)
        exposed = ExposedSite(entry, outline, tuple(pieces), energy, height, area)
    away = float(np.hypot(*(outline - np.asarray(case.flight.origin)).T).min())
    if away > FARTHEST:
        raise InputError(
            f"it lies {1e-3 * away:,.0f} km from the origin of distances; allowed: up to {1e-3 * FARTHEST:.0f} km: are "
            "latitude and longitude exchanged?"
        )
    for one in case.round:
        if contains(exposed.outline, np.array([one.position[:2]]))[0]:
            raise InputError(
                f"round {show(one.name)} stands in it; a position of people must lie outside of the rounds"
            )
    if isinstance(entry, PersonTable):
        for standing in case.obstacle:
            if contains(outline_of(standing), np.array([exposed.centre]))[0]:
                raise InputError(
                    f"it stands in obstacle {show(standing.name)}, which lets nothing through; for people in a "
                    f'building take kind = "building" with obstacle = {show(standing.name)} and its walls'
                )
    return exposed


def outline_of(obstacle: ObstacleTable) -> Array:
    """Corners (4, 2) of an obstacle's plan (m); of a bank that of its foot on level ground."""
    if isinstance(obstacle, BuildingTable):
        return rectangle(obstacle.position, obstacle.length, obstacle.width, obstacle.azimuth)
    start, end = np.asarray(obstacle.start), np.asarray(obstacle.end)
    way, (x, y) = end - start, (0.5 * (start + end)).tolist()
    if isinstance(obstacle, WallTable):
        foot = obstacle.thickness
    else:
        foot = obstacle.crest_width + 2.0 * obstacle.slope * obstacle.height
    return rectangle((x, y), float(np.hypot(*way)), foot, math.atan2(way[1], way[0]))


def _building(case: CaseTable, entry: ExposedBuildingTable, energy: float) -> tuple[Array, Prism]:
    if entry.obstacle is not None:
        standing = next(one for one in case.obstacle if one.name == entry.obstacle)
        assert isinstance(standing, BuildingTable)  # checked
        centre, size, base = standing.position, (standing.length, standing.width, standing.height), standing.base
        azimuth = standing.azimuth
    else:
        assert entry.position is not None  # checked
        assert entry.length is not None
        assert entry.width is not None
        assert entry.height is not None
        centre, size, base = entry.position, (entry.length, entry.width, entry.height), entry.base
        azimuth = entry.azimuth
    outline = rectangle(centre, size[0], size[1], azimuth)
    ground = ground_height(case, *centre) if base is None else base
    lowest = min(ground, *(ground_height(case, x, y) for x, y in outline.tolist()))
    wall, roof = (barrier and barrier.made() for barrier in (entry.wall, entry.roof))
    return outline, Prism(outline, lowest - DEPTH, ground + size[2], energy, size[2], wall, roof)


def _open(case: CaseTable, entry: PersonTable | RoadTable | AreaTable) -> tuple[Array, list[Array]]:
    if isinstance(entry, PersonTable):
        assert entry.position is not None  # checked
        away = np.subtract(entry.position, case.flight.origin)
        extent = entry.extent or min(5.0, max(1.0, 0.1 * float(np.hypot(*away))))
        outline = rectangle(entry.position, extent, extent, math.atan2(away[1], away[0]))
        return outline, [outline]
    assert entry.points is not None  # checked
    points = np.array(entry.points, dtype=np.float64)
    if isinstance(entry, RoadTable):
        return _strip(points, entry.width)
    return points, [points]


def _strip(points: Array, width: float) -> tuple[Array, list[Array]]:
    ways = np.diff(points, axis=0)
    lengths = np.hypot(ways[:, 0], ways[:, 1])
    if not lengths.min() > 0.0:
        raise InputError("two points of the road are the same")
    across = np.column_stack([-ways[:, 1], ways[:, 0]]) / lengths[:, None]
    ends = np.stack([points[:-1], points[1:]], axis=1)
    side = 0.5 * width * across[:, None]
    pieces = list(np.concatenate([ends - side, (ends + side)[:, ::-1]], axis=1))
    corner = np.concatenate([across[:1], across[:-1] + across[1:], across[-1:]])
    corner = corner / np.maximum((corner**2).sum(axis=1), 0.5)[:, None] * np.where(
        np.arange(len(points)) % (len(points) - 1) == 0, 1.0, 2.0
    )[:, None]  # fmt: skip
    outline = np.concatenate([points - 0.5 * width * corner, (points + 0.5 * width * corner)[::-1]])
    return outline, pieces


def is_convex(corners: Array) -> bool:
    """Whether corners (n, 2) in order are those of a convex polygon."""
    import shapely

    plan = shapely.Polygon(corners)
    return bool(plan.is_valid and plan.convex_hull.area <= plan.area * (1.0 + 1e-12))


def rectangle(centre: tuple[float, float], length: float, width: float, azimuth: float) -> Array:
    """Corners (4, 2) of a rectangle whose length points to an azimuth (rad)."""
    along = 0.5 * length * np.array([math.cos(azimuth), math.sin(azimuth)])
    across = 0.5 * width * np.array([-math.sin(azimuth), math.cos(azimuth)])
    return np.asarray(centre) + np.array([along + across, across - along, -along - across, along - across])
