"""The case file as a whole, and its table [uncertainty]: which inputs are uncertain, and how they are sampled."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from fragfield.case.tables.base import Table
from fragfield.case.tables.burst import BreakUpTable, BurstTable
from fragfield.case.tables.flight import FlightTable, HazardTable, WitnessTable
from fragfield.case.tables.round import PlaneTable, RoundTable, StackTable
from fragfield.case.tables.surroundings import DocumentTable, ExposedTable, ObstacleTable, OfficialTable, SiteTable
from fragfield_base.bounds import Bounds, Entries, OnlyWith

_ENDS = OnlyWith(
    "distribution", ("uniform", "triangular", "normal", "lognormal"), refused=True, needed=("uniform", "triangular")
)


def _of(distribution: str) -> OnlyWith:
    return OnlyWith("distribution", (distribution,), refused=True, needed=(distribution,))


class UncertainInputTable(Table):
    """An uncertain input: one draw from a distribution, for one key of the case or for several."""

    name: str = Field(min_length=1)
    """A name of its own; that of an input of the default set replaces it."""
    keys: list[str] = Field(min_length=1)
    """Dotted keys of the resolved case, as in `--set`, for example "burst.leakage.radius_ratio"; all get this draw."""
    applies: Literal["value", "factor", "shift"] = "value"
    """The draw is the key's value, a factor on the value that the case has, or is added to it."""
    distribution: Literal["uniform", "normal", "lognormal", "triangular", "discrete"]
    """Distribution of the draw."""
    low: Annotated[float | str | None, _ENDS] = None
    """Lower end; for "normal" and "lognormal" where the distribution is cut off, and may be left out."""
    high: Annotated[float | str | None, _ENDS] = None
    """Upper end, alike."""
    mode: Annotated[float | str | None, _of("triangular")] = None
    """For "triangular": the most probable value."""
    mean: Annotated[float | str | None, _of("normal")] = None
    """For "normal"."""
    standard_deviation: Annotated[float | str | None, _of("normal")] = None
    """For "normal"."""
    median: Annotated[float | str | None, _of("lognormal")] = None
    """For "lognormal"."""
    factor: Annotated[float | None, _of("lognormal")] = Field(default=None, gt=1.0)
    """For "lognormal": geometric standard deviation; 68 % lie within this factor either way of the median."""
    values: Annotated[list[float | str | bool] | None, _of("discrete")] = None
    """For "discrete": the values; names and words only with applies = "value"."""
    weights: Annotated[list[float] | None, OnlyWith("distribution", ("discrete",), refused=True)] = None
    """For "discrete": one for each value; left out: all alike."""
    source: str = Field(min_length=1)
    """Where the distribution comes from."""
    judgement: bool = False
    """Whether it is a judgement, not a measurement or a published range; the report says so."""


class UncertaintyTable(Table):
    """Which inputs are uncertain, and how they are sampled."""

    defaults: bool = True
    """Whether the default set for the case's rounds is sampled; an `input` of the same name or key replaces one."""
    samples: Annotated[int, Bounds(8, 1_000_000, "more samples than any machine runs")] = 1000
    """Number of samples: points of a Latin hypercube."""
    realisations: int = Field(default=12, ge=10, le=100_000)
    """Realisations of the break-up in each sample; their statistical error is taken out of the spread."""
    bursts: int | None = Field(default=None, ge=2, le=10_000)
    """Number of bursts that the samples share where the burst is in three dimensions; left out: twice the number of
    uncertain inputs of the burst, and two."""
    input: Annotated[list[UncertainInputTable], Entries(200, "more inputs than samples can distinguish")] = Field(
        default_factory=list
    )
    """Uncertain inputs."""


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
