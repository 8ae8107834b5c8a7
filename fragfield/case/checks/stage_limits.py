"""Limits of the stages, asked of the stages themselves before anything runs.

What a stage builds from a case, and refuses, is built here when the case is loaded: settings of the break-up, the scene
and the integrator of the flight, the criteria and cells of the hazard distance. What the rounds decide together with
these settings is asked with the masses of their casings.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from fragfield.case.checks.estimates import check_numbers, map_faults
from fragfield.case.conversion.exposed_sites import exposed_sites_of
from fragfield.case.conversion.rounds import first_alike, masses_of
from fragfield.case.conversion.stages import (
    break_up_settings,
    flight_arguments,
    hazard_criteria,
    hazard_directions,
    hazard_grid,
    kernel_degrees,
)
from fragfield.case.conversion.surroundings import check_surroundings
from fragfield.case.tables.round import ExplosiveTable
from fragfield_base.errors import show

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.case.schema import CaseTable
    from fragfield.case.tables.round import RoundTable
    from transition import BreakUpSettings


_MOST_CELLS = 20_000_000  # of the hazard distance: 160 MB a field, of which a batch of realisations keeps several
_NAMED = re.compile(r"^(witness|obstacle) (.+?): ")


def stage_faults(case: CaseTable) -> Iterator[str]:
    """Faults of a resolved case that its stages would find, as lines `key: ...`."""
    yield from _cells(case)
    yield from _break_up(case)
    flown = list(_flight(case))
    yield from flown
    if not flown:
        yield from map_faults(case)
    yield from _hazard(case)


def _cells(case: CaseTable) -> Iterator[str]:
    """A cell size with which a round of a profile has no mesh, or one that is too large."""
    from burst_fenicsx.axisymmetric.mesh import check_meridian_size
    from burst_fenicsx.errors import InputError
    from burst_fenicsx.meshing.sizing import check_mesh_size
    from fragfield.case.conversion.rounds import profile_of
    from fragfield.case.conversion.symmetry import burst_geometry

    if case.burst is None:
        return
    check = check_mesh_size if burst_geometry(case).geometry == "3d" else check_meridian_size
    for entry in case.round:
        if entry.mesh is not None:
            continue
        try:
            check(profile_of(entry), case.burst.cell_size)
        except InputError as error:
            yield f"burst.{str(error).replace('cell_size = ', 'cell_size: found ', 1)}"
            return


def _break_up(case: CaseTable) -> Iterator[str]:
    from transition import InputError

    try:
        settings = break_up_settings(case)
    except InputError as error:
        yield str(error)
        return
    for number, (entry, first) in enumerate(zip(case.round, first_alike(case), strict=True)):
        faults = list(_of_round(f"round[{number + 1}]", entry, settings)) if first == number else []
        yield from faults
        if faults:
            return  # the laws below would meet the same
    yield from check_numbers(case, settings)


def _of_round(key: str, entry: RoundTable, settings: BreakUpSettings) -> Iterator[str]:
    """Settings of the break-up that a round cannot have."""
    from transition import InputError
    from transition.law.mean_mass import explosive_constant

    if settings.mean_mass == "gurney_sarmousakis":
        assert isinstance(entry.explosive, ExplosiveTable)  # resolved
        try:
            explosive_constant(entry.explosive.name, settings.explosive_constant)
        except InputError as error:
            yield str(error)
    masses = masses_of(entry)
    if isinstance(settings.segments, tuple):
        yield from _stations(key, entry, settings.segments)
    segments = masses.segments if settings.segments is None else ()
    heaviest = max((one.casing for one in segments), default=masses.casing)
    whose = f"the heaviest segment of {key}" if segments else f"the casing of {key}"
    if isinstance(settings.mean_mass, float) and settings.mean_mass > heaviest:
        yield (
            f"break_up.mean_mass: found {settings.mean_mass:g} kg, above the mass of {whose}, {heaviest:.4g} kg; "
            "allowed: "
            "at most that (is it the mean mass of a fragment, in the unit that is meant?)"
        )


def _stations(key: str, entry: RoundTable, stations: tuple[float, ...]) -> Iterator[str]:
    from fragfield.case.conversion.rounds import profile_of

    if not isinstance(entry.profile, dict) or not stations:
        return
    length = profile_of(entry).length
    if stations[-1] >= length:
        yield (
            f"break_up.segments: found the station {1e3 * stations[-1]:.6g} mm, beyond {key}; allowed: below its "
            "length, "
            f"{1e3 * length:.6g} mm"
        )


def _flight(case: CaseTable) -> Iterator[str]:
    """Drag tables, maps, surfaces, obstacles, the integrator's limits."""
    from flight import InputError

    try:
        flight_arguments(case)
        check_surroundings(case)
        exposed_sites_of(case)
    except InputError as error:
        yield _keyed(case, str(error))


def _keyed(case: CaseTable, text: str) -> str:
    """A message of the flight with the key of the case in front."""
    if found := _NAMED.match(text):
        kind, name = found.groups()
        names = [entry.name for entry in (case.witness if kind == "witness" else case.obstacle)]
        if name in names:
            return f"{kind}[{names.index(name) + 1}]: {show(name)}: {text[found.end() :]}"
    if text.startswith(("exposed", "obstacle", "witness", "hazard")):
        return text
    return f"flight.{text.replace('contact: ', 'collisions: ', 1) if text.startswith('contact: ') else text}"


def _hazard(case: CaseTable) -> Iterator[str]:
    """Criteria, sectors and distance cells of the hazard distance, and the rule for stacks."""
    from flight import InputError
    from flight.hazard.density.directions import Directions
    from flight.hazard.tp12 import effective_number

    table = case.hazard
    try:
        hazard_criteria(case)
        grid = hazard_grid(case)
    except InputError as error:
        yield str(error).replace("hazard: ", "hazard.", 1)
        return
    cells = grid.sectors * grid.cuts * grid.cells
    if cells > _MOST_CELLS:
        yield (
            f"hazard.distance_cell: found {table.distance_cell:g} m with {table.sectors} sectors and a kernel of "
            f"{kernel_degrees(case):.3g} deg, which make {cells:.3g} cells of density; allowed: at most "
            f"{_MOST_CELLS:.0e}: "
            "wider cells, fewer sectors or a wider kernel"
        )
        return
    if case.round:
        basis, mirrors = hazard_directions(case)
        try:
            Directions(grid, basis, kernel_degrees(case), tuple(one for one in mirrors if grid.maps(one)))
        except InputError as error:
            yield str(error).replace("hazard: ", "hazard.", 1)
    if table.stack_rule.side is not None and table.stack_rule.top is not None:
        try:
            effective_number(table.stack_rule.side, table.stack_rule.top, table.stack_rule.cover)
        except InputError as error:
            yield f"hazard.stack_rule: {str(error).removeprefix('stack rule: ')}; allowed: one round or more"
