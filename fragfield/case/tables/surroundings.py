"""The tables [flight.ground], [[obstacle]], [[exposed]], [site], [official] and [document]: what stands around."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from flight.scene.obstacles import Barricade, Building, Wall
from fragfield.case.faults import Fault
from fragfield.case.tables.base import Table, by_kind, name_or_table
from fragfield.hazard.walls import StoppingWall
from fragfield.places.site import longitude_of
from fragfield_base.bounds import Bounds, OnlyWith
from fragfield_base.inputs import Angle, ArealDensity, Energy, Length, Offset, PositiveLength, Quantity, Vector
from fragfield_base.units import degrees


@dataclass(frozen=True)
class _East(Quantity):
    """Marks a longitude: read from -360 to 360 degrees, kept above -180 and up to 180."""

    def parse(self, value: object) -> float | str:
        """Read a longitude."""
        return _within_half_a_turn(super().parse(value))


@dataclass(frozen=True)
class _Place(Vector):
    """Marks a latitude and a longitude."""

    def parse(self, value: object) -> tuple[float, ...]:
        """Read both."""
        latitude, longitude = super().parse(value)
        return latitude, float(_within_half_a_turn(longitude))


def _within_half_a_turn(angle: float | str) -> float | str:
    """The same longitude (rad) by the one rule of `fragfield.places.site`: the very float of its degrees."""
    if isinstance(angle, str):
        return angle
    found = longitude_of(round(math.degrees(angle), 10))
    return angle if found == round(math.degrees(angle), 10) else degrees(found)


_TURN = 2.0 * math.pi
_HIGHEST_LATITUDE = degrees(89.0)
Latitude = Annotated[float, Quantity("rad", "51.5 deg", minimum=-_HIGHEST_LATITUDE, maximum=_HIGHEST_LATITUDE)]
Longitude = Annotated[float, _East("rad", "7.25 deg", minimum=-_TURN, maximum=_TURN)]
OnEarth = Annotated[
    tuple[float, float],
    _Place(2, Quantity("rad", "0 deg", minimum=-_TURN, maximum=_TURN), '["51.5 deg", "7.25 deg"]'),
]


class PlacesTable(Table):
    """People, roads, areas, buildings, barricades and walls from a map; each becomes an [[exposed]] or [[obstacle]]."""

    file: str = Field(min_length=1)
    """GeoJSON (.geojson, .json) or KML (.kml, .kmz)."""
    kind: str = Field(default="kind", min_length=1)
    """Property that says what a place is; without it the folder of a KML, or the shape."""
    kinds: dict[str, str] | None = Field(
        default=None, json_schema_extra={"inline": '{ Wohnhaus = "building", Point = "person", Baum = "ignore" }'}
    )
    """What its words mean: person, road, area, building, barricade, wall or ignore; also those of shapes: Point,
    LineString, Polygon."""
    unit: Annotated[float | str | None, Quantity("m", "1 m", above=0.0, words=("m", "ft"))] = None
    """Unit of heights and widths that have none in the map; left out: such are refused."""
    building_height: Annotated[float | None, Quantity("m", "6 m", above=0.0)] = None
    """Height of buildings that have none in the map; left out: such are refused."""


class SiteTable(Table):
    """Where `flight.origin` lies and how the axes are turned; with it, distances are written as maps."""

    latitude: Latitude
    """North positive, on WGS 84; to 89 degrees, since near a pole a contour has no map."""
    longitude: Longitude
    """East positive; 190 degrees is -170 degrees."""
    bearing: Annotated[float, Quantity("rad", "90 deg", minimum=-_TURN, maximum=_TURN)]
    """Of +x, clockwise from north: with 90 degrees x points east and y north."""
    places: (
        Annotated[Annotated[str, Tag("<name>")] | Annotated[PlacesTable, Tag("<table>")], Discriminator(name_or_table)]
        | None
    ) = None
    """A map of people, roads, areas, buildings and obstacles: a file, or a table that says how it is read."""


_FARTHEST = 20e3  # m


class OfficialTable(Table):
    """Published distances, shown beside the computed one; they change nothing that is computed."""

    hazardous_fragment_distance: Annotated[float | None, Quantity("m", "120 m", above=0.0, maximum=_FARTHEST)] = None
    """Distance to hazardous fragments, at one per 55.7 m2 (600 ft2) or as the authority defines it."""
    maximum_fragment_distance: Annotated[float | None, Quantity("m", "650 m", above=0.0, maximum=_FARTHEST)] = None
    """Distance that no fragment is expected to exceed."""
    rounds: int = Field(default=1, ge=1)
    """How many rounds, detonated together, the distances are published for."""
    source: str = Field(min_length=1)
    """Authority, document, edition and page, as the report is to cite them."""


def check_official(official: OfficialTable) -> Iterator[Fault]:
    """Faults of the table, as lines `key: found ...; allowed: ...`."""
    hazardous, farthest = official.hazardous_fragment_distance, official.maximum_fragment_distance
    if not official.source.strip():
        yield Fault("official.source", "found only blanks; allowed: authority, document, edition and page")
    if hazardous is None and farthest is None:
        yield Fault(
            "official.hazardous_fragment_distance",
            "missing, and maximum_fragment_distance too; needed: at least one of "
            'the two, for example hazardous_fragment_distance = "120 m"',
        )
    if hazardous is not None and farthest is not None and farthest < hazardous:
        yield Fault(
            "official.maximum_fragment_distance",
            f"found {farthest:g} m; allowed: at least hazardous_fragment_distance, {hazardous:g} m",
        )


class DocumentTable(Table):
    """What stands on the first page of the report and at the foot of every printed page."""

    number: str = ""
    """Document number."""
    revision: str = ""
    """Revision, for example "B"."""
    classification: str = ""
    """Classification line, printed as it is written here."""
    prepared_by: str = ""
    """Who prepared the report."""
    reviewed_by: str = ""
    """Who reviewed it."""
    approved_by: str = ""
    """Who approved it."""
    changes: list[str] = Field(default_factory=list)
    """What this revision changed, a line each."""


Surface = Literal["soft_soil", "hard_soil", "sand", "rock", "concrete", "asphalt", "water", "none"]

_MAP = OnlyWith("map", without=(None,), refused=True)
_RICOCHET = OnlyWith("ricochet", without=("none",), refused=True)


def _factor(of: str, low: float, high: float) -> Bounds:
    return Bounds(0.01, 10.0, f"the range of {of} is {low:g} to {high:g} times the table's", usual=(low, high))


class GroundTable(Table):
    """The ground: flat, or a map of heights."""

    height: Annotated[Length, Bounds(-1e4, 1e4, "heights on Earth"), OnlyWith("map", (None,))] = 0.0
    """z of flat ground; a casing that the burst drives below it starts its flight on it."""
    map: str | None = None
    """A map of heights instead of flat ground: an ESRI ASCII grid (.asc), a GeoTIFF (.tif), or .hgt, .dt2, .img."""
    site: Annotated[Offset | None, Bounds(-1e8, 1e8, "eastings and northings of any grid on Earth"), _MAP] = None
    """Easting and northing, on the map, of x = y = 0; left out: by [site], else (0, 0), in degrees its centre"""
    datum: Annotated[
        float | str, Quantity("m", "120 m", words=("site",)), Bounds(-1.2e4, 1e4, "heights on Earth"), _MAP
    ] = "site"
    """Height, on the map, of z = 0; "site": the map's height there, so that the ground at x = y = 0 is z = 0."""
    holes: Annotated[Literal["refuse", "neighbours"], _MAP] = "refuse"
    """Nodes of the map without a height: an error, or filled from their neighbours, where holes are narrow."""
    beyond: Annotated[Literal["refuse", "level"], _MAP] = "refuse"
    """A map that ends within a fragment's reach: an error, or level ground beyond, and no distance that gets there."""
    band: Annotated[int | None, Field(ge=1), _MAP] = None
    """Which band of the file holds the heights, where it has several."""
    height_unit: Annotated[Literal["m", "ft", "us_ft"] | None, _MAP] = None
    """Unit of the map's heights, where the file does not state it."""
    ricochet: Surface = "soft_soil"
    """Kind of ground, off which fragments ricochet at grazing angles; "none": they stay where they land."""
    critical_angle_factor: Annotated[float, _factor("critical angles of ricochet", 0.7, 1.8), _RICOCHET] = 1.0
    """Factor on the largest angle at which fragments ricochet off this kind of ground; 0.7 to 1.8 is its range."""
    speed_kept_factor: Annotated[float, _factor("the share of speed kept", 0.65, 1.3), _RICOCHET] = 1.0
    """Factor on the share of speed that is kept at that angle; 0.65 to 1.3 is its range."""
    departure_factor: Annotated[float, _factor("the angle of departure", 0.5, 1.5), _RICOCHET] = 1.0
    """Factor on the angle of departure over the angle of impact; 0.5 to 1.5 is its range."""
    roughness_factor: Annotated[
        float,
        Bounds(0.0, 10.0, "the range of the ground's roughness is 0.25 to 2 times the table's", usual=(0.0, 2.0)),
        _RICOCHET,
    ] = 1.0
    """Factor on the standard deviation of the ground's slopes, at which fragments graze it; 0.25 to 2 is its range."""


