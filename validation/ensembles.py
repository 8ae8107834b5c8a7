"""Many realisations of one burst, flown to a witness ring.

The ring catches every fragment, whatever its height: there is no ground, and only what never gets as far as the
radius misses. The band is the part of the ring that real panels cover. A fragment that has fallen below the band's
lower edge never rises again, so a band on or above the ground needs no ground for its hits either.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import flight
from transition import BreakUp, Snapshot
from transition.placement.mirroring import images
from validation.ring_counts import RingCounts, count_by_azimuth
from validation.runs import StudyError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from transition import BreakUpSettings

__all__ = ["BAND", "RADIUS", "RING_HITS", "RingEnsemble", "ring_ensemble", "ring_ensemble_of_run"]

RADIUS = 7.62  # m, the paper's
BAND = (0.1, 2.5)  # m, the height of real panels, about the middle of a shell whose base stands at 1 m
FLOOR = -1000.0  # m; what fell so far without reaching the ring never will
BATCH = 20_000  # fragments that fly together
AT_ONCE = 16  # realisations held in memory

RING_HITS = np.dtype([("realisation", "i4"), ("azimuth", "f8"), ("mass", "f8"), ("initial_speed", "f8")])
"""One hit: degrees, kg, m/s."""


@dataclass(frozen=True, eq=False)
class RingEnsemble:
    """Hits of an ensemble on the ring.

    Attributes
    ----------
    fragments : (r,) int64
        Fragments of every realisation.
    every_height, band : RingCounts
        Hits on the ring of unlimited height, and on the band.
    missed : mapping from "every_height" and "band" to (r,) int64
        Fragments that never hit them: counted by fragment, where the tables count by azimuth.
    hits : (n,) structured array of dtype RING_HITS
        The outward hits on the ring of unlimited height, one by one.
    """

    fragments: NDArray[np.int64]
    every_height: RingCounts
    band: RingCounts
    missed: dict[str, NDArray[np.int64]]
    hits: NDArray[Any]


def ring_ensemble(
    snapshot: Snapshot | str | Path,
    settings: BreakUpSettings | None = None,
    flight_arguments: Mapping[str, Any] | None = None,
    *,
    seed: int,
    realisations: int = 200,
    radius: float = RADIUS,
    band: tuple[float, float] = BAND,
    threads: int | None = None,
) -> RingEnsemble:
    """Break one burst up again and again and fly every realisation to the ring.

    Parameters
    ----------
    snapshot : Snapshot or path
        End of the burst stage; the ring stands about the origin.
    settings : BreakUpSettings, optional
        Choices of the break-up.
    flight_arguments : mapping, optional
        Arguments of `flight.fly` for air, drag, gravity, wind and integrator; ground, surfaces, origin, domain and
        sampled paths are the ring's own.
    seed : int
        Seed of the ensemble. Ensembles that are compared need seeds of their own: rounds alike would otherwise break
        alike, and the errors of the two would not be independent.
    realisations : int
        How many.
    radius : float
        Of the ring (m).
    band : (2,) floats
        Lower and upper edge of the band (m).
    threads : int, optional
        Threads of break-up and flight; all cores by default. The result does not depend on it.
    """
    prepared = BreakUp(snapshot, settings)
    own = ("ground", "witnesses", "origin", "domain", "sample", "seed", "time_limit", "threads")
    arguments = {key: value for key, value in (flight_arguments or {}).items() if key not in own}
    ring = flight.Cylinder(radius, name="ring")
    domain = flight.Domain(radius=1.01 * radius, floor=FLOOR)
    alone = arguments.get("contact") is not None and len(prepared.rounds) > 1  # no realisation meets another
    sizes: list[int] = []
    parts: dict[str, list[RingCounts]] = {"every_height": [], "band": []}
    missed: dict[str, list[NDArray[np.int64]]] = {"every_height": [], "band": []}
    single_hits: list[NDArray[Any]] = []
    batch: list[flight.Fragments] = []

    def fly_batch() -> None:
        numbers = [len(fragments) for fragments in batch]
        together = flight.Fragments.concatenate(batch)
        with warnings.catch_warnings():
            if sizes:  # what is said of the first realisations holds for all
                warnings.simplefilter("ignore", flight.FlightWarning)
            hits = flight.fly(together, **arguments, ground=None, witnesses=[ring], domain=domain, threads=threads).hits
        owner = np.repeat(np.arange(len(batch)), numbers)
        single_hits.append(_outward(hits, len(sizes) + owner[hits["fragment"]]))
        height = hits["position"][:, 2]
        for surface, met in (
            ("every_height", hits),
            ("band", hits[(height >= band[0]) & (height <= band[1])]),
        ):
            parts[surface].append(count_by_azimuth(met, owner[met["fragment"]], len(batch)))
            away = np.ones(len(together), dtype=bool)
            away[met["fragment"]] = False
            missed[surface].append(np.bincount(owner[away], minlength=len(batch)))
        sizes.extend(numbers)
        batch.clear()

    for start in range(0, realisations, AT_ONCE):
        for fragments in prepared.many(seed, range(start, min(start + AT_ONCE, realisations)), threads):
            batch.append(fragments)
            if alone or sum(len(part) for part in batch) >= BATCH:
                fly_batch()
    if batch:
        fly_batch()
    return RingEnsemble(
        np.array(sizes, dtype=np.int64),
        RingCounts.join(parts["every_height"]),
        RingCounts.join(parts["band"]),
        {surface: np.concatenate(counts) for surface, counts in missed.items()},
        np.concatenate(single_hits),
    )


def _outward(hits: NDArray[Any], realisation: NDArray[np.int64]) -> NDArray[Any]:
    """What is kept of single hits; `realisation` is that of each of them."""
    outward = hits["direction"] > 0
    kept = np.zeros(int(outward.sum()), dtype=RING_HITS)
    kept["realisation"] = realisation[outward]
    for name in ("azimuth", "mass", "initial_speed"):
        kept[name] = hits[name][outward]
    return kept


def ring_ensemble_of_run(
    folder: Path, rounds: int, *, seed: int, realisations: int = 200, threads: int | None = None
) -> RingEnsemble:
    """`ring_ensemble` of a finished run, with the break-up, air, drag and integrator of its case.

    Radius and band are those of the case's first cylinders of unlimited and of limited height, where it has them.

    Raises
    ------
    StudyError
        The run has not the number of `rounds` that it should, those behind planes of symmetry included.
    """
    from fragfield.case import read_resolved
    from fragfield.case.conversion.stages import break_up_settings, flight_arguments

    snapshot = Snapshot.read(folder / "burst_snapshot.h5")
    found = len(snapshot.rounds) * (len(images(snapshot.planes)) + 1)
    if found != rounds:
        raise StudyError(f"{folder}: a burst of {found} rounds, mirrored ones included; {rounds} are needed")
    case = read_resolved(folder / "case.toml")
    arguments = flight_arguments(case)
    rings = [surface for surface in arguments["witnesses"] if isinstance(surface, flight.Cylinder)]
    limited = [(ring.bottom, ring.top) for ring in rings if math.isfinite(ring.area)]
    unlimited = [ring.radius for ring in rings if not math.isfinite(ring.area)]
    return ring_ensemble(
        snapshot,
        break_up_settings(case),
        arguments,
        seed=seed,
        realisations=realisations,
        radius=unlimited[0] if unlimited else RADIUS,
        band=limited[0] if limited else BAND,
        threads=threads,
    )
