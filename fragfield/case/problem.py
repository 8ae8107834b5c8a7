"""The problem that a case states: the stages' own objects, built from its tables."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import flight
from burst_fenicsx.axisymmetric.applicability import why_not_axisymmetric
from burst_fenicsx.problem import BurstSettings, Geometry, Mirror, RigidPlane
from flight.fluence import PolarGrid
from flight.hazard.criteria import Criteria
from flight.hazard.density.directions import Directions
from flight.shape import Box, Lognormal, Shape
from fragfield.case.conversion.rounds import burst_rounds
from fragfield.case.conversion.surroundings import surroundings
from fragfield.case.conversion.turned import hazard_basis, is_axisymmetric, mirror_planes
from fragfield.case.faults import Fault
from fragfield.case.schema import CaseTable
from fragfield.case.tables.base import degrees_of
from fragfield.case.tables.flight import FlightTable
from fragfield.case.tables.round import PlaneTable
from transition import BreakUpSettings


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

    See `fragfield.case.conversion.turned`.
    """
    if elsewhere or not case.round:
        return "worst_direction", ()
    basis = hazard_basis(case)
    return basis, mirror_planes(case) if basis == "worst_direction" else ()


def density_directions(case: CaseTable, basis: str, mirrors: tuple[float, ...] = ()) -> Directions:
    """Directions of densities on a basis, folded at the mirror planes (degrees) that map cells on cells."""
    grid = hazard_grid(case)
    used = tuple(one for one in mirrors if grid.maps(one)) if basis == "worst_direction" else ()
    return Directions(grid, basis, kernel_degrees(case), used)


def kernel_degrees(case: CaseTable) -> float:
    """Half-width of the azimuth kernel in degrees."""
    return degrees_of(case.hazard.kernel)


def hazard_grid(case: CaseTable) -> PolarGrid:
    """Cells of the hazard distance."""
    return PolarGrid.of(case.hazard.sectors, kernel_degrees(case), case.hazard.distance_cell)