_FIRST = ("name", "base", "ricochet", "kind")


class WallTable(Table, Wall):
    """An upright wall."""

    ORDER: ClassVar = _FIRST
    name: str = Field(min_length=1)
    ricochet: Surface = "none"
    kind: Literal["wall"]
    """An upright wall."""


class BarricadeTable(Table, Barricade):
    """An earth barricade."""

    ORDER: ClassVar = _FIRST
    name: str = Field(min_length=1)
    ricochet: Surface = "none"
    kind: Literal["barricade"]
    """A bank with sloped sides and upright ends."""


class BuildingTable(Table, Building):
    """A building as a box."""

    ORDER: ClassVar = _FIRST
    name: str = Field(min_length=1)
    ricochet: Surface = "none"
    kind: Literal["building"]
    """A box; hits are counted on its four walls and its roof."""
    azimuth: Angle = 0.0
    """Direction of its length, from +x counter-clockwise; the front looks there."""


ObstacleTable = Annotated[
    Annotated[WallTable, Tag("<wall>")]
    | Annotated[BarricadeTable, Tag("<barricade>")]
    | Annotated[BuildingTable, Tag("<building>")],
    by_kind("wall"),
]


class BarrierTable(Table, StoppingWall):
    """A wall or roof by which fragments may be shown to be stopped."""


