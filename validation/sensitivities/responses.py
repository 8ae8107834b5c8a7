"""What a round answers to a variation: speeds, number of fragments, hazardous fragment distance.

The distance is the hazard stage's, over all azimuths: a round that stands upright is one of revolution, so that its
sectors differ at random alone. It is that of the expected density, the mean over the realisations, as in
`flight.hazard.density.expected`.

All ensembles have one seed: a realisation draws the same random numbers whatever is varied, and a bootstrap draws the
same realisations. Differences between two variations are therefore known better than the values are.
"""

from __future__ import annotations

import tomllib
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import flight
from flight.hazard.density.density_counts import density_counts
from flight.hazard.density.directions import Directions
from flight.hazard.density.estimate import Estimate
from flight.hazard.density.groups import DensityGroups
from transition import BreakUp, Snapshot
from validation.runs import ROOT, changed_case
from validation.sensitivities.variations import REFERENCE

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from fragfield.case.schema import Case
    from validation.sensitivities.variations import Variation

__all__ = ["Response", "respond"]

DRAWS = 200  # of the bootstrap
_AT_ONCE = 20  # realisations held in memory


@dataclass(frozen=True, eq=False)
class Response:
    """The answer to one variation.

    Attributes
    ----------
    variation : Variation
        What was varied.
    mean_speed, largest_speed : float
        Of the casing at the end of the burst (m/s): weighted by mass, and of the fastest cell.
    fragments : (n,) int64
        Number of fragments in every realisation.
    distance : float
        Hazardous fragment distance over all azimuths (m).
    draws : (b,) float64
        The distance in every draw of the bootstrap (m), the same realisations for all variations.
    cells : int
        Of the mesh.
    """

    variation: Variation
    mean_speed: float
    largest_speed: float
    fragments: NDArray[np.int64]
    distance: float
    draws: NDArray[np.float64]
    cells: int

    @property
    def number(self) -> float:
        """Mean number of fragments."""
        return float(self.fragments.mean())

    @property
    def error(self) -> float:
        """Standard error of the distance (m)."""
        return float(self.draws.std(ddof=1))

    def change(self, base: Response) -> float:
        """Distance less that of the base (m)."""
        return self.distance - base.distance

    def error_of_change(self, base: Response) -> float:
        """Standard error of `change` (m), smaller than that of two independent ensembles."""
        return float((self.draws - base.draws).std(ddof=1))


def respond(
    folder: Path, variation: Variation, burst: Mapping[str, Any], realisations: int, threads: int | None = None
) -> Response:
    """Break the casing up and fly the fragments to the ground, again and again.

    Parameters
    ----------
    folder : Path
        Run directory with the end of the burst.
    variation : Variation
        Whose case says how to break up, fly and count.
    burst : mapping
        The burst's part of summary.json.
    realisations : int
        How many.
    threads : int, optional
        Of break-up and flight; the result does not depend on it.
    """
    from fragfield.case.conversion.stages import break_up_settings, flight_arguments, hazard_criteria, hazard_grid
    from fragfield.pipeline.ensemble import above_ground

    case = _case(variation)
    arguments = flight_arguments(case) | {"witnesses": [], "sample": 0}
    criteria, grid = hazard_criteria(case), hazard_grid(case)
    arguments |= {"fluence": criteria.fluence_grid(grid)}
    prepared = BreakUp(Snapshot.read(folder / "burst_snapshot.h5"), break_up_settings(case))
    groups, sizes = DensityGroups(Directions(grid)), []
    for start in range(0, realisations, _AT_ONCE):
        numbers = range(start, min(start + _AT_ONCE, realisations))
        for fragments in prepared.many(REFERENCE["seed"], numbers, threads):
            started = above_ground(fragments, arguments["ground"], warn=False)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", flight.FlightWarning)
                landed = flight.fly(started, **arguments, threads=threads)
            groups.add(*density_counts(landed))
            sizes.append(len(fragments))
    distance, draws = drawn_distances(groups, criteria.density, draws=DRAWS)
    return Response(
        variation, burst["mean_initial_speed"], burst["max_initial_speed"], np.array(sizes), distance, draws,
        burst["cells"],
    )  # fmt: skip


def _case(variation: Variation) -> Case:
    from fragfield.case.load import case_from_document

    path = ROOT / REFERENCE["case"]
    document = tomllib.loads(changed_case(path, variation.all_changes))
    return case_from_document(document, source=str(path), folder=path.parent)


def drawn_distances(
    groups: DensityGroups, limit: float, *, draws: int = DRAWS, seed: int = 0
) -> tuple[float, NDArray[np.float64]]:
    """The distance over all azimuths (m), and in every draw of the bootstrap (b,); as `expected_distance`.

    Draws of the same seed take the same realisations: differences between ensembles of the same random numbers are
    then known better than the distances themselves.
    """
    found = Estimate(groups, limit, draws, seed)
    result = found.result(every_direction=False)
    reach = np.log([max(one, 1e-300) for one in (result.ground, result.normal)])[:, None]
    return result.distance, np.exp(found.draws_of(reach, 0))
