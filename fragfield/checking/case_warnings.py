"""What is doubtful in a case, and what its burst costs: first stable step, when it may end, memory."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from burst_fenicsx.geometry import Profile
from burst_fenicsx.meshing.mesh import CellMesh
from burst_fenicsx.problem import BurstSettings, CasingMaterial, Explosive, Round
from fragfield.case import CaseTable
from fragfield.case.checks.estimates import map_warnings
from fragfield.case.conversion.exposed_sites import outline_of
from fragfield.case.conversion.rounds import burst_round, first_alike, masses_of
from fragfield.case.faults import Doubt, outside_soft
from fragfield.case.tables.flight import CylinderTable
from fragfield.hazard.contents import arrangement_warnings, with_images
from fragfield.results.check import CheckedRound, ExpectedCost, Graded
from fragfield_base.substances import graded, substance, substance_names
from transition.law.mean_mass import gurney_speed, outside_data


def graded_name(one: CasingMaterial | Explosive) -> Graded:
    """A substance with the grades of its values."""
    return Graded(name=one.name, grades=graded(one.source))


def waiting_on_estimates(rounds: Sequence[Round]) -> Iterator[str]:
    """Explosives that wait for a neighbour's shock, of which only estimates say how shocks run in them."""
    waiting = {entry.explosive.name: entry.explosive for entry in rounds if not entry.ignition}
    for name, explosive in waiting.items():
        if "Unreacted estimate" in graded(explosive.source):
            yield (
                f'explosive "{name}": sound_speed and hugoniot_slope are estimates; what a neighbour\'s shock does to '
                "the charge follows from them (the speed of its casing hardly)"
            )


def yield_stress(casing: CasingMaterial) -> float:
    """Yield stress (Pa) of a tensile test: of a built-in casing whose strength is its flow stress, that at 1 /s."""
    if graded(casing.source) and casing.name in substance_names("casing"):
        initial = substance("casing", casing.name).value("johnson_cook", "A")
        if initial is not None:
            return float(initial)
    return 2.0 * casing.shear_strength  # Tresca


_WALL_CELLS = 3.0  # sizes of a cell in the thinnest wall, from which its bending is resolved
_MASS_TOLERANCE = 0.005
_GROWTH = 2.0  # radii, by which casings have grown when they no longer accelerate: 1.7 of the M107
_FUZE_DENSITIES = (700.0, 8000.0)  # kg/m3: from plastics, partly hollow, to solid steel


def case_warnings(
    case: CaseTable, settings: BurstSettings, described: Sequence[CheckedRound], expected: ExpectedCost
) -> Iterator[str]:
    """Warnings of `check`: `described` are a case's rounds as `check_report` describes them, `expected` the cost."""
    yield from doubts(case)
    yield from map_warnings(case)
    fixed = settings.time_step.fixed
    if fixed is not None and fixed > 0.5 * expected.stable_time_step:
        yield Doubt(
            "burst.time_step.fixed",
            f" = {fixed:g} s; the first stable step is about {expected.stable_time_step:.3g} s "
            "and falls while cells are compressed",
        )
    for index, number in Counter(first_alike(case)).items():
        others = f" and {number - 1} alike" if number > 1 else ""
        whose = f" ({described[index].name}{others})"
        for words in _round_warnings(settings, described[index]):
            yield Doubt(f"round[{index + 1}]", f"{whose}: {words}")
    yield from obstacle_warnings(case, settings, described)
    yield from witness_warnings(case, max(one.outer_diameter for one in described))


