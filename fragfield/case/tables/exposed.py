"""The table [[exposed]]: people, roads, buildings and areas at which the hazard is computed."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, Tag

from fragfield.case.tables.base import Table, by_kind
from fragfield.case.tables.site import Latitude, Longitude, OnEarth
from fragfield_base.inputs import Angle, ArealDensity, Energy, Length, Offset, PositiveLength, Quantity

__all__ = ["AreaTable", "BarrierTable", "ExposedBuildingTable", "ExposedTable", "PersonTable", "RoadTable"]


class BarrierTable(Table):
    """A wall or roof by which fragments may be shown to be stopped."""

    material: Literal["concrete", "steel"]
    """Concrete, by the modified NDRC relation, or mild steel plate, by that of BRL; see the theory of the hazard."""
    thickness: PositiveLength
    """Thickness."""
    strength: Annotated[float, Quantity("Pa", "30 MPa", above=0.0)] = 30e6
    """Cylinder strength of concrete."""


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
