"""Hazardous fragments by distance, as the table of 1944 counts them: without gravity, over all directions at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import flight
from flight.files.text_tables import read_columns
from transition.draws import Draws
from transition.law.mott import MottLaw, Quantile

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["FOOT", "Counts", "Table", "count", "prescribed", "read_table"]

FOOT = 0.3048
_NEAR, _FAR, _STEP = 30.0, 110.0, 2.0  # m, where the hazardous fragment distance is looked for
_TIME_LIMIT = 60.0  # s


@dataclass(frozen=True, eq=False)
class Table:
    """Table 56: distance (m), number of hazardous fragments, the lightest one's speed (m/s), each (n,)."""

    distance: NDArray[np.float64]
    number: NDArray[np.float64]
    speed: NDArray[np.float64]

    def gates(self, low: float, high: float) -> NDArray[np.intp]:
        """Rows between two distances (m)."""
        return np.flatnonzero((self.distance >= low - 1e-9) & (self.distance <= high + 1e-9))


@dataclass(frozen=True, eq=False)
class Counts:
    """What realisations of a round give at distances from it; all are means over the realisations.

    Attributes
    ----------
    distance : (n,) float64
        Distances (m).
    number : (n,) float64
        Fragments that still have the hazardous energy there.
    speed : (n,) float64
        Speed of the lightest of them (m/s); not a number where no realisation has any.
    fragments, mean_mass, initial_speed : float
        Fragments in all, their mean mass (kg) and their mass-weighted initial speed (m/s).
    """

    distance: NDArray[np.float64]
    number: NDArray[np.float64]
    speed: NDArray[np.float64]
    fragments: float
    mean_mass: float
    initial_speed: float

    def hazardous_distance(self, density: float) -> float:
        """Distance (m) at which the density N/(4 pi r^2) falls through `density` (1/m2)."""
        inside = (self.distance >= _NEAR) & (self.distance <= _FAR)
        order = np.argsort(self.distance[inside])
        distance, number = self.distance[inside][order], self.number[inside][order]
        return falling_through(distance, number / (4.0 * np.pi * distance**2), density)


def read_table(path: Path) -> Table:
    """Read Table 56, in feet, into SI."""
    columns = read_columns(path)
    return Table(FOOT * columns["distance_ft"], columns["number"], FOOT * columns["speed_ft_s"])


def prescribed(reference: Mapping[str, Any], seed: int, realisations: int) -> list[flight.Fragments]:
    """Realisations of the law through the table, every fragment with the table's initial speed."""
    law, speed = reference["law"], reference["initial_speed"]
    mott = MottLaw.from_mean(2.0 * law["mu"], dimension=2)
    whole = law["number"] * mott.mean
    masses = [Quantile().draw(mott, whole, Draws(seed, one)) for one in range(realisations)]
    return [flight.Fragments(mass, (0.0, 0.0, 0.0), (speed, 0.0, 0.0)) for mass in masses]


def count(
    rounds: Sequence[flight.Fragments], table: Table, reference: Mapping[str, Any], threads: int | None = None
) -> Counts:
    """Fly realisations of a round and count.

    Without gravity a fragment's speed depends on the length of its path alone, whatever its direction. All are
    therefore turned into the horizontal and launched from the origin: a cylinder of radius r then catches what has
    flown r.

    Parameters
    ----------
    rounds : fragments of every realisation.
    table : whose distances are counted at, besides those at which the hazardous distance is looked for.
    reference : with the tables `flight` and `hazard`.
    threads : of the flight; the result does not depend on it.
    """
    together = flight.Fragments.concatenate(rounds)
    owner = np.repeat(np.arange(len(rounds)), [len(one) for one in rounds])
    level = np.column_stack([together.speed, np.zeros((len(together), 2))])
    setting = reference["flight"]
    flown = flight.Fragments(together.mass, (0.0, 0.0, 0.0), level, setting["shape_factor"])
    radii = np.concatenate([table.distance, np.arange(_NEAR, _FAR + _STEP, _STEP)])
    result = flight.fly(
        flown,
        air=flight.ConstantAir(setting["air_density"], setting["sound_speed"]),
        drag=setting["drag"],
        gravity=0.0,
        ground=None,
        time_limit=_TIME_LIMIT,
        witnesses=[flight.Cylinder(radius, name=str(place)) for place, radius in enumerate(radii)],
        domain=flight.Domain(radius=1.01 * float(radii.max())),
        threads=threads,
    )
    number, speed = np.zeros(radii.size), np.full(radii.size, np.nan)
    for place in range(radii.size):
        hits = result.hits_on(str(place))
        hazardous = hits[hits["energy"] >= reference["hazard"]["energy"]]
        number[place] = len(hazardous) / len(rounds)
        speed[place] = _of_the_lightest(hazardous, owner[hazardous["fragment"]])
    return Counts(
        radii, number, speed, len(together) / len(rounds), float(together.mass.mean()),
        float(together.mass @ together.speed / together.mass.sum()),
    )  # fmt: skip


def _of_the_lightest(hits: NDArray[Any], owner: NDArray[np.intp]) -> float:
    """Mean over the realisations of the speed of each one's lightest fragment."""
    order = np.lexsort((hits["mass"], owner))
    _, first = np.unique(owner[order], return_index=True)
    return float(hits["speed"][order][first].mean()) if first.size else float("nan")


def falling_through(distance: NDArray[np.float64], density: NDArray[np.float64], limit: float) -> float:
    """Farthest distance (m) at which a density falls through the limit, linear between the distances given (rising).

    The last one where the density is above the limit there; 0 where the limit is never reached.
    """
    above = np.flatnonzero(density >= limit)
    if not above.size:
        return 0.0
    last = int(above[-1])
    if last == len(distance) - 1:
        return float(distance[-1])
    part = (density[last] - limit) / (density[last] - density[last + 1])
    return float(distance[last] + part * (distance[last + 1] - distance[last]))
