"""The case file as a whole."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from fragfield.case.tables.base import Table
from fragfield.case.tables.break_up import BreakUpTable
from fragfield.case.tables.burst import BurstTable
from fragfield.case.tables.exposed import ExposedTable
from fragfield.case.tables.flight import FlightTable, HazardTable, WitnessTable
from fragfield.case.tables.ground import ObstacleTable
from fragfield.case.tables.round import RoundTable
from fragfield.case.tables.site import DocumentTable, OfficialTable, SiteTable
from fragfield.case.tables.stack import PlaneTable, StackTable
from fragfield.case.tables.uncertainty import UncertaintyTable
from fragfield_base.inputs import Bounds, Entries

__all__ = ["CaseTable"]


class CaseTable(Table):
    """Everything that a run depends on. Values are in SI once read; field names are the file's keys."""

    title: str = ""
    """One line for reports."""
    seed: Annotated[int, Bounds(0, 2**63 - 1, "a whole number of 63 bits")] = 1
    """Seed of every random number."""
    burst: BurstTable | None = None
    """Needed by every command except `fly`."""
    round: Annotated[list[RoundTable], Entries(10000, "more rounds are not computed whole")] = Field(
        default_factory=list
    )
    """The cased charges."""
    stack: StackTable | None = None
    """An arrangement of copies of one round; once read, its rounds stand among the others."""
    plane: Annotated[list[PlaneTable], Entries(100, "every cell meets every plane")] = Field(default_factory=list)
    """Planes that no casing passes: ground, walls, planes of symmetry."""
    break_up: BreakUpTable = BreakUpTable()
    flight: FlightTable = FlightTable()
    obstacle: Annotated[list[ObstacleTable], Entries(1000, "every fragment meets every obstacle")] = Field(
        default_factory=list
    )
    """Walls, barricades and buildings that stop fragments or turn them off."""
    witness: Annotated[list[WitnessTable], Entries(1000, "every fragment meets every surface")] = Field(
        default_factory=list
    )
    """Surfaces that record fragments."""
    exposed: list[ExposedTable] = Field(default_factory=list)
    """People, roads, areas and buildings whose hazard is asked for."""
    hazard: HazardTable = HazardTable()
    site: SiteTable | None = None
    """Where on Earth; with it, distances are also written as contours.geojson and contours.kml."""
    official: OfficialTable | None = None
    """Distances of the round as its authority publishes them, shown beside the computed one."""
    document: DocumentTable = DocumentTable()
    """Number, revision and names on the report."""
    uncertainty: UncertaintyTable | None = None
    """Uncertain inputs, for `fragfield uncertainty`; a run itself takes no notice of them."""
