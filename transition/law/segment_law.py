"""The law by which a segment breaks: mean mass, mu and number from its geometry, speed and settings.

End pieces (nose and base, before and behind the charge) are few and large. The v0/a of Eq. 21 is a rate of hoop
strain, and an end piece is thrown along the axis too: its v0 is the outward speed of its expansion, not its speed of
flight. A base is a plate, which the charge stretches in both directions (by the end of the burst to 1.7 to 1.9 times in
the M107 and the M48, median by mass): at rupture its radius has grown by the critical strain and its thickness shrunk
by the square of that. Half of a nose stretches little before it parts from the wall: its radius and wall are those
before the burst, the thickness being at most its length. And there is never less than one piece: the mean mass is at
most the segment's mass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from transition.errors import InputError
from transition.law import mean_mass, mean_mass_data
from transition.law.count_fit import SegmentMasses, fit_counts
from transition.law.fragment_counts import FragmentCounts
from transition.law.mott import MottLaw

if TYPE_CHECKING:
    from collections.abc import Sequence

    from transition.law.count_fit import CountFit
    from transition.law.segments import CasingSegment
    from transition.settings import BreakUpSettings
    from transition.snapshot import RoundData


_ALIKE = 0.02  # of a segment's mass, by which the meshes of rounds that are alike may differ


@dataclass(frozen=True)
class SegmentLaw:
    """How a segment breaks. SI units."""

    law: MottLaw
    """With the mean mass of the segment."""
    mass: float
    """Of the segment's cells (kg)."""
    n0: float
    """Expected number of fragments M/mean (Eq. 20)."""
    v0: float
    """Speed used in the law (m/s); of an end piece that of its expansion."""
    radius: float
    """Outer radius at rupture (m)."""


def segment_laws(
    segments: Sequence[CasingSegment], masses: Sequence[float], rounds: Sequence[RoundData], settings: BreakUpSettings
) -> tuple[tuple[SegmentLaw, ...], CountFit | None]:
    """Laws of all segments, and the fit of their mean masses to the pieces of a test, where the settings hold them.

    `segments`, `masses`: segments of all rounds, and their masses (kg); `rounds`: the rounds; `settings`: choices of
    the break-up. Raises InputError: as `segment_law` and `fit_counts`; a test's pieces with rounds that are not alike.
    """
    pairs = list(zip(segments, masses, strict=True))
    if not isinstance(settings.mean_mass, FragmentCounts):
        return tuple(segment_law(s, mass, rounds[s.round], settings) for s, mass in pairs), None
    by_round: dict[int, list[float]] = {}
    for segment, mass in pairs:
        by_round.setdefault(segment.round, []).append(mass)
    first, *others = by_round.values()
    for other in others:
        if len(other) != len(first) or any(abs(b - a) > _ALIKE * a for a, b in zip(first, other, strict=True)):
            raise InputError(
                f"break_up.mean_mass: {settings.mean_mass.source} holds the fragments of one kind of round, and the "
                "rounds here are of several; give a law or a mass"
            )
    relative = tuple(_at_scale_one(s, mass, rounds[s.round], settings) for s, mass in pairs)
    known = SegmentMasses(relative, tuple(masses), len(by_round))
    fit = fit_counts(settings.mean_mass, settings.dimension, settings.mixed_fraction, known)
    scale = fit.scale * settings.mean_mass.scale
    return tuple(segment_law(s, mass, rounds[s.round], settings, scale) for s, mass in pairs), fit


def _at_scale_one(segment: CasingSegment, mass: float, data: RoundData, settings: BreakUpSettings) -> float:
    """Mean mass (kg) by the law, not limited by the segment's mass."""
    return _mean_mass(segment, data, settings, *_state(segment, mass, data, settings))


def segment_law(
    segment: CasingSegment, mass: float, data: RoundData, settings: BreakUpSettings, scale: float = 1.0
) -> SegmentLaw:
    """Law of a segment of `mass` (kg); `scale` is a factor on its mean mass.

    Raises InputError: the burst's speed, radius or wall of the segment cannot be used.
    """
    speed, radius, wall = _state(segment, mass, data, settings)
    mean = min(scale * _mean_mass(segment, data, settings, speed, radius, wall), mass)
    law = MottLaw.from_mean(mean, settings.dimension, settings.mixed_fraction)
    return SegmentLaw(law, mass, mass / mean, speed, radius)


def _state(
    segment: CasingSegment, mass: float, data: RoundData, settings: BreakUpSettings
) -> tuple[float, float, float]:
    """Speed (m/s), and outer radius and wall at rupture (m)."""
    where = f"round {data.name!r}, segment {segment.data.name!r}"
    return _speed(segment, mass, data, settings, where), *_at_rupture(segment, settings, where)


def outside_of(rounds: Sequence[RoundData], settings: BreakUpSettings) -> dict[str, list[str]]:
    """By a round's name: in which respects no published data on mean masses are near it; none for a known mean."""
    if not isinstance(settings.mean_mass, str):
        return {}
    found = {}
    for data in rounds:
        casing, charge = (sum(getattr(s, name) for s in data.segments) for name in ("casing_mass", "charge_mass"))
        diameter = 2.0 * max(segment.outer_radius for segment in data.segments)
        metal, filling = (data.casing_density, data.casing_yield), (data.explosive, data.explosive_density)
        found[data.name] = list(mean_mass_data.outside_data(diameter, charge / casing, metal, filling))
    return found


def _speed(segment: CasingSegment, mass: float, data: RoundData, settings: BreakUpSettings, where: str) -> float:
    if settings.velocity_source == "gurney":
        return mean_mass.gurney_speed(data.detonation_velocity, segment.data.charge_mass / mass)
    if segment.is_end:
        return segment.expansion
    if not (math.isfinite(segment.data.speed) and segment.data.speed >= 0.0):
        raise InputError(f"{where}: the burst stage gives the speed {segment.data.speed}; a finite speed is needed")
    return segment.data.speed


def _at_rupture(segment: CasingSegment, settings: BreakUpSettings, where: str) -> tuple[float, float]:
    data = segment.data
    for name, value in (("outer_radius", data.outer_radius), ("wall_thickness", data.wall_thickness)):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"{where}: {name} is {value:g} m; above zero is needed")
    if segment.is_end:
        thickness = min(data.wall_thickness, data.end - data.start)
        if data.kind == "base":
            stretch = 1.0 + settings.critical_strain
            return stretch * data.outer_radius, thickness / stretch**2
        return data.outer_radius, thickness
    return mean_mass.ruptured(data.outer_radius, data.wall_thickness, settings.critical_strain)


def _mean_mass(
    segment: CasingSegment, data: RoundData, settings: BreakUpSettings, speed: float, radius: float, wall: float
) -> float:
    rate = speed / radius  # of hoop strain
    if settings.mean_mass == "mott" or isinstance(settings.mean_mass, FragmentCounts):
        return mean_mass.mott_linfoot(
            settings.prefactor, data.casing_density, radius, settings.fracture_energy, wall, rate * radius
        )
    if settings.mean_mass == "mott_1947":
        return mean_mass.mott_1947(data.casing_density, settings.fracture_stress, settings.fracture_gamma, wall, rate)
    if settings.mean_mass == "gurney_sarmousakis":
        constant = mean_mass.explosive_constant(data.explosive, settings.explosive_constant)
        before = segment.data
        return mean_mass.gurney_sarmousakis(
            constant, before.wall_thickness, 2.0 * (before.outer_radius - before.wall_thickness)
        )
    return float(settings.mean_mass)
