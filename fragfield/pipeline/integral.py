"""The expected density by an integral: whether a scene admits it, the integral in one attitude, and over all attitudes.

What a scene needs for it is asked in one place, `why_not_integrated`; elsewhere weighted fragments are flown
(`fragfield.pipeline.weighted`), or realisations of the break-up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from flight.hazard.integral import POINTS, SMALLEST_SCATTER, integrate
from flight.hazard.pool import Completeness
from fragfield.case.conversion.attitude import is_mixed
from fragfield.case.conversion.turned import Arrangement
from fragfield.case.problem import burst_geometry
from fragfield.results.hazard import FlownAttitude

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from flight.hazard.density.expected import ExpectedDistance
    from flight.hazard.ensemble import EnsembleHazard
    from flight.hazard.integral import Integral
    from fragfield.case import CaseTable
    from fragfield.case.conversion.turned import Turned
    from fragfield.pipeline.flown import FlownEnsemble
    from transition.intensity import Intensity


FARTHEST_ORIGIN = 1.0  # m: distances of launches from the origin count to first order
LONGEST_FLIGHT = 600.0  # s: no fragment flies longer
DIRECTED = 4  # times the points of a distance over all azimuths, for one in a worst direction
SAMPLE_POINTS = 512
"""Points of a sample of a study."""
COARSE, FINE = 15.0, 5.0  # degrees from one inclination to the next: of all, then beside the worst
AZIMUTHS, AZIMUTH = 45.0, 15.0  # in wind the same of the nose's azimuths


def why_not_integrated(case: CaseTable, *, given: bool = False, rings: bool = False) -> str:
    """Why the expected density of a resolved case is no integral over a table of points; empty where it is.

    `given`: the fragments come from another source; `rings`: the burst was axisymmetric, else the case says so.
    """
    if given or case.burst is None or not case.round:
        return "the fragments come from another source"
    if len(case.round) > 1:
        return "several rounds, whose fragments may strike each other"
    geometry = None if rings else burst_geometry(case)
    wind, shape = case.flight.wind, case.flight.shape
    reasons = {
        "" if geometry is None else geometry.reason: geometry is not None and geometry.geometry != "axisymmetric",
        "exposed sites beside rounds of any attitude": is_mixed(case) and bool(case.exposed),
        "wind": wind.speed != 0.0 or any(wind.speeds or ()),
        "a map of heights": case.flight.ground.map is not None,
        "obstacles": bool(case.obstacle),
        "rounds that lean at random (break_up.tilt)": case.break_up.tilt > 0.0,
        'presented areas drawn at random (flight.shape.model = "lognormal")': shape.model == "lognormal",
        f"directions that scatter by less than {math.degrees(SMALLEST_SCATTER):g} degree (break_up.direction_scatter)":
            case.break_up.direction_scatter < SMALLEST_SCATTER,
        f"distances counted from more than {FARTHEST_ORIGIN:g} m beside the round (flight.origin)":
            math.dist(case.flight.origin, case.round[0].position[:2]) > FARTHEST_ORIGIN,
        "no gravity": case.flight.gravity == 0.0,
        f"flights that end after {LONGEST_FLIGHT:g} s or sooner (flight.time_limit)":
            case.flight.time_limit <= LONGEST_FLIGHT,
    }  # fmt: skip
    return next((reason for reason, holds in reasons.items() if holds), "")


@dataclass(frozen=True, eq=False)
class Integrand:
    """The intensity of a case's fragments, ready to be integrated in any attitude."""

    case: CaseTable
    intensity: Intensity
    threads: int
    sample: bool = False
    """Whether the distance alone is wanted, of a sample of a study: by fewer points, which are those of all samples."""

    def integral(self, attitude: Turned | None = None, *, finely: bool = True) -> Integral:
        """The expected numbers of fragments, in an attitude of the arrangement or as it stands.

        `finely`: with the points that the distance in a worst direction needs.
        """
        from fragfield.case.problem import density_directions, flight_arguments, hazard_criteria, hazard_directions

        case, intensity = self.case, self.intensity
        if attitude is not None:
            case, intensity = attitude.case, _turned(intensity, attitude)
        directions, arguments = density_directions(case, *hazard_directions(case)), flight_arguments(case)
        names = ("air", "drag", "gravity", "ground", "ricochet", "origin")
        return integrate(
            intensity, directions, hazard_criteria(case),
            **{name: arguments[name] for name in names}, threads=self.threads, distance_alone=self.sample,
            points=(SAMPLE_POINTS if self.sample else POINTS)
            * (1 if directions.axisymmetric or not finely else DIRECTED),
        )  # fmt: skip

    def solve(self, attitude: Turned | None = None) -> Solved:
        """The integral in an attitude, or as the rounds stand; of mixed attitudes, left out, in the worst of all."""
        if attitude is not None or not is_mixed(self.case):
            return Solved(self.integral(attitude), attitude)
        (worst, *_), curve = worst_attitudes(self.case, lambda one: self.integral(one, finely=False).expected())
        return Solved(self.integral(worst), worst, curve)


