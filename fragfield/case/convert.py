"""From a resolved case to what each stage is called with."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.case.flight_table import CylinderTable, PanelTable
from fragfield.case.geometry import burst_geometry
from fragfield.case.round_table import CasingTable, ExplosiveTable
from fragfield.case.surroundings import ground_height, surroundings

if TYPE_CHECKING:
    from burst_fenicsx.geometry import Profile
    from burst_fenicsx.problem import BurstSettings, CasingMaterial, Contact, Explosive, Geometry, RigidPlane, Round
    from flight import Contact as FragmentContact
    from flight import Wind
    from flight.hazard import Criteria
    from flight.shape import Shape
    from flight.targets import Witness
    from fragfield.case.burst_table import ContactTable
    from fragfield.case.flight_table import CollisionsTable, FlightTable, PolygonTable, WindTable
    from fragfield.case.plane_table import PlaneTable
    from fragfield.case.round_table import RoundTable
    from fragfield.case.schema import Case
    from transition import BreakUpSettings

__all__ = [
    "break_up_settings",
    "burst_round",
    "burst_rounds",
    "burst_settings",
    "flight_arguments",
    "hazard_criteria",
    "rigid_plane",
]


def burst_settings(case: Case, *, geometry: Geometry | None = None) -> BurstSettings:
    """Settings of the burst stage; the case must have a table [burst]. `geometry` overrides the case's choice."""
    from burst_fenicsx.problem import BurstSettings, Hourglass, Leakage, TimeStep, Viscosity

    table = case.burst
    assert table is not None  # checked when the case was loaded
    return BurstSettings(
        cell_size=table.cell_size,
        geometry=geometry or burst_geometry(case).geometry,
        section_station=table.section_station,
        symmetry=table.symmetry,
        quadrature=table.quadrature,
        products=table.products,
        burn=table.burn,
        end_time=table.end_time,
        acceleration_tolerance=table.acceleration_tolerance,
        acceleration_window=table.acceleration_window,
        time_limit=table.time_limit,
        output_interval=table.output.interval,
        energy_tolerance=table.energy_tolerance,
        damping=table.damping,
        time_step=TimeStep(**table.time_step.model_dump()),
        leakage=Leakage(**table.leakage.model_dump()),
        viscosity=Viscosity(**table.viscosity.model_dump()),
        hourglass=Hourglass(**table.hourglass.model_dump()),
        contact=_contact(table.contact),
        planes=tuple(rigid_plane(entry) for entry in case.plane),
    )


def rigid_plane(entry: PlaneTable) -> RigidPlane:
    """A resolved plane; one of symmetry has no friction."""
    from burst_fenicsx.problem import RigidPlane

    assert entry.point is not None  # resolved
    assert entry.normal is not None
    return RigidPlane(
        entry.name, entry.point, entry.normal, _degrees(entry.friction_angle or 0.0), entry.kind == "symmetry"
    )


def _contact(table: ContactTable) -> Contact:
    from burst_fenicsx.problem import Contact

    values: dict[str, Any] = table.model_dump()
    for key in ("friction_angle", "surface_friction_angle"):
        values[key] = _degrees(values[key])
    return Contact(**values)


def _degrees(angle: float) -> float:
    """An angle in degrees, free of what the way over radians adds in the last digits."""
    return round(math.degrees(angle), 10)


def break_up_settings(case: Case) -> BreakUpSettings:
    """Settings of the break-up; a single axisymmetric round is turned about its axis in each realisation."""
    from fragfield.case.symmetry import is_axisymmetric
    from transition import BreakUpSettings

    values = case.break_up.model_dump(exclude={"realisations"})
    if values["segments"] is not None:
        values["segments"] = tuple(values["segments"])
    return BreakUpSettings(**values, shape_factor=case.flight.shape_factor, random_turn=is_axisymmetric(case))


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


def _collisions(table: CollisionsTable | None) -> FragmentContact | None:
    from flight import Contact

    if table is None:
        return None
    values = table.model_dump(exclude={"friction_angle"})
    return Contact(**values, friction_angle_deg=_degrees(table.friction_angle))


def _shape(table: FlightTable) -> Shape | None:
    """The model of presented areas; None: the factors that the fragments bring."""
    from flight.shape import Box, Lognormal

    shape = table.shape
    if shape.model == "lognormal":
        return Lognormal(shape.spread or 0.0, table.shape_factor)
    if shape.model == "mean":
        return None
    length, width, height = shape.ratios
    return Box((length, width, height), shape.orientation, shape.density)


def hazard_criteria(case: Case) -> Criteria:
    """What counts as a hazard."""
    from flight.hazard import Criteria

    return Criteria(case.hazard.energy, case.hazard.density, case.hazard.person_area, case.hazard.person_height)


def hazard_directions(case: Case, *, elsewhere: bool = False) -> tuple[str, tuple[float, ...]]:
    """Basis of the hazard distance, and mirror planes of the arrangement (degrees); of fragments from elsewhere none.

    See `fragfield.case.directions`.
    """
    from fragfield.case.directions import hazard_basis, mirror_planes

    if elsewhere or not case.round:
        return "worst_direction", ()
    basis = hazard_basis(case)
    return basis, mirror_planes(case) if basis == "worst_direction" else ()


def kernel_degrees(case: Case) -> float:
    """Half-width of the azimuth kernel in degrees."""
    return _degrees(case.hazard.kernel)


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
