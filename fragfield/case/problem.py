"""The problem that a case states: the stages' own objects, built from its tables, and what a stage refuses of them.

What a stage refuses when it is built is asked when the case is loaded, and has the case's key.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import flight
from burst_fenicsx.problem import Mirror, RigidPlane
from flight.hazard.tp12 import effective_number
from flight.shape import Box, Lognormal
from fragfield.case.checks.estimates import check_numbers, map_faults
from fragfield.case.conversion.exposed_sites import exposed_sites_of
from fragfield.case.conversion.rounds import burst_rounds, first_alike, masses_of, profile_of
from fragfield.case.conversion.surroundings import check_surroundings, surroundings
from fragfield.case.conversion.symmetry import hazard_basis, is_axisymmetric, mirror_planes
from fragfield.case.faults import Fault
from fragfield.case.tables.base import degrees_of
from fragfield_base.errors import InputError, show

if TYPE_CHECKING:
    from collections.abc import Iterator

    from burst_fenicsx.problem import BurstSettings, Geometry
    from flight.fluence import PolarGrid
    from flight.hazard.criteria import Criteria
    from flight.shape import Shape
    from fragfield.case.schema import CaseTable
    from fragfield.case.tables.flight import FlightTable
    from fragfield.case.tables.round import PlaneTable, RoundTable
    from transition import BreakUpSettings


_MOST_CELLS = 20_000_000  # of the hazard distance: 160 MB a field, of which a batch of realisations keeps several


@dataclass(frozen=True)
class GeometryChoice:
    """Geometry of a burst, and the reason in words."""

    geometry: Literal["axisymmetric", "3d"]
    reason: str

    @property
    def words(self) -> str:
        """For log, `check` and report."""
        names = {"axisymmetric": "axisymmetric (the meridian of the round)", "3d": "three dimensions"}
        return f"{names[self.geometry]}: {self.reason}"


def burst_geometry(case: CaseTable) -> GeometryChoice:
    """Choose the geometry of a resolved case with a burst.

    An `auto` that can be axisymmetric is: one round of revolution, initiated on its axis, with no plane within reach.
    """
    assert case.burst is not None
    if case.burst.geometry == "3d":
        return GeometryChoice("3d", 'asked for by burst.geometry = "3d"')
    if (reason := _not_axisymmetric(case)) is not None:
        return GeometryChoice("3d", reason)
    return GeometryChoice("axisymmetric", "one round of revolution, initiated on its axis, out of reach of any plane")


def is_brief(case: CaseTable) -> bool:
    """Whether a run takes seconds, and has nothing to go on from: its burst is axisymmetric."""
    return case.burst is not None and bool(case.round) and burst_geometry(case).geometry == "axisymmetric"


def check_geometry(case: CaseTable) -> Iterator[Fault]:
    """Faults of a resolved case that asks for an axisymmetric burst and cannot have it."""
    if case.burst is not None and case.burst.geometry == "axisymmetric" and (reason := _not_axisymmetric(case)):
        yield Fault(
            "burst.geometry", f'found "axisymmetric", but {reason}; allowed here: "3d", or "auto", which chooses it'
        )


def _not_axisymmetric(case: CaseTable) -> str | None:
    from burst_fenicsx.axisymmetric.applicability import why_not_axisymmetric

    return why_not_axisymmetric(burst_rounds(case), burst_settings(case, geometry="3d"))


def burst_settings(case: CaseTable, *, geometry: Geometry | None = None) -> BurstSettings:
    """Settings of the burst stage; the case must have a table [burst]. `geometry` overrides the case's choice."""
    table = case.burst
    assert table is not None  # checked when the case was loaded
    made: BurstSettings = table.made(
        geometry=geometry or burst_geometry(case).geometry,
        output_interval=table.output.interval,
        nodal_stress=table.output.nodal_stress,
        planes=tuple(rigid_plane(entry) for entry in case.plane),
    )
    return made