class _ExposedTable(Table):
    """What all exposed sites have. At most one of the three limits."""

    name: str = Field(min_length=1)
    """A name of its own."""
    energy: Energy | None = None
    """Energy of a hazardous fragment here; left out: `hazard.energy`."""
    max_density: ArealDensity | None = None
    """Criterion: largest expected density of hazardous fragments; the default one, with `hazard.density`."""
    max_probability: float | None = Field(default=None, gt=0.0, lt=1.0)
    """Criterion: largest probability of at least one hazardous hit."""
    max_hits: float | None = Field(default=None, gt=0.0)
    """Criterion: largest expected number of hazardous hits."""


class _TargetTable(_ExposedTable):
    """People or vehicles in the open."""

    number: float = Field(default=1.0, gt=0.0)
    """How many stand there at once, all taken to stand where it is worst."""
    height: Annotated[float | None, Quantity("m", "1.8 m", above=0.0)] = None
    """Height up to which a passing fragment counts; left out: `hazard.person_height`."""
    target_area: Annotated[float | None, Quantity("m^2", "0.58 m^2", above=0.0)] = None
    """Area of one of them that a fragment may hit; left out: `hazard.person_area`."""


class PersonTable(_TargetTable):
    """A person in the open."""

    kind: Literal["person"] = "person"
    """A person in the open."""
    position: Offset | None = None
    """x and y; or latitude and longitude."""
    latitude: Latitude | None = None
    """Instead of `position`, with a table [site]."""
    longitude: Longitude | None = None
    """Instead of `position`, with a table [site]."""
    extent: Annotated[float | None, Quantity("m", "5 m", above=0.0)] = None
    """Side of the square about the position in which fragments count; left out: a tenth of the distance, 1 to 5 m."""


class RoadTable(_TargetTable):
    """A road with vehicles or people on it."""

    kind: Literal["road"]
    """A strip along a line."""
    points: list[Offset] | None = Field(default=None, min_length=2)
    """x and y of its centre line; or `points_on_earth`."""
    points_on_earth: list[OnEarth] | None = Field(default=None, min_length=2)
    """Latitude and longitude of its centre line, with a table [site]."""
    width: PositiveLength = 6.0
    """Width."""


class AreaTable(_TargetTable):
    """An open area where people may be anywhere."""

    kind: Literal["area"]
    """A convex polygon."""
    points: list[Offset] | None = Field(default=None, min_length=3)
    """x and y of its corners in order; or `points_on_earth`."""
    points_on_earth: list[OnEarth] | None = Field(default=None, min_length=3)
    """Latitude and longitude of its corners, with a table [site]."""


class ExposedBuildingTable(_ExposedTable):
    """A building as a box whose walls and roof count hits."""

    kind: Literal["building"]
    """A box; it shields what lies behind it only where it is an obstacle."""
    obstacle: str | None = None
    """Name of an [[obstacle]] of kind "building" whose box this is; then it shields what lies behind it."""
    position: Offset | None = None
    """x and y of the centre of its plan; or latitude and longitude."""
    latitude: Latitude | None = None
    """Instead of `position`, with a table [site]."""
    longitude: Longitude | None = None
    """Instead of `position`, with a table [site]."""
    length: Annotated[float | None, Quantity("m", "12 m", above=0.0)] = None
    """Along `azimuth`."""
    width: Annotated[float | None, Quantity("m", "8 m", above=0.0)] = None
    """Across `azimuth`."""
    height: Annotated[float | None, Quantity("m", "4 m", above=0.0)] = None
    """Height above the ground, or above `base`."""
    azimuth: Angle = 0.0
    """Direction of its length, from +x counter-clockwise."""
    base: Length | None = None
    """z from which its height counts; left out: the ground at its centre."""
    wall: BarrierTable | None = None
    """Its walls, to show which hazardous fragments they stop; left out: none is shown to be stopped."""
    roof: BarrierTable | None = None
    """Its roof, alike."""


ExposedTable = Annotated[
    Annotated[PersonTable, Tag("<person>")]
    | Annotated[RoadTable, Tag("<road>")]
    | Annotated[AreaTable, Tag("<area>")]
    | Annotated[ExposedBuildingTable, Tag("<building>")],
    by_kind("person"),
]
