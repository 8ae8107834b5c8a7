"""What stages refuse when they are built, with the case's keys, and what is estimated before the burst.

Estimated are how many fragments there are, and how far a map of heights must reach.

The laws are those of the break-up, with the speed of Gurney's formula (Eqs. 23-24) for that of the burst, which differs
from it by 30 % at most where a casing is closed: mean masses then by a factor below 2. An estimated mean mass is a
fault only where one `_MARGIN` times larger or smaller would be, too; what does not depend on the speed is exact.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import flight
from burst_fenicsx.axisymmetric.mesh import check_meridian_size
from burst_fenicsx.meshing.sizing import check_mesh_size
from burst_fenicsx.problem import Round
from flight import FlightWarning, Fragments, fly
from flight import InputError as FlightInputError
from flight.scene.scene import Scene
from fragfield.case import problem
from fragfield.case.checks.expected_masses import RECOVERED
from fragfield.case.conversion.attitude import is_mixed
from fragfield.case.conversion.exposed_sites import exposed_sites_of
from fragfield.case.conversion.rounds import burst_round, first_alike, masses_of, profile_of
from fragfield.case.conversion.surroundings import (
    bearing_of,
    check_surroundings,
    direction_words,
    ground_of,
    surroundings,
)
from fragfield.case.faults import Doubt, Fault
from fragfield.case.schema import CaseTable
from fragfield.case.tables.round import RoundTable
from fragfield.errors import InputError
from fragfield.hazard.tp12 import effective_number
from fragfield_base import errors
from fragfield_base.errors import show
from transition import BreakUpSettings
from transition.law.mean_mass import explosive_constant
from transition.settings import MOST_FRAGMENTS

Array = NDArray[np.float64]


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
    for segment, masses in zip(item.profile.segments, masses_of(item).segments, strict=True):
        mass, charge = masses.casing, masses.charge
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


def check_numbers(case: CaseTable, settings: BreakUpSettings, *, margin: float = _MARGIN) -> Iterator[Fault]:
    """Faults of a resolved case: more fragments than are computed, or segments of which grades hold none.

    `margin` is the factor by which an estimated mean mass may be wrong; with 1 the lines are what is to be expected.
    """
    if not case.round:
        return
    first = first_alike(case)
    items = {index: burst_round(case.round[index]) for index in set(first)}
    means = {index: expected_means(item, settings) for index, item in items.items()}
    number = _images(case) * sum(one.mass / one.mean for index in first for one in means[index])
    every = [one for found in means.values() for one in found]
    known = all(one.exact for one in every)
    if number > (1.0 if known else margin) * MOST_FRAGMENTS:
        smallest = min(one.mean for one in every)
        law = settings.mean_mass if isinstance(settings.mean_mass, str) else f"{settings.mean_mass:g} kg"
        yield Fault(
            "break_up.mean_mass",
            f"{law} makes about {number:.3g} fragments of the casings, with mean masses from "
            f"{smallest:.3g} kg; allowed: at most {MOST_FRAGMENTS:.0e}: check mean_mass, {_inputs(settings)}",
        )
    if settings.sampler == "graded":
        for index, found in means.items():
            yield from _empty_grades(f"round[{index + 1}]", found, settings, margin)


def _images(case: CaseTable) -> int:
    return int(2 ** sum(plane.kind == "symmetry" for plane in case.plane))


def _inputs(settings: BreakUpSettings) -> str:
    if settings.mean_mass == "gurney_sarmousakis":
        return "explosive_constant"
    return (
        "fracture_stress and fracture_gamma" if settings.mean_mass == "mott_1947" else "prefactor and fracture_energy"
    )


def _empty_grades(key: str, found: list[SegmentMean], settings: BreakUpSettings, margin: float) -> Iterator[Fault]:
    """The first segment of which the first grade holds less than one fragment, for any mean mass within the margin."""
    from transition.law.mott import Graded, MottLaw

    grades = Graded(settings.graded_m0, settings.graded_dm)
    for one in found:
        factors = (1.0,) if one.exact else (1.0 / margin, 1.0, margin)
        means = [min(factor * one.mean, one.mass) for factor in factors]
        laws = [MottLaw.from_mean(mean, settings.dimension, settings.mixed_fraction) for mean in means]
        numbers = [one.mass / mean for mean in means]
        if max(numbers) > 1e6 or math.isinf(one.mean):
            continue
        if not any(grades.grades(law, n, one.mass)[1].any() for law, n in zip(laws, numbers, strict=True)):
            yield Fault(
                "break_up.graded_dm",
                f"the first grade, graded_m0 + graded_dm = {settings.graded_m0 + settings.graded_dm:g} kg, holds less "
                f'than one fragment of the segment "{one.name}" of {key} ({one.mass:.4g} kg, mean mass about '
                f'{one.mean:.3g} kg); allowed: wider grades, or sampler = "quantile"',
            )
            return


_FASTER = 1.25  # than Gurney's speed: the fastest pieces of a wall, and those of a focus
_ONE_IN = 100.0  # events, in one of which a piece as heavy as the heaviest is expected
_ELEVATIONS = np.radians(np.arange(10.0, 51.0, 5.0))
_LONGEST = 120.0  # s, of a path
_LEVEL = "beyond its edge the ground is taken as level, and a distance that reaches there is not determined"
_STEEP = 3.0  # of a rise over its run: 72 degrees
_OTHER_ALTITUDE = 100.0  # m, between the air's altitude and the map's height, beyond which that is said


def map_faults(case: CaseTable, fragments: Fragments | None = None) -> Iterator[Fault]:
    """A map that ends before the farthest throw of the rounds, or of given fragments, where that is refused."""
    if case.flight.ground.beyond == "refuse":
        yield from _short(case, fragments, 'allowed: beyond = "level" (see the guide, "Your map"), or a map')


def map_warnings(case: CaseTable, fragments: Fragments | None = None) -> Iterator[str]:
    """A map that ends before the farthest throw, where level ground beyond it is allowed, and what else is doubtful."""
    ground = ground_of(case)
    if isinstance(ground, float):
        return
    if case.flight.ground.beyond == "level":
        faults = _short(case, fragments, f"{_LEVEL}. A map that holds all is one")
        yield from (Doubt(key, f": {words}") for key, words in faults)
    air = case.flight.air
    if air.model == "standard" and abs((air.altitude or 0.0) - (ground.datum or 0.0)) > _OTHER_ALTITUDE:
        words = f"by the map z = 0 is at {ground.datum or 0.0:.4g} m; left out, it is the map's"
        yield Doubt("flight.air.altitude", f" = {air.altitude or 0.0:g} m, and {words}")
    steps = zip((1, 0), ground.step, strict=True)
    rise = max(float(np.abs(np.diff(ground.heights, axis=axis)).max()) / step for axis, step in steps)
    if rise > _STEEP:
        words = f": neighbours rise {rise:.3g} times their distance: is a hole filled by a number?"
        yield Doubt("flight.ground.map", words)
    yield from (Doubt("flight.ground.map", f": {note}") for note in ground.facts.get("notes", ()) if note.endswith("?"))
    if "no place was given" in ground.facts.get("position", ""):
        yield Doubt("flight.ground.map", f": {ground.facts['position']}; say where the rounds stand by a table [site]")


def given_fragments(case: CaseTable, path: Path) -> list[str]:
    """Warnings for the fragments of a file, neither of whose masses nor of whose places the case knows.

    Raises InputError: the file cannot be read, they are heavier than the casings, start off the map or in an
    obstacle, or may fly beyond the map.
    """
    fragments, found = Fragments.read(path), surroundings(case)
    if not is_mixed(case):
        scene = Scene(found["ground"], found["ricochet"], tuple(found["obstacles"]))
        try:
            scene.check_places(fragments.position, case.flight.origin, "fragments")
        except FlightInputError as error:
            raise InputError(f"{path.name}: {error}") from None
    for fault in map_faults(case, fragments):
        raise InputError(str(fault))
    return [*_masses_of_given(case, fragments, path.name), *map_warnings(case, fragments)]


def _masses_of_given(case: CaseTable, fragments: Fragments, name: str) -> Iterator[str]:
    casings = [masses_of(one).casing for one in case.round]
    if not casings or case.flight.arena_mass == "as_given":
        return
    heaviest, mass, whole = float(fragments.mass.max()), float(fragments.mass.sum()), _images(case) * sum(casings)
    low, high = RECOVERED
    held = f"{mass:.4g} kg of fragments, {100.0 * mass / whole:.3g} %"
    words = f"{name}: holds {held} of the {whole:.4g} kg of the casings"
    if heaviest > high * max(casings) or mass > high * whole:
        raise InputError(
            f"{words}, the heaviest of {heaviest:.4g} kg; allowed: at most {100.0 * high:g} % (are masses in kg?), or "
            'flight.arena_mass = "as_given"'
        )
    if mass < low * whole:
        yield f"{words}: densities and distances are those of these alone"


def _short(case: CaseTable, fragments: Fragments | None, end: str) -> Iterator[Fault]:
    ground = ground_of(case)
    if isinstance(ground, float):
        return
    throw = farthest_throw(case) if fragments is None else farthest_flight(case, fragments)
    if throw is None:
        return
    azimuth = np.arange(0.0, 360.0, 1.0)
    reach = ground.reach(case.flight.origin, azimuth)
    nearest = int(np.argmin(reach))
    needed = 50.0 * math.ceil(throw / 50.0)
    if reach[nearest] < throw:
        (x, y), turn = case.flight.origin, float(azimuth[nearest])
        yield Fault(
            "flight.ground.map",
            f"ends {reach[nearest]:.0f} m from the rounds "
            f"({direction_words(turn, bearing_of(case, turn), whole=True)}), and fragments may fly up to about "
            f"{throw:.0f} m; {end} that reaches from {x - needed:.0f} to {x + needed:.0f} m along x and from "
            f"{y - needed:.0f} to {y + needed:.0f} m along y",
        )


def farthest_throw(case: CaseTable) -> float | None:
    """Distance (m) that the heaviest and fastest fragment to be expected may fly; None without masses to go by.

    Of every wall the piece of which one is expected in a hundred events by Mott's distribution, N(> m) = N0
    exp(-sqrt(2 m / mean)), at most the wall itself, launched at `_FASTER` times Gurney's speed at the best elevation,
    over level ground in the air, and with the drag, of the flight.
    """
    pieces = []
    try:
        settings = problem.break_up_settings(case)
        for index in set(first_alike(case)):
            for one in expected_means(burst_round(case.round[index]), settings):
                number = _images(case) * len(case.round) * _ONE_IN * one.mass / one.mean
                heaviest = min(0.5 * one.mean * math.log(number) ** 2, one.mass)
                pieces.append((heaviest, _FASTER * one.speed))
    except errors.InputError:
        return None  # faults of the break-up are reported as such
    if not pieces:
        return None
    mass, speed = np.array(pieces).T
    return float(_range(case, mass, speed).max())


def farthest_flight(case: CaseTable, fragments: Fragments) -> float:
    """Distance (m) that given fragments may fly, each at the best elevation: of those that none outdoes in both."""
    # the mass that with the case's shape factor has the fragment's area per mass
    mass = fragments.mass * (fragments.shape_factor / case.flight.shape_factor) ** 2
    order = np.lexsort((mass, fragments.speed))[::-1]
    mass, speed = mass[order], fragments.speed[order]
    front = np.concatenate([[True], mass[1:] > np.maximum.accumulate(mass)[:-1]])
    return float(_range(case, mass[front], speed[front]).max())


def _range(case: CaseTable, mass: Array, speed: Array) -> Array:
    """Largest horizontal ranges (n,) of fragments (kg, m/s) over `_ELEVATIONS`, back to the height of launch."""
    number, turn = len(_ELEVATIONS), np.tile(_ELEVATIONS, len(mass))
    way = np.column_stack([np.cos(turn), np.zeros(len(turn)), np.sin(turn)])
    velocity = np.repeat(speed, number)[:, None] * way
    shots = Fragments(np.repeat(mass, number), (0.0, 0.0, 0.0), velocity, case.flight.shape_factor)
    arguments = {name: problem.flight_arguments(case)[name] for name in ("air", "drag", "gravity", "integrator")}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FlightWarning)  # of the flight itself, once it is flown
        flown = fly(shots, **arguments, ricochet=None, time_limit=_LONGEST, threads=1)
    return np.asarray(flown.landing["distance"].reshape(-1, number).max(axis=1))


_MOST_CELLS = 20_000_000  # of the hazard distance: 160 MB a field, of which a batch of realisations keeps several


def stage_faults(case: CaseTable) -> Iterator[Fault]:
    """Faults of a resolved case that its stages would find."""
    yield from _cells(case)
    try:
        yield from _of_break_up(case, problem.break_up_settings(case))
    except errors.InputError as error:
        yield _rekeyed(case, error, "")
    yield from list(_of_flight(case)) or map_faults(case)
    try:
        yield from _of_hazard(case)
    except errors.InputError as error:
        yield _rekeyed(case, error, "hazard.")


def _of_flight(case: CaseTable) -> Iterator[Fault]:
    try:
        flight.Drag.of(case.flight.drag)
    except errors.InputError as error:  # of a file: without the key
        yield Fault("flight.drag", str(error).removeprefix("drag: "))
        return
    try:
        problem.flight_arguments(case)
        check_surroundings(case)
        exposed_sites_of(case)
    except errors.InputError as error:
        yield _rekeyed(case, error, "flight.")


def _rekeyed(case: CaseTable, error: errors.InputError, table: str) -> Fault:
    """A stage's refusal with the case's key: a stage begins with what is at fault, and its name if it has one."""
    text = str(error)
    for key in ("witness", "obstacle", "exposed"):
        for number, entry in enumerate(getattr(case, key), start=1):
            for name in (entry.name, show(entry.name)):
                if text.startswith(head := f"{key} {name}: "):
                    return Fault(f"{key}[{number}]", f"{show(entry.name)}: {text.removeprefix(head)}")
    key, _, words = text.partition(": ")
    return Fault(table + {"contact": "collisions"}.get(key, key), words)


def _cells(case: CaseTable) -> Iterator[Fault]:
    if case.burst is None:
        return
    check = check_mesh_size if problem.burst_geometry(case).geometry == "3d" else check_meridian_size
    for entry in case.round:
        try:
            if entry.mesh is None:
                check(profile_of(entry), case.burst.cell_size)
        except errors.InputError as error:
            yield Fault("burst.cell_size", str(error).replace("cell_size = ", "found ", 1))
            return


def _of_break_up(case: CaseTable, settings: BreakUpSettings) -> Iterator[Fault]:
    for number, (entry, first) in enumerate(zip(case.round, first_alike(case), strict=True)):
        faults = list(_of_round(f"round[{number + 1}]", entry, settings)) if first == number else []
        yield from faults
        if faults:
            return  # the laws below would meet the same
    yield from check_numbers(case, settings)


def _of_round(key: str, entry: RoundTable, settings: BreakUpSettings) -> Iterator[Fault]:
    if settings.mean_mass == "gurney_sarmousakis":
        explosive_constant(entry.material("explosive").name, settings.explosive_constant)
    masses, stations = masses_of(entry), settings.segments
    if isinstance(stations, tuple) and stations and isinstance(entry.profile, dict):
        length = profile_of(entry).length
        if stations[-1] >= length:
            yield Fault(
                "break_up.segments",
                f"found the station {1e3 * stations[-1]:.6g} mm, beyond {key}; allowed: below its length, "
                f"{1e3 * length:.6g} mm",
            )
    segments = masses.segments if stations is None else ()
    heaviest = max((one.casing for one in segments), default=masses.casing)
    whose = f"the heaviest segment of {key}" if segments else f"the casing of {key}"
    if isinstance(settings.mean_mass, float) and settings.mean_mass > heaviest:
        yield Fault(
            "break_up.mean_mass",
            f"found {settings.mean_mass:g} kg, above the mass of {whose}, {heaviest:.4g} kg; allowed: "
            "at most that (is it the mean mass of a fragment, in the unit that is meant?)",
        )


def _of_hazard(case: CaseTable) -> Iterator[Fault]:
    table = case.hazard
    problem.hazard_criteria(case)
    grid = problem.hazard_grid(case)
    cells = grid.sectors * grid.cuts * grid.cells
    if cells > _MOST_CELLS:
        yield Fault(
            "hazard.distance_cell",
            f"found {table.distance_cell:g} m with {table.sectors} sectors and a kernel of "
            f"{problem.kernel_degrees(case):.3g} deg, which make {cells:.3g} cells of density; allowed: at most "
            f"{_MOST_CELLS:.0e}: wider cells, fewer sectors or a wider kernel",
        )
        return
    if case.round:
        problem.density_directions(case, *problem.hazard_directions(case))
    rule = table.stack_rule
    if rule.side is not None and rule.top is not None:
        try:
            effective_number(rule.side, rule.top, rule.cover)
        except errors.InputError as error:
            words = str(error).removeprefix("stack rule: ")
            yield Fault("hazard.stack_rule", f"{words}; allowed: one round or more")