def rigid_plane(entry: PlaneTable) -> RigidPlane | Mirror:
    """A resolved plane."""
    assert entry.point is not None  # resolved
    assert entry.normal is not None
    if entry.kind == "symmetry":
        return Mirror(entry.name, entry.point, entry.normal)
    return RigidPlane(entry.name, entry.point, entry.normal, degrees_of(entry.friction_angle or 0.0))


def break_up_settings(case: CaseTable) -> BreakUpSettings:
    """Settings of the break-up; a single axisymmetric round is turned about its axis in each realisation."""
    table = case.break_up
    counted: dict[str, Any] = {}
    if table.mean_mass_is_file:
        assert table.counts is not None  # read when the case was resolved
        counted = {"mean_mass": table.counts.made()}
    made: BreakUpSettings = table.made(
        shape_factor=case.flight.shape_factor, random_roll=is_axisymmetric(case), **counted
    )
    return made


def flight_arguments(case: CaseTable) -> dict[str, Any]:
    """Keyword arguments of `flight.fly`; raises flight's InputError for a drag table, a map or a surface at fault."""
    table = case.flight
    return {
        "air": table.air.air(),
        "drag": flight.Drag.of(table.drag).scaled(table.drag_factor),
        "gravity": table.gravity,
        "wind": table.wind.wind(),
        **surroundings(case),
        "witnesses": [surface.made() for surface in case.witness],
        "integrator": table.integrator.integrator(),
        "contact": None if table.collisions == "none" else table.collisions.made(between="rounds"),
        "shape": _shape(table),
        "time_limit": table.time_limit,
        "origin": table.origin,
        "sample": table.trajectories,
        "seed": case.seed,
    }


def _shape(table: FlightTable) -> Shape | None:
    shape = table.shape
    if shape.model == "lognormal":
        return Lognormal(shape.spread or 0.0, table.shape_factor)
    if shape.model == "mean":
        return None
    length, width, height = shape.ratios
    return Box((length, width, height), shape.density)


def hazard_criteria(case: CaseTable) -> Criteria:
    """What counts as a hazard."""
    made: Criteria = case.hazard.made()
    return made


def hazard_directions(case: CaseTable, *, elsewhere: bool = False) -> tuple[str, tuple[float, ...]]:
    """Basis of the hazard distance, and mirror planes of the arrangement (degrees); none for given fragments.

    See `fragfield.case.conversion.symmetry`.
    """
    if elsewhere or not case.round:
        return "worst_direction", ()
    basis = hazard_basis(case)
    return basis, mirror_planes(case) if basis == "worst_direction" else ()


def kernel_degrees(case: CaseTable) -> float:
    """Half-width of the azimuth kernel in degrees."""
    return degrees_of(case.hazard.kernel)


def hazard_grid(case: CaseTable) -> PolarGrid:
    """Cells of the hazard distance."""
    from flight.fluence import PolarGrid

    return PolarGrid.of(case.hazard.sectors, kernel_degrees(case), case.hazard.distance_cell)


# --- what the stages refuse ---------------------------------------------------------------------------------------


def stage_faults(case: CaseTable) -> Iterator[Fault]:
    """Faults of a resolved case that its stages would find."""
    yield from _cells(case)
    try:
        yield from _of_break_up(case, break_up_settings(case))
    except InputError as error:
        yield _rekeyed(case, error, "")
    yield from list(_of_flight(case)) or map_faults(case)
    try:
        yield from _of_hazard(case)
    except InputError as error:
        yield _rekeyed(case, error, "hazard.")


def _of_flight(case: CaseTable) -> Iterator[Fault]:
    try:
        flight.Drag.of(case.flight.drag)
    except InputError as error:  # of a file: without the key
        yield Fault("flight.drag", str(error).removeprefix("drag: "))
        return
    try:
        flight_arguments(case)
        check_surroundings(case)
        exposed_sites_of(case)
    except InputError as error:
        yield _rekeyed(case, error, "flight.")


