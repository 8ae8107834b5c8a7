"""The tables [site], [official] and [document]: where on Earth, published distances, and data for document control."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from pydantic import Discriminator, Field, Tag

from fragfield.case.faults import Fault
from fragfield.case.tables.base import Table, name_or_table
from fragfield_base.inputs import Quantity, Vector
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
    from fragfield.places.site import longitude_of

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
