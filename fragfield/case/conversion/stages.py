"""From a resolved case to the rounds, planes, settings and arguments of each stage."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from fragfield.case.conversion.stack import expanded
from fragfield.case.conversion.surroundings import ground_height, surroundings
from fragfield.case.tables.base import values_of
from fragfield.case.tables.flight import CylinderTable, PanelTable
from fragfield.case.tables.round import CasingTable, ExplosiveTable

if TYPE_CHECKING:
    from burst_fenicsx.geometry import Profile
    from burst_fenicsx.problem import (
        BurstSettings,
        CasingMaterial,
        ContactSettings,
        Explosive,
        Geometry,
        Mirror,
        RigidPlane,
        Round,
    )
    from flight import Contact as FragmentContact
    from flight import Wind
    from flight.fluence import PolarGrid
    from flight.hazard.criteria import Criteria
    from flight.scene.targets import Witness
    from flight.shape import Shape
    from fragfield.case.schema import Case
    from fragfield.case.tables.burst import ContactTable
    from fragfield.case.tables.flight import CollisionsTable, FlightTable, PolygonTable, WindTable
    from fragfield.case.tables.round import RoundTable
    from fragfield.case.tables.stack import PlaneTable
    from transition import BreakUpSettings

__all__ = [
    "GeometryChoice",
    "all_azimuths_alike",
    "break_up_settings",
    "burst_geometry",
    "burst_round",
    "burst_rounds",
    "burst_settings",
    "check_geometry",
    "degrees_of",
    "flight_arguments",
    "hazard_criteria",
    "hazard_directions",
    "hazard_grid",
    "is_axisymmetric",
    "kernel_degrees",
    "rigid_plane",
    "settings_in",
]


def burst_settings(case: Case, *, geometry: Geometry | None = None) -> BurstSettings:
    """Settings of the burst stage; the case must have a table [burst]. `geometry` overrides the case's choice."""
    return settings_in(case, geometry or burst_geometry(case).geometry)


def break_up_settings(case: Case) -> BreakUpSettings:
    """Settings of the break-up; a single axisymmetric round is turned about its axis in each realisation."""
    from transition import BreakUpSettings

    values = case.break_up.model_dump(exclude={"realisations", "counts"})
    if case.break_up.mean_mass_is_file:
        from fragfield.case.conversion.fragment_counts import counts_of

        assert case.break_up.counts is not None  # read when the case was resolved
        values["mean_mass"] = counts_of(case.break_up.counts)
    if values["segments"] is not None:
        values["segments"] = tuple(values["segments"])
    return BreakUpSettings(**values, shape_factor=case.flight.shape_factor, random_roll=is_axisymmetric(case))


