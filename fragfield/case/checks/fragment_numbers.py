"""How many fragments a case would make, estimated before its burst: a law that makes dust, or none, is refused here.

The laws are those of the break-up, with the speed of Gurney's formula (Eqs. 23-24) for that of the burst, which differs
from it by 30 % at most where a casing is closed: mean masses then by a factor below 2. An estimated mean mass is a
fault only where one `_MARGIN` times larger or smaller would be, too; what does not depend on the speed is exact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fragfield.case.conversion.burst import burst_round
from fragfield.case.conversion.placing import first_alike

if TYPE_CHECKING:
    from collections.abc import Iterator

    from burst_fenicsx.problem import Round
    from fragfield.case.schema import CaseTable
    from transition import BreakUpSettings

__all__ = ["SegmentMean", "check_numbers", "expected_means"]

_MARGIN = 4.0


@dataclass(frozen=True)
class SegmentMean:
    """Casing mass, mean fragment mass (kg) and Gurney speed (m/s) of a segment; `exact`: whatever the burst gives."""

    name: str
    mass: float
    mean: float
    exact: bool
    speed: float


def expected_means(item: Round, settings: BreakUpSettings) -> list[SegmentMean]:
    """Mean masses of the walls of a round with a profile, by the law of the settings; none where they are fitted."""
    from transition.law import mean_mass

    if item.profile is None or not isinstance(settings.mean_mass, (str, float)):
        return []
    found = []
    for segment in item.profile.segments:
        volumes = item.profile.volumes(segment.start, segment.end)
        mass, charge = volumes.casing * item.casing.density, volumes.charge * item.explosive.density
        if segment.kind != "wall" or not charge > 0.0:
            continue
        section = item.profile.section(0.5 * (segment.start + segment.end))
        outer, wall = float(section.outer_radius), float(section.wall)
        radius, thin = mean_mass.ruptured(outer, wall, settings.critical_strain)
        speed = mean_mass.gurney_speed(item.explosive.detonation_velocity, charge / mass)
        if isinstance(settings.mean_mass, float):
            mean = settings.mean_mass
        elif settings.mean_mass == "gurney_sarmousakis":
            constant = mean_mass.explosive_constant(item.explosive.name, settings.explosive_constant)
            mean = mean_mass.gurney_sarmousakis(constant, wall, 2.0 * (outer - wall))
        elif settings.mean_mass == "mott_1947":
            gamma, stress = settings.fracture_gamma, settings.fracture_stress
            mean = mean_mass.mott_1947(item.casing.density, stress, gamma, thin, speed / radius)
        else:
            energy = settings.fracture_energy
            mean = mean_mass.mott_linfoot(settings.prefactor, item.casing.density, radius, energy, thin, speed)
        exact = isinstance(settings.mean_mass, float) or settings.mean_mass == "gurney_sarmousakis"
        found.append(SegmentMean(segment.name, mass, min(mean, mass), exact, speed))
    return found


def check_numbers(case: CaseTable, settings: BreakUpSettings, *, margin: float = _MARGIN) -> Iterator[str]:
    """Faults of a resolved case: more fragments than are computed, or segments of which grades hold none.

    `margin` is the factor by which an estimated mean mass may be wrong; with 1 the lines are what is to be expected.
    """
    from transition.settings import MOST_FRAGMENTS

    if not case.round:
        return
    first = first_alike(case)
    items = {index: burst_round(case.round[index], f"round[{index + 1}]") for index in set(first)}
    means = {index: expected_means(item, settings) for index, item in items.items()}
    images = 2 ** sum(plane.kind == "symmetry" for plane in case.plane)  # they are perpendicular to each other
    number = images * sum(one.mass / one.mean for index in first for one in means[index])
    every = [one for found in means.values() for one in found]
    known = all(one.exact for one in every)
    if number > (1.0 if known else margin) * MOST_FRAGMENTS:
        smallest = min(one.mean for one in every)
        law = settings.mean_mass if isinstance(settings.mean_mass, str) else f"{settings.mean_mass:g} kg"
        yield (
            f"break_up.mean_mass: {law} makes about {number:.3g} fragments of the casings, with mean masses from "
            f"{smallest:.3g} kg; allowed: at most {MOST_FRAGMENTS:.0e}: check mean_mass, {_inputs(settings)}"
        )
    if settings.sampler == "graded":
        for index, found in means.items():
            yield from _empty_grades(f"round[{index + 1}]", found, settings, margin)


def _inputs(settings: BreakUpSettings) -> str:
    """Inputs of the law."""
    if settings.mean_mass == "gurney_sarmousakis":
        return "explosive_constant"
    return (
        "fracture_stress and fracture_gamma" if settings.mean_mass == "mott_1947" else "prefactor and fracture_energy"
    )


def _empty_grades(key: str, found: list[SegmentMean], settings: BreakUpSettings, margin: float) -> Iterator[str]:
    """The first segment of which the first grade holds less than one fragment, for any mean mass within the margin."""
    from transition.law.mott import MottLaw
    from transition.law.samplers import Graded

    grades = Graded(settings.graded_m0, settings.graded_dm)
    for one in found:
        factors = (1.0,) if one.exact else (1.0 / margin, 1.0, margin)
        means = [min(factor * one.mean, one.mass) for factor in factors]
        laws = [MottLaw.from_mean(mean, settings.dimension, settings.mixed_fraction) for mean in means]
        numbers = [one.mass / mean for mean in means]
        if max(numbers) > 1e6 or math.isinf(one.mean):
            continue
        if not any(grades.grades(law, n, one.mass)[1].any() for law, n in zip(laws, numbers, strict=True)):
            yield (
                "break_up.graded_dm: the first grade, graded_m0 + graded_dm = "
                f"{settings.graded_m0 + settings.graded_dm:g} "
                f'kg, holds less than one fragment of the segment "{one.name}" of {key} ({one.mass:.4g} kg, mean '
                "mass about "
                f'{one.mean:.3g} kg); allowed: wider grades, or sampler = "quantile"'
            )
            return
