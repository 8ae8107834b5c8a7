"""Verdicts in words: on exposed sites, rounds without ignition points, distances where the ground is not known."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np

from flight.hazard.density.expected import ExpectedDistance
from fragfield.case import CaseTable
from fragfield.case.conversion.exposed_sites import ExposedSite, outline_of
from fragfield.case.conversion.surroundings import bearing_of, direction_words, ground_of
from fragfield.numbers import number
from fragfield.results.burst import BurstRound, Exposure
from fragfield.results.site import Estimate, Probability
from fragfield.results.site import ExposedSite as AssessedSite

_WORDS = {"density": "density", "probability": "probability of a hit", "hits": "expected hits"}


def criterion_of(case: CaseTable, site: ExposedSite) -> tuple[Literal["density", "probability", "hits"], float]:
    """Quantity and limit of a site's criterion: "density" (1/m2), "probability" or "hits"."""
    table = site.table
    if table.max_probability is not None:
        return "probability", table.max_probability
    if table.max_hits is not None:
        return "hits", table.max_hits
    return "density", case.hazard.density if table.max_density is None else table.max_density


def governing(site: AssessedSite, by: str = "upper") -> Estimate | Probability | None:
    """The value on which a site's criterion is judged, largest in `by`; None where there is none."""
    by_quantity: dict[str, tuple[Estimate | Probability | None, ...]] = {
        "density": (site.density_normal, site.density_ground),
        "probability": (site.probability,),
        "hits": (site.expected_hits,),
    }
    values = [one for one in by_quantity[site.criterion.quantity] if one is not None]
    return max(values, key=lambda value: float(getattr(value, by))) if values else None


def verdict_of(site: AssessedSite) -> Literal["met", "not met", "not shown", "not determined"]:
    """Return "met" where the bound meets the criterion, "not met" where the estimate exceeds it, else "not shown"."""
    upper, expected = governing(site), governing(site, "expected")
    if upper is None or expected is None or upper.upper is None or expected.expected is None:
        return "not determined"
    if upper.upper <= site.criterion.limit:
        return "met"
    return "not met" if expected.expected > site.criterion.limit else "not shown"


def part_of_criterion(site: AssessedSite) -> float | None:
    """The bound over the limit: 1 is the limit."""
    value = governing(site)
    return None if value is None or value.upper is None else value.upper / site.criterion.limit


def part_text(site: AssessedSite) -> str:
    """`part_of_criterion` in two digits, rounded up: a bound must not meet it by the print alone; "–" for none."""
    part = part_of_criterion(site)
    if part is None:
        return "–"
    step = 10.0 ** (math.floor(math.log10(part)) - 1) if part > 0.0 else 1.0
    return number(math.ceil(part / step - 1e-9) * step, 2)


def criterion_words(site: AssessedSite) -> str:
    """The criterion of a site: "density, at most 1 in 55.7 m²"."""
    quantity, limit = site.criterion.quantity, site.criterion.limit
    most = f"1 in {1.0 / limit:.4g} m²" if quantity == "density" else f"{limit:.4g}"
    return f"{_WORDS[quantity]}, at most {most}"


def no_margin(case: CaseTable, site: ExposedSite) -> str:
    """Why a site has no margin in metres to the line of the expected density; empty where it has one.

    The line says where people in the open meet the density of `hazard`. It says nothing of a site that is judged by
    another criterion, or that lies behind an obstacle: there shelter decides, and the line, smoothed over directions,
    may pass on either side of it.
    """
    quantity, limit = criterion_of(case, site)
    usual = case.hazard.energy, case.hazard.person_height
    if quantity != "density":
        return f"judged by the {_WORDS[quantity]}, not by the density of the distance"
    if site.prism is not None:
        return "a building is judged by the hits on its walls and roof"
    if limit != case.hazard.density or (site.energy, site.height) != usual:
        return "has a density, energy or height of its own"
    import shapely

    origin = np.asarray(case.flight.origin, dtype=np.float64)
    ways = shapely.linestrings(np.stack([np.broadcast_to(origin, site.edge().shape), site.edge()], axis=1))
    between = [one.name for one in case.obstacle if shapely.LinearRing(outline_of(one)).intersects(ways).any()]
    return f"shelter decides: behind {', '.join(between)}" if between else ""


_VERDICT = {
    "below": "below the published critical energies",
    "within": "within the scatter of the published critical energies",
    "above": "above the published critical energies: initiation is to be expected",
    "no critical energy": "no critical energy is known for this explosive",
}


def exposed_rounds(rounds: Sequence[BurstRound]) -> Iterator[tuple[str, Exposure, bool]]:
    """Name and exposure of every round without ignition points, and whether a shock initiated it."""
    for entry in rounds:
        if entry.exposure is not None:
            yield entry.name, entry.exposure, bool(entry.ignition)


def exposure_words(found: Exposure) -> str:
    """An exposure in one sentence, with what must be known to read it."""
    if not found.energy > 0.0:
        return (
            f"largest pressure {found.peak_pressure / 1e9:.3g} GPa, never above the threshold of "
            f"{found.floor / 1e9:.3g} GPa from which a pulse is counted"
        )
    words = (
        f"largest pressure {found.peak_pressure / 1e9:.3g} GPa; strongest pulse {found.pulse_pressure / 1e9:.3g} "
        f"GPa held for {found.held_time * 1e6:.3g} us, {found.energy / 1e6:.3g} MJ/m2"
    )
    if found.critical_energy and found.ratio:
        low, high = (value / 1e6 for value in found.critical_energy)
        words += f" against {low:.3g} to {high:.3g} MJ/m2 (ratio {found.ratio[1]:.2g} to {found.ratio[0]:.2g})"
    words += f": {_VERDICT[found.verdict]}"
    if not found.resolved:
        words += (
            f"; the cells are too coarse to resolve this pulse, which needs {found.resolved_cell * 1e3:.2g} mm or "
            "less: pressure and energy increase with smaller cells"
        )
    return words


def beyond_map_words(case: CaseTable, expected: ExpectedDistance) -> str:
    """Why a distance is not determined that reaches beyond the map, where the ground is not known; else empty.

    `expected` is the distance of the flights of the resolved case.
    """
    ground = ground_of(case)
    if isinstance(ground, float):
        return ""
    reach = ground.reach(case.flight.origin, expected.azimuth)
    if expected.direction is None:  # one distance for every direction
        reach = ground.reach(case.flight.origin, np.arange(360.0)).min(keepdims=True)
    distance = np.fmax(expected.by_direction, expected.upper_by_direction)
    farthest = int(np.argmax(distance - reach))
    if not distance[farthest] > reach[farthest]:
        return ""
    turn = float(expected.azimuth[farthest])
    where = "" if expected.direction is None else f", {direction_words(turn, bearing_of(case, turn), whole=True)}"
    return (
        f"over level ground beyond the map of heights it would be {distance[farthest]:.0f} m{where}, and the map ends "
        f"{reach[farthest]:.0f} m from the rounds; take a larger map"
    )
