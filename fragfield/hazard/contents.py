"""Net explosive quantity, masses and arrangement of a case's rounds, as rules of distance ask for them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.case.conversion.placing import are_alike, mirrored
from fragfield_base.substances import substance, substance_key, substance_title, substances_with

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Profile
    from fragfield.case import CaseTable
    from fragfield.case.conversion.clearance import Body
    from fragfield.case.tables.round import RoundTable


_ON_A_LINE = 1e-3  # m beside a straight line
_AT_ONCE = 1e-9  # s between initiations


@dataclass(frozen=True)
class Contents:
    """What stands there: all rounds with their images."""

    explosive: float
    """Net explosive quantity (kg)."""
    tnt: float
    """Its equivalent in TNT for peak pressure (kg)."""
    all_up: float
    """Mass of the rounds whole, without packaging (kg)."""
    largest_round: float
    """Mass of the heaviest round (kg)."""
    rounds: int
    """How many."""
    equivalents: tuple[str, ...] = ()
    """Words on the equivalents taken."""
    in_a_row: bool = False
    """Whether the positions of two or more rounds lie on one straight line, within 1 mm."""
    clearance: float | None = None
    """Smallest clear distance (m) of the rounds of a row from each other; None where they are in no row."""
    charge_diameter: float | None = None
    """Largest diameter of a charge (m); None of a round from a mesh file."""
    at_once: bool = True
    """Whether every round is ignited at the same time."""
    protective_works: tuple[str, ...] = ()
    """Names of obstacles and walls of the case."""
    alike: bool = True
    """Whether all rounds have the same contour, casing and explosive."""


def quantity_words(explosive: float, tnt: float, equivalents: Sequence[str]) -> str:
    """The net explosive quantity (kg) and its equivalent in TNT (kg), in words."""
    return "; ".join(
        (f"net explosive quantity {explosive:.3g} kg, TNT equivalent for peak pressure {tnt:.3g} kg", *equivalents)
    )


def contents_of(case: CaseTable, summary: Mapping[str, Any]) -> Contents | None:
    """What a resolved case's rounds hold, images behind planes of symmetry too; None for fragments from another source.

    Rounds from mesh files take their masses from the burst's part of summary.json; without it there is None.
    """
    from fragfield.case.conversion.burst import burst_round
    from fragfield.hazard.arrangement import with_images

    if not case.round:
        return None
    positions = with_images(case)
    images = len(positions) // len(case.round)
    burst = {str(one.get("name")): one for one in (summary.get("burst") or {}).get("rounds") or []}
    explosive = tnt = all_up = heaviest = 0.0
    words, profiles = [], []
    for number, entry in enumerate(case.round, start=1):
        one = burst_round(entry, f"round[{number}]")
        if one.profile is not None:
            charge = one.profile.charge_volume * one.explosive.density
            whole = charge + one.profile.casing_volume * one.casing.density + one.profile.fuze_mass
            profiles.append(one.profile)
        elif "charge_mass" in burst.get(entry.name, {}):
            charge = float(burst[entry.name]["charge_mass"])
            whole = charge + float(burst[entry.name]["casing_mass"])
        else:
            return None
        factor, said = tnt_equivalent(one.explosive.name)
        if said:
            words.append(said)
        explosive, all_up = explosive + images * charge, all_up + images * whole
        tnt, heaviest = tnt + images * charge * factor, max(heaviest, whole)
    known = len(profiles) == len(case.round)
    in_a_row = _on_a_line(positions)
    return Contents(
        explosive,
        tnt,
        all_up,
        heaviest,
        len(positions),
        tuple(dict.fromkeys(words)),
        in_a_row,
        _clearance(case, profiles) if known and in_a_row else None,
        max(_charge_diameter(profile) for profile in profiles) if known else None,
        _ignited_at_once(case.round),
        (
            *(f"{one.kind} “{one.name}”" for one in case.obstacle),
            *(f"wall “{plane.name}”" for plane in case.plane if plane.kind == "wall"),
        ),
        are_alike(case),
    )


def _on_a_line(positions: NDArray[np.float64]) -> bool:
    """Whether two or more positions lie on one straight line."""
    if len(positions) < 2:
        return False
    from_first = positions - positions[0]
    farthest = from_first[np.argmax(np.linalg.norm(from_first, axis=1))]
    length = float(np.linalg.norm(farthest))
    if length == 0.0:
        return False
    along = (from_first @ farthest / length)[:, None] * farthest / length
    return bool(np.linalg.norm(from_first - along, axis=1).max() <= _ON_A_LINE)


def _clearance(case: CaseTable, profiles: Sequence[Profile]) -> float | None:
    """Smallest clear distance (m) between the rounds of a row and their images."""
    from fragfield.case.conversion.clearance import min_clearance, placed_body

    placed = [
        (np.array(entry.position, dtype=np.float64), np.array(entry.axis, dtype=np.float64), profile)
        for profile, entry in zip(profiles, case.round, strict=True)
    ]
    bodies: list[Body] = [
        placed_body(profile, place.tolist(), axis.tolist()) for place, axis, profile in mirrored(case, placed)
    ]
    nearest = min_clearance(bodies)
    return None if nearest is None else max(nearest[2], 0.0)


def _charge_diameter(profile: Profile) -> float:
    """Largest diameter of a charge (m), at 2,001 stations and the corners of the cavity."""
    stations = np.linspace(profile.charge_front, profile.charge_end, 2001)
    corners = [at for at in profile.cavity.stations if profile.charge_front <= at <= profile.charge_end]
    return 2.0 * float(np.max(profile.section(np.concatenate([stations, corners])).charge_radius))


def _ignited_at_once(rounds: Sequence[RoundTable]) -> bool:
    """Whether every round has ignition points, and the first of each is ignited at the same time."""
    if not all(entry.ignition for entry in rounds):
        return False
    first = [min(point.delay for point in entry.ignition or ()) for entry in rounds]
    return max(first) - min(first) <= _AT_ONCE


@cache
def tnt_equivalents() -> dict[str, tuple[float, str]]:
    """Factor for peak incident overpressure and its source, by built-in name of the explosive."""
    factors = substances_with("explosive", "tnt_equivalent", "pressure")
    return {
        name: (factor, substance("explosive", name).groups["tnt_equivalent"].source) for name, factor in factors.items()
    }


def tnt_equivalent(explosive: str) -> tuple[float, str]:
    """Equivalent of an explosive in TNT for peak pressure, and words on it with the source (empty for TNT itself).

    An explosive that is not in the table has the largest equivalent that is: its blast distances are then rather too
    long.
    """
    table = tnt_equivalents()
    known = table.get(substance_key(explosive))
    if known is None:
        strongest = max(table, key=lambda name: table[name][0])
        factor, source = table[strongest]
        return factor, (
            f"{factor:g} for {explosive}, whose equivalent is not known: the largest known one, of "
            f"{substance_title(strongest)} ({source})"
        )
    factor, source = known
    return factor, f"{factor:g} for {explosive} ({source})" if factor != 1.0 else ""


SITING, DISPOSAL, COMPARISON = "siting", "disposal", "comparison"
"""What a rule is for: distances for storage and handling, for disposal in the open, or none that is prescribed."""


@dataclass(frozen=True)
class Rule:
    """A distance by a rule: name, source, formula, inputs and range in words and SI units."""

    name: str
    hazard: str
    """"fragments" or "blast": what it keeps people from."""
    use: str
    """What it is prescribed for, "siting" or "disposal"; "comparison": it is shown beside the others alone."""
    distance: float | None
    """In m; None outside the rule's range."""
    source: str
    formula: str
    inputs: str
    range: str
    reason: str = ""
    """Why the rule does not apply to this arrangement; empty where it does."""
    basis: str = "mass alone"
    """What it rests on."""

    def __post_init__(self) -> None:
        if (self.distance is None) != bool(self.reason):
            raise ValueError(f"{self.name}: a rule has either a distance or a reason why it has none")