def worst_attitudes(
    case: CaseTable, expected: Callable[[Turned], ExpectedDistance]
) -> tuple[list[Turned], list[FlownAttitude]]:
    """Attitudes of one round of revolution, those of the farthest distances first, and the farthest by inclination.

    In wind the nose points to every azimuth too; where the wind blows one way at all heights, to one side of it.
    """
    arrangement, wind = Arrangement(case), case.flight.wind
    ways = {0.0} if wind.is_still else set(wind.directions or [wind.towards])
    towards, one_way = math.degrees(next(iter(ways))), len(ways) == 1
    rows: dict[tuple[float, float], FlownAttitude] = {}
    attitudes: dict[tuple[float, float], Turned] = {}

    def add(inclination: float, turn: float) -> None:
        turn %= 360.0
        if wind.is_still or inclination in (0.0, 180.0):
            turn = 0.0
        elif one_way:
            turn = min(turn, 360.0 - turn)
        if (inclination, turn) in rows or not 0.0 <= inclination <= 180.0:
            return
        azimuth = 0.0 if wind.is_still else towards + turn
        attitudes[inclination, turn] = turned = arrangement.turned(inclination, azimuth=azimuth)
        found = expected(turned)
        rows[inclination, turn] = FlownAttitude.read({
            "inclination_deg": inclination, "roll_deg": 0.0, "expected": found.distance,
            "upper": found.upper, "standard_error": found.standard_error, "realisations": 0,
            "direction_deg": None if found.direction is None else (found.direction - azimuth) % 360.0,
        })  # fmt: skip

    def reach(key: tuple[float, float]) -> float:
        return rows[key].expected or 0.0

    for inclination, turn in product(np.arange(0.0, 180.1, COARSE).tolist(), np.arange(0.0, 360.0, AZIMUTHS).tolist()):
        add(inclination, turn)
    worst = (-1.0, 0.0)
    while worst != (worst := max(sorted(rows), key=reach)):
        for step in (-FINE, FINE):
            add(worst[0] + step, worst[1])
        for step in (-AZIMUTH, AZIMUTH):
            add(worst[0], worst[1] + step)
    rising = sorted(sorted(rows, reverse=True), key=reach)
    farthest = {key[0]: rows[key] for key in rising}
    return [attitudes[key] for key in reversed(rising)], [farthest[one] for one in sorted(farthest)]


@dataclass(frozen=True, eq=False)
class Solved:
    """The expected density without realisations, and the attitude to which it belongs."""

    integral: Integral
    attitude: Turned | None
    curve: Sequence[FlownAttitude] = ()
    """Distances over mixed attitudes."""
    completeness: Completeness = field(default_factory=Completeness)
    """How the flights ended, where fragments were flown one by one."""

    def flown(self, case: CaseTable) -> FlownEnsemble:
        """What a run of a case gives, without what single events do."""
        from fragfield.hazard.verdict import beyond_map_words
        from fragfield.pipeline.flown import FlownEnsemble

        found = self._hazard(case.hazard.tolerance)
        unended = self.completeness.reason if self.completeness.fragments else ""
        found = replace(found, undetermined=unended or beyond_map_words(case, found.expected))
        return FlownEnsemble(None, found, {}, self.completeness, False, [], 0, attitude=self.attitude, curve=self.curve)

    def _hazard(self, tolerance: float) -> EnsembleHazard:
        from flight.hazard.density.sectors import Tally
        from flight.hazard.ensemble import EnsembleHazard

        none = np.zeros((0, self.integral.directions.grid.sectors), dtype=np.int64)
        return EnsembleHazard(
            Tally(none, none, none.astype(np.float64)), self.integral.criteria, tolerance,
            self.integral.expected(), np.zeros(0), integral=self.integral,
        )  # fmt: skip


def _turned(intensity: Intensity, attitude: Turned) -> Intensity:
    axis, place = attitude.matrix @ intensity.axis, attitude.matrix @ intensity.place + attitude.shift
    return replace(intensity, axis=tuple(axis.tolist()), place=tuple(place.tolist()))