def doubts(case: CaseTable, *, burst: bool = True) -> Iterator[str]:
    """What is doubtful in a resolved case, whatever comes out of it: `check` warns of it, and so does the report.

    `burst`: its fragments come from the case's own burst.
    """
    yield from outside_soft(case)
    settings = case.burst
    if settings is None or not burst:
        return
    yield from arrangement_warnings(case)
    if settings.products == "landau":
        yield Doubt(
            "burst.products",
            ' = "landau" starts from the pressure of an instantaneous explosion; with a travelling detonation front '
            'the products do about 1.2 times the work rho Q; "landau_cj" and "jwl" give the heat of detonation',
        )
    if settings.burn == "time" and settings.products != "jwl":
        yield Doubt(
            "burst.burn",
            ' = "time" does not give a steady front with Landau products: cells ahead of it may be crushed; '
            '"time_or_compression" ignites them',
        )
    if settings.end_time is not None:
        yield Doubt(
            "burst.end_time",
            f" = {settings.end_time:g} s: the burst ends there, complete or not, and fragments "
            "start with the speeds of that time; left out, it ends by its asymptote, not before casings have collided",
        )
    if not settings.leakage.enabled:
        yield Doubt(
            "burst.leakage.enabled", " = false: the products expand without venting, so speeds are upper bounds"
        )
    for index, number in Counter(first_alike(case)).items():
        profile = burst_round(case.round[index]).profile
        if profile is None or not any(one.kind == "wall" for one in profile.segments):
            continue
        wall, station = thinnest_wall(profile)
        if wall < _WALL_CELLS * settings.cell_size:
            name = f"{case.round[index].name}{f' and {number - 1} alike' if number > 1 else ''}"
            enough = math.floor(1e4 * wall / _WALL_CELLS) / 10.0  # mm
            yield (
                f"the thinnest wall of {name}, {1e3 * wall:.1f} mm at {1e3 * station:.0f} mm from the nose, is "
                f"{wall / settings.cell_size:.1f} cells of {1e3 * settings.cell_size:g} mm thick; {_WALL_CELLS:g} or "
                f"more resolve its bending: set burst.cell_size to {enough:g} mm or less"
            )


def thinnest_wall(profile: Profile) -> tuple[float, float]:
    """Smallest wall (m) around the charge, and its station (m), at 401 stations a segment."""
    ends = [(one.start, one.end) for one in profile.segments if one.kind == "wall"]
    stations = np.concatenate([np.linspace(start, end, 401) for start, end in ends])
    walls = profile.section(stations).wall
    thinnest = int(np.argmin(walls))
    return float(walls[thinnest]), float(stations[thinnest])


def mean_mass_warnings(case: CaseTable, rounds: Sequence[Round], described: Sequence[CheckedRound]) -> Iterator[str]:
    """Rounds near which no published mean masses are; a mean mass that is given or fitted needs none."""
    if isinstance(case.break_up.mean_mass, float):
        yield from _heavy_mean(case, described)
        return
    if case.break_up.mean_mass_is_file:
        return
    for index, number in Counter(first_alike(case)).items():
        entry, known = rounds[index], described[index]
        casing = entry.casing.density, yield_stress(entry.casing)
        filling = entry.explosive.name, entry.explosive.density
        texts = list(outside_data(known.outer_diameter, known.charge_ratio, casing, filling))
        if texts:
            others = f" and {number - 1} alike" if number > 1 else ""
            yield Doubt(
                f"round[{index + 1}]",
                f" ({known.name}{others}): no published mean masses of fragments are close: {'; '.join(texts)}. No "
                "published scatter covers it: measure the mean mass, or vary it and compare the distances",
            )


def _heavy_mean(case: CaseTable, described: Sequence[CheckedRound]) -> Iterator[str]:
    mean = float(case.break_up.mean_mass)
    for index in dict.fromkeys(first_alike(case)):
        segments = (described[index].segments or ()) if case.break_up.segments is None else ()
        light = [f'"{one.name}" ({one.casing_mass:.3g} kg)' for one in segments if one.casing_mass < mean]
        if light:
            yield Doubt(
                f"round[{index + 1}]",
                f" ({described[index].name}): break_up.mean_mass = {mean:g} kg is above the mass of "
                f"{' and '.join(light)}, of which each stays one piece",
            )


def _round_warnings(settings: BurstSettings, known: CheckedRound) -> Iterator[str]:
    low, high = _FUZE_DENSITIES
    if known.fuze_density and not low <= known.fuze_density <= high:
        yield (
            f"the fuze of {known.fuze_mass:.3g} kg has {known.fuze_density:.0f} kg/m3 in its cavity; usual: {low:g} to "
            f"{high:g} kg/m3, for what fills the cavity alone"
        )
    for name, error in known.mass_error_of_mesh.items():
        if abs(error) > _MASS_TOLERANCE:
            yield f"{name} of the mesh is off by {error:+.2%}; use smaller cells to follow the contour"
    passage = known.charge_length / known.detonation_velocity
    if settings.end_time is not None and settings.end_time < passage:
        yield f"burst.end_time = {settings.end_time:g} s ends before the front has passed ({passage:.3g} s)"