def flight_arguments(case: Case) -> dict[str, Any]:
    """Keyword arguments of `flight.fly`; raises flight's InputError for a drag table, a map or a surface at fault."""
    import flight

    table = case.flight
    air = (
        flight.ConstantAir(table.air.density or 0.0, table.air.sound_speed)
        if table.air.model == "constant"
        else flight.StandardAtmosphere(table.air.altitude)
    )
    adaptive = table.integrator.method == "adaptive"
    return {
        "air": air,
        "drag": flight.Drag.of(table.drag).scaled(table.drag_factor),
        "gravity": table.gravity,
        "wind": _wind(table.wind, ground_height(case, *table.origin)),
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


def hazard_criteria(case: Case) -> Criteria:
    """What counts as a hazard."""
    from flight.hazard.criteria import Criteria

    return Criteria(case.hazard.energy, case.hazard.density, case.hazard.person_area, case.hazard.person_height)


def hazard_directions(case: Case, *, elsewhere: bool = False) -> tuple[str, tuple[float, ...]]:
    """Basis of the hazard distance, and mirror planes of the arrangement (degrees); none for given fragments.

    See `fragfield.case.conversion.directions`.
    """
    from fragfield.case.conversion.directions import hazard_basis, mirror_planes

    if elsewhere or not case.round:
        return "worst_direction", ()
    basis = hazard_basis(case)
    return basis, mirror_planes(case) if basis == "worst_direction" else ()


def kernel_degrees(case: Case) -> float:
    """Half-width of the azimuth kernel in degrees."""
    return degrees_of(case.hazard.kernel)


def hazard_grid(case: Case) -> PolarGrid:
    """Cells of the hazard distance."""
    from flight.fluence import PolarGrid

    hazard = case.hazard
    return PolarGrid.of(hazard.sectors, kernel_degrees(case), hazard.distance_cell)


def _wind(table: WindTable, ground: float) -> Wind | None:
    import flight

    if table.model == "profile":
        directions = [math.degrees(angle) for angle in table.directions or []]
        return flight.Wind.profile(table.heights or [], table.speeds or [], directions)
    if table.speed == 0.0:
        return None
    towards = math.degrees(table.towards)
    if table.model == "power_law":
        return flight.Wind.power_law(table.speed, towards, table.reference_height, table.exponent, ground)
    return flight.Wind.constant(table.speed, towards)


def _surface(table: CylinderTable | PanelTable | PolygonTable) -> Witness:
    import flight

    values = table.model_dump(exclude={"kind"}, exclude_none=True)
    if isinstance(table, CylinderTable):
        return flight.Cylinder(**values)
    if isinstance(table, PanelTable):
        return flight.Panel(**values)
    return flight.Polygon(**values)


def settings_in(case: Case, geometry: Geometry) -> BurstSettings:
    """Settings of the burst stage in a geometry, whatever the case asks for; the case must have a table [burst]."""
    from burst_fenicsx.problem import BurstSettings, Hourglass, Leakage, TimeStep, Viscosity

    table = case.burst
    assert table is not None  # checked when the case was loaded
    values = values_of(table, BurstSettings) | {"geometry": geometry}
    return BurstSettings(
        **values,
        output_interval=table.output.interval,
        nodal_stress=table.output.nodal_stress,
        time_step=TimeStep(**values_of(table.time_step, TimeStep)),
        leakage=Leakage(**values_of(table.leakage, Leakage)),
        viscosity=Viscosity(**values_of(table.viscosity, Viscosity)),
        hourglass=Hourglass(**values_of(table.hourglass, Hourglass)),
        contact=_contact(table.contact),
        planes=tuple(rigid_plane(entry) for entry in case.plane),
    )


def rigid_plane(entry: PlaneTable) -> RigidPlane | Mirror:
    """A resolved plane."""
    from burst_fenicsx.problem import Mirror, RigidPlane

    assert entry.point is not None  # resolved
    assert entry.normal is not None
    if entry.kind == "symmetry":
        return Mirror(entry.name, entry.point, entry.normal)
    return RigidPlane(entry.name, entry.point, entry.normal, degrees_of(entry.friction_angle or 0.0))


def _contact(table: ContactTable) -> ContactSettings:
    from burst_fenicsx.problem import ContactSettings

    values: dict[str, Any] = table.model_dump()
    for key in ("friction_angle", "surface_friction_angle"):
        values[key] = degrees_of(values[key])
    return ContactSettings(**values)


def degrees_of(angle: float) -> float:
    """An angle in degrees, free of what the way over radians adds in the last digits."""
    return round(math.degrees(angle), 10)


def burst_rounds(case: Case) -> list[Round]:
    """Rounds of the burst stage, in the order of the file."""
    made: dict[str, Profile] = {}
    return [burst_round(entry, f"round[{number}]", made) for number, entry in enumerate(case.round, start=1)]


def burst_round(entry: RoundTable, key: str, made: dict[str, Profile] | None = None) -> Round:
    """One resolved round; `key` names it in messages, profiles already `made` are taken from there."""
    from burst_fenicsx.geometry import profile_from_table
    from burst_fenicsx.problem import IgnitionPoint, Round, ShockInitiation

    assert isinstance(entry.explosive, ExplosiveTable)  # resolved
    assert isinstance(entry.casing, CasingTable)
    profile = None
    if isinstance(entry.profile, dict):
        made, text = ({} if made is None else made), repr(entry.profile)
        profile = made.get(text) or profile_from_table(entry.profile, where=f"{key}.profile")
        made[text] = profile
    return Round(
        name=entry.name,
        explosive=_explosive(entry.explosive),
        casing=_casing(entry.casing),
        profile=profile,
        mesh_file=Path(entry.mesh) if entry.mesh is not None else None,
        position=entry.position,
        axis=entry.axis,
        ignition=tuple(
            IgnitionPoint(float(point.station), point.offset, point.delay) for point in entry.ignition or []
        ),
        initiation=ShockInitiation(
            math.inf if entry.initiation.pressure is None else entry.initiation.pressure,
            entry.initiation.duration,
            entry.initiation.floor,
        )
        if entry.initiation
        else None,
    )


def _explosive(table: ExplosiveTable) -> Explosive:
    from burst_fenicsx.problem import Explosive, JonesWilkinsLee

    values = table.model_dump(exclude={"jwl"})
    return Explosive(**values, jwl=JonesWilkinsLee(**table.jwl.model_dump()) if table.jwl else None)


def _casing(table: CasingTable) -> CasingMaterial:
    from burst_fenicsx.problem import CasingMaterial

    values = table.model_dump()
    for key in ("shear_softening_strain", "tensile_softening_strain", "softening_length"):
        values[key] = None if values[key] == "none" else values[key]
    return CasingMaterial(**values)


_NAMES = {
    "axisymmetric": "axisymmetric (the meridian of the round)",
    "3d": "three dimensions",
}


@dataclass(frozen=True)
class GeometryChoice:
    """What was chosen, and the reason in words."""

    geometry: Literal["axisymmetric", "3d"]
    reason: str

    @property
    def words(self) -> str:
        """For log, `check` and report."""
        return f"{_NAMES[self.geometry]}: {self.reason}"


def burst_geometry(case: Case) -> GeometryChoice:
    """Choose the geometry of a resolved case with a burst.

    An `auto` that can be axisymmetric is: one round of revolution, initiated on its axis, with no plane within reach.
    """
    assert case.burst is not None
    wanted = case.burst.geometry
    if wanted == "3d":
        return GeometryChoice("3d", 'asked for by burst.geometry = "3d"')
    reason = _obstacle(case)
    if reason is not None:
        return GeometryChoice("3d", reason)
    return GeometryChoice("axisymmetric", "one round of revolution, initiated on its axis, out of reach of any plane")


def check_geometry(case: Case) -> list[str]:
    """Faults of a resolved case that asks for an axisymmetric burst and cannot have it."""
    if case.burst is None or case.burst.geometry != "axisymmetric":
        return []
    reason = _obstacle(case)
    if reason is None:
        return []
    return [f'burst.geometry: found "axisymmetric", but {reason}; allowed here: "3d", or "auto", which chooses it']


def _obstacle(case: Case) -> str | None:
    """Why the burst cannot be axisymmetric; None where it can."""
    from burst_fenicsx.axisymmetric.applicability import why_not_axisymmetric

    return why_not_axisymmetric(burst_rounds(case), settings_in(case, "3d"))


_PARALLEL = 1e-9  # 1 - |cosine| below which two directions are one


def is_axisymmetric(case: Case) -> bool:
    """Whether a resolved case is a single round of revolution, initiated on its axis, with nothing beside it.

    A plane across the axis (the ground below an upright round) keeps the symmetry; any other plane breaks it.
    """
    rounds = expanded(case)
    if len(rounds) != 1:
        return False
    (only,) = rounds
    if only.profile is None or only.initiation is not None:
        return False
    if any(point.offset != (0.0, 0.0) for point in only.ignition or ()):
        return False
    return all(plane.normal is not None and _parallel(plane.normal, only.axis) for plane in case.plane)


def all_azimuths_alike(case: Case) -> bool:
    """Whether every azimuth has the same expected hazard as far as the rounds go: one upright axisymmetric round."""
    return is_axisymmetric(case) and upright(expanded(case)[0])


def upright(item: RoundTable) -> bool:
    """Whether the round's axis is vertical."""
    return _parallel(item.axis, (0.0, 0.0, 1.0))


def _parallel(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    cosine = sum(a * b for a, b in zip(one, other, strict=True)) / (math.hypot(*one) * math.hypot(*other))
    return 1.0 - abs(cosine) < _PARALLEL
