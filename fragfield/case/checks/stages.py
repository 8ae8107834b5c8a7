"""What a stage refuses of a case when it is built is asked when the case is loaded, and has the case's key."""

from __future__ import annotations

from collections.abc import Iterator

import flight
from fragfield.case.checks.estimates import check_numbers, map_faults
from fragfield.case.conversion.exposed_sites import exposed_sites_of
from fragfield.case.conversion.rounds import first_alike, masses_of, profile_of
from fragfield.case.conversion.surroundings import check_surroundings
from fragfield.case.faults import Fault
from fragfield.case.problem import (
    break_up_settings,
    burst_geometry,
    flight_arguments,
    hazard_criteria,
    hazard_directions,
    hazard_grid,
    kernel_degrees,
)
from fragfield.case.schema import CaseTable
from fragfield.case.tables.round import RoundTable
from fragfield.hazard.tp12 import effective_number
from fragfield_base.errors import InputError, show
from transition import BreakUpSettings

_MOST_CELLS = 20_000_000  # of the hazard distance: 160 MB a field, of which a batch of realisations keeps several


def stage_faults(case: CaseTable) -> Iterator[Fault]:
    """Faults of a resolved case that its stages would find."""
    yield from _cells(case)
    try:
        yield from _of_break_up(case, break_up_settings(case))
    except InputError as error:
        yield _rekeyed(case, error, "")
    yield from list(_of_flight(case)) or map_faults(case)
    try:
        yield from _of_hazard(case)
    except InputError as error:
        yield _rekeyed(case, error, "hazard.")


def _of_flight(case: CaseTable) -> Iterator[Fault]:
    try:
        flight.Drag.of(case.flight.drag)
    except InputError as error:  # of a file: without the key
        yield Fault("flight.drag", str(error).removeprefix("drag: "))
        return
    try:
        flight_arguments(case)
        check_surroundings(case)
        exposed_sites_of(case)
    except InputError as error:
        yield _rekeyed(case, error, "flight.")


def _rekeyed(case: CaseTable, error: InputError, table: str) -> Fault:
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
    from burst_fenicsx.axisymmetric.mesh import check_meridian_size
    from burst_fenicsx.meshing.sizing import check_mesh_size

    if case.burst is None:
        return
    check = check_mesh_size if burst_geometry(case).geometry == "3d" else check_meridian_size
    for entry in case.round:
        try:
            if entry.mesh is None:
                check(profile_of(entry), case.burst.cell_size)
        except InputError as error:
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
    from transition.law.mean_mass import explosive_constant

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
    from flight.hazard.density.directions import Directions

    table = case.hazard
    hazard_criteria(case)
    grid = hazard_grid(case)
    cells = grid.sectors * grid.cuts * grid.cells
    if cells > _MOST_CELLS:
        yield Fault(
            "hazard.distance_cell",
            f"found {table.distance_cell:g} m with {table.sectors} sectors and a kernel of {kernel_degrees(case):.3g} "
            f"deg, which make {cells:.3g} cells of density; allowed: at most {_MOST_CELLS:.0e}: wider cells, fewer "
            "sectors or a wider kernel",
        )
        return
    if case.round:
        basis, mirrors = hazard_directions(case)
        Directions(grid, basis, kernel_degrees(case), tuple(one for one in mirrors if grid.maps(one)))
    rule = table.stack_rule
    if rule.side is not None and rule.top is not None:
        try:
            effective_number(rule.side, rule.top, rule.cover)
        except InputError as error:
            words = str(error).removeprefix("stack rule: ")
            yield Fault("hazard.stack_rule", f"{words}; allowed: one round or more")
