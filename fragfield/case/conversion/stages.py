"""From a resolved case to the rounds, planes, settings and arguments of each stage."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from fragfield.case.conversion.rounds import degrees_of, settings_in
from fragfield.case.conversion.surroundings import air_of, surroundings
from fragfield.case.conversion.symmetry import burst_geometry, is_axisymmetric
from fragfield.case.tables.base import values_of
from fragfield.case.tables.flight import CylinderTable, PanelTable

if TYPE_CHECKING:
    from burst_fenicsx.problem import (
        BurstSettings,
        Geometry,
    )
    from flight import Contact as FragmentContact
    from flight import Wind
    from flight.fluence import PolarGrid
    from flight.hazard.criteria import Criteria
    from flight.scene.targets import Witness
    from flight.shape import Shape
    from fragfield.case.schema import CaseTable
    from fragfield.case.tables.flight import CollisionsTable, FlightTable, PolygonTable, WindTable
    from transition import BreakUpSettings


def burst_settings(case: CaseTable, *, geometry: Geometry | None = None) -> BurstSettings:
    """Settings of the burst stage; the case must have a table [burst]. `geometry` overrides the case's choice."""
    return settings_in(case, geometry or burst_geometry(case).geometry)


def break_up_settings(case: CaseTable) -> BreakUpSettings:
    """Settings of the break-up; a single axisymmetric round is turned about its axis in each realisation."""
    from transition import BreakUpSettings

    values = case.break_up.model_dump(exclude={"realisations", "counts"})
    if case.break_up.mean_mass_is_file:
        from fragfield.case.conversion.mean_mass import counts_of

        assert case.break_up.counts is not None  # read when the case was resolved
        values["mean_mass"] = counts_of(case.break_up.counts)
    if values["segments"] is not None:
        values["segments"] = tuple(values["segments"])
    return BreakUpSettings(**values, shape_factor=case.flight.shape_factor, random_roll=is_axisymmetric(case))


def flight_arguments(case: CaseTable) -> dict[str, Any]:
    """Keyword arguments of `flight.fly`; raises flight's InputError for a drag table, a map or a surface at fault."""
    import flight

    table = case.flight
    adaptive = table.integrator.method == "adaptive"
    return {
        "air": air_of(case),
        "drag": flight.Drag.of(table.drag).scaled(table.drag_factor),
        "gravity": table.gravity,
        "wind": _wind(table.wind),
        **surroundings(case),
        "witnesses": [_surface(surface) for surface in case.witness],
        "integrator": flight.Adaptive(table.integrator.tolerance)
        if adaptive
        else flight.FixedStep(table.integrator.step),
        "contact": _collisions(table.collisions),
        "shape": _shape(table),
        "time_limit": table.time_limit,
        "origin": table.origin,
        "sample": table.trajectories,
        "seed": case.seed,
    }


def _collisions(table: CollisionsTable | Literal["none"]) -> FragmentContact | None:
    from flight import Contact

    if table == "none":
        return None
    values = table.model_dump(exclude={"friction_angle"})
    return Contact(**values, friction_angle_deg=degrees_of(table.friction_angle), between="rounds")


def _shape(table: FlightTable) -> Shape | None:
    """The model of presented areas; None: the factors that the fragments bring."""
    from flight.shape import Box, Lognormal

    shape = table.shape
    if shape.model == "lognormal":
        return Lognormal(shape.spread or 0.0, table.shape_factor)
    if shape.model == "mean":
        return None
    length, width, height = shape.ratios
    return Box((length, width, height), shape.density)


def hazard_criteria(case: CaseTable) -> Criteria:
    """What counts as a hazard."""
    from flight.hazard.criteria import Criteria

    return Criteria(**values_of(case.hazard, Criteria))


def hazard_directions(case: CaseTable, *, elsewhere: bool = False) -> tuple[str, tuple[float, ...]]:
    """Basis of the hazard distance, and mirror planes of the arrangement (degrees); none for given fragments.

    See `fragfield.case.conversion.symmetry`.
    """
    from fragfield.case.conversion.symmetry import hazard_basis, mirror_planes

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

    hazard = case.hazard
    return PolarGrid.of(hazard.sectors, kernel_degrees(case), hazard.distance_cell)


def _wind(table: WindTable) -> Wind | None:
    import flight

    if table.model == "profile":
        directions = [degrees_of(angle) for angle in table.directions or []]
        return flight.Wind.profile(table.heights or [], table.speeds or [], directions)
    if table.speed == 0.0:
        return None
    towards = degrees_of(table.towards)
    if table.model == "power_law":
        return flight.Wind.power_law(table.speed, towards, table.reference_height, table.exponent)
    return flight.Wind.constant(table.speed, towards)


def _surface(table: CylinderTable | PanelTable | PolygonTable) -> Witness:
    import flight

    values = table.model_dump(exclude={"kind"}, exclude_none=True)
    if isinstance(table, CylinderTable):
        return flight.Cylinder(**values)
    if isinstance(table, PanelTable):
        return flight.Panel(**values)
    return flight.Polygon(**values)
