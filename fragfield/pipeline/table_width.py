"""What the widths of an arena table's groups and zones leave open of the distance that it gives."""

from __future__ import annotations

import math
import warnings

import flight
from flight.arena import MOTT, ArenaTable
from flight.hazard.density.directions import Directions
from flight.hazard.pool import FlightCounts, PooledFlights
from fragfield.case.problem import flight_arguments, hazard_criteria, hazard_grid, kernel_degrees
from fragfield.pipeline.arena import arena_basis, arena_realisation
from fragfield.pipeline.flown import above_ground
from fragfield.pipeline.job import Job

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
