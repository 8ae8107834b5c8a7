"""Arena tables: written from a run's break-up, or flown instead of it when a test's table is given."""

from __future__ import annotations

import logging
import math
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import flight
from flight import Fragments
from flight.arena import MOTT, ArenaTable, is_arena_file
from flight.hazard.density.directions import Directions
from flight.hazard.pool import FlightCounts, PooledFlights
from fragfield.case import CaseTable
from fragfield.case.checks.expected_masses import recovered_mass
from fragfield.case.conversion.attitude import is_mixed
from fragfield.case.conversion.rounds import charge_centre
from fragfield.case.conversion.turned import even_surroundings
from fragfield.case.problem import flight_arguments, hazard_criteria, hazard_directions, hazard_grid, kernel_degrees
from fragfield.errors import InputError
from fragfield.pipeline.flown import above_ground
from fragfield.pipeline.job import Job
from fragfield.results.flight import Recovered

_WIDEST = 30.0  # degrees of a zone with fragments
_log = logging.getLogger(__name__)


def read_arena(path: Path | None, case: CaseTable) -> tuple[ArenaTable, Recovered] | None:
    """The table of a file with the numbers that are flown, and what of the casing it holds; None: no arena table.

    Raises InputError: the table cannot be read or carry a distance, its mass is not that of the case's rounds, or the
    case has planes of symmetry: give every round its own place.
    """
    if path is None or not is_arena_file(path):
        return None
    if any(plane.kind == "symmetry" for plane in case.plane):
        raise InputError(
            "arena tables and planes of symmetry: give every round its own table [[round]] with its position"
        )
    if is_mixed(case) and not case.flight.wind.is_still:
        raise InputError('arena tables, attitude = "any" and wind: leave one of them out')
    table = ArenaTable.read(path)
    width = np.diff(table.zones)
    wide = np.flatnonzero((width[table.zone] > _WIDEST + 1e-9) & (table.number > 0.0))
    if wide.size:
        zone = table.zone[wide[0]]
        raise InputError(
            f"{path}: fragments in a zone from {table.zones[zone]:g} to {table.zones[zone + 1]:g} degrees; allowed: "
            f"zones of at most {_WIDEST:g} degrees, wider ones do not say where a round throws its fragments"
        )
    recovered = recovered_mass(case, table, str(path))
    return table.scaled(recovered.factor), recovered


def arena_realisation(table: ArenaTable, case: CaseTable, number: int, *, law: float = MOTT) -> Fragments:
    """Fragments of all rounds of a case, each alone, from the middle of its charge.

    Of a case without rounds one upright round, its charge 1 m up. `law`: power of the mass within a group.
    """
    places = [(charge_centre(one), one.axis) for one in case.round] or [((*case.flight.origin, 1.0), (0.0, 0.0, 1.0))]
    if number == 0 and len(places) > 1:
        _log.warning(
            "the arena table is that of one round: %d rounds fly as if each were alone",
            len(places),
            extra={"code": "arena_alone"},
        )
    return Fragments.concatenate(
        [
            table.realisation(
                case.seed, number, position=position, axis=axis, shape_factor=case.flight.shape_factor,
                round_number=index, law=law,
            )
            for index, (position, axis) in enumerate(places)
        ]
    )  # fmt: skip


def arena_basis(case: CaseTable) -> tuple[str, tuple[float, ...]]:
    """Basis of the hazard distance of an arena table, and mirror planes, as `hazard_directions`."""
    if case.round:
        return hazard_directions(case)
    return ("all_azimuths" if even_surroundings(case) else "worst_direction"), ()


def arena_of(case: CaseTable, realisations: Sequence[Fragments]) -> ArenaTable | None:
    """Mean table of one round; None where rounds behind planes of symmetry look another way than those before them."""
    axes = np.array([one.axis for one in case.round], dtype=np.float64).reshape(-1, 3)
    rounds = 1 + max(int(one.round.max()) for one in realisations if len(one))
    if rounds > len(axes):
        first = axes[0] / np.linalg.norm(axes[0])
        normals = np.array([plane.normal for plane in case.plane if plane.kind == "symmetry"]).reshape(-1, 3)
        if np.abs(axes / np.linalg.norm(axes, axis=1, keepdims=True) - first).max() > 1e-9:
            return None
        if np.abs(normals @ first).max(initial=0.0) > 1e-9:
            return None
        axes = axes[:1]
    return ArenaTable.of(realisations, axes)


def write_arena(case: CaseTable, realisations: Sequence[Fragments], path: Path) -> None:
    """Write arena.csv, the mean of one round over all realisations, zones from the nose, where a break-up has one."""
    table = arena_of(case, realisations) if case.round and any(len(one) for one in realisations) else None
    if table is None:
        path.unlink(missing_ok=True)
        return
    table.write(path)


_OTHER_LAWS = (1.0 / 3.0, 1.0)
_MOST_FLOWN = 32  # realisations of each table beside the run's own


def table_width(job: Job, table: ArenaTable, number: int) -> float:
    """What the widths of a table's groups and zones leave open of the expected distance: a half-width (m).

    Within groups Mott's law is taken: the larger of the changes where the mass counts by the power 1/3, of pieces
    broken along three dimensions, or 1. Zones: the change where they are twice as wide. All by the same first
    realisations, the two added as squares.
    """
    case, basis = job.case, arena_basis(job.case)[0]
    grid, criteria = hazard_grid(case), hazard_criteria(case)
    arguments = {**flight_arguments(case), "witnesses": (), "sample": 0, "fluence": criteria.fluence_grid(grid)}

    def distance(of: ArenaTable, law: float) -> float:
        pool = PooledFlights(Directions(grid, basis, kernel_degrees(case)), criteria, ricochet=False)
        for one in range(min(number, _MOST_FLOWN)):
            fragments = above_ground(arena_realisation(of, case, one, law=law), arguments["ground"], warn=False)
            flown = flight.fly(fragments, **arguments, threads=job.cores)
            pool.add(FlightCounts.of(flown, fragments, ground=arguments["ground"], gravity=case.flight.gravity))
        return float(pool.expected().distance)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", flight.FlightWarning)  # reported for the run itself
        base = distance(table, MOTT)
        by_law = max(abs(distance(table, law) - base) for law in _OTHER_LAWS)
        by_zone = abs(distance(table.merged(), MOTT) - base)
    return math.hypot(by_law, by_zone)
