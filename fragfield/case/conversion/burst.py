"""From a resolved case to the rounds, planes and settings of the burst stage."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.case.tables.base import values_of
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
    from fragfield.case.schema import CaseTable
    from fragfield.case.tables.burst import ContactTable
    from fragfield.case.tables.round import PlaneTable, RoundTable


def burst_rounds(case: CaseTable) -> list[Round]:
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
        mesh_unit=entry.mesh_unit or "m",
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


def settings_in(case: CaseTable, geometry: Geometry) -> BurstSettings:
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