def _rekeyed(case: CaseTable, error: InputError, table: str) -> Fault:
    """A stage's refusal with the case's key: a stage begins with what is at fault, and its name if it has one."""
    text = str(error)
    for key in ("witness", "obstacle", "exposed"):
        for number, entry in enumerate(getattr(case, key), start=1):
            for name in (entry.name, show(entry.name)):
                if text.startswith(head := f"{key} {name}: "):
                    return Fault(f"{key}[{number}]", f"{show(entry.name)}: {text.removeprefix(head)}")
    key, _, words = text.partition(": ")
    return Fault(table + {"contact": "collisions"}.get(key, key), words)


def _cells(case: CaseTable) -> Iterator[Fault]:
    from burst_fenicsx.axisymmetric.mesh import check_meridian_size
    from burst_fenicsx.meshing.sizing import check_mesh_size

    if case.burst is None:
        return
    check = check_mesh_size if burst_geometry(case).geometry == "3d" else check_meridian_size
    for entry in case.round:
        try:
            if entry.mesh is None:
                check(profile_of(entry), case.burst.cell_size)
        except InputError as error:
            yield Fault("burst.cell_size", str(error).replace("cell_size = ", "found ", 1))
            return


def _of_break_up(case: CaseTable, settings: BreakUpSettings) -> Iterator[Fault]:
    for number, (entry, first) in enumerate(zip(case.round, first_alike(case), strict=True)):
        faults = list(_of_round(f"round[{number + 1}]", entry, settings)) if first == number else []
        yield from faults
        if faults:
            return  # the laws below would meet the same
    yield from check_numbers(case, settings)


def _of_round(key: str, entry: RoundTable, settings: BreakUpSettings) -> Iterator[Fault]:
    from transition.law.mean_mass import explosive_constant

    if settings.mean_mass == "gurney_sarmousakis":
        explosive_constant(entry.material("explosive").name, settings.explosive_constant)
    masses, stations = masses_of(entry), settings.segments
    if isinstance(stations, tuple) and stations and isinstance(entry.profile, dict):
        length = profile_of(entry).length
        if stations[-1] >= length:
            yield Fault(
                "break_up.segments",
                f"found the station {1e3 * stations[-1]:.6g} mm, beyond {key}; allowed: below its length, "
                f"{1e3 * length:.6g} mm",
            )
    segments = masses.segments if stations is None else ()
    heaviest = max((one.casing for one in segments), default=masses.casing)
    whose = f"the heaviest segment of {key}" if segments else f"the casing of {key}"
    if isinstance(settings.mean_mass, float) and settings.mean_mass > heaviest:
        yield Fault(
            "break_up.mean_mass",
            f"found {settings.mean_mass:g} kg, above the mass of {whose}, {heaviest:.4g} kg; allowed: "
            "at most that (is it the mean mass of a fragment, in the unit that is meant?)",
        )


def _of_hazard(case: CaseTable) -> Iterator[Fault]:
    from flight.hazard.density.directions import Directions

    table = case.hazard
    hazard_criteria(case)
    grid = hazard_grid(case)
    cells = grid.sectors * grid.cuts * grid.cells
    if cells > _MOST_CELLS:
        yield Fault(
            "hazard.distance_cell",
            f"found {table.distance_cell:g} m with {table.sectors} sectors and a kernel of {kernel_degrees(case):.3g} "
            f"deg, which make {cells:.3g} cells of density; allowed: at most {_MOST_CELLS:.0e}: wider cells, fewer "
            "sectors or a wider kernel",
        )
        return
    if case.round:
        basis, mirrors = hazard_directions(case)
        Directions(grid, basis, kernel_degrees(case), tuple(one for one in mirrors if grid.maps(one)))
    rule = table.stack_rule
    if rule.side is not None and rule.top is not None:
        try:
            effective_number(rule.side, rule.top, rule.cover)
        except InputError as error:
            words = str(error).removeprefix("stack rule: ")
            yield Fault("hazard.stack_rule", f"{words}; allowed: one round or more")