def obstacle_warnings(case: CaseTable, settings: BurstSettings, described: Sequence[CheckedRound]) -> Iterator[str]:
    """Obstacles of the flight that a casing reaches while it grows: the burst does not know them."""
    for number, (entry, known) in enumerate(zip(case.round, described, strict=True), start=1):
        radius = 0.5 * known.outer_diameter
        growth = _GROWTH * radius
        if settings.end_time is not None and known.charge_ratio > 0.0:
            growth = settings.end_time * gurney_speed(known.detonation_velocity, known.charge_ratio)
        along = np.asarray(entry.axis) / np.linalg.norm(entry.axis) * known.length
        axis = np.asarray(entry.position) + np.linspace(0.0, 1.0, 9)[:, None] * along
        for obstacle in case.obstacle:
            plan = outline_of(obstacle)
            away = min(_distances(point[:2], plan)[0] for point in axis)
            if away < radius + growth:
                yield (
                    f"obstacle {obstacle.name}: {away:.3g} m from the axis of round[{number}] ({known.name}), whose "
                    f"casing grows to about {radius + growth:.2g} m in the burst, where no obstacle stops it: a run "
                    'whose fragments start inside it is refused; move it, or use a plane of kind "wall" in the burst'
                )


def witness_warnings(case: CaseTable, largest_diameter: float) -> Iterator[str]:
    """Cylinders that a casing may reach before it breaks up, or that cut the foot of an obstacle.

    `case`: resolved, with a burst; `largest_diameter`: of the rounds (m).
    """
    for number, surface in enumerate(case.witness, start=1):
        if not isinstance(surface, CylinderTable):
            continue
        key, radius = f"witness[{number}].radius", f" = {surface.radius:g} m"
        reach = max(math.hypot(x - surface.centre[0], y - surface.centre[1]) for x, y, _ in with_images(case))
        if surface.radius < 2.0 * (reach + largest_diameter):
            yield Doubt(key, f"{radius}: so close that casings may reach it before break-up")
        for obstacle in case.obstacle:
            nearest, farthest = _distances(np.asarray(surface.centre), outline_of(obstacle))
            if nearest < surface.radius < farthest:
                yield Doubt(
                    key,
                    f'{radius}: {surface.name} cuts {obstacle.kind} "{obstacle.name}", whose foot lies {nearest:.3g} '
                    f"to {farthest:.3g} m from its centre: part of the surface lies in front of the obstacle and part "
                    f"behind it; use less than {nearest:.3g} m or more than {farthest:.3g} m",
                )


def _distances(centre: NDArray[np.float64], corners: NDArray[np.float64]) -> tuple[float, float]:
    import shapely

    return float(shapely.Polygon(corners).distance(shapely.Point(centre))), float(np.hypot(*(centre - corners).T).max())


_EXPANSION_AT_END = 2.7  # of a casing, at which its acceleration is complete
# Memory of one process, by rows of one to four M107 with 6 and 8 mm cells, whole and as quarters (within a twentieth).
# Images of what symmetry leaves are joined to the whole at every output.
_BYTES_PER_CELL, _BYTES_PER_CELL_OF_WHOLE = 2_450.0, 1_050.0
_BYTES_AT_START = 272e6


def expected_cost(
    settings: BurstSettings,
    rounds: Sequence[Round],
    meshes: Sequence[CellMesh],
    cells: int,
    share: float,
    attitudes: int | None,
) -> ExpectedCost:
    """Estimate what a burst will cost: `meshes` of the computed parts of rounds, `cells` a `share` of the whole."""
    return ExpectedCost(
        stable_time_step=min(
            mesh.shortest_edge / max(_sound_speed(entry), entry.explosive.detonation_velocity)
            for entry, mesh in zip(rounds, meshes, strict=True)
        ),
        end_time=expected_end(settings, rounds),
        memory_bytes=_BYTES_AT_START + (_BYTES_PER_CELL + _BYTES_PER_CELL_OF_WHOLE / share) * cells,
        attitudes=attitudes,
    )


def expected_end(settings: BurstSettings, rounds: Sequence[Round]) -> float | None:
    """Time (s) at which a burst may end; None of several rounds, and of one from a mesh file.

    A casing sets out when the front has passed half of its charge and grows at Gurney's speed until it has expanded as
    far as casings are accelerated.
    """
    if settings.end_time is not None:
        return settings.end_time
    if len(rounds) > 1 or (profile := rounds[0].profile) is None:
        return None
    front = rounds[0].explosive.detonation_velocity
    begin = max((point.delay for point in rounds[0].ignition), default=math.inf)
    passage = 0.5 * (profile.charge_end - profile.charge_front) / front
    travel = (_EXPANSION_AT_END - 1.0) * profile.max_radius / gurney_speed(front, masses_of(rounds[0]).ratio)
    return min(float(begin + passage + travel), settings.time_limit)


def _sound_speed(entry: Round) -> float:
    nu = entry.casing.poisson_ratio
    modulus = entry.casing.elastic_modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return math.sqrt(modulus / entry.casing.density)
