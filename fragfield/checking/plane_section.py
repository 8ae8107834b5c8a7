"""`fragfield check` for a plane section: its mesh and its masses per metre."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from fragfield.report.tables.plane_section import CAUTION, WORDS
from transition.law.mean_mass import gurney_coefficient, gurney_speed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.meshing import MeshQuality
    from burst_fenicsx.plane_section.mesh import SectionMesh
    from burst_fenicsx.problem import BurstSettings, Round

__all__ = ["CAUTION", "WORDS", "described_section", "meshed_section", "section_stations"]


def section_stations(rounds: Sequence[Round], settings: BurstSettings) -> list[float]:
    """Station of each round in the section (m from its nose end); the case has been checked."""
    from burst_fenicsx.plane_section.section import find_section

    section, reason = find_section(rounds, settings)
    assert section is not None, reason
    return [float(station) for station in section.stations]


def meshed_section(item: Round, station: float, settings: BurstSettings) -> tuple[SectionMesh, MeshQuality]:
    """The quadrilaterals of a round's section, and their quality."""
    from burst_fenicsx.meshing.split import split_charges
    from burst_fenicsx.plane_section.mesh import mesh_section, section_quality

    assert item.profile is not None
    mesh = mesh_section(item.profile, station, settings.cell_size)
    found = section_quality(mesh)
    return (split_charges(mesh) if settings.contact.charge_casing == "bonded" else mesh), found


def described_section(entry: Round, station: float) -> dict[str, Any]:
    """What follows from a round's section; masses in kg per metre."""
    profile = entry.profile
    assert profile is not None
    radii = profile.section(station)
    inner, outer = float(radii.inner_radius), float(radii.outer_radius)
    casing = math.pi * (outer**2 - inner**2) * entry.casing.density
    charge = math.pi * inner**2 * entry.explosive.density
    constant = gurney_coefficient(entry.explosive.detonation_velocity)
    return {
        "name": entry.name,
        "profile": profile.name,
        "length": profile.length,
        "section_station": station,
        "outer_diameter": 2.0 * outer,
        "casing_mass_per_metre": casing,
        "charge_mass_per_metre": charge,
        "charge_length": profile.charge_end - profile.charge_front,
        "charge_ratio": charge / casing,
        "detonation_velocity": entry.explosive.detonation_velocity,
        "gurney_constant": constant,
        "gurney_speed": gurney_speed(entry.explosive.detonation_velocity, charge / casing),
        "segments": [],
        "mass_error_of_mesh": {},
    }
