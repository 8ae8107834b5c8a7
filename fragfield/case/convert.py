"""From a resolved case to what each stage is called with."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fragfield.case.round_table import CasingTable, ExplosiveTable

if TYPE_CHECKING:
    from burst_fenicsx.problem import BurstSettings, CasingMaterial, Explosive, Round
    from fragfield.case.round_table import RoundTable
    from fragfield.case.schema import Case

__all__ = ["burst_rounds", "burst_settings"]


def burst_settings(case: Case) -> BurstSettings:
    """Settings of the burst stage; the case must have a table [burst]."""
    from burst_fenicsx.problem import BurstSettings, Hourglass, Leakage, TimeStep, Viscosity

    table = case.burst
    assert table is not None  # checked when the case was loaded
    return BurstSettings(
        cell_size=table.cell_size,
        quadrature=table.quadrature,
        products=table.products,
        burn=table.burn,
        end_time=table.end_time,
        acceleration_tolerance=table.acceleration_tolerance,
        acceleration_window=table.acceleration_window,
        time_limit=table.time_limit,
        output_interval=table.output.interval,
        energy_tolerance=table.energy_tolerance,
        time_step=TimeStep(**table.time_step.model_dump()),
        leakage=Leakage(**table.leakage.model_dump()),
        viscosity=Viscosity(**table.viscosity.model_dump()),
        hourglass=Hourglass(**table.hourglass.model_dump()),
    )


def burst_rounds(case: Case) -> list[Round]:
    """Rounds of the burst stage, in the order of the file."""
    return [_round(entry, f"round[{number}]") for number, entry in enumerate(case.round, start=1)]


def _round(entry: RoundTable, key: str) -> Round:
    from burst_fenicsx.geometry import profile_from_table
    from burst_fenicsx.problem import IgnitionPoint, Round

    assert isinstance(entry.explosive, ExplosiveTable)  # resolved
    assert isinstance(entry.casing, CasingTable)
    profile = profile_from_table(entry.profile, where=f"{key}.profile") if isinstance(entry.profile, dict) else None
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
    )


def _explosive(table: ExplosiveTable) -> Explosive:
    from burst_fenicsx.problem import Explosive, JonesWilkinsLee

    values = table.model_dump(exclude={"jwl"})
    return Explosive(**values, jwl=JonesWilkinsLee(**table.jwl.model_dump()) if table.jwl else None)


def _casing(table: CasingTable) -> CasingMaterial:
    from burst_fenicsx.problem import CasingMaterial

    values = table.model_dump()
    for key in ("shear_softening_strain", "tensile_softening_strain"):
        values[key] = None if values[key] == "none" else values[key]
    return CasingMaterial(**values)
